//! What is found out before a scan: whether rig and plan will give a measurement, and how good it will be.
//!
//! [`examine`] looks at everything and gives a [`Report`] of [`Check`]s, each with a finding in numbers and, if something is to be done,
//! advice. The parts can be used alone: [`repeated_phases`] and [`Prediction`] from numbers, [`Flicker`] from frames, [`measure_motion`],
//! [`measure_settling`] and [`measure_repeatability`] with a stage and a camera.

mod error;
mod examine;
mod flicker;
mod motion;
mod picture;
mod prediction;
mod repeatability;
mod rules;
mod sampling;
mod settling;
mod stops;
mod view;

use serde::Serialize;

use crate::capture::CapturePlan;

pub use error::{DoctorError, MotionError};
pub use examine::examine;
pub use flicker::{Flicker, nearest_exposure_us, suits_mains};
pub use motion::{ImageMotion, measure_motion};
pub use prediction::{Prediction, Prospect, Resolution};
pub use repeatability::{RETURNS, Repeatability, measure_repeatability};
pub use sampling::{RepeatedPhases, better_step_mm, repeated_phases};
pub use settling::{Settling, measure_settling};
pub use view::View;

/// The scan that is planned, and what is known of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct DoctorPlan {
    /// The scan itself.
    pub scan: CapturePlan,
    /// Distance of the object, in mm, if known.
    pub distance_mm: Option<f64>,
    /// Height differences that are to be seen, in mm, if known.
    pub relief_mm: Option<f64>,
    /// Frequency of the mains that feed the lamps, in Hz, if known.
    pub mains_hz: Option<f64>,
    /// Room on the disk where the sequence will be, in bytes, if known.
    pub free_bytes: Option<u64>,
    /// Leaves out what takes many moves: settling and repeatability.
    pub short: bool,
}

/// What a check comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// As it should be.
    Good,
    /// It could not be found out.
    Unknown,
    /// The measurement will be worse for it.
    Warning,
    /// There will be no measurement.
    Bad,
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Check {
    /// What was looked at, in a word or two.
    pub name: &'static str,
    /// What it comes to.
    pub verdict: Verdict,
    /// What was found, a sentence with numbers and units.
    pub finding: String,
    /// What to do, if something is to be done.
    pub advice: Option<String>,
}

impl Check {
    fn good(name: &'static str, finding: String) -> Self {
        Self { name, verdict: Verdict::Good, finding, advice: None }
    }

    fn with_advice(name: &'static str, verdict: Verdict, finding: String, advice: impl Into<String>) -> Self {
        Self { name, verdict, finding, advice: Some(advice.into()) }
    }
}

/// All that was found out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// What the camera is set to, as it says.
    pub configuration: String,
    /// All checks, in the order in which they were made.
    pub checks: Vec<Check>,
    /// How the picture moves with the stage, if that could be measured.
    pub motion: Option<ImageMotion>,
    /// How the stage came to rest, if that was measured.
    pub settling: Option<Settling>,
    /// How well it comes back, if that was measured.
    pub repeatability: Option<Repeatability>,
    /// How well heights will be known, if enough is known for that.
    pub predicted: Option<Prediction>,
}

impl Report {
    /// The worst verdict.
    pub fn verdict(&self) -> Verdict {
        self.checks.iter().map(|check| check.verdict).max().unwrap_or(Verdict::Good)
    }
}

#[cfg(test)]
mod tests;
