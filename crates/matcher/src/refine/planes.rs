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
    /// Variance of the noise around the pixel, in DN^2, once it is known.
    pub(super) noise: Padded,
    /// Derivatives of the template along x.
    pub(super) gradient: Padded,
    pub(super) curvature: Padded,
    /// Variance of the pixel's own residuals, as noise, in DN^2, once the noise is known.
    pub(super) residual: Padded,
}

/// A row of observation planes to be filled.
pub(super) struct ObservationRow<'a> {
    planes: [&'a mut [f32]; 6],
}

impl ObservationRow<'_> {
    pub(super) fn put(self, observations: &[Observation], origin: f32) {
        let [weight, moment, inverse, residual, gradient, curvature] = self.planes;
        for (x, observation) in observations.iter().enumerate() {
            let place = PAD + x;
            weight[place] = observation.weight;
            moment[place] = observation.moment + observation.weight * (observation.base - origin);
            inverse[place] = if observation.weight > 0.0 { 1.0 / observation.weight } else { 0.0 };
            residual[place] = observation.variance;
            gradient[place] = observation.gradient;
            curvature[place] = observation.curvature;
        }
    }
}

impl ObservationMaps {
    pub(super) fn empty(rows: usize, columns: usize) -> Self {
        let plane = || Padded::filled(rows, columns, 0.0);
        Self {
            weight: plane(),
            moment: plane(),
            inverse: plane(),
            noise: Padded::given_back(),
            gradient: plane(),
            curvature: plane(),
            residual: plane(),
        }
    }

    pub(super) fn rows(&self) -> usize {
        self.weight.values.len() / self.weight.stride
    }

    /// Gives back the room of the residuals.
    pub(super) fn forget_residuals(&mut self) {
        self.residual = Padded::given_back();
    }

    /// Gives back the room of the template's derivatives.
    pub(super) fn forget_derivatives(&mut self) {
        self.gradient = Padded::given_back();
        self.curvature = Padded::given_back();
    }

    /// Estimates the noise around each pixel, and reduces the weight of pixels whose residuals exceed it.
    ///
    /// `gain` is the variance of residuals over that of the noise, of which there is at least `least`;
    /// `freedom` the degrees of freedom of single variances. The noise is the mean over the square of side 2
    /// `reach` + 1, without residuals that exceed the harmonic mean by more than chance: the harmonic mean is
    /// hardly influenced by a few large ones. The limit is gradual, so that a small change of the input
    /// changes the result by little.
    pub(super) fn estimate_noise(&mut self, reach: usize, gain: f32, least: f32, freedom: f32) {
        let stride = self.weight.stride;
        self.residual.par_rows().zip(self.inverse.values.par_chunks(stride)).for_each(
            |(residual, inverse)| {
                for (residual, inverse) in residual.iter_mut().zip(inverse) {
                    *residual = if *inverse > 0.0 { (*residual / gain).max(least) } else { 0.0 };
                }
            },
        );
        // The mean of one over a chi-squared variable of n degrees of freedom is n / (n - 2) times one over
        // its mean.
        let harmonic = (freedom - 2.0).max(1.0) / freedom;
        let exceeding = 1.0 + EXCEEDS_SIGMAS * (2.0 / freedom).sqrt();
        let inverses = box_means([&self.residual], reach, |[residual]| (1.0, 1.0 / residual));
        // How far a residual belongs to the noise whose inverses have this mean, 1 to 0.
        let belongs = move |residual: f32, inverse: f32| {
            let over = residual * harmonic * inverse / exceeding;
            ((EXCEEDS_WHOLLY - over) / (EXCEEDS_WHOLLY - 1.0)).clamp(0.0, 1.0)
        };
        self.noise = box_means([&self.residual, &inverses], reach, |[residual, inverse]| {
            let weight = belongs(residual, inverse);
            (weight, weight * residual)
        });
        let observations = self.weight.par_rows().zip(self.moment.par_rows()).zip(self.inverse.par_rows());
        let residuals = self.residual.values.par_chunks(stride).zip(inverses.values.par_chunks(stride));
        observations.zip(self.noise.par_rows()).zip(residuals).for_each(
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
    }

    pub(super) fn par_rows(&mut self) -> impl IndexedParallelIterator<Item = ObservationRow<'_>> {
        let first = self.weight.par_rows().zip(self.moment.par_rows()).zip(self.inverse.par_rows());
        let second = first.zip(self.residual.par_rows());
        let all = second.zip(self.gradient.par_rows()).zip(self.curvature.par_rows());
        all.map(|(((((a, b), c), d), e), f)| ObservationRow { planes: [a, b, c, d, e, f] })
    }
}

