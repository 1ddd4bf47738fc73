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
//! Relief that is small against the noise of single observations changes predictions by little, and
//! then the larger disc smooths it away. But it makes both sizes disagree everywhere: what the mean
//! of the squared differences over many pixels exceeds chance by is added to the variance, times
//! p^2. A curved surface is flattened by the larger disc, everywhere alike: the mean of the
//! differences over many pixels, as far as chance does not explain it, is taken off. Both means are
//! weighted by p^2: they are asked where the larger disc is taken.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::observed::Observed;
use super::pooling::{halved_sums, pooled};
use super::surface::Surface;
use crate::refine::padded::{PAD, Padded};

/// Disagreement is averaged over a Gaussian of this standard deviation, in pixels of the map that
/// has been halved so often: 29 px.
const DISAGREEMENT_PX: f32 = 3.6;
const DISAGREEMENT_HALVINGS: usize = 3;
/// Chance leaves a mean beyond this many of its standard deviations once in six.
const CHANCE_SIGMAS: f32 = 1.0;

/// A difference counts no more than this many of its standard deviations: at an outline it may be
/// another surface's.
const LARGEST_DIFFERENCE: f32 = 3.0;

/// The difference of two sizes has no less than this share of the smaller one's variance by chance:
/// both have other pixels.
const LEAST_CHANCE: f32 = 0.1;
/// A usual variance by chance, in px^2: weights around 1 do not leave the range of single
/// precision.
const USUAL_CHANCE: f32 = 1e-5;

/// One pixel of each so many rows and columns tells how often the larger disc is right: neighbours
/// tell the same.
const SAMPLED: usize = 4;
/// Steps of expectation maximisation.
const STEPS: usize = 5;
/// Each size is right at least at this share of the places: others cannot exclude it at one.
const LEAST_SHARE: f64 = 0.02;

/// A single prediction counts no less than this logarithm: it may be an outlier.
const LEAST_SCORE: f32 = -12.0;
/// A pixel's own observation has no more than this share in its disparity.
const LARGEST_SHARE: f32 = 0.95;

