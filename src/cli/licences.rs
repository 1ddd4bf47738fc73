//! `epirig licences`.

use clap::Args;

use super::{CliError, Talk};

/// Made by cargo-about, see CONTRIBUTING.md.
const THIRD_PARTY: &str = include_str!("../../THIRD-PARTY.txt");

/// Print the licences of epirig and of its dependencies
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  epirig licences | less")]
pub(super) struct Licences {}

impl Licences {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        talk.result(&serde_json::json!({ "licences": THIRD_PARTY }), || THIRD_PARTY.to_owned())
    }
}
