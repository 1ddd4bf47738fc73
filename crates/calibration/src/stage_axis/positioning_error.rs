//! Positioning error of the stage, measured with the target.

use epirig_core::statistics::upper_median;
use serde::{Deserialize, Serialize};

use super::MeasuredTau;

/// An error this many robust standard deviations from the others is named.
const OUTLIER: f64 = 4.0;
/// From the median absolute deviation to the standard deviation of normal numbers.
const MAD: f64 = 1.482_602_218_505_602;

/// One stop of the stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FramePosition {
    /// The position that the stage reported, in mm.
    pub reported_mm: f64,
    /// Where the target shows it, on the stage's scale, in mm; as reported where no target is seen.
    pub measured_mm: f64,
    /// Standard deviation of `measured_mm`, in mm, against the first and the last frame that show the target;
    /// `None` where none is seen.
    pub sigma_mm: Option<f64>,
}

/// The stage's report against the target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositioningError {
    /// Every frame.
    pub frames: Vec<FramePosition>,
    /// Root mean square of measured less reported, in um, over the frames that show the target.
    pub rms_um: f64,
    /// The largest of them, in um.
    pub largest_um: f64,
    /// Outliers: frames with significant errors.
    pub outliers: Vec<usize>,
    /// Length of the baseline between the first and the last frame, in mm.
    pub baseline_mm: f64,
    /// Its standard uncertainty, in mm, by the stage's positioning errors.
    pub baseline_sigma_mm: f64,
}

impl PositioningError {
    /// Measured less reported position of a frame, in um.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn error_um(&self, frame: usize) -> f64 {
        1000.0 * (self.frames[frame].measured_mm - self.frames[frame].reported_mm)
    }
}

/// Puts measured tau on the stage's scale: the straight line through reported positions over tau, by least
/// squares without the outliers. `None` if less than two frames show the target.
///
/// # Panics
/// If the numbers of positions and taus differ.
pub fn positioning_error(tau: &[Option<MeasuredTau>], reported_mm: &[f64]) -> Option<PositioningError> {
    assert_eq!(tau.len(), reported_mm.len());
    let seen: Vec<(usize, f64, f64)> = tau
        .iter()
        .zip(reported_mm)
        .enumerate()
        .filter_map(|(frame, (measured, reported))| measured.map(|measured| (frame, measured.tau, *reported)))
        .collect();
    let mut good = seen.clone();
    let mut line = Line::through(&good)?;
    // Each round may free the line of frames that pulled it.
    for _ in 0..5 {
        let mut errors: Vec<f64> = good.iter().map(|point| line.error(point).abs()).collect();
        let deviation = MAD * upper_median(&mut errors).unwrap_or(0.0);
        // The target's own uncertainty is no fault of the stage.
        let limit = |frame: usize| {
            let sigma = tau[frame].map_or(0.0, |measured| measured.sigma) * line.slope.abs();
            OUTLIER * deviation.max(sigma)
        };
        good = seen.iter().filter(|point| line.error(point).abs() <= limit(point.0)).copied().collect();
        line = Line::through(&good)?;
    }
    let named: Vec<usize> =
        seen.iter().map(|point| point.0).filter(|frame| good.iter().all(|point| point.0 != *frame)).collect();
    let frames: Vec<FramePosition> = tau
        .iter()
        .zip(reported_mm)
        .map(|(measured, &reported_mm)| FramePosition {
            reported_mm,
            measured_mm: measured.map_or(reported_mm, |measured| line.offset + line.slope * measured.tau),
            sigma_mm: measured.map(|measured| line.slope.abs() * measured.sigma),
        })
        .collect();
    let errors_um: Vec<f64> = seen.iter().map(|point| 1000.0 * line.error(point)).collect();
    let squares: f64 = errors_um.iter().map(|error| error * error).sum();
    Some(PositioningError {
        rms_um: (squares / seen.len() as f64).sqrt(),
        largest_um: errors_um.iter().fold(0.0, |largest, error| error.abs().max(largest)),
        outliers: named,
        baseline_mm: frames.last()?.measured_mm - frames.first()?.measured_mm,
        baseline_sigma_mm: line.slope_sigma,
        frames,
    })
}

/// reported = offset + slope tau.
struct Line {
    offset: f64,
    slope: f64,
    slope_sigma: f64,
}

impl Line {
    fn through(points: &[(usize, f64, f64)]) -> Option<Self> {
        let count = points.len() as f64;
        let mean = |of: &dyn Fn(&(usize, f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (tau, reported) = (mean(&|point| point.1), mean(&|point| point.2));
        let spread = mean(&|point| (point.1 - tau).powi(2)) * count;
        if points.len() < 2 || spread == 0.0 {
            return None;
        }
        let slope = mean(&|point| (point.1 - tau) * (point.2 - reported)) * count / spread;
        let mut line = Self { offset: reported - slope * tau, slope, slope_sigma: 0.0 };
        let squares: f64 = points.iter().map(|point| line.error(point).powi(2)).sum();
        line.slope_sigma = (squares / (count - 2.0).max(1.0) / spread).sqrt();
        Some(line)
    }

    /// Measured less reported, in mm.
    fn error(&self, (_, tau, reported): &(usize, f64, f64)) -> f64 {
        self.offset + self.slope * tau - reported
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(tau: f64) -> Option<MeasuredTau> {
        Some(MeasuredTau { tau, sigma: 1e-6 })
    }

    #[test]
    fn a_stop_that_is_off_is_named_and_does_not_bend_the_others() {
        // Ten stops at 10, 11, ... 19 mm, the stage's errors +-1 um in turn; in frame 4 it stood 50 um
        // farther, and frame 7 shows no target.
        let reported: Vec<f64> = (0..10).map(|index| 10.0 + f64::from(index)).collect();
        let mut tau: Vec<_> = (0..10)
            .map(|index| {
                let error = if index % 2 == 0 { 0.001 } else { -0.001 };
                measured((f64::from(index) + error + if index == 4 { 0.05 } else { 0.0 }) / 9.0)
            })
            .collect();
        tau[7] = None;
        let positioning = positioning_error(&tau, &reported).unwrap();
        assert_eq!(positioning.outliers, [4]);
        assert!((positioning.error_um(4) - 51.0).abs() < 1.0, "{positioning:?}");
        assert!((positioning.error_um(3) + 1.0).abs() < 1.0, "{positioning:?}");
        assert_eq!(positioning.frames[7].measured_mm, 17.0);
        assert_eq!(positioning.frames[7].sigma_mm, None);
        assert!((positioning.baseline_mm - 9.0).abs() < 0.003);
        // 1 um over a spread of 9 mm in nine stops.
        assert!(
            positioning.baseline_sigma_mm > 0.0005 && positioning.baseline_sigma_mm < 0.002,
            "{positioning:?}"
        );
    }

    #[test]
    fn one_frame_has_no_positioning_error() {
        assert_eq!(positioning_error(&[measured(0.0), None], &[1.0, 2.0]), None);
    }
}
