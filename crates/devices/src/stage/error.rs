//! Why a stage did not do what it was asked.

use thiserror::Error;

use crate::link::LinkError;

/// Why a stage did not do what it was asked, and what to do.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum StageError {
    /// The stage does not know where it is.
    #[error("the stage has not been homed, so its position is unknown; home it first (`epirig stage home`)")]
    NotHomed,
    /// The position lies outside the travel.
    #[error(
        "{position_mm} mm lies outside the stage's travel of 0 to {travel_mm} mm; choose a position on it"
    )]
    OutsideTravel {
        /// Position asked for, in mm from home.
        position_mm: f64,
        /// Length of the travel, in mm.
        travel_mm: f64,
    },
    /// There is not enough room to come from below.
    #[error(
        "{position_mm} mm cannot be approached from one side: the stage would have to come from {approach_mm} mm \
         below; choose positions from {approach_mm} mm on, or a shorter approach"
    )]
    NoApproach {
        /// Position asked for, in mm from home.
        position_mm: f64,
        /// Length of the approach, in mm.
        approach_mm: f64,
    },
    /// The line to the stage failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Nothing, or nothing that made sense, came back.
    #[error(
        "the stage at {port} does not answer ({asked}, {patience_s:.1} s); check power, cable and {hint}"
    )]
    NoAnswer {
        /// Where it should be.
        port: String,
        /// What it was asked.
        asked: String,
        /// How long it was given, in s.
        patience_s: f64,
        /// What else to check.
        hint: &'static str,
    },
    /// Something answers that is no such stage.
    #[error("{port} answers, but not as a {expected} stage: {heard}; {hint}")]
    Foreign {
        /// Where.
        port: String,
        /// The dialect.
        expected: &'static str,
        /// What came.
        heard: String,
        /// What to do.
        hint: String,
    },
    /// A stage whose settings do not allow a measurement.
    #[error("the stage at {port} is set up so that it cannot be trusted: {what}; {remedy}")]
    Unsuitable {
        /// Where.
        port: String,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// The stage would not.
    #[error("the stage refuses: {reason}")]
    Refused {
        /// Why, and what to do.
        reason: String,
    },
    /// The stage has restarted.
    #[error(
        "the stage has restarted (power or reset) {during}, so its position is lost; home it and go on from there"
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
    /// It is not where it was sent.
    #[error(
        "the stage reports {reported_mm:.4} mm where {commanded_mm:.4} mm was commanded (tolerance {tolerance_mm:.4} mm); \
         home it, and look for what holds it if that happens again"
    )]
    Disagrees {
        /// Where it was sent, in mm from home.
        commanded_mm: f64,
        /// Where it says it is, in mm from home.
        reported_mm: f64,
        /// How much they may differ, in mm.
        tolerance_mm: f64,
    },
    /// It says that it is there before it can be.
    #[error(
        "the stage claims to have moved {distance_mm:.3} mm in {took_s:.3} s, which takes it {least_s:.3} s at least; it \
         has not moved, or its settings are not what it says: check the motor's power, then home it"
    )]
    TooFast {
        /// Length of the move, in mm.
        distance_mm: f64,
        /// Time until it was said to be done, in s.
        took_s: f64,
        /// The least that is possible, in s.
        least_s: f64,
    },
    /// It did not come to an end.
    #[error(
        "the stage has not finished {during} after {patience_s:.1} s; check that nothing blocks it, then home it"
    )]
    TooSlow {
        /// The operation.
        during: String,
        /// How long it was given, in s.
        patience_s: f64,
    },
    /// A person, or another thread, stopped it.
    #[error("stopped{}", match .position_mm { Some(mm) => format!(" at {mm:.3} mm; the position is known"), None => "; home the stage before it moves again".to_owned() })]
    Stopped {
        /// Where, in mm from home, if that is still known.
        position_mm: Option<f64>,
    },
}
