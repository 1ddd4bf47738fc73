//! What each pixel by itself says of its disparity: the regression of its intensities on tau.

use super::QUANTISATION_VARIANCE;
use crate::epi::interpolation::{Interpolation, SampledEpi, TAPS};
use crate::epi::lines::{Lines, SeenRule};
use crate::epi::options::HiddenPoints;

/// Variance of the value of a cubic B-spline through white noise, over that of the noise, mean over the positions between
/// pixels: 1 at a pixel, 0.76 halfway (the squared response of weights and prefilter, integrated; see the tests).
pub(super) const VALUE_NOISE_GAIN: f64 = 0.874;
/// The same for its derivative, per px^2: 1.39 at a pixel, 3.42 halfway.
const GRADIENT_NOISE_GAIN: f64 = 2.475;

/// One pixel's share in the fits of the windows that contain it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vote {
    /// g^2 S, the weight in the fit.
    pub(super) weight: f32,
    /// Weight times (voted disparity - d0).
    pub(super) moment: f32,
    /// Sum of squared residuals of the regression, in DN^2.
    pub(super) residual: f32,
    /// Degrees of freedom of that sum.
    pub(super) freedom: f32,
    /// What the weight would be on average without texture, over the noise variance.
    pub(super) noise_weight: f32,
}

pub(super) const NO_VOTE: Vote =
    Vote { weight: 0.0, moment: 0.0, residual: 0.0, freedom: 0.0, noise_weight: 0.0 };

/// Sums over the frames that see one pixel's line.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    tau: f64,
    tau_tau: f64,
    value: f64,
    value_tau: f64,
    value_value: f64,
    slope: f64,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, tau: f64, value: f64, slope: f64) {
        self.count += 1.0;
        self.tau += tau;
        self.tau_tau += tau * tau;
        self.value += value;
        self.value_tau += value * tau;
        self.value_value += value * value;
        self.slope += slope;
    }

    fn joined(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            tau: self.tau + other.tau,
            tau_tau: self.tau_tau + other.tau_tau,
            value: self.value + other.value,
            value_tau: self.value_tau + other.value_tau,
            value_value: self.value_value + other.value_value,
            slope: self.slope + other.slope,
        }
    }

    fn vote(self) -> Vote {
        let spread = self.tau_tau - self.tau * self.tau / self.count;
        if self.count < 3.0 || spread <= 0.0 {
            return NO_VOTE;
        }
        let covariance = self.value_tau - self.value * self.tau / self.count;
        let gradient = self.slope / self.count;
        let energy = self.value_value - self.value * self.value / self.count;
        Vote {
            weight: (gradient * gradient * spread) as f32,
            moment: (-gradient * covariance) as f32,
            residual: (energy - covariance * covariance / spread).max(0.0) as f32,
            freedom: (self.count - 2.0) as f32,
            noise_weight: (GRADIENT_NOISE_GAIN / self.count * spread) as f32,
        }
    }

    fn residual_variance(self) -> f64 {
        let vote = self.vote();
        if vote.freedom > 0.0 { f64::from(vote.residual / vote.freedom) } else { f64::INFINITY }
    }
}

/// The vote of pixel `x` of the row in `epi`, whose guess is `disparity`.
pub(super) fn pixel_vote(epi: &SampledEpi, lines: &Lines, x: usize, disparity: f64, rule: SeenRule) -> Vote {
    if disparity.is_nan() {
        return NO_VOTE;
    }
    let reference = lines.reference();
    let (anchor, anchor_slope) = sample(epi.taps(reference, x as isize, 1), 0.0);
    // The spline is mirrored at the borders, so within a pixel of them its slope is not that of the scene.
    let sound = |position: f64| position >= 1.0 && position <= (lines.columns() - 2) as f64;
    let mut sides = [Sums::default(); 2];
    for (t, &tau) in lines.offsets().iter().enumerate() {
        let position = x as f64 + disparity * tau;
        if t == reference || !sound(position) {
            continue;
        }
        let whole = position.floor();
        let (value, slope) = sample(epi.taps(t, whole as isize, 1), (position - whole) as f32);
        sides[usize::from(t > reference)].add(tau, f64::from(value - anchor), slope.into());
    }
    let mut own = Sums::default();
    if sound(x as f64) {
        own.add(0.0, 0.0, anchor_slope.into());
    }
    let [before, after] = sides;
    let all = before.joined(after).joined(own);
    let mut best = all;
    if rule.hidden_points == HiddenPoints::OneSide {
        // A side that fits far better than all frames together says that the point is hidden on the other one: twice the
        // residual variance is beyond chance for some ten frames.
        for side in [before.joined(own), after.joined(own)] {
            let clearly_better =
                2.0 * side.residual_variance() + QUANTISATION_VARIANCE < best.residual_variance();
            if rule.suffices(side.count as usize) && clearly_better {
                best = side;
            }
        }
    }
    if rule.suffices(best.count as usize) { best.vote() } else { NO_VOTE }
}

#[inline(always)]
fn sample(taps: &[f32], fraction: f32) -> (f32, f32) {
    let values = Interpolation::bspline_weights(fraction);
    let slopes = Interpolation::bspline_slope_weights(fraction);
    let taps: &[f32; TAPS] = taps.first_chunk().unwrap_or(&[0.0; TAPS]);
    let dot = |weights: [f32; TAPS]| {
        weights[0] * taps[0] + weights[1] * taps[1] + weights[2] * taps[2] + weights[3] * taps[3]
    };
    (dot(values), dot(slopes))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean over the positions between pixels of the squared frequency response of `weights` and the prefilter, integrated
    /// over the frequencies: the variance that white noise is left with.
    fn noise_gain(weights: fn(f32) -> [f32; TAPS]) -> f64 {
        let (steps, fractions) = (2000, 200);
        let mut sum = 0.0;
        for index in 0..fractions {
            let weights = weights((index as f32 + 0.5) / fractions as f32);
            for step in 0..steps {
                let omega = std::f64::consts::TAU * (f64::from(step) + 0.5) / f64::from(steps);
                let (mut real, mut imaginary) = (0.0, 0.0);
                for (tap, weight) in weights.iter().enumerate() {
                    real += f64::from(*weight) * (omega * tap as f64).cos();
                    imaginary += f64::from(*weight) * (omega * tap as f64).sin();
                }
                let prefilter = 6.0 / (4.0 + 2.0 * omega.cos());
                sum += (real * real + imaginary * imaginary) * prefilter * prefilter;
            }
        }
        sum / (f64::from(steps) * f64::from(fractions))
    }

    #[test]
    fn noise_gains_are_those_of_the_frequency_response() {
        assert!((noise_gain(Interpolation::bspline_weights) - VALUE_NOISE_GAIN).abs() < 0.001);
        assert!((noise_gain(Interpolation::bspline_slope_weights) - GRADIENT_NOISE_GAIN).abs() < 0.002);
    }
}
