//! Prediction of the uncertainty of heights before the scan.
//!
//! Over N evenly spread frames, the slope of a line in an EPI is a least-squares slope over tau = 0 .. 1,
//! with sum (tau - mean)^2 = N (N + 1) / (12 (N - 1)). With noise s per frame, gradients g along x and W
//! pixels fitted together, the standard uncertainty of the disparity d is
//!
//! ```text
//! sigma_d = s / (g sqrt W) * sqrt(12 (N - 1) / (N (N + 1)))
//! ```
//!
//! which is the Cramer-Rao bound. Height is Z = f B / d, with the disparity D = f B / Z px over the baseline
//! B: sigma_Z = Z / D * sigma_d.
//!
//! A position error e of the stage shifts the whole picture by f / Z e. It enters the slope in the same way,
//! but is common to all pixels. It moves and tilts the surface as a whole, and changes a relief h only by its
//! share h / Z.

use serde::Serialize;

/// Relief of at least this many sigma is resolved ...
const RESOLVED: f64 = 5.0;
/// ... and relief below this many sigma is lost in noise.
const UNRESOLVED: f64 = 2.0;

/// Inputs of a prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prospect {
    /// Motion of the picture per mm of the stage, in px: f / Z.
    pub(super) px_per_mm: f64,
    /// Distance of the object Z, in mm.
    pub(super) distance_mm: f64,
    /// Distance from the first to the last position, in mm.
    pub(super) baseline_mm: f64,
    /// Number of frames, at least 2.
    pub(super) frames: usize,
    /// Standard deviation of a frame's samples, in DN.
    pub(super) noise_dn: f64,
    /// Root mean square of the gradient along x, without noise, in DN per px.
    pub(super) gradient_dn_per_px: f64,
    /// Number of pixels fitted together.
    pub(super) window_px: f64,
    /// Standard deviation of the stage's positions, in mm, if known.
    pub(super) step_error_mm: Option<f64>,
    /// Height difference that must be resolved, in mm, if known.
    pub(super) relief_mm: Option<f64>,
}

/// Whether the relief is resolved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Resolution {
    /// 5 sigma and more.
    Resolved,
    /// 2 to 5 sigma.
    Marginal,
    /// Less than 2 sigma.
    Hidden,
}

/// Predicted results of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Prediction {
    /// Absolute disparity over the whole baseline, in px.
    pub disparity_px: f64,
    /// Standard uncertainty of a pixel's disparity from noise, in px.
    pub sigma_disparity_px: f64,
    /// Standard uncertainty of a pixel's height from noise, in mm.
    pub sigma_height_mm: f64,
    /// Standard uncertainty common to all disparities, from the stage, in px.
    pub common_disparity_px: Option<f64>,
    /// The same for heights, in mm.
    pub common_height_mm: Option<f64>,
    /// Disparity of the relief, in px.
    pub relief_px: Option<f64>,
    /// The relief in sigmas of a pixel's height, from noise and the relief's share of the common error.
    pub relief_sigmas: Option<f64>,
    /// Whether the relief is resolved.
    pub resolution: Option<Resolution>,
}

impl Prediction {
    /// The prediction from `prospect`.
    pub(super) fn of(prospect: &Prospect) -> Self {
        let frames = prospect.frames as f64;
        let slope = (12.0 * (frames - 1.0) / (frames * (frames + 1.0))).sqrt();
        let disparity_px = (prospect.px_per_mm * prospect.baseline_mm).abs();
        let mm_per_px = prospect.distance_mm / disparity_px;
        let sigma_disparity_px =
            prospect.noise_dn / (prospect.gradient_dn_per_px * prospect.window_px.sqrt()) * slope;
        let sigma_height_mm = mm_per_px * sigma_disparity_px;
        let common_disparity_px =
            prospect.step_error_mm.map(|error_mm| (prospect.px_per_mm * error_mm).abs() * slope);
        let common_height_mm = common_disparity_px.map(|common_px| common_px * mm_per_px);
        let relief_sigmas = prospect.relief_mm.map(|relief_mm| {
            let share = relief_mm / prospect.distance_mm;
            relief_mm / sigma_height_mm.hypot(share * common_height_mm.unwrap_or(0.0))
        });
        Self {
            disparity_px,
            sigma_disparity_px,
            sigma_height_mm,
            common_disparity_px,
            common_height_mm,
            relief_px: prospect.relief_mm.map(|relief_mm| relief_mm / mm_per_px),
            relief_sigmas,
            resolution: relief_sigmas.map(Resolution::of),
        }
    }
}

