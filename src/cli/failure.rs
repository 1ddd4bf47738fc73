//! Exit codes, and the output of `--json` for a failure.

use serde::Serialize;
use serde_json::Value;

/// Trouble with a file, a disk or memory.
pub(super) const TROUBLE: u8 = 1;
/// Wrong use.
pub(super) const USAGE: u8 = 2;
/// No such device, or no access to it.
pub(super) const NO_DEVICE: u8 = 3;
/// A device failed.
pub(super) const DEVICE: u8 = 4;
/// Data are invalid or damaged.
pub(super) const INTEGRITY: u8 = 5;
/// Frames that do not give a calibration.
pub(super) const REJECTED: u8 = 6;
/// An interrupted scan that can be resumed.
pub(super) const RESUMABLE: u8 = 7;
/// A match in which no pixel has an answer.
pub(super) const NO_ANSWER: u8 = 8;
/// Interrupted: 128 + SIGINT, as shells do.
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
/// `device` (4), `data` (5), `rejected` (6), `resumable` (7), `no-answer` (8), `interrupted` (130).
///
/// stdout holds one object at most: a verb that has printed its result (such as the findings of `verify`)
/// prints no second one. Options that cannot be parsed are reported on stderr only.
#[derive(Debug, Serialize)]
pub(super) struct Failure {
    error: FailureFacts,
}

#[derive(Debug, Serialize)]
struct FailureFacts {
    message: String,
    kind: &'static str,
    exit_code: u8,
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<Value>,
}

impl Failure {
    pub(super) fn new(message: String, exit_code: u8) -> Self {
        Self { error: FailureFacts { message, kind: kind(exit_code), exit_code, report: None } }
    }

    /// The same with what was measured before.
    pub(super) fn with_report(mut self, report: Option<&Value>) -> Self {
        self.error.report = report.cloned();
        self
    }
}

/// The kind of failure that an exit code stands for.
pub(super) fn kind(exit_code: u8) -> &'static str {
    match exit_code {
        USAGE => "usage",
        NO_DEVICE => "no-device",
        DEVICE => "device",
        INTEGRITY => "data",
        REJECTED => "rejected",
        RESUMABLE => "resumable",
        NO_ANSWER => "no-answer",
        INTERRUPTED => "interrupted",
        _ => "trouble",
    }
}
