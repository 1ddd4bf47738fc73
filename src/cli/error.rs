//! Why a verb fails: a line on stderr, an exit code, and with `--json` a [`Failure`](super::failure::Failure).

use std::io;
use std::path::Path;

use serde_json::Value;

use epirig_core::fault::{Blame, Fault};
use epirig_server::ServerError;

/// Why a verb fails.
#[derive(Debug)]
pub(super) struct CliError {
    /// One line, or one for each mistake of a profile.
    pub(super) message: String,
    /// Who must act.
    pub(super) blame: Blame,
    /// What was measured before the failure.
    pub(super) report: Option<Value>,
}

impl<F: Fault> From<F> for CliError {
    fn from(fault: F) -> Self {
        Self { message: fault.message(), blame: fault.blame(), report: None }
    }
}

impl CliError {
    /// A failure of which `message` tells; line breaks in names are replaced.
    pub(super) fn new(blame: Blame, message: impl ToString) -> Self {
        Self { message: message.to_string().replace('\n', "\u{fffd}"), blame, report: None }
    }

    /// Whether this is no failure: the result is printed, and the exit code tells its verdict.
    pub(super) fn is_verdict(&self) -> bool {
        matches!(self.blame, Blame::NotConforming | Blame::Undecided)
    }

    /// Wrong use.
    pub(super) fn usage(message: impl ToString) -> Self {
        Self::new(Blame::Request, message)
    }

    /// Data that are invalid or damaged.
    pub(super) fn data(message: impl ToString) -> Self {
        Self::new(Blame::Data, message)
    }

    /// A file that the system refuses to `action`.
    pub(super) fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::new(Blame::System, format!("{}: cannot {action}: {source}", path.display()))
    }

    /// A result that cannot be printed.
    pub(super) fn output(source: impl ToString) -> Self {
        Self::new(Blame::System, format!("cannot print the result: {}", source.to_string()))
    }

    /// A page that cannot be served. The address is what a person asked for.
    pub(super) fn server(error: ServerError) -> Self {
        let blame = if matches!(error, ServerError::Listen { .. }) { Blame::Request } else { Blame::System };
        Self::new(blame, error)
    }
}