/// A plane d + p u + q v for each pixel, and how well it is known.
#[derive(Debug, Clone)]
pub(super) struct SurfacePlanes {
    pub(super) disparity: Padded,
    pub(super) slant_x: Padded,
    pub(super) slant_y: Padded,
    /// Variance of d, in px^2; infinite where nothing is known.
    pub(super) variance: Padded,
    /// Scatter of the observations about the plane over the scatter expected from their noise.
    pub(super) misfit: Padded,
    /// Mean weight over the variance of the noise: how clear the texture is.
    pub(super) texture: Padded,
    /// Variance of both slants together, in (px/px)^2; infinite where nothing is known.
    pub(super) slant_variance: Padded,
}

/// One row of planes to be filled; those that have been given back are empty, and those of zeros alone may
/// be.
pub(super) struct PlaneRow<'a> {
    pub(super) disparity: &'a mut [f32],
    pub(super) slant_x: &'a mut [f32],
    pub(super) slant_y: &'a mut [f32],
    pub(super) variance: &'a mut [f32],
    pub(super) misfit: &'a mut [f32],
    pub(super) texture: &'a mut [f32],
    pub(super) slant_variance: &'a mut [f32],
}

impl SurfacePlanes {
    pub(super) fn unknown(rows: usize, columns: usize) -> Self {
        let plane = |value| Padded::filled(rows, columns, value);
        Self {
            disparity: plane(0.0),
            slant_x: plane(0.0),
            slant_y: plane(0.0),
            variance: plane(f32::INFINITY),
            misfit: plane(f32::INFINITY),
            texture: plane(0.0),
            slant_variance: plane(f32::INFINITY),
        }
    }

    /// Makes all planes unknown, in the same memory.
    fn forget(&mut self) {
        self.par_rows().for_each(|row| {
            for zeros in [row.disparity, row.slant_x, row.slant_y, row.texture] {
                zeros.fill(0.0);
            }
            for infinite in [row.variance, row.misfit, row.slant_variance] {
                infinite.fill(f32::INFINITY);
            }
        });
    }

    /// The guesses that the observations are counted from, as planes without slant.
    pub(super) fn of_guesses(observations: &ObservationMaps, guess: &Grid<f32>, origin: f32) -> Self {
        let (rows, columns) = (guess.rows(), guess.columns());
        let plane = |value| Padded::filled(rows, columns, value);
        let mut planes = Self {
            disparity: plane(0.0),
            slant_x: Padded::of_zeros(columns),
            slant_y: Padded::of_zeros(columns),
            variance: plane(f32::INFINITY),
            misfit: Padded::given_back(),
            texture: Padded::given_back(),
            slant_variance: Padded::given_back(),
        };
        planes.par_rows().enumerate().for_each(|(y, planes)| {
            for (place, &guess) in planes.disparity[PAD..].iter_mut().zip(guess.row(y)) {
                *place = if guess.is_nan() { 0.0 } else { guess - origin };
            }
            let (inverse, noise) = (observations.inverse.row(y), observations.noise.row(y));
            for (place, variance) in planes.variance.iter_mut().enumerate() {
                if inverse[place] > 0.0 {
                    *variance = noise[place] * inverse[place];
                }
            }
        });
        planes
    }

    /// A surface, counted from `origin`, whose slants are the differences of neighbours up to this steep, in
    /// px/px: steeper ones are edges of things.
    pub(super) fn of_surface(surface: &Grid<f32>, origin: f32, steepest: f32) -> Self {
        let (rows, columns) = (surface.rows(), surface.columns());
        let mut planes = Self::unknown(rows, columns);
        let slant = |difference: f32, distance: usize| {
            let slant = difference / distance.max(1) as f32;
            if slant.abs() <= steepest { slant } else { 0.0 }
        };
        planes.par_rows().enumerate().for_each(|(y, row)| {
            let (above, below) = (y.saturating_sub(1), (y + 1).min(rows - 1));
            for (x, disparity) in surface.row(y).iter().enumerate().filter(|(_, value)| !value.is_nan()) {
                let (place, left, right) = (PAD + x, x.saturating_sub(1), (x + 1).min(columns - 1));
                row.disparity[place] = disparity - origin;
                row.variance[place] = 0.0;
                row.slant_x[place] = slant(surface.at(right, y) - surface.at(left, y), right - left);
                row.slant_y[place] = slant(surface.at(x, below) - surface.at(x, above), below - above);
            }
        });
        planes
    }

