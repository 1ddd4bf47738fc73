//! The command line: one file a verb, no logic of its own.

mod demo;
mod error;
mod evaluate;
mod export;
mod import;
mod match_arguments;
mod matching;
mod progress;
mod verify;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use crate::scratch::Scratch;
use error::CliError;
use progress::Talk;

const EXIT_CODES: &str = "Exit codes: 0 done, 1 file or disk trouble, 2 wrong use, 4 device fault, \
5 bad or damaged data, 130 interrupted.

Examples:
  epirig demo                                       a simulated measurement, no hardware needed
  epirig import photos/ --out seq                   your own photographs
  epirig match seq --reference middle";

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
    Import(import::Import),
    Verify(verify::Verify),
    Match(matching::Match),
    Evaluate(evaluate::Evaluate),
    Export(export::Export),
    /// Print a completion script for a shell
    #[command(
        after_help = "Example:\n  epirig completions bash > ~/.local/share/bash-completion/completions/epirig"
    )]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Ends the program on Ctrl-C, hang-up or termination.
fn interrupted() {
    Scratch::remove_all();
    eprintln!("\nerror: interrupted; a scan keeps the frames it has, and nothing else was left half-written");
    // 128 + SIGINT, as shells have it.
    std::process::exit(130);
}

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let talk = Talk::new(cli.json, cli.quiet);
    if let Err(error) = ctrlc::set_handler(interrupted) {
        talk.say(&format!("note: Ctrl-C will leave hidden .epirig- folders behind: {error}"));
    }
    let done = match cli.verb {
        Verb::Demo(verb) => verb.run(&talk),
        Verb::Import(verb) => verb.run(&talk),
        Verb::Verify(verb) => verb.run(&talk),
        Verb::Match(verb) => verb.run(&talk),
        Verb::Evaluate(verb) => verb.run(&talk),
        Verb::Export(verb) => verb.run(&talk),
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
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
