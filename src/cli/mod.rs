//! The command line: one file per verb, without logic of its own.

mod bands;
mod calibrate;
mod caller;
mod camera;
mod capture;
mod characterise;
mod choice;
mod colours;
mod compare;
mod completions;
mod console;
mod csv_table;
mod decode;
mod demo;
mod devices;
mod doctor;
pub mod embedded;
mod error;
mod evaluate;
mod export;
mod failure;
mod files;
mod grab;
mod help;
mod import;
mod init;
mod interrupt;
mod licences;
mod linearity;
mod lines;
mod list;
mod log;
mod manual;
mod match_arguments;
mod matching;
mod measure;
mod memory;
mod memory_limit;
mod motion_sentence;
mod motion_words;
mod need;
mod no_answer;
mod numbers;
mod pack;
mod plan;
mod progress;
mod rectify;
mod region;
mod repeat;
mod resume;
mod rig;
mod run;
mod scan;
mod scan_end;
mod simulate;
mod slurm;
mod stage;
mod submit;
mod surface;
mod target;
mod threads;
mod trend;
mod ui;
mod verdict;
mod verify;
mod view;

use std::ffi::OsString;
use std::process::ExitCode;
use std::time::Instant;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use tracing::{Span, error, info, info_span};

use error::CliError;
use failure::code;
use help::Extent;
use log::LogArguments;
use memory::share_arena;
use progress::{Talk, tell_failure};
use threads::start_threads;

const EXIT_CODES: &str =
    "Exit codes: 0 done, 1 file, disk or memory trouble, 2 wrong use, 3 no device, 4 device fault, \
5 bad or damaged data, 6 calibration rejected, 7 interrupted and can be resumed, 8 match without any answer, \
9 verdict fail, 10 verdict undecided, 130 interrupted.

Examples:
  epirig demo                                       a simulated measurement, no hardware needed
  epirig measure photos/ --out first                your own photographs
  epirig calibrate tile                             lens, stage axis, positions, light
  epirig match seq
  epirig view seq                                   maps and reasons, in a browser
  epirig ui --rig sim                               rig, scan and results, in a browser
  epirig devices                                    serial ports and cameras
  epirig stage home && epirig stage move 12.5
  epirig init && epirig run --out tile              a rig profile, and a measurement with it
  epirig capture --out seq --step-mm 1.5 --frames 101";

/// Computes disparity, height and uncertainty from the frames of a capture rig.
#[derive(Debug, Parser)]
#[command(name = "epirig", version, max_term_width = 100, after_help = EXIT_CODES, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
    /// Print the result as JSON on stdout; a failure as {"error": {"message": ..., "kind": ..., "exit_code":
    /// N}}
    #[arg(long, global = true)]
    json: bool,
    /// Print only errors and the result
    #[arg(long, short, global = true)]
    quiet: bool,
    #[command(flatten)]
    log: LogArguments,
}

/// The table of verbs: one file each, in the order of the help.
macro_rules! verbs {
    ($($verb:ident = $arguments:ty,)+) => {
        #[derive(Debug, Subcommand)]
        enum Verb {
            $($verb($arguments),)+
        }

        impl Verb {
            fn run(self, talk: &Talk) -> Result<(), CliError> {
                match self {
                    $(Self::$verb(verb) => verb.run(talk),)+
                }
            }

            fn name(&self) -> String {
                let name = match self {
                    $(Self::$verb(_) => stringify!($verb),)+
                };
                name.to_lowercase()
            }
        }
    };
}

verbs! {
    Demo = demo::Demo,
    Measure = measure::Measure,
    Import = import::Import,
    Init = init::Init,
    Devices = devices::Devices,
    Camera = camera::CameraVerb,
    Stage = stage::StageVerb,
    Grab = grab::Grab,
    Target = target::TargetVerb,
    Doctor = doctor::Doctor,
    Plan = plan::Plan,
    Capture = capture::Capture,
    Resume = resume::Resume,
    Run = run::Run,
    Repeat = repeat::Repeat,
    Verify = verify::Verify,
    Calibrate = calibrate::CalibrateVerb,
    Rectify = rectify::Rectify,
    Pack = pack::Pack,
    Match = matching::Match,
    Submit = submit::Submit,
    Surface = surface::Surface,
    Evaluate = evaluate::Evaluate,
    Compare = compare::Compare,
    List = list::List,
    Trend = trend::TrendVerb,
    Characterise = characterise::Characterise,
    View = view::View,
    Ui = ui::Ui,
    Export = export::Export,
    Decode = decode::Decode,
    Simulate = simulate::Simulate,
    Licences = licences::Licences,
    Completions = completions::Completions,
    Manual = manual::Manual,
}

impl Verb {
    /// Whether the verb may take frames, which are logged.
    fn scans(&self) -> bool {
        matches!(
            self,
            Self::Capture(_) | Self::Resume(_) | Self::Run(_) | Self::Repeat(_) | Self::Demo(_) | Self::Ui(_)
        )
    }

    /// Runs the verb in a log span of its own.
    fn run_logged(self, talk: &Talk) -> Result<(), CliError> {
        let begun = Instant::now();
        let span: Span = info_span!("verb", verb = self.name());
        let _entered = span.enter();
        info!(version = env!("CARGO_PKG_VERSION"), pid = std::process::id(), "begun");
        let done = self.run(talk);
        let seconds = begun.elapsed().as_secs_f64();
        match &done {
            Ok(()) => info!(seconds, "done"),
            Err(verdict) if verdict.is_verdict() => info!(seconds, exit_code = code(verdict.blame).0, "done"),
            Err(failure) => {
                let (exit_code, kind) = code(failure.blame);
                error!(seconds, exit_code, kind, reason = failure.message, "failed");
            }
        }
        done
    }
}

/// Runs the program with the process's arguments. Call it while there is one thread.
pub fn main() -> ExitCode {
    ExitCode::from(run(std::env::args_os()))
}

/// Runs the program with these arguments, of which the first is its name; returns the exit code. Call it while there
/// is one thread.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let program = help::arranged(Cli::command(), Extent::asked_for(arguments.iter().cloned()));
    let parsed = program.clone().try_get_matches_from(arguments);
    let parsed = parsed.and_then(|mut found| Cli::from_arg_matches_mut(&mut found));
    let cli = match parsed {
        Ok(cli) => cli,
        Err(error) => {
            let error = numbers::in_words(error, &program);
            // Where nothing can be printed, the exit code still tells.
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(2);
        }
    };
    // Without it everything works as long as addresses last.
    share_arena();
    let talk = Talk::new(cli.json, cli.quiet);
    let listening = log::listen(&cli.log, cli.quiet, cli.verb.scans());
    if let Err(error) = interrupt::install() {
        talk.say(&format!("note: Ctrl-C will leave .epirig-* folders behind: {error}"));
    }
    let ready = listening.and_then(|()| start_threads(&talk));
    match ready.and_then(|()| cli.verb.run_logged(&talk)) {
        Ok(()) => 0,
        Err(error) => {
            talk.clear();
            tell_failure(&error);
            code(error.blame).0
        }
    }
}
