//! What measured step heights of standards tell of an instrument (ISO 25178-700: amplification and linearity).

use serde::Serialize;

use super::repeats::Sums;
use super::student::student_t_95;

/// A step whose height is known, and what was measured of it.
#[derive(Debug, Clone, PartialEq)]
pub struct StandardStep {
    /// The known height (or depth), in mm; positive.
    pub known_mm: f64,
    /// Its standard uncertainty, in mm; 0 for one that counts as exact.
    pub known_sigma_mm: f64,
    /// The heights that were measured, in mm.
    pub measured_mm: Vec<f64>,
    /// Half the width of the interval of 95 % coverage that a measurement claims of itself, in mm: root mean square of all;
    /// `None` if one does not know it. A part of it, such as that of the scale, is the same for all of them.
    pub claimed_half_width_mm: Option<f64>,
}

/// A step by the instrument.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepResponse {
    /// The known height, in mm.
    pub known_mm: f64,
    /// Number of measurements.
    pub count: usize,
    /// Their mean, in mm.
    pub mean_mm: f64,
    /// Mean less known height, in mm (bias).
    pub deviation_mm: f64,
    /// Half the width of its interval of 95 % coverage, in mm, by the repeats and by what is known of the standard; `None`
    /// if no step was measured twice.
    pub half_width_95_mm: Option<f64>,
    /// Whether the interval that a measurement claims of itself, with that of the standard, reaches from the mean to the known
    /// height; `None` if the measurements claim none.
    pub as_claimed: Option<bool>,
}

/// How measured heights follow known ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Response {
    /// Amplification coefficient: the slope of the line through zero that fits best, as a step is a difference. 1 if
    /// heights are right.
    pub amplification: f64,
    /// Half the width of its interval of 95 % coverage; `None` if no step was measured twice.
    pub half_width_95: Option<f64>,
    /// Linearity deviation: the largest distance of a mean from that line, in mm; `None` for one step.
    pub linearity_mm: Option<f64>,
    /// Each step.
    pub steps: Vec<StepResponse>,
}

impl Response {
    /// Of steps that were measured; those that were not are left out, and `None` is the answer if nothing is left. The
    /// measurements of all steps are taken to scatter alike, and all steps count alike: weights by so few measurements would
    /// make the interval too narrow.
    pub fn of(steps: &[StandardStep]) -> Option<Self> {
        let steps: Vec<&StandardStep> = steps.iter().filter(|step| !step.measured_mm.is_empty()).collect();
        let sums: Vec<Sums> = steps.iter().map(|step| Sums::of(&step.measured_mm)).collect();
        let degrees = steps.iter().map(|step| step.measured_mm.len() - 1).sum::<usize>() as f64;
        let variance = (degrees > 0.0).then(|| sums.iter().map(|sums| sums.squares).sum::<f64>() / degrees);
        // Variances of a mean by the repeats, and by the standard.
        let scatter = |step: &StandardStep| variance.map(|variance| variance / step.measured_mm.len() as f64);
        let known = |step: &StandardStep| step.known_sigma_mm.powi(2);
        let squares: f64 = steps.iter().map(|step| step.known_mm.powi(2)).sum();
        let products = steps.iter().zip(&sums).map(|(step, sums)| step.known_mm * sums.mean);
        let amplification = products.sum::<f64>() / squares;
        if !amplification.is_finite() {
            return None;
        }
        let of_slope = |of: &dyn Fn(&StandardStep) -> f64| -> f64 {
            steps.iter().map(|step| (step.known_mm / squares).powi(2) * of(step)).sum()
        };
        let by_scatter = |step: &StandardStep| scatter(step).unwrap_or(0.0);
        let half_width_95 = variance.map(|_| half_width(of_slope(&by_scatter), of_slope(&known), degrees));
        let off_line =
            steps.iter().zip(&sums).map(|(step, sums)| (sums.mean - amplification * step.known_mm).abs());
        let linearity_mm = (steps.len() > 1).then(|| off_line.fold(0.0, f64::max));
        let each = steps.iter().zip(&sums).map(|(step, sums)| {
            let deviation_mm = sums.mean - step.known_mm;
            let claimed_mm = step
                .claimed_half_width_mm
                .map(|claimed| claimed.hypot(student_t_95(f64::INFINITY) * step.known_sigma_mm));
            StepResponse {
                known_mm: step.known_mm,
                count: step.measured_mm.len(),
                mean_mm: sums.mean,
                deviation_mm,
                half_width_95_mm: scatter(step).map(|scatter| half_width(scatter, known(step), degrees)),
                as_claimed: claimed_mm.map(|claimed_mm| deviation_mm.abs() <= claimed_mm),
            }
        });
        Some(Self { amplification, half_width_95, linearity_mm, steps: each.collect() })
    }
}

