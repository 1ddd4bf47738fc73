//! What is observed at each pixel, and at each 2 x 2 pixels together.

use rayon::prelude::*;

use crate::fit::padded::{PAD, Padded};
use crate::fit::planes::{Guess, ObservationMaps};
use crate::one_surface::OneSurface;
use epirig_core::progress::Progress;

/// A pixel's own observation has no more than this share in its disparity.
const LARGEST_SHARE: f32 = 0.95;

/// An observation that is as far from its guess as this, in px, and as this many of its standard
/// deviations more, is no step of a linearisation. Noise may carry it farther: to leave it out then
/// would pull the mean to the guess.
const LARGEST_STEP_PX: f32 = 1.0;
const STEP_SIGMAS: f32 = 3.0;

/// Observed disparities.
pub(super) struct Observed<'a> {
    /// Disparity from the origin, in px.
    pub(super) value: Padded,
    /// One over its variance, in 1/px^2; 0 for no observation.
    pub(super) precision: Padded,
    /// The disparity that it was observed around, in px from the origin; NaN where there is none.
    pub(super) guess: Padded,
    pub(super) columns: usize,
    /// Who may cancel the work.
    pub(super) progress: &'a dyn Progress,
}

impl<'a> Observed<'a> {
    fn none(rows: usize, columns: usize, progress: &'a dyn Progress) -> Self {
        let map = |value| Padded::filled(rows, columns, value);
        Self { value: map(0.0), precision: map(0.0), guess: map(f32::NAN), columns, progress }
    }

    /// The `observations` around a guess.
    pub(super) fn of(
        observations: &ObservationMaps,
        Guess { map: guess, origin }: Guess<'_>,
        progress: &'a dyn Progress,
    ) -> Self {
        let mut observed = Self::none(guess.rows(), guess.columns(), progress);
        let Self { value, precision, guess: around, .. } = &mut observed;
        let maps = value.par_rows().zip(precision.par_rows()).zip(around.par_rows()).enumerate();
        maps.for_each(|(y, ((value, precision), around))| {
            let (weight, moment) = (observations.weight.row(y), observations.moment.row(y));
            let (inverse, noise) = (observations.inverse.row(y), observations.noise.row(y));
            for (x, guess) in guess.row(y).iter().enumerate() {
                let place = PAD + x;
                around[place] = guess - origin;
                value[place] = moment[place] * inverse[place];
                let sigma = (noise[place] * inverse[place]).sqrt();
                let near = (value[place] - around[place]).abs() < LARGEST_STEP_PX + STEP_SIGMAS * sigma;
                if inverse[place] > 0.0 && near {
                    precision[place] = weight[place] / noise[place];
                }
            }
        });
        observed
    }

    pub(super) fn rows(&self) -> usize {
        self.value.values.len() / self.value.stride
    }

    /// The mean of each 2 x 2 pixels of one surface, that of the best observation.
    pub(super) fn halved(&self) -> Self {
        let mut halved = Self::none(self.rows().div_ceil(2), self.columns.div_ceil(2), self.progress);
        let columns = halved.columns;
        let Self { value, precision, guess: around, .. } = &mut halved;
        let maps = value.par_rows().zip(precision.par_rows()).zip(around.par_rows()).enumerate();
        maps.for_each(|(y, ((value, precision), around))| {
            // A row beyond the last is the last one, without weight.
            let rows = [2 * y, (2 * y + 1).min(self.rows() - 1)];
            let counts = if rows[0] == rows[1] { [1.0, 0.0] } else { [1.0, 1.0] };
            for x in 0..columns {
                let (first, out) = (PAD + 2 * x, PAD + x);
                let pixel = |index: usize| {
                    let (row, place) = (rows[index / 2], first + index % 2);
                    let weight = counts[index / 2] * self.precision.row(row)[place];
                    (self.guess.row(row)[place], weight, self.value.row(row)[place])
                };
                let pixels = [pixel(0), pixel(1), pixel(2), pixel(3)];
                let mut best = pixels[0];
                for pixel in &pixels[1..] {
                    if best.0.is_nan() || pixel.1 > best.1 {
                        best = *pixel;
                    }
                }
                // Guesses follow the surface, so they carry each observation to the middle of the
                // four.
                let (mut guesses, mut count, mut weights, mut moments) = (0.0, 0.0, 0.0, 0.0);
                for (index, (guess, weight, value)) in pixels.into_iter().enumerate() {
                    if OneSurface::FINE.holds(guess - best.0, 0.0) {
                        guesses += counts[index / 2] * (guess - best.0);
                        count += counts[index / 2];
                        weights += weight;
                        moments += weight * (value - guess);
                    }
                }
                around[out] = best.0 + guesses / f32::max(count, 1.0);
                if weights > 0.0 {
                    precision[out] = weights;
                    value[out] = around[out] + moments / weights;
                }
            }
        });
        halved
    }
}

/// What is left of 1 beside the share of a pixel's own observation in its disparity.
#[inline(always)]
pub(super) fn one_less_leverage(precision: f32, variance: f32) -> f32 {
    let share = precision * variance;
    1.0 - if share < LARGEST_SHARE { share } else { LARGEST_SHARE }
}
