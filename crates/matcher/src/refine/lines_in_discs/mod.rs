//! The surface through the observations of all pixels.
//!
//! In discs around each pixel the surface is a plane, or a plane with one line through it (`plane`, `lines`).
//! The average over both, and over all places and directions of the line, is the posterior's mean (`discs`).
//! Discs grow fourfold, and the surfaces by two sizes are averaged by how well they predict the observations
//! (`sizes`). The largest discs work on sums of 2 x 2 and more pixels (`observed`), and only where sigma is
//! larger than wanted. No direction is preferred.

mod approximate;
mod disc;
mod discs;
mod lines;
mod model;
mod observed;
mod plane;
mod pooling;
mod residuals;
mod sizes;
mod surface;
#[cfg(test)]
mod tests;
mod texture;

use fearless_simd::Level;
use rayon::prelude::*;

use super::foreshortening::take_off_drift;
use super::padded::{PAD, Padded};
use super::planes::{ObservationMaps, SurfacePlanes};
use crate::options::Effort;
use discs::Discs;
use epirig_core::grid::Grid;
use model::{Model, STEEPEST, Shapes};
use observed::Observed;
use pooling::{halved_sums, of_observed};
use residuals::raise_by_residuals;
use sizes::take_larger;
use surface::Surface;
use texture::texture;

/// Squared radius of the smallest discs, of 32 pixels, and of the next ones, of 164, in px^2.
const SMALL: usize = 9;
const LARGE: usize = 52;
/// Half of the larger disc's radius, in px: predictions are compared within a Gaussian of this standard
/// deviation.
const HALF_LARGE_PX: f32 = 3.6;
/// Discs grow to this many times the large one's radius, in powers of two: 115 px across.
const MOST_HALVINGS: usize = 3;

/// Lines of neighbouring directions lie this far apart at the rim of the disc, in px, where nothing else is
/// asked.
const RIM_PX: f32 = 1.4;

/// Variance of the blur before anything is seen, in px^2, and one over the variance of that: a pixel's aperture
/// has 1/12, and a lens spreads a point by some 0.45 px; 0.1 more or less.
const EXPECTED_BLUR: f64 = 0.28;
const EXPECTED_BLUR_INFORMATION: f64 = 100.0;
/// Share of discs that a line crosses, where nothing is known.
const EVEN_SHARE: f64 = 0.5;
/// Lines cross at least this share of the discs, and leave out at least as many: other discs cannot exclude a
/// line in one.
const LEAST_SHARE: f64 = 0.02;

/// The result of a fit.
pub(super) struct Joined {
    /// In px, from the origin.
    pub(super) disparity: Padded,
    /// Variance of the disparity, in px^2; infinite where nothing is known.
    pub(super) variance: Padded,
    /// How clear the texture is: the mean weight over the variance of the noise.
    pub(super) texture: Padded,
}

/// How a fit is done.
#[derive(Debug, Clone, Copy)]
pub(super) struct Joining {
    /// With [`Effort::Quick`] lines cross small discs only.
    pub(super) effort: Effort,
    /// Share of discs that a line crosses, as a step before found it.
    pub(super) share: Option<f64>,
    /// Larger discs are used where sigma exceeds this, in px; infinite: nowhere.
    pub(super) wanted_sigma_px: f64,
}

impl Joining {
    fn model(self, rim_px: f32, blur: f64) -> Model {
        let share = self.share.unwrap_or(EVEN_SHARE).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        let (large, wanted_sigma_px) = match self.effort {
            Effort::Full => (Shapes::PlanesAndLines, self.wanted_sigma_px),
            Effort::Quick => (Shapes::Planes, f64::INFINITY),
        };
        Model {
            shapes: [Shapes::PlanesAndLines, large],
            rim_px,
            line_odds: (share / (1.0 - share)) as f32,
            blur: blur as f32,
            wanted_variance: wanted_sigma_px.powi(2) as f32,
        }
    }
}

/// The disparities of a step before the last, in px from `origin`, and the share of discs that a line crosses.
/// Every other direction of lines does.
pub(super) fn rough_surface(
    level: Level,
    observations: &ObservationMaps,
    (guess, origin): (&Grid<f32>, f32),
    effort: Effort,
) -> (Padded, f64) {
    let joining = Joining { effort, share: None, wanted_sigma_px: f64::INFINITY };
    let model = joining.model(2.0 * RIM_PX, EXPECTED_BLUR);
    let (surface, share) = surface(level, &Observed::of(observations, guess, origin), model);
    (surface.disparity, share)
}

