//! Checks before a scan: whether rig and plan give a measurement, and its predicted uncertainty.
//!
//! [`examine`] makes all checks and gives a [`Report`] of [`Check`]s, each with a finding in numbers, and
//! with advice if something must be done.

mod error;
mod examine;
mod flicker;
mod motion;
mod picture;
mod prediction;
mod repeatability;
mod response;
mod rules;
mod sampling;
mod settling;
mod stops;
mod view;

use serde::Serialize;

use crate::capture::CapturePlan;

pub use error::DoctorError;
pub use examine::examine;
pub use motion::ImageMotion;
pub use prediction::{Prediction, Resolution};
pub use repeatability::Repeatability;
pub use rules::disk as check_disk;
pub use settling::Settling;

/// The planned scan, and knowledge of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct DoctorPlan {
    /// The scan.
    pub scan: CapturePlan,
    /// Distance of the object, in mm, if known.
    pub distance_mm: Option<f64>,
    /// Height difference that must be resolved, in mm, if known.
    pub relief_mm: Option<f64>,
    /// Mains frequency of the lamps, in Hz, if known.
    pub mains_hz: Option<f64>,
    /// Free space on the disk of the sequence, in bytes, if known.
    pub free_bytes: Option<u64>,
    /// Skips measurements that need many moves: settling and repeatability.
    pub short: bool,
}

/// The verdict of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Good.
    Good,
    /// Unknown: the check was not possible.
    Unknown,
    /// The measurement will be worse.
    Warning,
    /// A measurement is not possible.
    Bad,
}

/// One check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Check {
    /// What was checked, in a word or two.
    pub name: &'static str,
    /// The verdict.
    pub verdict: Verdict,
    /// The finding, with numbers and units.
    pub finding: String,
    /// What to do, if anything.
    pub advice: Option<String>,
}

impl Check {
    fn good(name: &'static str, finding: String) -> Self {
        Self { name, verdict: Verdict::Good, finding, advice: None }
    }

    /// `advice` is for what is not good.
    fn new(name: &'static str, verdict: Verdict, finding: String, advice: impl Into<String>) -> Self {
        let advice = (verdict != Verdict::Good).then(|| advice.into());
        Self { name, verdict, finding, advice }
    }
}

/// The result of the examination.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The settings of the camera, as it reports them.
    pub configuration: String,
    /// All checks, in their order.
    pub checks: Vec<Check>,
    /// Motion of the picture with the stage, if measured.
    pub motion: Option<ImageMotion>,
    /// Mechanical settling, if measured.
    pub settling: Option<Settling>,
    /// Repeatability, if measured.
    pub repeatability: Option<Repeatability>,
    /// Predicted uncertainty of heights, if enough is known.
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