impl Resolution {
    fn of(sigmas: f64) -> Self {
        if sigmas >= RESOLVED {
            Self::Resolved
        } else if sigmas >= UNRESOLVED {
            Self::Marginal
        } else {
            Self::Hidden
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prospect() -> Prospect {
        Prospect {
            px_per_mm: 2.0,
            distance_mm: 500.0,
            baseline_mm: 50.0,
            frames: 25,
            noise_dn: 2.0,
            gradient_dn_per_px: 8.0,
            window_px: 25.0,
            step_error_mm: Some(0.005),
            relief_mm: Some(0.5),
        }
    }

    #[test]
    fn the_numbers_are_those_worked_out_by_hand() {
        let found = Prediction::of(&prospect());
        // sqrt(12 * 24 / (25 * 26)) = 0.665640; 2 / (8 * 5) = 0.05; D = 100 px, so 5 mm for each px.
        assert!((found.disparity_px - 100.0).abs() < 1e-12);
        assert!((found.sigma_disparity_px - 0.033_282).abs() < 1e-6, "{found:?}");
        assert!((found.sigma_height_mm - 0.166_410).abs() < 1e-6);
        assert!((found.common_disparity_px.unwrap() - 0.006_656_4).abs() < 1e-7);
        assert!((found.common_height_mm.unwrap() - 0.033_282).abs() < 1e-6);
        assert!((found.relief_px.unwrap() - 0.1).abs() < 1e-12);
        // 0.5 / 0.166410, for 0.001 of the common error is nothing.
        assert!((found.relief_sigmas.unwrap() - 3.00463).abs() < 1e-4);
        assert_eq!(found.resolution, Some(Resolution::Marginal));
    }

    #[test]
    fn the_rig_of_the_paper_resolves_its_relief() {
        // f = 25 / 9 * 1024 px, 900 mm, 101 frames over 150 mm; 1 DN of noise, 10 DN per px of texture.
        let predicted = Prediction::of(&Prospect {
            px_per_mm: 25.0 / 9.0 * 1024.0 / 900.0,
            distance_mm: 900.0,
            baseline_mm: 150.0,
            frames: 101,
            noise_dn: 1.0,
            gradient_dn_per_px: 10.0,
            window_px: 25.0,
            step_error_mm: Some(0.01),
            relief_mm: Some(0.2),
        });
        assert!((predicted.relief_px.unwrap() - 0.105).abs() < 0.001);
        assert_eq!(predicted.resolution, Some(Resolution::Resolved));
    }

    #[test]
    fn more_light_resolves_and_less_hides() {
        let with = |noise_dn: f64| Prediction::of(&Prospect { noise_dn, ..prospect() }).resolution;
        assert_eq!(with(1.0), Some(Resolution::Resolved));
        assert_eq!(with(4.0), Some(Resolution::Hidden));
        assert_eq!(Prediction::of(&Prospect { relief_mm: None, ..prospect() }).resolution, None);
    }

    #[test]
    fn the_slope_of_a_line_scatters_as_the_formula_says() {
        // The exact covariance of a least-squares slope, summed frame by frame.
        for frames in [2_usize, 5, 25, 101] {
            let taus: Vec<f64> = (0..frames).map(|t| t as f64 / (frames - 1) as f64).collect();
            let sum: f64 = taus.iter().map(|tau| (tau - 0.5).powi(2)).sum();
            let found = Prediction::of(&Prospect {
                frames,
                noise_dn: 1.0,
                gradient_dn_per_px: 1.0,
                window_px: 1.0,
                ..prospect()
            });
            assert!((found.sigma_disparity_px - sum.sqrt().recip()).abs() < 1e-12, "{frames}");
        }
    }
}
