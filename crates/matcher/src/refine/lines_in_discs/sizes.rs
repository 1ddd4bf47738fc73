//! Discs of two sizes: which of them is right, by what they predict.
//!
//! Each pixel's own observation has the share h = w V in its disparity (V is the posterior's variance, w one
//! over that of the observation v; for a posterior's mean the derivative to v is w V exactly). So the
//! logarithm of the density of v as predicted from all others is
//!
//! ```text
//! s = -(w (v - d)^2 / (1 - h) - ln(1 - h)) / 2          (leave one out; Geisser and Eddy 1979)
//! ```
//!
//! Its difference between two sizes, summed over a Gaussian as wide as half of the larger disc, is the
//! logarithm of their odds, but for the share of places where the larger one is right, which the whole image
//! tells (expectation maximisation; Dempster, Laird and Rubin 1977). Where a corner, a second line or curvature
//! breaks the larger disc's model, the smaller one predicts better.
//!
//! With the share p of the larger disc, the disparity is the mean of both. As the larger disc holds the
//! smaller one, their difference has by chance the variance V_small - V_large (Hausman 1978); what exceeds
//! that is disagreement:
//!
//! ```text
//! V = (1 - p)^2 V_small + (1 - (1 - p)^2) V_large + p (1 - p) max(0, (d_small - d_large)^2 - (V_small - V_large))
//! ```
//!
//! Relief that is small against the noise of single observations changes predictions by little, and then the
//! larger disc smooths it away. But it makes both sizes disagree everywhere: what the mean of the squared
//! differences over many pixels exceeds chance by is added to the variance, times p^2.

use fearless_simd::Level;
use rayon::prelude::*;

use super::observed::Observed;
use super::pooling::{halved_sums, of_observed, pooled};
use super::surface::Surface;
use crate::refine::padded::{PAD, Padded};

/// Disagreement is averaged over a Gaussian of this standard deviation, in pixels of the map that has been
/// halved so often: 29 px.
const DISAGREEMENT_PX: f32 = 3.6;
const DISAGREEMENT_HALVINGS: usize = 3;
/// Chance leaves a mean beyond this many of its standard deviations once in six.
const CHANCE_SIGMAS: f32 = 1.0;

/// One pixel of each so many rows and columns tells how often the larger disc is right: neighbours tell the same.
const SAMPLED: usize = 4;
/// Steps of expectation maximisation.
const STEPS: usize = 5;
/// Each size is right at least at this share of the places: others cannot exclude it at one.
const LEAST_SHARE: f64 = 0.02;

/// A single prediction counts no less than this logarithm: it may be an outlier.
const LEAST_SCORE: f32 = -12.0;
/// A pixel's own observation has no more than this share in its disparity.
const LARGEST_SHARE: f32 = 0.95;

/// Takes `larger`, the surface by larger discs, into `surface`, as far as it predicts better. Predictions are
/// summed over a Gaussian of this standard deviation, in pixels of the map that has been halved so often.
/// `pixels` is the number of pixels of the smaller discs.
pub(super) fn take_larger(
    level: Level,
    observed: &Observed,
    surface: &mut Surface,
    larger: &Surface,
    (sigma_px, halvings): (f32, usize),
    pixels: f32,
) {
    let both = |place: usize, y: usize| {
        let known = surface.variance.row(y)[place].is_finite() && larger.variance.row(y)[place].is_finite();
        if known { score(observed, larger, place, y) - score(observed, surface, place, y) } else { 0.0 }
    };
    let extent = (observed.rows(), observed.columns);
    let evidence = halved_sums(of_observed(observed, both), extent, halvings);
    let evidence = pooled(level, &evidence, sigma_px);
    let usual = usual_odds(observed, |place, y| {
        let (small, large) = (surface.variance.row(y)[place], larger.variance.row(y)[place]);
        let evidence = evidence.row(y >> halvings)[PAD + ((place - PAD) >> halvings)];
        (small.is_finite() && large.is_finite()).then(|| odds(evidence, small, large))
    });
    let disagreement = disagreement(level, observed, (surface, larger), pixels);
    let Surface { disparity, variance, addition, .. } = surface;
    let rows = disparity.par_rows().zip(variance.par_rows()).zip(addition.par_rows()).enumerate();
    rows.for_each(|(y, ((disparity, variance), addition))| {
        let evidence = evidence.row(y >> halvings);
        let disagreement = disagreement.row(y >> DISAGREEMENT_HALVINGS);
        let maps = [&larger.disparity, &larger.variance, &larger.addition].map(|map: &Padded| map.row(y));
        for place in PAD..PAD + observed.columns {
            let [d, v, walls] = maps.map(|map| map[place]);
            if !v.is_finite() {
                continue;
            }
            let small = variance[place];
            let share = if small.is_finite() {
                let evidence = evidence[PAD + ((place - PAD) >> halvings)];
                1.0 / (1.0 + 1.0 / (usual * odds(evidence, small, v)))
            } else {
                1.0
            };
            let smoothed = disagreement[PAD + ((place - PAD) >> DISAGREEMENT_HALVINGS)];
            let rest = 1.0 - share;
            let apart = d - disparity[place];
            if rest > 0.0 {
                let chance = (small - v).abs();
                let sure = rest * rest * small + (1.0 - rest * rest) * v.min(small);
                variance[place] = sure + share * rest * (apart * apart - chance).max(0.0);
                disparity[place] += share * apart;
                addition[place] += share * (walls - addition[place] + share * smoothed);
            } else {
                (disparity[place], variance[place], addition[place]) = (d, v, walls);
            }
        }
    });
}