/// Takes `larger`, the surface by larger discs, into `surface`, as far as it predicts better.
/// Predictions are summed over a Gaussian of this standard deviation, in pixels of the map that has
/// been halved so often. `pixels` is the number of pixels of the smaller discs.
pub(super) fn take_larger(
    level: Level,
    observed: &Observed,
    surface: &mut Surface,
    larger: &Surface,
    (sigma_px, halvings): (f32, usize),
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
    let evidence = halved_sums(evidence, extent, halvings);
    let evidence = pooled(level, &evidence, sigma_px);
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
    let Disagreement { smoothed, flattened } =
        disagreement(level, observed, (surface, larger), &shares, pixels);
    let Surface { disparity, variance, addition, .. } = surface;
    let rows = disparity.par_rows().zip(variance.par_rows()).zip(addition.par_rows()).enumerate();
    rows.for_each(|(y, ((disparity, variance), addition))| {
        let shares = shares.row(y);
        let [smoothed, flattened] = [&smoothed, &flattened].map(|map| map.row(y >> DISAGREEMENT_HALVINGS));
        let maps = [&larger.disparity, &larger.variance, &larger.addition].map(|map: &Padded| map.row(y));
        for place in (PAD..PAD + observed.columns).filter(|place| shares[*place] > 0.0) {
            let [d, v, places] = maps.map(|map| map[place]);
            let (small, share) = (variance[place], shares[place]);
            let rest = 1.0 - share;
            if !small.is_finite() {
                (disparity[place], variance[place], addition[place]) = (d, v, places);
                continue;
            }
            let cell = PAD + ((place - PAD) >> DISAGREEMENT_HALVINGS);
            let apart = d - disparity[place];
            let chance = (small - v).abs();
            let sure = rest * rest * small + (1.0 - rest * rest) * v.min(small);
            variance[place] = sure + share * rest * (apart * apart - chance).max(0.0);
            disparity[place] += share * (apart - flattened[cell]);
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
    let share = precision * variance;
    let spare = 1.0 - if share < LARGEST_SHARE { share } else { LARGEST_SHARE };
    let away = value - disparity;
    let score = -0.5 * (precision * away * away / spare - logarithm(spare));
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

/// What both sizes disagree by beyond chance, by cells of the halved map.
struct Disagreement {
    /// The mean square, in px^2.
    smoothed: Padded,
    /// The mean of larger less smaller discs, in px.
    flattened: Padded,
}

fn disagreement(
    level: Level,
    observed: &Observed,
    (small, large): (&Surface, &Surface),
    shares: &Padded,
    pixels: f32,
) -> Disagreement {
    const CELL: usize = 1 << DISAGREEMENT_HALVINGS;
    let (rows, columns) = (observed.rows(), observed.columns);
    let cells = || Padded::filled(rows.div_ceil(CELL), columns.div_ceil(CELL), 0.0);
    let [mut weights, mut squared_weights, mut variances, mut squares, mut signed] =
        [(); 5].map(|()| cells());
    let [mut told_weights, mut told] = [(); 2].map(|()| cells());
    let sums = weights.par_rows().zip(squared_weights.par_rows()).zip(variances.par_rows());
    let sums = sums.zip(squares.par_rows()).zip(signed.par_rows());
    let sums = sums.zip(told_weights.par_rows().zip(told.par_rows())).enumerate();
    sums.for_each(
        |(cell_row, (((((weights, squared_weights), variances), squares), signed), (told_weights, told)))| {
            for y in CELL * cell_row..(CELL * (cell_row + 1)).min(rows) {
                let own = PAD..PAD + columns;
                let maps = [
                    shares,
                    &small.disparity,
                    &small.variance,
                    &large.disparity,
                    &large.variance,
                    &observed.value,
                    &observed.precision,
                ];
                let maps = maps.map(|map| &map.row(y)[own.clone()]);
                let out = [&mut *weights, squared_weights, variances, squares, signed, told_weights, told];
                dispatch!(level, _simd => add_disagreement::<CELL>(maps, out.map(|cells| &mut cells[PAD..])));
            }
        },
    );
    let [weights, squared_weights, variances, mut squares, mut signed] =
        [weights, squared_weights, variances, squares, signed]
            .map(|map| pooled(level, &map, DISAGREEMENT_PX));
    let [told_weights, told] = [told_weights, told].map(|map| pooled(level, &map, DISAGREEMENT_PX));
    squares.par_rows().zip(signed.par_rows()).enumerate().for_each(|(y, (squares, signed))| {
        let sums = weights.row(y).iter().zip(squared_weights.row(y)).zip(variances.row(y));
        let sums = sums.zip(told_weights.row(y).iter().zip(told.row(y)));
        for ((square, mean), (((weight, squared_weight), variance), (told_weight, told))) in
            squares.iter_mut().zip(signed).zip(sums)
        {
            if *weight > 0.0 {
                // Differences in one of the smaller discs are one; squared weights of a Gaussian
                // sum to half of what weights do.
                let independent = (2.0 * weight / squared_weight * weight / pixels).max(1.0);
                let variance = variance / weight;
                // The positive part of James and Stein's (1961) estimate: what the scatter explains
                // of a mean.
                *mean /= weight;
                let scatter = *square / weight + variance - *mean * *mean;
                let by_chance = scatter.max(variance) / independent;
                let left = (1.0 - by_chance / (*mean * *mean).max(f32::MIN_POSITIVE)).max(0.0);
                *mean *= left;
                // Squares of a Gaussian variable scatter by the root of 2 of their mean.
                let excess = *square / weight - *mean * *mean;
                // The larger disc's part of it: by how much more it misses what it does not know.
                let more = if *told_weight > 0.0 { told / told_weight } else { 0.0 };
                let of_square = 2.0 / independent * variance * variance;
                let of_more = if *told_weight > 0.0 { 2.0 / told_weight } else { 0.0 };
                let chance = CHANCE_SIGMAS * (of_square + of_more).sqrt();
                *square = (0.5 * (excess + more - chance)).clamp(0.0, excess.max(0.0)) + left * by_chance;
            } else {
                (*square, *mean) = (0.0, 0.0);
            }
        }
    });
    Disagreement { smoothed: squares, flattened: signed }
}

/// Adds to the cells of a row, weighted by the squared shares of the larger discs over the squared
/// variances by chance: one, these weights, the variance of the difference of both surfaces by
/// chance, what its square exceeds that by, and the difference.
#[inline(always)]
fn add_disagreement<const CELL: usize>(maps: [&[f32]; 7], mut out: [&mut [f32]; 7]) {
    for start in (0..maps[0].len()).step_by(CELL) {
        let [p, d, v, e, w, values, precisions] = maps.map(|map| &map[start..(start + CELL).min(map.len())]);
        let mut sums = [0.0_f32; 7];
        for i in 0..p.len() {
            let known = p[i] > 0.0 && v[i] < f32::INFINITY;
            let chance = if known { (v[i] - w[i]).max(LEAST_CHANCE * v[i]) } else { 1.0 };
            let share = p[i] * (USUAL_CHANCE / chance);
            let weight = if known { share * share } else { 0.0 };
            let apart = if known { e[i] - d[i] } else { 0.0 };
            let most = LARGEST_DIFFERENCE * chance.sqrt();
            let apart = if apart > most {
                most
            } else if apart < -most {
                -most
            } else {
                apart
            };
            sums[0] += weight;
            sums[1] += weight * weight;
            sums[2] += weight * chance;
            sums[3] += weight * (apart * apart - chance);
            sums[4] += weight * apart;
            let precision = precisions[i];
            let observed = known && precision > 0.0;
            let most = LARGEST_DIFFERENCE / precision.sqrt();
            let away = values[i] - d[i];
            let away = if away > most {
                most
            } else if away < -most {
                -most
            } else {
                away
            };
            let spare = |variance: f32| {
                let share = precision * variance;
                1.0 - if share < LARGEST_SHARE { share } else { LARGEST_SHARE }
            };
            let (small, large) = (spare(v[i]), spare(w[i]));
            let (misses_small, misses_large) = (away / small, (away - apart) / large);
            let more =
                misses_large * misses_large - misses_small * misses_small - (w[i] / large - v[i] / small);
            let weight = if observed { p[i] * p[i] * precision / v[i] } else { 0.0 };
            sums[5] += weight;
            sums[6] += if observed { weight * more } else { 0.0 };
        }
        for (out, sum) in out.iter_mut().zip(sums) {
            out[start / CELL] += sum;
        }
    }
}
