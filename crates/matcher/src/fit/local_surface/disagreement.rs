//! What discs of two sizes disagree by beyond chance.
//!
//! Relief that is small against the noise of single observations changes predictions by little, and
//! then the larger disc smooths it away. But it makes both sizes disagree everywhere: what the mean
//! of the squared differences over many pixels exceeds chance by is added to the variance, times
//! p^2. A curved surface is flattened by the larger disc, everywhere alike: the mean of the
//! differences over many pixels, as far as chance does not explain it, is taken off. Both means are
//! weighted by p^2: they are asked where the larger disc is taken.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::observed::{Observed, one_less_leverage};
use super::pooling::{CELL, pooled_cells};
use super::surface::Surface;
use crate::fit::padded::{PAD, Padded};

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

/// What both sizes disagree by beyond chance, by cells.
pub(super) struct Disagreement {
    /// The mean square, in px^2.
    pub(super) smoothed: Padded,
    /// The mean of larger less smaller discs, in px.
    pub(super) flattened: Padded,
}

/// Sums over the pixels of a cell or more: weights, their squares, and weighted, the variances by
/// chance of the differences of both sizes, what the squares of these exceed that by, and the
/// differences; then the weights of observations, and weighted, by how much more of its square the
/// larger disc misses than chance explains.
type Sums = [f32; 7];

/// The disagreement of `small` and `large` discs, of which the large ones have these `shares`.
/// `pixels` is the number of pixels of the small ones.
pub(super) fn disagreement(
    level: Level,
    observed: &Observed,
    small: &Surface,
    large: &Surface,
    shares: &Padded,
    pixels: f32,
) -> Disagreement {
    let (rows, columns) = (observed.rows(), observed.columns);
    let (down, across) = (rows.div_ceil(CELL), columns.div_ceil(CELL));
    let sums_of_row = |cell_row: usize| {
        let mut sums: Vec<Sums> = vec![[0.0; 7]; across];
        for y in CELL * cell_row..(CELL * (cell_row + 1)).min(rows) {
            let maps = [
                shares,
                &small.disparity,
                &small.variance,
                &large.disparity,
                &large.variance,
                &observed.value,
                &observed.precision,
            ];
            let maps = maps.map(|map| &map.row(y)[PAD..PAD + columns]);
            dispatch!(level, _simd => add_disagreement(maps, &mut sums));
        }
        sums
    };
    let sums: Vec<Vec<Sums>> = (0..down).into_par_iter().map(sums_of_row).collect();
    let sums: [Padded; 7] = std::array::from_fn(|index| {
        let mut map = Padded::filled(down, across, 0.0);
        let rows = map.par_rows().zip(&sums);
        rows.for_each(|(map, row)| {
            map[PAD..].iter_mut().zip(row).for_each(|(cell, sums)| *cell = sums[index])
        });
        pooled_cells(level, &map)
    });
    let nothing = Padded::filled(down, across, 0.0);
    let mut found = Disagreement { smoothed: nothing.clone(), flattened: nothing };
    let rows = found.smoothed.par_rows().zip(found.flattened.par_rows()).enumerate();
    rows.for_each(|(y, (smoothed, flattened))| {
        let sums = sums.each_ref().map(|map| map.row(y));
        for place in PAD..PAD + across {
            (smoothed[place], flattened[place]) = beyond_chance(sums.map(|row| row[place]), pixels);
        }
    });
    found
}

/// The mean square that is added to the variance and the mean that is taken off, by these sums.
fn beyond_chance(
    [weight, squared_weight, variance, square, difference, observed_weight, excess_misfit]: Sums,
    pixels: f32,
) -> (f32, f32) {
    if weight <= 0.0 {
        return (0.0, 0.0);
    }
    // Differences in one of the smaller discs are one; squared weights of a Gaussian sum to half of
    // what weights do.
    let independent = (2.0 * weight / squared_weight * weight / pixels).max(1.0);
    let (variance, square, mean) = (variance / weight, square / weight, difference / weight);
    // The positive part of James and Stein's (1961) estimate: what the scatter explains of a mean.
    let scatter = square + variance - mean * mean;
    let by_chance = scatter.max(variance) / independent;
    let left = (1.0 - by_chance / (mean * mean).max(f32::MIN_POSITIVE)).max(0.0);
    let mean = mean * left;
    // Squares of a Gaussian variable scatter by the root of 2 of their mean.
    let excess = square - mean * mean;
    // The larger disc's part of it: by how much more it misses what it does not know.
    let (more, of_more) = if observed_weight > 0.0 {
        (excess_misfit / observed_weight, 2.0 / observed_weight)
    } else {
        (0.0, 0.0)
    };
    let of_square = 2.0 / independent * variance * variance;
    let chance = CHANCE_SIGMAS * (of_square + of_more).sqrt();
    ((0.5 * (excess + more - chance)).clamp(0.0, excess.max(0.0)) + left * by_chance, mean)
}

/// Adds the pixels of a row to its cells. Differences are weighted by the squared shares of the
/// larger discs over the squared variances by chance.
#[inline(always)]
fn add_disagreement(maps: [&[f32]; 7], cells: &mut [Sums]) {
    for (cell, sums) in cells.iter_mut().enumerate() {
        let own = CELL * cell..(CELL * (cell + 1)).min(maps[0].len());
        let [p, d, v, e, w, values, precisions] = maps.map(|map| &map[own.clone()]);
        let mut more_sums: Sums = [0.0; 7];
        for i in 0..p.len() {
            let known = p[i] > 0.0 && v[i] < f32::INFINITY;
            let chance = if known { (v[i] - w[i]).max(LEAST_CHANCE * v[i]) } else { 1.0 };
            let share = p[i] * (USUAL_CHANCE / chance);
            let weight = if known { share * share } else { 0.0 };
            let difference = if known { e[i] - d[i] } else { 0.0 };
            let difference = limited(difference, LARGEST_DIFFERENCE * chance.sqrt());
            let precision = precisions[i];
            let away = limited(values[i] - d[i], LARGEST_DIFFERENCE / precision.sqrt());
            let (small, large) = (one_less_leverage(precision, v[i]), one_less_leverage(precision, w[i]));
            let (misses_small, misses_large) = (away / small, (away - difference) / large);
            let more =
                misses_large * misses_large - misses_small * misses_small - (w[i] / large - v[i] / small);
            let observed = known && precision > 0.0;
            let observed_weight = if observed { p[i] * p[i] * precision / v[i] } else { 0.0 };
            let terms = [
                weight,
                weight * weight,
                weight * chance,
                weight * (difference * difference - chance),
                weight * difference,
                observed_weight,
                if observed { observed_weight * more } else { 0.0 },
            ];
            more_sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        sums.iter_mut().zip(more_sums).for_each(|(sum, more)| *sum += more);
    }
}

/// `value`, but at most `most` from zero.
#[inline(always)]
fn limited(value: f32, most: f32) -> f32 {
    if value > most {
        most
    } else if value < -most {
        -most
    } else {
        value
    }
}
