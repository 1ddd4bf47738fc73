//! An object whose depth is known, among the scans of a series.

use std::fmt;
use std::path::{Component, Path, PathBuf};
use std::str::FromStr;

use thiserror::Error;

use super::SeriesEntry;
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
            // `./low` is `low`.
            below: Path::new(below).components().filter(|part| *part != Component::CurDir).collect(),
            depth_mm: rounded(0.5 * (lower_mm + upper_mm)),
            sigma_mm: 0.5 * (upper_mm - lower_mm) / student_t_95(f64::INFINITY),
        })
    }
}

/// To a millionth of a micrometre: the middle of 0.2 and 0.22 is 0.21.
fn rounded(mm: f64) -> f64 {
    (mm * 1e9).round() / 1e9
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
    /// The place, among the `standards`, of the one that a sequence is a scan of; `None` for another object. Of folders inside
    /// each other the innermost counts.
    pub(super) fn of_sequence(standards: &[Self], name: &str) -> Option<usize> {
        let inside = standards.iter().enumerate().filter(|(_, one)| Path::new(name).starts_with(&one.below));
        inside.max_by_key(|(_, standard)| standard.below.components().count()).map(|(place, _)| place)
    }

    /// What was measured of each of the `standards`.
    pub(super) fn steps(standards: &[Self], entries: &[SeriesEntry]) -> Vec<StandardStep> {
        let step = |(number, standard): (usize, &Self)| {
            let is_own = |entry: &&SeriesEntry| Self::of_sequence(standards, &entry.name) == Some(number);
            let own = || entries.iter().filter(is_own).filter(|entry| entry.depth_mm.is_some());
            let half_widths: Option<Vec<f64>> = own().map(|entry| entry.half_width_95_mm).collect();
            StandardStep {
                known_mm: standard.depth_mm,
                known_sigma_mm: standard.sigma_mm,
                measured_mm: own().filter_map(|entry| entry.depth_mm).collect(),
                claimed_half_width_mm: half_widths.map(|half_widths| root_mean_square(&half_widths)),
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
        assert_eq!(of("./a/./b=0.21 +- 0.01 mm").unwrap().to_string(), "of 0.21 mm in a/b");
        let found = of("0.3 mm").unwrap();
        assert_eq!((found.below, found.depth_mm, found.sigma_mm), (PathBuf::new(), 0.3, 0.0));
        for text in ["", "low", "0.2", "0.1..0.2 mm", "-0.2 mm", "0 mm", "0.2 s", "0.1 +- 0.2 mm", "low="] {
            let message = of(text).unwrap_err().to_string();
            assert!(message.starts_with(text) && message.contains("0.2 +- 0.001 mm"), "{message}");
        }
    }

    #[test]
    fn a_sequence_counts_for_the_innermost_folder() {
        let standards = ["0.1 mm", "runs=0.2 mm", "runs/low=0.3 mm"].map(|text| text.parse().unwrap());
        let of = |name| Standard::of_sequence(&standards, name);
        let found = ["001", "runs/001", "runs/low/001", "runs/lower/001"].map(of);
        assert_eq!(found, [Some(0), Some(1), Some(2), Some(1)]);
        assert_eq!(Standard::of_sequence(&standards[1..], "001"), None);
        let entry = |name: &str, depth_mm| SeriesEntry {
            depth_mm,
            half_width_95_mm: Some(0.004),
            ..SeriesEntry::of(Path::new("there is none"), name.to_owned())
        };
        let entries = [entry("runs/1", Some(0.19)), entry("runs/low/1", Some(0.3)), entry("runs/2", None)];
        let steps = Standard::steps(&standards, &entries);
        let measured: Vec<&[f64]> = steps.iter().map(|step| step.measured_mm.as_slice()).collect();
        assert_eq!(measured, [&[][..], &[0.19], &[0.3]]);
        assert_eq!(steps[1].claimed_half_width_mm, Some(0.004));
    }
}