/// Joins the `observations` around `guess`, counted from `origin`. The effect of the blur is taken off them first,
/// unless the guesses are those of the search (`guess_is_fitted`): their steps are no slants.
pub(super) fn joined(
    level: Level,
    observations: &mut ObservationMaps,
    (guess, origin): (&Grid<f32>, f32),
    guess_is_fitted: bool,
    joining: Joining,
) -> Joined {
    let mut blur = EXPECTED_BLUR;
    if guess_is_fitted {
        let found = take_off_drift(observations, &SurfacePlanes::of_surface(guess, origin, STEEPEST));
        blur = (found.information * found.variance + EXPECTED_BLUR_INFORMATION * EXPECTED_BLUR)
            / (found.information + EXPECTED_BLUR_INFORMATION);
    }
    observations.forget_derivatives();
    let observed = Observed::of(observations, guess, origin);
    let (mut surface, _) = surface(level, &observed, joining.model(RIM_PX, blur));
    raise_by_residuals(level, &observed, &mut surface);
    let Surface { disparity, mut variance, addition, .. } = surface;
    variance.values.par_iter_mut().zip(&addition.values).for_each(|(variance, more)| *variance += more);
    Joined { disparity, variance, texture: texture(level, &observed) }
}

/// The surface at each pixel that has a guess, and the share of discs that a line crosses.
fn surface(level: Level, observed: &Observed, model: Model) -> (Surface, f64) {
    let [small, large] = model.shapes;
    let mut discs = Discs::new(SMALL, small, &model, 1.0);
    let (mut surface, share_of_small) = discs.surface(level, observed, &observed.guess);
    let mut pixels = discs.pixels();
    discs = Discs::new(LARGE, large, &model, 1.0);
    let (larger, share) = discs.surface(level, observed, &observed.guess);
    take_larger(level, observed, &mut surface, &larger, (HALF_LARGE_PX, 0), pixels);
    drop(larger);
    let mut halved = Vec::new();
    for halvings in 1..=MOST_HALVINGS {
        let Some(wanted) = pixels_that_want_more(observed, &surface, model.wanted_variance, halvings) else {
            break;
        };
        let finer = halved.last().unwrap_or(observed);
        halved.push(finer.halved());
        let coarse = &halved[halvings - 1];
        let guesses = where_wanted(coarse, &wanted);
        pixels = discs.pixels();
        discs = Discs::new(LARGE, large, &model, (1 << halvings) as f32);
        let (mut larger, _) = discs.surface(level, coarse, &guesses);
        for finer in (0..halvings).rev() {
            larger = larger.doubled(if finer == 0 { observed } else { &halved[finer - 1] });
        }
        take_larger(level, observed, &mut surface, &larger, (HALF_LARGE_PX, halvings), pixels);
    }
    (surface, if large == Shapes::Planes { share_of_small } else { share })
}

/// How many pixels in each pixel of a map halved so often have a larger variance than wanted; `None` if none
/// has.
fn pixels_that_want_more(
    observed: &Observed,
    surface: &Surface,
    wanted_variance: f32,
    halvings: usize,
) -> Option<Padded> {
    let wants =
        |place: usize, y: usize| f32::from(u8::from(surface.variance.row(y)[place] > wanted_variance));
    let extent = (observed.rows(), observed.columns);
    let wanted = halved_sums(of_observed(observed, wants), extent, halvings);
    wanted.values.par_iter().any(|count| *count > 0.0).then_some(wanted)
}

/// The guesses of the pixels that want more; NaN for the others.
fn where_wanted(observed: &Observed, wanted: &Padded) -> Padded {
    let mut guesses = observed.guess.clone();
    guesses.par_rows().enumerate().for_each(|(y, guesses)| {
        let wanted = wanted.row(y);
        for place in PAD..PAD + observed.columns {
            if wanted[place] <= 0.0 {
                guesses[place] = f32::NAN;
            }
        }
    });
    guesses
}
