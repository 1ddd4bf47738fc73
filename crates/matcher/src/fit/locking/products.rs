//! Products of values and gradients along a line, from which pixel locking is measured, and the bias that
//! they predict.

use std::f64::consts::TAU as TURN;

use nalgebra::{SMatrix, SVector};

use crate::fit::spline::FRACTIONS;
use crate::locking::LOCKING_HARMONICS;

/// Number of terms fitted to a line: a constant, a slope over tau', and cos and sin of each harmonic.
pub(super) const TERMS: usize = 2 + 2 * LOCKING_HARMONICS;

pub(super) type Terms = SVector<f64, TERMS>;
pub(super) type Normal = SMatrix<f64, TERMS, TERMS>;

/// sin and cos of every tabulated fraction of a turn.
pub(in crate::fit) struct Turns(Vec<(f64, f64)>);

impl Turns {
    pub(in crate::fit) fn new() -> Self {
        Self((0..FRACTIONS).map(|index| (TURN * index as f64 / FRACTIONS as f64).sin_cos()).collect())
    }

    /// sin and cos of h times the shift for each harmonic.
    fn harmonics(&self, fraction: usize) -> [(f64, f64); LOCKING_HARMONICS] {
        std::array::from_fn(|index| self.0[(index + 1) * fraction % FRACTIONS])
    }

    pub(super) fn terms(&self, tau: f64, fraction: usize) -> Terms {
        let mut terms = Terms::zeros();
        (terms[0], terms[1]) = (1.0, tau);
        for (index, (sin, cos)) in self.harmonics(fraction).into_iter().enumerate() {
            (terms[2 + 2 * index], terms[3 + 2 * index]) = (cos, sin);
        }
        terms
    }
}

/// The tabulated fraction of a pixel of `shift`, in px.
pub(super) fn fraction(shift: f64) -> usize {
    ((shift * FRACTIONS as f64).round() as isize).rem_euclid(FRACTIONS as isize) as usize
}

/// Means and slopes of the harmonics over the frames that see a point.
pub(super) struct Regression {
    /// u and m of the module's formula, with cos and less sin for real and imaginary part.
    pub(super) mean: [(f64, f64); LOCKING_HARMONICS],
    pub(super) slope: [(f64, f64); LOCKING_HARMONICS],
}

impl Regression {
    /// From tau' and fraction of each frame; without slopes if fewer than three frames see the point.
    pub(super) fn of(turns: &Turns, sightings: impl Iterator<Item = (f64, usize)>) -> Self {
        let (mut count, mut tau_sum, mut squares) = (0.0, 0.0, 0.0);
        let mut mean = [(0.0, 0.0); LOCKING_HARMONICS];
        let mut slope = mean;
        for (tau, fraction) in sightings {
            count += 1.0;
            tau_sum += tau;
            squares += tau * tau;
            let sums = mean.iter_mut().zip(&mut slope);
            for ((mean, slope), (sin, cos)) in sums.zip(turns.harmonics(fraction)) {
                mean.0 += cos;
                mean.1 -= sin;
                slope.0 += tau * cos;
                slope.1 -= tau * sin;
            }
        }
        let spread = squares - tau_sum * tau_sum / count;
        for (mean, slope) in mean.iter_mut().zip(&mut slope) {
            *mean = (mean.0 / count, mean.1 / count);
            *slope = if count >= 3.0 {
                ((slope.0 - tau_sum * mean.0) / spread, (slope.1 - tau_sum * mean.1) / spread)
            } else {
                (0.0, 0.0)
            };
        }
        Self { mean, slope }
    }
}

/// Sums over points of the products of the module's formula.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Products {
    /// g_0^2.
    pub(super) square: f64,
    /// For each harmonic those of alpha, kappa, gamma and Q.
    pub(super) harmonics: [[f64; 4]; LOCKING_HARMONICS],
}

impl Products {
    pub(super) fn of(values: &Terms, gradients: &Terms, weight: f64) -> Self {
        let gradient = gradients[0];
        let harmonic = |index: usize| {
            let (cos, sin) = (values[2 + 2 * index], values[3 + 2 * index]);
            let (cos_gradient, sin_gradient) = (gradients[2 + 2 * index], gradients[3 + 2 * index]);
            [
                weight * gradient * sin,
                weight * (sin_gradient * cos - cos_gradient * sin),
                weight * gradient * cos_gradient,
                weight * (cos_gradient * cos_gradient + sin_gradient * sin_gradient),
            ]
        };
        Self { square: weight * gradient * gradient, harmonics: std::array::from_fn(harmonic) }
    }

    pub(super) fn add(&mut self, other: &Self, sign: f64) {
        self.square += sign * other.square;
        let pairs = self.harmonics.iter_mut().flatten().zip(other.harmonics.iter().flatten());
        pairs.for_each(|(own, other)| *own += sign * other);
    }

    /// The bias that these products make, in px.
    pub(super) fn bias(&self, regression: &Regression) -> f64 {
        let (mut moment, mut square) = (0.0, self.square);
        let harmonics = self.harmonics.iter().zip(regression.mean.iter().zip(&regression.slope));
        for ([alpha, kappa, gamma, q], (u, m)) in harmonics {
            moment += -alpha * m.1 - 0.5 * kappa * (u.1 * m.0 - u.0 * m.1);
            square += 2.0 * gamma * u.0 + 0.5 * q * (u.0 * u.0 + u.1 * u.1);
        }
        // Measured products may contradict each other; a gradient's square stays one.
        -moment / square.max(0.1 * self.square)
    }

    /// Amplitudes as displacements, in px: alpha's and kappa's of each harmonic.
    pub(super) fn amplitudes(&self) -> [[f64; 2]; LOCKING_HARMONICS] {
        self.harmonics.map(|[alpha, kappa, ..]| [alpha / self.square, -0.5 * kappa / self.square])
    }
}
