//! Maps of observations and of fitted planes, laid out so that sixteen neighbours are loaded at once.

mod means;

use rayon::prelude::*;

use super::observations::Observation;
use super::padded::{PAD, Padded};
use epirig_core::grid::Grid;
use means::box_means;

/// Residuals begin to exceed the noise around them if their variance does so by this many of its standard
/// deviations ...
const EXCEEDS_SIGMAS: f32 = 4.0;
/// ... and do so altogether at this many times that.
const EXCEEDS_WHOLLY: f32 = 1.25;

/// Observations of all pixels. Disparities are counted from a common origin.
#[derive(Debug, Clone)]
pub(super) struct ObservationMaps {
    pub(super) weight: Padded,
    /// Weight times observed disparity.
    pub(super) moment: Padded,
    /// One over the weight; 0 for no observation.
    pub(super) inverse: Padded,
    /// Variance of residuals over that of the noise at the frequencies of the texture.
    pub(super) noise_gain: f32,
    /// Variance of the noise around the pixel, in DN^2.
    pub(super) noise: Padded,
}

/// The template of each pixel.
#[derive(Debug, Clone)]
pub(super) struct Template {
    /// Derivatives along x.
    pub(super) gradient: Padded,
    pub(super) curvature: Padded,
    /// Mean intensity along the line, in DN.
    pub(super) intensity: Padded,
}

/// What all pixels have observed.
pub(super) struct Observations {
    pub(super) maps: ObservationMaps,
    pub(super) template: Template,
    /// Variance of the pixel's own residuals, as noise, in DN^2.
    pub(super) residual: Padded,
}

/// Observations that are put in row by row, before the noise is known.
pub(super) struct RawObservations {
    weight: Padded,
    moment: Padded,
    inverse: Padded,
    /// Variance of the pixel's own residuals, in DN^2.
    residual: Padded,
    template: Template,
}

/// Disparities in px that observations start from; NaN where there is none.
#[derive(Clone, Copy)]
pub(super) struct Guess<'a> {
    pub(super) map: &'a Grid<f32>,
    /// The disparity that the observations are counted from, in px.
    pub(super) origin: f32,
}

/// A row of observation planes to be filled.
pub(super) struct ObservationRow<'a> {
    planes: [&'a mut [f32]; 7],
}

impl ObservationRow<'_> {
    pub(super) fn put(self, observations: &[Observation], origin: f32) {
        let [weight, moment, inverse, residual, gradient, curvature, intensity] = self.planes;
        for (x, observation) in observations.iter().enumerate() {
            let place = PAD + x;
            weight[place] = observation.weight;
            moment[place] = observation.moment + observation.weight * (observation.base - origin);
            inverse[place] = if observation.weight > 0.0 { 1.0 / observation.weight } else { 0.0 };
            residual[place] = observation.variance;
            gradient[place] = observation.gradient;
            curvature[place] = observation.curvature;
            intensity[place] = observation.intensity;
        }
    }
}

impl ObservationMaps {
    pub(super) fn rows(&self) -> usize {
        self.weight.values.len() / self.weight.stride
    }
}

impl RawObservations {
    pub(super) fn empty(rows: usize, columns: usize) -> Self {
        let map = || Padded::filled(rows, columns, 0.0);
        Self {
            weight: map(),
            moment: map(),
            inverse: map(),
            residual: map(),
            template: Template { gradient: map(), curvature: map(), intensity: map() },
        }
    }

