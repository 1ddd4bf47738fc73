//! The command line: one file a verb, no logic of its own.

mod calibrate;
mod camera;
mod capture;
mod decode;
mod demo;
mod devices;
mod doctor;
mod error;
mod evaluate;
mod export;
mod files;
mod grab;
mod import;
mod init;
mod interrupt;
mod licences;
mod linearity;
mod match_arguments;
mod matching;
mod memory;
mod motion;
mod need;
mod plan;
mod progress;
mod rectify;
mod resume;
mod rig;
mod run;
mod scan;
mod scan_end;
mod simulate;
mod surface;
mod target;
mod verify;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use error::CliError;
pub use memory::keep_memory;
use progress::{Talk, tell};

const EXIT_CODES: &str =
    "Exit codes: 0 done, 1 file, disk or memory trouble, 2 wrong use, 3 no device, 4 device fault, \
5 bad or damaged data, 6 calibration rejected, 7 interrupted and can be resumed, 130 interrupted.

Examples:
  epirig demo                                       a simulated measurement, no hardware needed
  epirig import photos/ --out seq                   your own photographs
  epirig calibrate tile                             lens, direction of travel, positions, light
  epirig match seq --reference middle
  epirig devices                                    serial ports and cameras
  epirig home && epirig move 12.5
  epirig init && epirig run --out tile              a rig profile, and a measurement with it
  epirig capture --out seq --step-mm 1.5 --frames 101";

/// Turns the frames of a capture rig into disparity, height and their uncertainty.
#[derive(Debug, Parser)]
#[command(name = "epirig", version, max_term_width = 100, after_help = EXIT_CODES, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
    /// Print the result as JSON on stdout
    #[arg(long, global = true)]
    json: bool,
    /// Say nothing but errors and the result
    #[arg(long, short, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Demo(demo::Demo),
    Devices(devices::Devices),
    Camera(camera::CameraVerb),
    Grab(grab::Grab),
    Init(init::Init),
    Doctor(doctor::Doctor),
    Plan(plan::Plan),
    Capture(capture::Capture),
    Resume(resume::Resume),
    Run(run::Run),
    Home(motion::Home),
    Move(motion::Move),
    Stop(motion::Stop),
    Where(motion::Where),
    Import(import::Import),
    Calibrate(calibrate::CalibrateVerb),
    Rectify(rectify::Rectify),
    Verify(verify::Verify),
    Match(matching::Match),
    Surface(surface::Surface),
    Evaluate(evaluate::Evaluate),
    Export(export::Export),
    Decode(decode::Decode),
    Simulate(simulate::Simulate),
    Target(target::TargetVerb),
    Licences(licences::Licences),
    /// Print a completion script for a shell
    #[command(
        after_help = "Example:\n  epirig completions bash > ~/.local/share/bash-completion/completions/epirig"
    )]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Starts the threads that compute; where the system allows no more of them, this one computes alone.
fn start_threads() {
    if rayon::ThreadPoolBuilder::new().build_global().is_err() {
        // If that fails, too, the first work in parallel says why.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
    }
}

/// Runs the program with the process's arguments. To be called while there is one thread.
pub fn main() -> ExitCode {
    // Where it cannot, everything works, a little slower.
    keep_memory();
    let cli = Cli::parse();
    let talk = Talk::new(cli.json, cli.quiet);
    if let Err(error) = interrupt::install() {
        talk.say(&format!("note: Ctrl-C will leave hidden .epirig- folders behind: {error}"));
    }
    start_threads();
    let done = match cli.verb {
        Verb::Demo(verb) => verb.run(&talk),
        Verb::Devices(verb) => verb.run(&talk),
        Verb::Camera(verb) => verb.run(&talk),
        Verb::Grab(verb) => verb.run(&talk),
        Verb::Init(verb) => verb.run(&talk),
        Verb::Doctor(verb) => verb.run(&talk),
        Verb::Plan(verb) => verb.run(&talk),
        Verb::Capture(verb) => verb.run(&talk),
        Verb::Resume(verb) => verb.run(&talk),
        Verb::Run(verb) => verb.run(&talk),
        Verb::Home(verb) => verb.run(&talk),
        Verb::Move(verb) => verb.run(&talk),
        Verb::Stop(verb) => verb.run(&talk),
        Verb::Where(verb) => verb.run(&talk),
        Verb::Import(verb) => verb.run(&talk),
        Verb::Calibrate(verb) => verb.run(&talk),
        Verb::Rectify(verb) => verb.run(&talk),
        Verb::Verify(verb) => verb.run(&talk),
        Verb::Match(verb) => verb.run(&talk),
        Verb::Surface(verb) => verb.run(&talk),
        Verb::Evaluate(verb) => verb.run(&talk),
        Verb::Export(verb) => verb.run(&talk),
        Verb::Decode(verb) => verb.run(&talk),
        Verb::Simulate(verb) => verb.run(&talk),
        Verb::Target(verb) => verb.run(&talk),
        Verb::Licences(verb) => verb.run(&talk),
        Verb::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "epirig", &mut script);
            talk.print(&String::from_utf8_lossy(&script))
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            talk.clear();
            tell(&format!("error: {}", error.in_words()));
            ExitCode::from(error.exit_code())
        }
    }
}
