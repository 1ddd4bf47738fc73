//! Cost aggregation across rows, for weak texture (semi-global matching, Hirschmueller 2008).
//!
//! Surfaces go on from row to row, so a candidate is better if the rows above and below can agree with it at
//! little cost. This is semi-global matching (Hirschmueller 2008, equation 13) along the two vertical paths:
//! with the pixel's own cost C,
//!
//! ```text
//! L(y, k) = C(y, k) + min(L(y-1, k), L(y-1, k-1) + P1, L(y-1, k+1) + P1, min L(y-1, .) + P2) - min L(y-1, .)
//! ```
//!
//! once downwards and once upwards; the aggregated cost is the sum of both less C. On a chain of rows this is
//! exact: but for a constant, it is the least sum of costs and penalties of all ways from the first row to
//! the last that lead through the candidate. What a row does along itself, its mapping or its best
//! candidates, is then found from the aggregated costs.
//!
//! The penalties are what chance makes of costs ([`Penalties`]), so little changes where texture is strong.
//! Costs are held as whole counts of 16 bit, so sums have no rounding. A band of rows is aggregated with a
//! margin of rows above and below it, beyond which paths begin afresh.

use epirig_core::statistics::upper_median;
use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::rows::{BAND_ROWS, sampled_rows};
use crate::options::MatchError;
use epirig_core::volume::Volume;

/// Rows above and below a band whose costs come down to it. On a bowed surface of 1 DN of contrast in 1 DN of
/// noise and 40 frames, 99.9 % of the pixels take the candidate that paths over all rows give them; with half
/// the contrast 97 %.
const MARGIN_ROWS: usize = 16;
/// A band of fewer rows is mostly margin.
const LEAST_BAND_ROWS: usize = 8;
/// Bytes that bands may hold whatever the frames take: little beside a program. Where half of the frames'
/// bytes are more, they may hold as many.
const FREE_BYTES: usize = 32 << 20;

/// Marks a candidate without a cost.
const UNKNOWN: u16 = u16::MAX;
/// Counts of a chance difference, if costs are not too large for it.
const COUNTS_OF_CHANCE: f32 = 16.0;
/// Costs are distinguished up to at least this many typical ones.
const TYPICAL_TOLD_APART: f32 = 64.0;
/// Penalty of a step by one candidate over a chance difference of two costs: so cheap that a surface may
/// slant by a step in each row.
const SMALL_STEP: f32 = 1.0;
/// The same of any larger step. The best of some hundred wrong candidates costs by chance some three of these
/// differences less than they do in the mean; twice that keeps a row from following it.
const LARGE_STEP: f32 = 6.0;

/// The penalties for a change of the candidate from one row to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Penalties {
    /// A step by one candidate, in counts.
    small: u16,
    /// Penalty of any larger step, in counts; far below the limit of 16 bit.
    large: u16,
    /// Size of a count, in the unit of the costs.
    count: f32,
}

impl Penalties {
    /// Penalties where right candidates cost `typical`, the mean square of `samples` deviations.
    ///
    /// Such a mean has a relative standard deviation of sqrt(2 / samples), the difference of two of them
    /// sqrt(4 / samples): the scatter by chance.
    pub(crate) fn of_typical(typical: f32, samples: usize) -> Self {
        let chance = typical * (4.0 / samples as f32).sqrt();
        let coarsest = TYPICAL_TOLD_APART * typical / f32::from(UNKNOWN / 2);
        let count = (chance / COUNTS_OF_CHANCE).max(coarsest).max(f32::MIN_POSITIVE);
        let counts = |factor: f32| (factor * chance / count).round() as u16;
        Self { small: counts(SMALL_STEP), large: counts(LARGE_STEP), count }
    }

    /// The largest cost that is distinguished from larger ones, in counts.
    fn largest_cost(self) -> u16 {
        UNKNOWN - 1 - self.large
    }
}

/// Median cost of the chosen candidates in a few rows, each searched by itself; at least `least`, the
/// smallest significant difference.
pub(crate) fn typical_cost(
    rows: usize,
    least: f32,
    costs_of_row: impl Fn(usize) -> Vec<f32> + Sync + Send,
) -> f32 {
    let costs = sampled_rows(rows).into_par_iter().flat_map_iter(costs_of_row);
    let mut known: Vec<f32> = costs.filter(|cost| !cost.is_nan()).collect();
    upper_median(&mut known).unwrap_or(0.0).max(least)
}

/// How an image is cut into bands, and how many of them may be searched at once so that memory stays bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Bands {
    rows: usize,
    /// Rows of a band without its margins.
    pub(crate) band_rows: usize,
    /// Bands that may be searched at once.
    pub(crate) at_once: usize,
    /// Counts that a band holds.
    pub(crate) band_counts: usize,
}

/// The parameters of aggregation across rows.
pub(crate) struct Aggregation<'a> {
    /// Penalties for differing from the neighbouring rows.
    pub(crate) penalties: Penalties,
    /// Room for the counts of a band.
    pub(crate) room: &'a mut [u16],
}