    /// Estimates the noise around each pixel, and reduces the weight of pixels whose residuals exceed it.
    ///
    /// `gain` is the variance of residuals over that of the noise, of which there is at least `least`;
    /// `freedom` the degrees of freedom of single variances. The noise is the mean over the square of side 2
    /// `reach` + 1, without residuals that exceed the harmonic mean by more than chance: the harmonic mean is
    /// hardly influenced by a few large ones. The limit is gradual, so that a small change of the input
    /// changes the result by little.
    pub(super) fn estimate_noise(self, reach: usize, gain: f32, least: f32, freedom: f32) -> Observations {
        let Self { mut weight, mut moment, mut inverse, mut residual, template } = self;
        let stride = weight.stride;
        residual.par_rows().zip(inverse.values.par_chunks(stride)).for_each(|(residual, inverse)| {
            for (residual, inverse) in residual.iter_mut().zip(inverse) {
                *residual = if *inverse > 0.0 { (*residual / gain).max(least) } else { 0.0 };
            }
        });
        // The mean of one over a chi-squared variable of n degrees of freedom is n / (n - 2) times one over
        // its mean.
        let harmonic = (freedom - 2.0).max(1.0) / freedom;
        let exceeding = 1.0 + EXCEEDS_SIGMAS * (2.0 / freedom).sqrt();
        let inverses = box_means([&residual], reach, |[residual]| (1.0, 1.0 / residual));
        // How far a residual belongs to the noise whose inverses have this mean, 1 to 0.
        let belongs = move |residual: f32, inverse: f32| {
            let over = residual * harmonic * inverse / exceeding;
            ((EXCEEDS_WHOLLY - over) / (EXCEEDS_WHOLLY - 1.0)).clamp(0.0, 1.0)
        };
        let mut noise = box_means([&residual, &inverses], reach, |[residual, inverse]| {
            let weight = belongs(residual, inverse);
            (weight, weight * residual)
        });
        let observations = weight.par_rows().zip(moment.par_rows()).zip(inverse.par_rows());
        let residuals = residual.values.par_chunks(stride).zip(inverses.values.par_chunks(stride));
        observations.zip(noise.par_rows()).zip(residuals).for_each(
            |((((weight, moment), one_over), noise), (residual, inverse))| {
                for place in 0..stride {
                    noise[place] = noise[place].max(least);
                    let belongs = belongs(residual[place], inverse[place]);
                    // Beside noisier pixels the mean may exceed residuals that exceed the harmonic mean; no
                    // observation gains weight by that.
                    let exceeding = (noise[place] / residual[place].max(least)).min(1.0);
                    let share = belongs + (1.0 - belongs) * exceeding;
                    weight[place] *= share;
                    moment[place] *= share;
                    one_over[place] /= share;
                }
            },
        );
        let maps = ObservationMaps { weight, moment, inverse, noise_gain: gain, noise };
        Observations { maps, template, residual }
    }

    pub(super) fn par_rows(&mut self) -> impl IndexedParallelIterator<Item = ObservationRow<'_>> {
        let first = self.weight.par_rows().zip(self.moment.par_rows()).zip(self.inverse.par_rows());
        let second = first.zip(self.residual.par_rows());
        let Template { gradient, curvature, intensity } = &mut self.template;
        let all = second.zip(gradient.par_rows()).zip(curvature.par_rows()).zip(intensity.par_rows());
        all.map(|((((((a, b), c), d), e), f), g)| ObservationRow { planes: [a, b, c, d, e, f, g] })
    }
}

/// A surface and its slants, for each pixel.
#[derive(Debug, Clone)]
pub(super) struct SurfacePlanes {
    /// In px, counted from an origin.
    pub(super) disparity: Padded,
    /// Along columns and rows, in px/px.
    pub(super) slant_x: Padded,
    pub(super) slant_y: Padded,
}

impl SurfacePlanes {
    /// A surface whose slants are the differences of neighbours up to this steep, in
    /// px/px: steeper ones are edges of things. Without a disparity it is flat.
    pub(super) fn of_surface(Guess { map: surface, origin }: Guess<'_>, steepest: f32) -> Self {
        let (rows, columns) = (surface.rows(), surface.columns());
        let [mut disparity, mut slant_x, mut slant_y] = [(); 3].map(|()| Padded::filled(rows, columns, 0.0));
        let slant = |difference: f32, distance: usize| {
            let slant = difference / distance.max(1) as f32;
            if slant.abs() <= steepest { slant } else { 0.0 }
        };
        let maps = disparity.par_rows().zip(slant_x.par_rows()).zip(slant_y.par_rows());
        maps.enumerate().for_each(|(y, ((disparities, slants_x), slants_y))| {
            let (above, below) = (y.saturating_sub(1), (y + 1).min(rows - 1));
            for (x, disparity) in surface.row(y).iter().enumerate().filter(|(_, value)| !value.is_nan()) {
                let (place, left, right) = (PAD + x, x.saturating_sub(1), (x + 1).min(columns - 1));
                disparities[place] = disparity - origin;
                slants_x[place] = slant(surface.at(right, y) - surface.at(left, y), right - left);
                slants_y[place] = slant(surface.at(x, below) - surface.at(x, above), below - above);
            }
        });
        Self { disparity, slant_x, slant_y }
    }
}

#[cfg(test)]
mod tests;