    /// Gives back the room of the misfits.
    pub(super) fn forget_misfit(&mut self) {
        self.misfit = Padded::given_back();
    }

    /// Gives back the room of all but the planes and the variances.
    pub(super) fn forget_fit(&mut self) {
        self.forget_misfit();
        self.texture = Padded::given_back();
    }

    /// Adds `more`, in px^2, to the variances.
    pub(super) fn raise_variance(&mut self, more: &Padded) {
        self.variance.values.par_iter_mut().zip(&more.values).for_each(|(variance, more)| *variance += more);
    }

    pub(super) fn rows(&self) -> usize {
        self.disparity.values.len() / self.disparity.stride
    }

    pub(super) fn par_rows(&mut self) -> impl IndexedParallelIterator<Item = PlaneRow<'_>> {
        let stride = self.disparity.stride;
        let mut rest = [
            &mut self.slant_x,
            &mut self.slant_y,
            &mut self.variance,
            &mut self.misfit,
            &mut self.texture,
            &mut self.slant_variance,
        ]
        .map(|plane| plane.values.chunks_mut(stride));
        let row = |disparity| {
            // Maps whose memory was given back have no rows.
            let [slant_x, slant_y, variance, misfit, texture, slant_variance] =
                rest.each_mut().map(|rows| rows.next().unwrap_or_default());
            PlaneRow { disparity, slant_x, slant_y, variance, misfit, texture, slant_variance }
        };
        self.disparity.values.chunks_mut(stride).map(row).collect::<Vec<_>>().into_par_iter()
    }
}

/// Planes that are no longer needed, kept for those that will be: to fetch memory takes longer than many a
/// computation into it.
#[derive(Debug)]
pub(super) struct SpareMaps {
    rows: usize,
    columns: usize,
    spare: Vec<SurfacePlanes>,
}

impl SpareMaps {
    pub(super) fn none(rows: usize, columns: usize) -> Self {
        Self { rows, columns, spare: Vec::new() }
    }

    fn any(&mut self) -> SurfacePlanes {
        self.spare.pop().unwrap_or_else(|| SurfacePlanes::unknown(self.rows, self.columns))
    }

    /// Planes of competing windows, without a map of texture, to be filled. Their content is undefined,
    /// except beside the rows.
    pub(super) fn windows(&mut self) -> SurfacePlanes {
        let mut planes = self.any();
        if planes.misfit.is_given_back() {
            std::mem::swap(&mut planes.misfit, &mut planes.texture);
        }
        planes.texture = Padded::given_back();
        planes
    }

    /// Planes of supports, which are taken however well they fit; of unknown content, nothing beside the rows
    /// excepted; to be filled.
    pub(super) fn supports(&mut self) -> SurfacePlanes {
        let mut planes = self.any();
        if planes.texture.is_given_back() {
            std::mem::swap(&mut planes.misfit, &mut planes.texture);
        }
        planes.forget_misfit();
        planes
    }

    /// Planes of infinite variance.
    pub(super) fn unknown(&mut self) -> SurfacePlanes {
        let Some(mut planes) = self.spare.pop() else {
            return SurfacePlanes::unknown(self.rows, self.columns);
        };
        for plane in [&mut planes.misfit, &mut planes.texture] {
            if plane.is_given_back() {
                *plane = Padded::filled(self.rows, self.columns, 0.0);
            }
        }
        planes.forget();
        planes
    }

    /// A copy of the `planes` of supports.
    pub(super) fn copy_of(&mut self, planes: &SurfacePlanes) -> SurfacePlanes {
        let mut copy = self.supports();
        copy.par_rows().enumerate().for_each(|(y, row)| {
            row.disparity.copy_from_slice(planes.disparity.row(y));
            row.slant_x.copy_from_slice(planes.slant_x.row(y));
            row.slant_y.copy_from_slice(planes.slant_y.row(y));
            row.variance.copy_from_slice(planes.variance.row(y));
            row.texture.copy_from_slice(planes.texture.row(y));
            row.slant_variance.copy_from_slice(planes.slant_variance.row(y));
        });
        copy
    }

    pub(super) fn keep(&mut self, planes: SurfacePlanes) {
        self.spare.push(planes);
    }

    /// Gives back the spare memory.
    pub(super) fn release(&mut self) {
        self.spare.clear();
    }
}

#[cfg(test)]
mod tests;