impl Bands {
    /// Bands of `volume` for this number of candidates.
    ///
    /// # Errors
    /// [`MatchError::TooManyToAggregate`] if not even a band of the fewest rows may be held.
    pub(crate) fn of(volume: &Volume, candidates: usize) -> Result<Self, MatchError> {
        let sample_bytes = if volume.bit_depth() > 8 { 2 } else { 1 };
        let pixels = volume.rows() * volume.columns();
        let budget = (pixels * volume.frames() * sample_bytes / 2).max(FREE_BYTES);
        let row_bytes = candidates * volume.columns() * size_of::<u16>();
        // Costs of the rows and of the margin below them, and path costs of the rows.
        let bytes = |band_rows: usize| (2 * band_rows + MARGIN_ROWS) * row_bytes;
        let mut band_rows = BAND_ROWS;
        while bytes(band_rows) > budget && band_rows > LEAST_BAND_ROWS {
            band_rows /= 2;
        }
        match budget / bytes(band_rows) {
            0 => Err(MatchError::TooManyToAggregate {
                candidates,
                limit: budget / (bytes(band_rows) / candidates),
            }),
            at_once => {
                let band_counts = bytes(band_rows) / size_of::<u16>();
                Ok(Self { rows: volume.rows(), band_rows, at_once, band_counts })
            }
        }
    }

    /// The bands in their order, in groups that may be searched at once.
    pub(crate) fn groups(self) -> Vec<Vec<RowBand>> {
        let starts: Vec<usize> = (0..self.rows).step_by(self.band_rows).collect();
        let band = |&y: &usize| RowBand::with_margins(y..(y + self.band_rows).min(self.rows), self.rows);
        starts.chunks(self.at_once).map(|group| group.iter().map(band).collect()).collect()
    }
}

/// Rows that are searched together, and those of them that are answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RowBand {
    pub(crate) searched: Range<usize>,
    pub(crate) answered: Range<usize>,
}

impl RowBand {
    /// Rows `answered` alone.
    pub(crate) fn alone(answered: Range<usize>) -> Self {
        Self { searched: answered.clone(), answered }
    }

    /// Rows `answered` with their margins in an image of `rows`.
    fn with_margins(answered: Range<usize>, rows: usize) -> Self {
        let searched = answered.start.saturating_sub(MARGIN_ROWS)..(answered.end + MARGIN_ROWS).min(rows);
        Self { searched, answered }
    }
}

/// Costs of the rows of a band, to be aggregated; rows come in their order.
pub(crate) struct PathAggregation<'a> {
    level: Level,
    penalties: Penalties,
    columns: usize,
    candidates: usize,
    band: RowBand,
    /// Rows that have come.
    came: usize,
    /// Costs of the row that comes, in counts: candidates x columns.
    coming: Vec<u16>,
    /// Sums of the path that came down to the last row, and the path costs of that row.
    path: Path,
    /// Costs of the rows from the first answered one on: rows x candidates x columns.
    costs: &'a mut [u16],
    /// Path costs of the answered rows: rows x candidates x columns.
    path_costs: &'a mut [u16],
}

impl<'a> PathAggregation<'a> {
    pub(crate) fn new(
        band: RowBand,
        candidates: usize,
        columns: usize,
        aggregation: Aggregation<'a>,
    ) -> Self {
        let Aggregation { penalties, room } = aggregation;
        let size = candidates * columns;
        let (costs, room) = room.split_at_mut(size * (band.searched.end - band.answered.start));
        Self {
            level: Level::new(),
            penalties,
            columns,
            candidates,
            came: band.searched.start,
            coming: vec![UNKNOWN; size],
            path: Path::new(candidates, columns, penalties),
            costs,
            path_costs: &mut room[..size * band.answered.len()],
            band,
        }
    }

    /// Costs under candidate `k` of the current row, from column `first` on. Columns that are not given, and
    /// those of NaN, have no cost.
    pub(crate) fn hold(&mut self, k: usize, first: usize, costs: &[f32]) {
        let place = k * self.columns + first;
        let out = &mut self.coming[place..place + costs.len()];
        let (scale, dearest) = (1.0 / self.penalties.count, f32::from(self.penalties.largest_cost()));
        dispatch!(self.level, simd => to_counts(simd, costs, scale, dearest, out));
    }

    /// All costs of the row have been held.
    pub(crate) fn row_done(&mut self) {
        let y = self.came;
        self.came += 1;
        let size = self.coming.len();
        let RowBand { answered, .. } = &self.band;
        let place = |y: usize| (y - answered.start) * size..(y - answered.start + 1) * size;
        if y < answered.end {
            let path_costs = self.path.step(self.level, &self.coming);
            if y >= answered.start {
                self.path_costs[place(y)].copy_from_slice(path_costs);
            }
        }
        if y >= answered.start {
            self.costs[place(y)].copy_from_slice(&self.coming);
        }
    }

