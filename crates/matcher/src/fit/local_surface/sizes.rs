//! Discs of two sizes: which of them is right, by what they predict.
//!
//! Each pixel's own observation has the share h = w V in its disparity (V is the posterior's
//! variance, w one over that of the observation v; for a posterior's mean the derivative to v is w
//! V exactly). So the logarithm of the density of v as predicted from all others is
//!
//! ```text
//! s = -(w (v - d)^2 / (1 - h) - ln(1 - h)) / 2          (leave one out; Geisser and Eddy 1979)
//! ```
//!
//! Its difference between two sizes, summed over a Gaussian as wide as half of the larger disc, is
//! the logarithm of their odds, but for the share of places where the larger one is right, which
//! the whole image tells (expectation maximisation; Dempster, Laird and Rubin 1977). Where a
//! corner, a third edge or curvature breaks the larger disc's model, the smaller one predicts
//! better.
//!
//! With the share p of the larger disc, the disparity is the mean of both. As the larger disc holds
//! the smaller one, their difference has by chance the variance V_small - V_large (Hausman 1978);
//! what exceeds that is disagreement:
//!
//! ```text
//! V = (1 - p)^2 V_small + (1 - (1 - p)^2) V_large + p (1 - p) max(0, (d_small - d_large)^2 - (V_small - V_large))
//! ```
//!
//! What both disagree by on many pixels beyond chance is dealt with in `disagreement`.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::disagreement::disagreement;
use super::observed::{Observed, one_less_leverage};
use super::pooling::{CELL_HALVINGS, halved_sums, pooled};
use super::surface::Surface;
use crate::fit::padded::{PAD, Padded};

/// Half of the larger disc's radius, in px: predictions are compared within a Gaussian of this
/// standard deviation.
const HALF_LARGE_PX: f32 = 3.6;
/// One pixel of each so many rows and columns tells how often the larger disc is right: neighbours
/// tell the same.
const SAMPLED: usize = 4;
/// Steps of expectation maximisation.
const STEPS: usize = 5;
/// Each size is right at least at this share of the places: others cannot exclude it at one.
const LEAST_SHARE: f64 = 0.02;

/// A single prediction counts no less than this logarithm: it may be an outlier.
const LEAST_SCORE: f32 = -12.0;

