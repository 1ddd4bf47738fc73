//! The program `epirig`.

use std::process::ExitCode;

fn main() -> ExitCode {
    epirig::cli::main()
}
