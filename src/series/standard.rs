//! An object whose depth is known, among the scans of a series.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use thiserror::Error;

use super::{Trend, TrendValue};
use epirig_core::settings::quantity::{MM, Quantity, measure};
use epirig_core::statistics::root_mean_square;
use epirig_surface::conformity::Limits;
use epirig_surface::{StandardStep, student_t_95};

/// An object whose depth is known, and where its scans are.
///
/// ```
/// use epirig::series::Standard;
///
/// let standard: Standard = "low=0.2 +- 0.001 mm".parse()?;
/// assert_eq!((standard.below.to_str(), standard.depth_mm), (Some("low"), 0.2));
/// # Ok::<(), epirig::series::NoStandard>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Standard {
    /// Its sequences: those whose names, as in the list of the series, begin with this folder; empty for all.
    pub below: PathBuf,
    /// The known depth, in mm; positive.
    pub depth_mm: f64,
    /// Its standard uncertainty, in mm; 0 if it counts as exact.
    pub sigma_mm: f64,
}

/// A text that is no [`Standard`].
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "{0}: give a known depth as `0.2 +- 0.001 mm` with its interval of 95 % coverage, or `0.2 mm`; `FOLDER=0.2 mm` is that of the sequences in FOLDER"
)]
pub struct NoStandard(String);

impl FromStr for Standard {
    type Err = NoStandard;

    fn from_str(text: &str) -> Result<Self, NoStandard> {
        let (below, depth) = text.rsplit_once('=').unwrap_or(("", text));
        let ends = || {
            let limits: Limits = depth.parse().ok().filter(|_| !depth.contains(".."))?;
            Some((limits.lower_mm()?, limits.upper_mm()?))
        };
        let exactly = || {
            let found = measure(depth).ok().filter(|found| found.unit.quantity == Quantity::Length)?;
            Some((found.in_unit(MM), found.in_unit(MM)))
        };
        let (lower_mm, upper_mm) = ends()
            .or_else(exactly)
            .filter(|(lower_mm, _)| *lower_mm > 0.0)
            .ok_or(NoStandard(text.to_owned()))?;
        Ok(Self {
            below: below.into(),
            depth_mm: 0.5 * (lower_mm + upper_mm),
            sigma_mm: 0.5 * (upper_mm - lower_mm) / student_t_95(f64::INFINITY),
        })
    }
}

impl fmt::Display for Standard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { below, depth_mm, .. } = self;
        match below.as_os_str().is_empty() {
            true => write!(f, "of {depth_mm} mm"),
            false => write!(f, "of {depth_mm} mm in {}", below.display()),
        }
    }
}

impl Standard {
    /// The place, among the `standards`, of the first one that the sequence is a scan of; `None` for another object.
    pub(super) fn of_sequence(standards: &[Self], name: &str) -> Option<usize> {
        standards.iter().position(|standard| Path::new(name).starts_with(&standard.below))
    }

    /// What was measured of each of the `standards`, by the depths of a series.
    pub(super) fn steps(standards: &[Self], depths: &Trend) -> Vec<StandardStep> {
        let step = |(number, standard): (usize, &Self)| {
            let is_own = |value: &&TrendValue| Self::of_sequence(standards, &value.sequence) == Some(number);
            let own = || depths.values.iter().filter(is_own);
            let sigmas: Option<Vec<f64>> = own().map(|value| value.sigma).collect();
            StandardStep {
                known_mm: standard.depth_mm,
                known_sigma_mm: standard.sigma_mm,
                measured_mm: own().map(|value| value.value).collect(),
                claimed_sigma_mm: sigmas.map(|sigmas| root_mean_square(&sigmas)),
            }
        };
        standards.iter().enumerate().map(step).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standard_is_a_depth_with_or_without_its_interval() {
        let of = |text: &str| text.parse::<Standard>();
        let found = of("runs/low=200 +- 1.96 um").unwrap();
        assert_eq!(found.below, Path::new("runs/low"));
        assert!((found.depth_mm - 0.2).abs() < 1e-12 && (found.sigma_mm - 0.001).abs() < 1e-7, "{found:?}");
        let found = of("0.3 mm").unwrap();
        assert_eq!((found.below, found.depth_mm, found.sigma_mm), (PathBuf::new(), 0.3, 0.0));
        for text in ["", "low", "0.2", "0.1..0.2 mm", "-0.2 mm", "0 mm", "0.2 s", "0.1 +- 0.2 mm", "low="] {
            let message = of(text).unwrap_err().to_string();
            assert!(message.starts_with(text) && message.contains("0.2 +- 0.001 mm"), "{message}");
        }
    }
}
