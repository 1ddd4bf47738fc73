//! What a pixel sees: a square of 1 px, blurred by a Gaussian.

use std::f64::consts::{PI, SQRT_2, TAU};

/// Beyond this many sigma the Gaussian holds 6e-7 of its light.
const REACH_SIGMA: f64 = 5.0;
/// Longest interval that one Gauss-Legendre rule integrates, in px: the integrand has no detail finer than 1
/// px.
const PANEL_PX: f64 = 0.25;
/// Gauss-Legendre rule of 5 points on [-1, 1]: nodes and weights.
const RULE: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// The aperture along one axis.
#[derive(Clone, Copy)]
pub struct Aperture {
    /// Standard deviation of the Gaussian, in px.
    pub sigma_px: f64,
}

impl Aperture {
    /// Distance from the pixel's middle beyond which it sees nothing, in px.
    pub fn reach_px(self) -> f64 {
        0.5 + REACH_SIGMA * self.sigma_px
    }

    /// What is left of a wave of `frequency` cycles per px: sinc of the square, and the transform of the
    /// Gaussian.
    pub fn response(self, frequency: f64) -> f64 {
        let square = if frequency == 0.0 { 1.0 } else { (PI * frequency).sin() / (PI * frequency) };
        square * (-0.5 * (TAU * frequency * self.sigma_px).powi(2)).exp()
    }

    /// Weight of light that falls `distance` px beside the pixel's middle, per px.
    fn weight(self, distance: f64) -> f64 {
        if self.sigma_px == 0.0 {
            return if distance.abs() <= 0.5 { 1.0 } else { 0.0 };
        }
        let scale = self.sigma_px * SQRT_2;
        0.5 * (erf((distance + 0.5) / scale) - erf((distance - 0.5) / scale))
    }

    /// Real and imaginary part of what a pixel sees of exp(2 pi i frequency (x' - `middle`)) if only
    /// `from`..`to` is in view.
    pub fn part_response(self, frequency: f64, middle: f64, (from, to): (f64, f64)) -> (f64, f64) {
        let from = from.max(middle - self.reach_px());
        let to = to.min(middle + self.reach_px());
        if from >= to {
            return (0.0, 0.0);
        }
        let panels = ((to - from) / PANEL_PX).ceil();
        let half = 0.5 * (to - from) / panels;
        let mut sum = (0.0, 0.0);
        for panel in 0..panels as usize {
            let centre = from + (2 * panel + 1) as f64 * half;
            for (node, weight) in RULE {
                let distance = centre + node * half - middle;
                let weight = half * weight * self.weight(distance);
                let (sin, cos) = (TAU * frequency * distance).sin_cos();
                sum = (sum.0 + weight * cos, sum.1 + weight * sin);
            }
        }
        sum
    }
}

/// The error function to 1.5e-7 (Abramowitz and Stegun 1964, 7.1.26).
fn erf(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let polynomial = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592]
        .iter()
        .fold(0.0, |sum, factor| (sum + factor) * t);
    (1.0 - polynomial * (-x * x).exp()).copysign(x)
}