    /// The aggregated costs of the answered rows, when all have come.
    pub(crate) fn aggregated(self) -> Aggregated<'a> {
        let size = self.coming.len();
        let mut path = Path::new(self.candidates, self.columns, self.penalties);
        for (index, costs) in self.costs.chunks_exact(size).enumerate().rev() {
            let from_below = path.step(self.level, costs);
            if index < self.band.answered.len() {
                let both = &mut self.path_costs[index * size..(index + 1) * size];
                dispatch!(self.level, simd => add(simd, from_below, both));
            }
        }
        Aggregated(self)
    }
}

/// A path along all columns at once.
struct Path {
    penalties: Penalties,
    columns: usize,
    /// L of the last row, a row of `columns` for each candidate, between two unknown ones.
    sums: Vec<u16>,
    /// Least L of each column.
    low: Vec<u16>,
    /// Path costs of the current row: L - C, from 0 to the penalty of a large step.
    path_costs: Vec<u16>,
}

impl Path {
    fn new(candidates: usize, columns: usize, penalties: Penalties) -> Self {
        let mut sums = vec![UNKNOWN; (candidates + 2) * columns];
        sums[columns..(candidates + 1) * columns].fill(0);
        Self { penalties, columns, sums, low: vec![0; columns], path_costs: vec![0; candidates * columns] }
    }

    /// Continues to a row with these costs; gives its path costs.
    fn step(&mut self, level: Level, costs: &[u16]) -> &[u16] {
        dispatch!(level, simd => self.step_rows(simd, costs));
        &self.path_costs
    }

    #[inline(always)]
    fn step_rows<S: Simd>(&mut self, _simd: S, costs: &[u16]) {
        let n = self.columns;
        let Penalties { small, large, .. } = self.penalties;
        let low = &self.low[..n];
        for (path_costs, sums) in self.path_costs.chunks_exact_mut(n).zip(self.sums.windows(3 * n).step_by(n))
        {
            let (before, same, after) = (&sums[..n], &sums[n..2 * n], &sums[2 * n..3 * n]);
            let path_costs = &mut path_costs[..n];
            for x in 0..n {
                let beside = before[x].min(after[x]).saturating_add(small);
                let any = low[x].saturating_add(large);
                path_costs[x] = same[x].min(beside).min(any) - low[x];
            }
        }
        let low = &mut self.low[..n];
        low.fill(UNKNOWN);
        let rows = costs.chunks_exact(n).zip(self.path_costs.chunks_exact(n));
        for (sums, (costs, path_costs)) in self.sums[n..].chunks_exact_mut(n).zip(rows) {
            let (sums, costs, path_costs) = (&mut sums[..n], &costs[..n], &path_costs[..n]);
            for x in 0..n {
                sums[x] = costs[x].saturating_add(path_costs[x]);
                low[x] = low[x].min(sums[x]);
            }
        }
    }
}

#[inline(always)]
fn to_counts<S: Simd>(_simd: S, costs: &[f32], scale: f32, dearest: f32, out: &mut [u16]) {
    let count = costs.len();
    let out = &mut out[..count];
    for x in 0..count {
        let counts = costs[x] * scale + 0.5;
        let counts = if counts < dearest { counts } else { dearest };
        // A number of at most 16 bit, made through 32 bit: that is one instruction.
        let whole = counts as i32 as u16;
        out[x] = if costs[x].is_nan() { UNKNOWN } else { whole };
    }
}

#[inline(always)]
fn add<S: Simd>(_simd: S, values: &[u16], out: &mut [u16]) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += value;
    }
}

/// Aggregated costs of the answered rows.
pub(crate) struct Aggregated<'a>(PathAggregation<'a>);

impl Aggregated<'_> {
    /// The rows.
    pub(crate) fn rows(&self) -> Range<usize> {
        self.0.band.answered.clone()
    }

    fn place(&self, y: usize, k: usize, x: usize) -> usize {
        ((y - self.0.band.answered.start) * self.0.candidates + k) * self.0.columns + x
    }

    /// Aggregated costs of row `y` under candidate `k`, from column `first` on; NaN where unknown.
    pub(crate) fn copy(&self, y: usize, k: usize, first: usize, out: &mut [f32]) {
        let place = self.place(y, k, first);
        let places = place..place + out.len();
        let (costs, path_costs) = (&self.0.costs[places.clone()], &self.0.path_costs[places]);
        let count = self.0.penalties.count;
        dispatch!(self.0.level, simd => to_costs(simd, costs, path_costs, count, out));
    }

    /// The candidate's own cost, which must be known; as much as can be held if it is larger.
    pub(crate) fn own(&self, y: usize, k: usize, x: usize) -> f32 {
        f32::from(self.0.costs[self.place(y, k, x)]) * self.0.penalties.count
    }
}

#[inline(always)]
fn to_costs<S: Simd>(_simd: S, costs: &[u16], path_costs: &[u16], count: f32, out: &mut [f32]) {
    let length = out.len();
    let (costs, path_costs) = (&costs[..length], &path_costs[..length]);
    for x in 0..length {
        let aggregated = (u32::from(costs[x]) + u32::from(path_costs[x])) as f32 * count;
        out[x] = if costs[x] == UNKNOWN { f32::NAN } else { aggregated };
    }
}

#[cfg(test)]
mod scenes;
#[cfg(test)]
mod tests;
