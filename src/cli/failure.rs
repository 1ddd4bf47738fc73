//! Exit codes, and the output of `--json` for a failure.

use serde::Serialize;
use serde_json::Value;

use super::CliError;
use epirig_core::fault::Blame;

/// The exit code of an interrupted verb: 128 + SIGINT, as shells do.
pub(super) const INTERRUPTED: u8 = 130;

/// A failure as `--json` prints it on stdout:
///
/// ```json
/// {"error": {"message": "there is no row 90 to draw; the last is 23", "kind": "usage", "exit_code": 2}}
/// ```
///
/// If the rig is not ready, `report` holds the findings of its examination, as `epirig doctor --json` prints them.
///
/// `message` is the line of stderr without `error: `. `kind` stands for the exit code: `trouble` (1), `usage` (2), `no-device` (3),
/// `device` (4), `data` (5), `rejected` (6), `resumable` (7), `no-answer` (8), `interrupted` (130). A verdict that is fail (9) or undecided (10) is no failure: it stands in the result.
///
/// stdout holds one object at most: a verb that has printed its result (such as the findings of `verify`)
/// prints no second one. Options that cannot be parsed are reported on stderr only.
#[derive(Debug, Serialize)]
pub(super) struct Failure<'a> {
    error: FailureFacts<'a>,
}

#[derive(Debug, Serialize)]
struct FailureFacts<'a> {
    message: &'a str,
    kind: &'static str,
    exit_code: u8,
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<&'a Value>,
}

impl<'a> Failure<'a> {
    pub(super) fn of(error: &'a CliError) -> Self {
        let (exit_code, kind) = code(error.blame);
        let CliError { message, report, .. } = error;
        Self { error: FailureFacts { message, kind, exit_code, report: report.as_ref() } }
    }
}

/// The exit code of a failure, as listed in `--help`, and the name of its kind.
pub(super) const fn code(blame: Blame) -> (u8, &'static str) {
    match blame {
        Blame::System => (1, "trouble"),
        Blame::Request => (2, "usage"),
        Blame::NoDevice => (3, "no-device"),
        Blame::Device => (4, "device"),
        Blame::Data => (5, "data"),
        Blame::Rejection => (6, "rejected"),
        Blame::Resumable => (7, "resumable"),
        Blame::NoAnswer => (8, "no-answer"),
        Blame::NotConforming => (9, "fail"),
        Blame::Undecided => (10, "undecided"),
        Blame::Interruption => (INTERRUPTED, "interrupted"),
    }
}
