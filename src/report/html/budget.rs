//! The uncertainty budget of a depth, as in the GUM.

use super::contents::ScaleSigma;
use epirig_matcher::surface::{Depth, student_t_95};

/// How a contribution was evaluated (GUM, 2.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Evaluation {
    /// From the scatter of this measurement.
    A,
    /// From elsewhere: here from the calibration.
    B,
}

/// A contribution to the uncertainty of a depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contribution {
    pub(super) name: &'static str,
    pub(super) evaluation: Evaluation,
    /// Standard uncertainty of the depth by it, in mm; `None` if it is not known.
    pub(super) sigma_mm: Option<f64>,
}

/// All known contributions together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Combined {
    /// Combined standard uncertainty, in mm.
    pub(super) sigma_mm: f64,
    /// Effective degrees of freedom by Welch and Satterthwaite.
    pub(super) degrees_of_freedom: f64,
    /// Coverage factor for 95 % (Student's t).
    pub(super) coverage_factor: f64,
}

impl Combined {
    /// Expanded uncertainty for 95 % coverage, in mm.
    pub(super) fn expanded_mm(&self) -> f64 {
        self.coverage_factor * self.sigma_mm
    }
}

/// The contributions to a depth.
pub(super) fn contributions(depth: &Depth, scale: ScaleSigma) -> [Contribution; 3] {
    let of_scale = |relative: Option<f64>| relative.map(|relative| relative * depth.depth_mm.abs());
    let made = |name, evaluation, sigma_mm| Contribution { name, evaluation, sigma_mm };
    [
        made("scatter between independent parts of the field", Evaluation::A, depth.sigma_mm),
        made("scale: focal length", Evaluation::B, of_scale(scale.focal_length)),
        made("scale: length of the baseline", Evaluation::B, of_scale(scale.baseline)),
    ]
}

/// The known contributions together; `None` if the scatter, with its degrees of freedom, is not known.
pub(super) fn combined(depth: &Depth, scale: ScaleSigma) -> Option<Combined> {
    let (scatter_mm, degrees) = depth.sigma_mm.zip(depth.degrees_of_freedom)?;
    let squares = contributions(depth, scale).map(|part| part.sigma_mm.unwrap_or(0.0).powi(2));
    let variance = squares.iter().sum::<f64>();
    // The scale's own degrees of freedom count as infinite.
    let degrees_of_freedom = degrees * variance.powi(2) / scatter_mm.powi(4);
    let combined = Combined {
        sigma_mm: variance.sqrt(),
        degrees_of_freedom,
        coverage_factor: student_t_95(degrees_of_freedom),
    };
    combined.degrees_of_freedom.is_finite().then_some(combined)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(sigma_mm: Option<f64>) -> Depth {
        Depth {
            depth_mm: -2.0,
            sigma_mm,
            degrees_of_freedom: sigma_mm.map(|_| 10.0),
            half_width_95_mm: sigma_mm.map(|sigma| 2.228 * sigma),
            scale_sigma_mm: 0.005,
        }
    }

    #[test]
    fn contributions_add_in_squares_and_share_their_degrees_of_freedom() {
        let scale = ScaleSigma { focal_length: Some(0.0015), baseline: Some(0.002) };
        let depth = depth(Some(0.012));
        let sigmas = contributions(&depth, scale).map(|part| part.sigma_mm);
        assert_eq!(sigmas, [Some(0.012), Some(0.003), Some(0.004)]);
        // 0.012, 0.003 and 0.004 make 0.013; 10 (0.013 / 0.012)^4 = 13.77 degrees of freedom, whose t by
        // tables lies between 2.160 (13) and 2.145 (14).
        let combined = combined(&depth, scale).unwrap();
        assert!((combined.sigma_mm - 0.013).abs() < 1e-12);
        assert!((combined.degrees_of_freedom - 13.773).abs() < 1e-3);
        assert!((2.145..2.160).contains(&combined.coverage_factor), "{}", combined.coverage_factor);
        assert!((combined.expanded_mm() - 0.013 * combined.coverage_factor).abs() < 1e-15);
    }

    #[test]
    fn without_a_scale_the_scatter_is_all_and_without_scatter_there_is_no_sum() {
        let alone = combined(&depth(Some(0.012)), ScaleSigma::default()).unwrap();
        assert!((alone.sigma_mm - 0.012).abs() < 1e-15 && (alone.degrees_of_freedom - 10.0).abs() < 1e-9);
        // Tables: 2.228 for 10.
        assert!((alone.coverage_factor - 2.228).abs() < 1e-3);
        let scale = ScaleSigma { focal_length: Some(0.0015), baseline: None };
        assert_eq!(combined(&depth(None), scale), None);
        // Heights without any scatter leave no degrees of freedom to count.
        assert_eq!(combined(&depth(Some(0.0)), scale), None);
    }
}
