//! The surface through the observations of all pixels.
//!
//! In discs around each pixel the surface is a plane, or a plane with an edge through it (`plane`,
//! `edges`, `directions`). The average over both, and over all shapes, places and directions of the
//! edge, is the posterior's mean (`discs`). Discs grow fourfold, and the surfaces by two sizes are
//! averaged by how well they predict the observations (`sizes`, `disagreement`). The largest discs
//! work on sums of 2 x 2 and more pixels (`observed`), and only where sigma is larger than wanted. No
//! direction is preferred.

mod approximate;
mod averaged;
mod directions;
mod disagreement;
mod disc;
mod discs;
mod edge_shapes;
mod edges;
mod model;
mod observed;
mod plane;
mod pooling;
mod priors;
mod residuals;
mod sizes;
mod surface;
#[cfg(test)]
mod tests;
mod texture;

use fearless_simd::Level;
use rayon::prelude::*;

use super::foreshortening::take_off_drift;
use super::light::{Drift, take_off_light};
use super::padded::{PAD, Padded};
use super::planes::{Guess, ObservationMaps, SurfacePlanes, Template};
use crate::one_surface::OneSurface;
use crate::options::MatchOptions;
use discs::Discs;
use epirig_core::progress::{Cancelled, Progress};
use model::{Model, Shapes};
use observed::Observed;
use pooling::{halved_sums, of_observed};
use priors::learned;
use residuals::raise_by_residuals;
use sizes::take_larger;
use surface::Surface;
use texture::texture;

/// Squared radius of the smallest discs, of 32 pixels, and of the next ones, of 164, in px^2.
const SMALL: usize = 9;
const LARGE: usize = 52;
/// The same of discs of one size, which see no farther than windows of 5 x 5 px.
const EQUAL: usize = 5;
/// Discs grow to this many times the large one's radius, in powers of two: 115 px across.
const MOST_HALVINGS: usize = 3;

/// Radius of the largest discs, in px, rounded up.
pub(crate) fn largest_disc_px() -> usize {
    ((LARGE as f64).sqrt() * f64::from(1 << MOST_HALVINGS)).ceil() as usize
}

/// Variance of the blur before anything is seen, in px^2, and one over the variance of that: a
/// pixel's aperture has 1/12, and a lens spreads a point by some 0.45 px; 0.1 more or less.
const EXPECTED_BLUR: f64 = 0.28;
const EXPECTED_BLUR_INFORMATION: f64 = 100.0;
/// Variance of a pixel's aperture, in px^2: nothing is sharper.
const APERTURE: f64 = 1.0 / 12.0;

/// The result of a fit.
pub(super) struct Fused {
    /// In px, from the origin.
    pub(super) disparity: Padded,
    /// Variance of the disparity, in px^2; infinite where nothing is known.
    pub(super) variance: Padded,
    /// How clear the texture is: the mean weight over the variance of the noise.
    pub(super) texture: Padded,
    /// The drift of the light that was taken off; `None` if nothing shows it.
    pub(super) light: Option<Drift>,
}

/// The discs in which a surface is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Sizes {
    /// One small size, with planes alone: nothing is selected, and every pixel sees as far as any
    /// other.
    Equal,
    /// Two sizes, with edges through the small ones alone: for a first look.
    Two,
    /// Two sizes with edges, and larger ones where sigma exceeds this, in px.
    Growing {
        /// The wanted sigma.
        wanted_sigma_px: f64,
    },
}

impl Sizes {
    /// Those that `options` ask for.
    pub(crate) fn of(options: &MatchOptions) -> Self {
        match options.wanted_sigma_px {
            _ if options.quick => Self::Two,
            None => Self::Equal,
            Some(wanted_sigma_px) => Self::Growing { wanted_sigma_px },
        }
    }

    fn model(self, blur: f64, least_texture: f32) -> Model {
        let (shapes, wanted_sigma_px) = match self {
            Self::Equal => ([Shapes::Planes; 2], f64::INFINITY),
            Self::Two => ([Shapes::PlanesAndEdges, Shapes::Planes], f64::INFINITY),
            Self::Growing { wanted_sigma_px } => ([Shapes::PlanesAndEdges; 2], wanted_sigma_px),
        };
        let wanted_variance = wanted_sigma_px.powi(2) as f32;
        Model { shapes, blur: blur as f32, least_texture, wanted_variance }
    }
}

