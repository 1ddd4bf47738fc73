//! `epirig completions`: completion scripts for shells.

use clap::{Args, CommandFactory};

use super::{Cli, CliError, Talk};

/// Print a completion script for a shell
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  epirig completions bash > ~/.local/share/bash-completion/completions/epirig"
)]
pub(super) struct Completions {
    /// The shell
    shell: clap_complete::Shell,
}

impl Completions {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "epirig", &mut script);
        talk.print(&String::from_utf8_lossy(&script))
    }
}
