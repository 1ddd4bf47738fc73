//! What measured step heights of standards tell of an instrument (ISO 25178-700: amplification and linearity).

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use super::student::student_t_95;
use epirig_core::statistics::mean;

/// A step whose height is known, and what was measured of it.
#[derive(Debug, Clone, PartialEq)]
pub struct StandardStep {
    /// The known height (or depth), in mm; positive.
    pub known_mm: f64,
    /// Its standard uncertainty, in mm; 0 for one that counts as exact.
    pub known_sigma_mm: f64,
    /// The heights that were measured, in mm.
    pub measured_mm: Vec<f64>,
    /// The standard uncertainty that the measurements claim of themselves, in mm: root mean square; `None` if one does
    /// not know it. Its larger part is the same for all of them, such as that of the scale.
    pub claimed_sigma_mm: Option<f64>,
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
    /// How often a height with the claimed uncertainty is off as far as this, or farther, by chance; 0 to 1. `None` if
    /// the measurements claim none.
    pub by_chance: Option<f64>,
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

/// Mean, number, and sum of the squared distances from the mean.
struct Sums {
    mean_mm: f64,
    count: f64,
    squares: f64,
}

impl Sums {
    fn of(values: &[f64]) -> Self {
        let mean_mm = mean(values);
        let squares = values.iter().map(|value| (value - mean_mm).powi(2)).sum();
        Self { mean_mm, count: values.len() as f64, squares }
    }
}

impl Response {
    /// Of steps that were measured; those that were not are left out, and `None` is the answer if nothing is left. The
    /// measurements of all steps are taken to scatter alike.
    pub fn of(steps: &[StandardStep]) -> Option<Self> {
        let steps: Vec<&StandardStep> = steps.iter().filter(|step| !step.measured_mm.is_empty()).collect();
        let sums: Vec<Sums> = steps.iter().map(|step| Sums::of(&step.measured_mm)).collect();
        let degrees: f64 = sums.iter().map(|sums| sums.count - 1.0).sum();
        let variance = (degrees > 0.0).then(|| sums.iter().map(|sums| sums.squares).sum::<f64>() / degrees);
        // Variances of a mean by the repeats, and by the standard.
        let parts: Vec<(f64, f64)> = steps
            .iter()
            .zip(&sums)
            .map(|(step, sums)| (variance.unwrap_or(0.0) / sums.count, step.known_sigma_mm.powi(2)))
            .collect();
        let one_is_exact = parts.iter().any(|(scatter, known)| scatter + known <= 0.0);
        let weights: Vec<f64> = parts
            .iter()
            .map(|(scatter, known)| if one_is_exact { 1.0 } else { (scatter + known).recip() })
            .collect();
        let [mut over, mut under] = [0.0, 0.0];
        for ((step, sums), weight) in steps.iter().zip(&sums).zip(&weights) {
            over += weight * step.known_mm * sums.mean_mm;
            under += weight * step.known_mm.powi(2);
        }
        let amplification = over / under;
        if !amplification.is_finite() {
            return None;
        }
        let of_slope = |part: fn(&(f64, f64)) -> f64| {
            let each = steps.iter().zip(&parts).zip(&weights);
            each.map(|((step, parts), weight)| (weight * step.known_mm / under).powi(2) * part(parts)).sum()
        };
        let half_width_95 =
            variance.map(|_| half_width(of_slope(|part| part.0), of_slope(|part| part.1), degrees));
        let off_line =
            steps.iter().zip(&sums).map(|(step, sums)| (sums.mean_mm - amplification * step.known_mm).abs());
        let linearity_mm = (steps.len() > 1).then(|| off_line.fold(0.0, f64::max));
        let each = steps.iter().zip(&sums).zip(&parts).map(|((step, sums), (scatter, known))| {
            let deviation_mm = sums.mean_mm - step.known_mm;
            let claimed = step.claimed_sigma_mm.map(|claimed| claimed.hypot(step.known_sigma_mm));
            StepResponse {
                known_mm: step.known_mm,
                count: step.measured_mm.len(),
                mean_mm: sums.mean_mm,
                deviation_mm,
                half_width_95_mm: variance.map(|_| half_width(*scatter, *known, degrees)),
                by_chance: claimed
                    .filter(|claimed| *claimed > 0.0)
                    .map(|claimed| 2.0 * Normal::standard().sf(deviation_mm.abs() / claimed)),
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
        StandardStep { known_mm, known_sigma_mm: 0.0, measured_mm, claimed_sigma_mm: Some(0.002) }
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
        // One and a half standard deviations or more: 13.36 % of a normal distribution.
        assert!((first.by_chance.unwrap() - 0.1336).abs() < 1e-4, "{first:?}");
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
        let held = (0..runs)
            .filter(|_| {
                let steps: Vec<StandardStep> = [0.05, 0.2, 0.8]
                    .iter()
                    .map(|&true_mm| StandardStep {
                        known_mm: true_mm + 0.0005 * normal(),
                        known_sigma_mm: 0.0005,
                        measured_mm: (0..4).map(|_| truth * true_mm + 0.002 * normal()).collect(),
                        claimed_sigma_mm: None,
                    })
                    .collect();
                let found = Response::of(&steps).unwrap();
                (found.amplification - truth).abs() <= found.half_width_95.unwrap()
            })
            .count() as f64;
        // Four standard deviations of a count with 95 % inside.
        assert!((held - 0.95 * 2000.0).abs() < 4.0 * (2000.0_f64 * 0.95 * 0.05).sqrt(), "{held}");
    }
}