/// Takes `larger`, the surface by larger discs, into `surface`, as far as it predicts better. Its discs are
/// large ones of the map that has been halved so often. `pixels` is the number of pixels of the smaller
/// discs. Once the work is cancelled, what is left in `surface` means nothing.
pub(super) fn take_larger(
    level: Level,
    observed: &Observed,
    surface: &mut Surface,
    larger: &Surface,
    halvings: usize,
    pixels: f32,
) {
    let extent = (observed.rows(), observed.columns);
    let mut evidence = Padded::filled(observed.rows(), observed.columns, 0.0);
    evidence.par_rows().enumerate().for_each(|(y, evidence)| {
        let own = PAD..PAD + observed.columns;
        let maps = [surface, larger]
            .map(|surface| [&surface.disparity.row(y)[own.clone()], &surface.variance.row(y)[own.clone()]]);
        let seen = [&observed.value.row(y)[own.clone()], &observed.precision.row(y)[own.clone()]];
        dispatch!(level, _simd => evidence_of_row(seen, maps, &mut evidence[own.clone()]));
    });
    if observed.progress.cancelled() {
        return;
    }
    let evidence = halved_sums(evidence, extent, halvings);
    let evidence = pooled(level, &evidence, HALF_LARGE_PX);
    let usual = usual_odds(observed, |place, y| {
        let (small, large) = (surface.variance.row(y)[place], larger.variance.row(y)[place]);
        let evidence = evidence.row(y >> halvings)[PAD + ((place - PAD) >> halvings)];
        (small.is_finite() && large.is_finite()).then(|| odds(evidence, small, large))
    });
    let mut shares = Padded::filled(observed.rows(), observed.columns, 0.0);
    shares.par_rows().enumerate().for_each(|(y, shares)| {
        let evidence = evidence.row(y >> halvings);
        let (small, large) = (surface.variance.row(y), larger.variance.row(y));
        let known = |place: &usize| large[*place].is_finite() && (small[*place].is_finite() || halvings == 0);
        for place in (PAD..PAD + observed.columns).filter(known) {
            let evidence = evidence[PAD + ((place - PAD) >> halvings)];
            shares[place] = match small[place].is_finite() {
                true => 1.0 / (1.0 + 1.0 / (usual * odds(evidence, small[place], large[place]))),
                false => 1.0,
            };
        }
    });
    if observed.progress.cancelled() {
        return;
    }
    let found = disagreement(level, observed, surface, larger, &shares, pixels);
    let Surface { disparity, variance, addition, .. } = surface;
    let rows = disparity.par_rows().zip(variance.par_rows()).zip(addition.par_rows()).enumerate();
    rows.for_each(|(y, ((disparity, variance), addition))| {
        let shares = shares.row(y);
        let [smoothed, flattened] =
            [&found.smoothed, &found.flattened].map(|map| map.row(y >> CELL_HALVINGS));
        let maps = [&larger.disparity, &larger.variance, &larger.addition].map(|map: &Padded| map.row(y));
        for place in (PAD..PAD + observed.columns).filter(|place| shares[*place] > 0.0) {
            let [d, v, places] = maps.map(|map| map[place]);
            let (small, share) = (variance[place], shares[place]);
            let rest = 1.0 - share;
            if !small.is_finite() {
                (disparity[place], variance[place], addition[place]) = (d, v, places);
                continue;
            }
            let cell = PAD + ((place - PAD) >> CELL_HALVINGS);
            let difference = d - disparity[place];
            let chance = (small - v).abs();
            let sure = rest * rest * small + (1.0 - rest * rest) * v.min(small);
            variance[place] = sure + share * rest * (difference * difference - chance).max(0.0);
            disparity[place] += share * (difference - flattened[cell]);
            addition[place] += share * (places - addition[place] + share * smoothed[cell]);
        }
    });
}

/// Odds of the larger disc, if both are as likely before. Of two that predict as well the better
/// known one has the larger odds.
fn odds(evidence: f32, small: f32, large: f32) -> f32 {
    evidence.exp() * (small / large).sqrt()
}

/// The odds that the larger disc is right where nothing is observed. `odds` are those of a pixel,
/// if both are as likely before.
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

/// By how much more the second surface predicts each observation of a row than the first; 0 where
/// one is unknown.
#[inline(always)]
fn evidence_of_row(
    [values, precisions]: [&[f32]; 2],
    [[d, v], [other_d, other_v]]: [[&[f32]; 2]; 2],
    evidence: &mut [f32],
) {
    let own = values.iter().zip(precisions);
    let surfaces = d.iter().zip(v).zip(other_d.iter().zip(other_v));
    for (evidence, ((value, precision), ((d, v), (other_d, other_v)))) in
        evidence.iter_mut().zip(own.zip(surfaces))
    {
        let known = *precision > 0.0 && *v < f32::INFINITY && *other_v < f32::INFINITY;
        let more = score(*value, *precision, *other_d, *other_v) - score(*value, *precision, *d, *v);
        *evidence = if known { more } else { 0.0 };
    }
}

/// The logarithm of the density that a surface of this disparity and variance predicts for an
/// observation from all others.
#[inline(always)]
fn score(value: f32, precision: f32, disparity: f32, variance: f32) -> f32 {
    let one_less_leverage = one_less_leverage(precision, variance);
    let away = value - disparity;
    let score = -0.5 * (precision * away * away / one_less_leverage - logarithm(one_less_leverage));
    if score > LEAST_SCORE { score } else { LEAST_SCORE }
}

/// The natural logarithm of a positive number, to 0.0002.
#[inline(always)]
fn logarithm(number: f32) -> f32 {
    let bits = number.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    let m = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000);
    let quartic =
        m * (2.821_202_6 + m * (-1.469_956_8 + m * (0.447_179_55 - 0.056_570_85 * m))) - 1.741_793_9;
    exponent as f32 * std::f32::consts::LN_2 + quartic
}