/// Odds of the larger disc, if both are as likely before. Of two that predict as well the better known one has
/// the larger odds.
fn odds(evidence: f32, small: f32, large: f32) -> f32 {
    evidence.exp() * (small / large).sqrt()
}

/// The odds that the larger disc is right where nothing is observed. `odds` are those of a pixel, if both are as
/// likely before.
pub(super) fn usual_odds(observed: &Observed, odds: impl Fn(usize, usize) -> Option<f32>) -> f32 {
    let mut found = Vec::new();
    for y in (0..observed.rows()).step_by(SAMPLED) {
        let places = (PAD..PAD + observed.columns).step_by(SAMPLED);
        found.extend(places.filter_map(|place| odds(place, y)).map(f64::from));
    }
    let mut usual = 1.0;
    for _ in 0..STEPS {
        let shares = found.iter().map(|odds| 1.0 / (1.0 + 1.0 / (odds * usual)));
        let share = (shares.sum::<f64>() / found.len().max(1) as f64).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        usual = share / (1.0 - share);
    }
    usual as f32
}

/// The logarithm of the density that a surface predicts for an observation from all others.
fn score(observed: &Observed, surface: &Surface, place: usize, y: usize) -> f32 {
    let precision = observed.precision.row(y)[place];
    let spare = 1.0 - (precision * surface.variance.row(y)[place]).min(LARGEST_SHARE);
    let away = observed.value.row(y)[place] - surface.disparity.row(y)[place];
    (-0.5 * (precision * away * away / spare - spare.ln())).max(LEAST_SCORE)
}

/// The mean square of what both sizes disagree by, beyond chance, in px^2: by cells of the halved map.
fn disagreement(
    level: Level,
    observed: &Observed,
    (small, large): (&Surface, &Surface),
    pixels: f32,
) -> Padded {
    let both = |place: usize, y: usize| {
        let (v, w) = (small.variance.row(y)[place], large.variance.row(y)[place]);
        (v.is_finite() && w.is_finite()).then_some([v, v - w])
    };
    let mean = |value: &(dyn Fn(usize, usize) -> f32 + Sync)| {
        let extent = (observed.rows(), observed.columns);
        let map = halved_sums(of_observed(observed, value), extent, DISAGREEMENT_HALVINGS);
        pooled(level, &map, DISAGREEMENT_PX)
    };
    let counts = mean(&|place, y| f32::from(u8::from(both(place, y).is_some())));
    let variances = mean(&|place, y| both(place, y).map_or(0.0, |[v, _]| v));
    let mut excess = mean(&|place, y| {
        let apart = large.disparity.row(y)[place] - small.disparity.row(y)[place];
        both(place, y).map_or(0.0, |[_, chance]| apart * apart - chance)
    });
    excess.par_rows().enumerate().for_each(|(y, excess)| {
        let (counts, variances) = (counts.row(y), variances.row(y));
        for (excess, (count, variance)) in excess.iter_mut().zip(counts.iter().zip(variances)) {
            if *count > 0.0 {
                // Squares of a Gaussian variable scatter by the root of 2 of their mean; those of one disc are
                // one; squared weights of a Gaussian sum to half of what weights do.
                let independent = 2.0 * count / pixels;
                let chance = CHANCE_SIGMAS * (2.0 / independent).sqrt() * variance / count;
                *excess = (*excess / count - chance).max(0.0);
            }
        }
    });
    excess
}