/// The disparities of a step before the last, in px from `origin`.
pub(super) fn rough_surface(
    (level, progress): (Level, &dyn Progress),
    observations: &mut ObservationMaps,
    template: &Template,
    guess: Guess<'_>,
    sizes: Sizes,
) -> Result<Padded, Cancelled> {
    take_off_light(observations, template, guess, None);
    progress.unless_cancelled()?;
    let sizes = match sizes {
        Sizes::Two => Sizes::Two,
        // What the step finds is a guess.
        Sizes::Equal | Sizes::Growing { .. } => Sizes::Growing { wanted_sigma_px: f64::INFINITY },
    };
    let model = sizes.model(EXPECTED_BLUR, 0.0);
    Ok(surface(level, &Observed::of(observations, guess, progress), model)?.disparity)
}

/// Fuses the `observations` around `guess`. The effect of the blur is taken off them first, unless the
/// guesses are those of the search (not `guess_is_fitted`): their steps are no slants. Pixels whose mean
/// precision is less than `least_texture`, in 1/px^2, show no more texture than noise does.
pub(super) fn fused(
    (level, progress): (Level, &dyn Progress),
    mut observations: ObservationMaps,
    template: Template,
    guess: Guess<'_>,
    guess_is_fitted: bool,
    sizes: Sizes,
    least_texture: f32,
) -> Result<Fused, Cancelled> {
    let mut blur = EXPECTED_BLUR;
    let slants = guess_is_fitted.then(|| SurfacePlanes::of_surface(guess, OneSurface::FINE.slant));
    progress.unless_cancelled()?;
    let light = take_off_light(&mut observations, &template, guess, slants.as_ref());
    progress.unless_cancelled()?;
    if let Some(slants) = slants {
        let found = take_off_drift(&mut observations, &template, &slants);
        // What is left of a step edge is spread by all of the blur: its drift was the part that goes
        // with the texture.
        blur = (found.information * found.variance + EXPECTED_BLUR_INFORMATION * EXPECTED_BLUR)
            / (found.information + EXPECTED_BLUR_INFORMATION);
    }
    blur = blur.max(APERTURE);
    progress.unless_cancelled()?;
    drop(template);
    let observed = Observed::of(&observations, guess, progress);
    let model = sizes.model(blur, least_texture);
    let mut surface = match sizes {
        Sizes::Equal => Discs::new(EQUAL, None, &model, 1.0).surface(level, &observed, &observed.guess),
        Sizes::Two | Sizes::Growing { .. } => surface(level, &observed, model)?,
    };
    progress.unless_cancelled()?;
    raise_by_residuals(level, &observed, &mut surface, observations.noise_gain);
    progress.unless_cancelled()?;
    let Surface { disparity, mut variance, addition, .. } = surface;
    variance.values.par_iter_mut().zip(&addition.values).for_each(|(variance, more)| *variance += more);
    Ok(Fused { disparity, variance, texture: texture(level, &observed), light })
}

/// The surface at each pixel that has a guess.
fn surface(level: Level, observed: &Observed, model: Model) -> Result<Surface, Cancelled> {
    let [small, large] = [0, 1].map(|size| {
        let squared_radius = [SMALL, LARGE][size];
        (model.shapes[size] == Shapes::PlanesAndEdges)
            .then(|| learned(level, observed, squared_radius, &model))
    });
    observed.progress.unless_cancelled()?;
    let mut discs = Discs::new(SMALL, small, &model, 1.0);
    let mut surface = discs.surface(level, observed, &observed.guess);
    let mut pixels = discs.pixels();
    discs = Discs::new(LARGE, large, &model, 1.0).ending_with_the_texture(model.least_texture);
    let larger = discs.surface(level, observed, &observed.guess);
    observed.progress.unless_cancelled()?;
    take_larger(level, observed, &mut surface, &larger, 0, pixels);
    surface.forget_unknown_of(&larger);
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
        let mut larger = discs.surface(level, coarse, &guesses);
        observed.progress.unless_cancelled()?;
        for finer in (0..halvings).rev() {
            let has_slants = finer > 0;
            larger = larger.doubled(if has_slants { &halved[finer - 1] } else { observed }, has_slants);
        }
        take_larger(level, observed, &mut surface, &larger, halvings, pixels);
    }
    Ok(surface)
}

/// How many pixels in each pixel of a map halved so often have a larger variance than wanted;
/// `None` if none has.
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
