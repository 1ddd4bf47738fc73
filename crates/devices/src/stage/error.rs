//! Errors of a stage.

use std::time::Duration;

use thiserror::Error;

use crate::link::LinkError;

/// Error of a stage, with advice.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum StageError {
    /// The position is unknown.
    #[error("the stage has not been homed, so its position is unknown; home it first (`epirig stage home`)")]
    NotHomed,
    /// The position is outside the travel.
    #[error(
        "{} mm is outside the stage's travel of 0 to {travel_mm} mm; choose a position within it",
        (position_mm * 1e4).round() / 1e4
    )]
    OutsideTravel {
        /// Commanded position, in mm from home.
        position_mm: f64,
        /// Length of the travel, in mm.
        travel_mm: f64,
    },
    /// There is not enough room for the approach.
    #[error(
        "{position_mm} mm cannot be approached from one side: the stage would have to come from {approach_mm} mm \
         below; choose positions from {approach_mm} mm on, or a shorter approach"
    )]
    NoApproach {
        /// Commanded position, in mm from home.
        position_mm: f64,
        /// Length of the approach, in mm.
        approach_mm: f64,
    },
    /// The line to the stage failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// There is no valid answer.
    #[error(
        "the stage at {port} does not answer ({asked}, {patience_s:.1} s); check power, cable and {hint}"
    )]
    NoAnswer {
        /// The port.
        port: String,
        /// The request.
        asked: String,
        /// Time-out, in s.
        patience_s: f64,
        /// What else to check.
        hint: &'static str,
    },
    /// Another kind of device answers.
    #[error("{port} answers, but not as a {expected} stage: {heard}; {hint}")]
    Foreign {
        /// The port.
        port: String,
        /// The dialect.
        expected: &'static str,
        /// The answer.
        heard: String,
        /// What to do.
        hint: String,
    },
    /// The settings of the stage prevent a measurement.
    #[error("the stage at {port} is set up so that it cannot be trusted: {what}; {remedy}")]
    Unsuitable {
        /// The port.
        port: String,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// The stage refuses the command.
    #[error("the stage refuses: {reason}")]
    Refused {
        /// Why, and what to do.
        reason: String,
    },
    /// The stage has restarted.
    #[error(
        "the stage has restarted (power or reset) {during}, so its position is lost; home it, then continue"
    )]
    Restarted {
        /// When it was noticed.
        during: String,
    },
    /// The stage stopped by itself.
    #[error("the stage stopped {during}: {fault}")]
    Fault {
        /// When.
        during: String,
        /// Why, and what to do.
        fault: String,
    },
    /// The reported position is not the commanded one.
    #[error(
        "the stage reports {reported_mm:.4} mm where {commanded_mm:.4} mm was commanded (tolerance {tolerance_mm:.4} mm); \
         home it; if it happens again, look for what blocks it"
    )]
    Disagrees {
        /// Commanded position, in mm from home.
        commanded_mm: f64,
        /// Reported position, in mm from home.
        reported_mm: f64,
        /// Largest allowed difference, in mm.
        tolerance_mm: f64,
    },
    /// The stage reports the end of a move too early.
    #[error(
        "the stage claims to have moved {distance_mm:.3} mm in {took_s:.3} s, which needs {least_s:.3} s at least; it \
         did not move, or its reported settings are wrong: check the motor's power, then home it"
    )]
    TooFast {
        /// Length of the move, in mm.
        distance_mm: f64,
        /// Time until the reported end, in s.
        took_s: f64,
        /// Least possible time, in s.
        least_s: f64,
    },
    /// An operation did not end in time.
    #[error(
        "the stage has not finished {during} after {patience_s:.1} s; check that nothing blocks it, then home it"
    )]
    TooSlow {
        /// The operation.
        during: String,
        /// Time-out, in s.
        patience_s: f64,
    },
    /// It is in feed hold, or a feed hold ended its motion.
    #[error(
        "the stage is held{}: feed hold was pressed at the controller, or another program sent it; press cycle \
         start (or send `~` with `epirig stage console`), then give the command again",
        match .position_mm { Some(mm) => format!(" at {mm:.3} mm"), None => String::new() }
    )]
    Held {
        /// Position, in mm from home, if known.
        position_mm: Option<f64>,
    },
    /// The operator, or another thread, stopped it.
    #[error("stopped{}", match .position_mm { Some(mm) => format!(" at {mm:.3} mm; the position is known"), None => "; home the stage before it moves again".to_owned() })]
    Stopped {
        /// Position, in mm from home, if still known.
        position_mm: Option<f64>,
    },
}

impl StageError {
    /// There is no valid answer to `asked` within `patience`; `hint` is what else to check.
    pub fn no_answer(port: &str, asked: &str, patience: Duration, hint: &'static str) -> Self {
        let (port, asked, patience_s) = (port.to_owned(), asked.to_owned(), patience.as_secs_f64());
        Self::NoAnswer { port, asked, patience_s, hint }
    }

    /// Another kind of device than `expected` answers.
    pub fn foreign(
        port: &str,
        expected: &'static str,
        heard: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Self::Foreign { port: port.to_owned(), expected, heard: heard.into(), hint: hint.into() }
    }

    /// The settings of the stage prevent a measurement.
    pub fn unsuitable(port: &str, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Unsuitable { port: port.to_owned(), what: what.into(), remedy: remedy.into() }
    }

    /// The stage stopped by itself: why, and what to do.
    pub fn fault(during: &str, fault: impl Into<String>) -> Self {
        Self::Fault { during: during.to_owned(), fault: fault.into() }
    }

    /// An operation did not end in time.
    pub fn too_slow(during: &str, patience: Duration) -> Self {
        Self::TooSlow { during: during.to_owned(), patience_s: patience.as_secs_f64() }
    }
}