/// Of a variance with so many degrees of freedom and one that is known (GUM, G.4.1).
fn half_width(scatter: f64, known: f64, degrees: f64) -> f64 {
    let sum = scatter + known;
    let together = if scatter > 0.0 { degrees * (sum / scatter).powi(2) } else { f64::INFINITY };
    student_t_95(together) * sum.sqrt()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    fn step(known_mm: f64, measured_mm: &[f64]) -> StandardStep {
        let measured_mm = measured_mm.to_vec();
        StandardStep { known_mm, known_sigma_mm: 0.0, measured_mm, claimed_half_width_mm: Some(0.004) }
    }

    #[test]
    fn a_response_is_the_line_through_zero() {
        let found = Response::of(&[step(0.1, &[0.102, 0.104]), step(0.2, &[0.206, 0.204])]).unwrap();
        // Means 0.103 and 0.205: (0.1 * 0.103 + 0.2 * 0.205) / 0.05, by hand; both have the same weight.
        assert!((found.amplification - 1.026).abs() < 1e-12, "{found:?}");
        assert!((found.linearity_mm.unwrap() - 0.0004).abs() < 1e-12, "{found:?}");
        // Standard deviation of one 0.0014142, of a mean 0.001, of the slope 0.001 / 0.2236; t of two degrees is 4.303.
        assert!((found.half_width_95.unwrap() - 4.303 * 0.001 / 0.05_f64.sqrt()).abs() < 1e-5, "{found:?}");
        let first = found.steps[0];
        assert_eq!(first.count, 2);
        assert!((first.deviation_mm - 0.003).abs() < 1e-12, "{first:?}");
        assert!((first.half_width_95_mm.unwrap() - 0.004303).abs() < 1e-5, "{first:?}");
        // 0.003 mm and 0.005 mm off, with 0.004 mm claimed.
        assert_eq!(
            found.steps.iter().map(|step| step.as_claimed).collect::<Vec<_>>(),
            [Some(true), Some(false)]
        );
    }

    #[test]
    fn one_scan_has_a_slope_and_no_interval() {
        let found = Response::of(&[step(0.2, &[0.198]), step(0.3, &[])]).unwrap();
        assert!((found.amplification - 0.99).abs() < 1e-12);
        assert_eq!((found.half_width_95, found.linearity_mm, found.steps.len()), (None, None, 1));
        assert_eq!(Response::of(&[]), None);
        // Repeats that are equal to the last bit.
        let found = Response::of(&[step(0.2, &[0.198, 0.198])]).unwrap();
        assert_eq!(found.half_width_95, Some(0.0));
    }

    #[test]
    fn intervals_hold_the_truth_as_often_as_stated() {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let (runs, truth) = (2000, 0.98);
        // Known height, what it is known to, and number of measurements, of each standard.
        let even = [(0.05, 0.0005, 4), (0.2, 0.0005, 4), (0.8, 0.0005, 4)];
        let uneven = [(0.05, 0.0001, 2), (0.2, 0.005, 1), (0.8, 0.001, 1)];
        let exact = [(0.1, 0.0, 3), (0.2, 0.0, 1), (0.3, 0.0, 1)];
        for standards in [even, uneven, exact] {
            let held = (0..runs)
                .filter(|_| {
                    let steps = standards.map(|(true_mm, known_sigma_mm, count)| StandardStep {
                        known_mm: true_mm + known_sigma_mm * normal(),
                        known_sigma_mm,
                        measured_mm: (0..count).map(|_| truth * true_mm + 0.002 * normal()).collect(),
                        claimed_half_width_mm: None,
                    });
                    let found = Response::of(&steps).unwrap();
                    (found.amplification - truth).abs() <= found.half_width_95.unwrap()
                })
                .count() as f64;
            // Four standard deviations of a count with 95 % inside, and a hundredth: degrees of freedom of a sum of
            // variances are approximate.
            let allowed = 4.0 * (2000.0_f64 * 0.95 * 0.05).sqrt() + 20.0;
            assert!((held - 0.95 * 2000.0).abs() < allowed, "{standards:?}: {held}");
        }
    }
}
