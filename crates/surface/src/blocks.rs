//! The standard deviation of a fit to pixels whose errors are correlated.
//!
//! Windows of the matcher overlap, so neighbours share their errors, and sigma over the root of the number of
//! pixels is far too small. The field is cut into blocks larger than the correlation length, and each block
//! is left out in turn. The scatter of the results gives their standard deviation, whatever the errors within
//! a block are like (the grouped jackknife of Quenouille and Tukey).

use rayon::prelude::*;

use super::normal::{Normal, Solution};
use epirig_core::grid::Grid;

/// Pixels are independent beyond the distance at which the correlation falls below this. The rest beyond it,
/// and the scatter of the correlation in a field of some hundred independent patches, are of this size.
const VANISHED: f64 = 0.1;
/// Width of a block over the reach of the errors ...
const BLOCK_OVER_REACH: usize = 4;
/// ... unless that leaves fewer blocks than this along a side; they are at least twice as wide.
const BLOCKS_ALONG: usize = 4;
/// Most blocks along a side: a thousand blocks give a standard deviation to 2 %.
const MOST_ALONG: usize = 32;

/// The correlation of the errors of neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    /// Correlation of pixels 0, 1, 2 ... columns apart, up to where it vanishes; the first is 1.
    pub along_x: Vec<f64>,
    /// The same for rows.
    pub along_y: Vec<f64>,
}

impl Correlation {
    /// Of a field whose values scatter about 0; NaN does not count. Lags up to an eighth of the field are
    /// looked at, beyond which too few independent parts would be left.
    pub fn of(residual: &Grid<f32>) -> Self {
        let (rows, columns) = (residual.rows(), residual.columns());
        Self {
            along_x: until_vanished(columns, |lag| {
                let pairs = |y| products(&residual.row(y)[..columns - lag], &residual.row(y)[lag..]);
                (0..rows).into_par_iter().map(pairs).collect()
            }),
            along_y: until_vanished(rows, |lag| {
                let pairs = |y| products(residual.row(y - lag), residual.row(y));
                (lag..rows).into_par_iter().map(pairs).collect()
            }),
        }
    }

    /// Correlation length of the errors, in px: pixels farther apart are independent. 1 if neighbours are.
    pub fn reach_px(&self) -> usize {
        self.along_x.len().max(self.along_y.len())
    }

    /// How many pixels along a row or a column, the longer of the two, are worth one independent one: the sum
    /// of the correlation over all lags.
    pub fn length_px(&self) -> f64 {
        let sum = |along: &[f64]| 2.0 * along.iter().sum::<f64>() - 1.0;
        sum(&self.along_x).max(sum(&self.along_y))
    }

    /// The share of a mean's variance that blocks of this side see; pairs of pixels on two sides of a border
    /// between blocks are missed.
    fn seen_by(&self, side: usize) -> f64 {
        let share = |along: &[f64]| {
            let both = |lag: usize| if lag == 0 { 1.0 } else { 2.0 };
            let all: f64 = along.iter().enumerate().map(|(lag, value)| both(lag) * value).sum();
            let inside = |lag: usize| (1.0 - lag as f64 / side as f64).max(0.0);
            let seen: f64 =
                along.iter().enumerate().map(|(lag, value)| both(lag) * inside(lag) * value).sum();
            seen / all
        };
        share(&self.along_x) * share(&self.along_y)
    }
}

/// The correlation at lags 0, 1, 2 ... of a field with `size` pixels along it, up to where it vanishes. `of`
/// gives the [products](products) of each row at a lag: they are summed in the order of the rows, so that the
/// number of threads changes nothing.
fn until_vanished(size: usize, of: impl Fn(usize) -> Vec<(f64, f64)>) -> Vec<f64> {
    let correlation = |lag: usize| {
        let add = |(a, b): (f64, f64), (c, d): (f64, f64)| (a + c, b + d);
        let (products, squares) = of(lag).into_iter().fold((0.0, 0.0), add);
        if squares > 0.0 { products / squares } else { 0.0 }
    };
    let known = (1..(size / 8).max(2)).map(correlation).take_while(|value| *value >= VANISHED);
    std::iter::once(1.0).chain(known).collect()
}

/// The sum of a b, and that of (a^2 + b^2) / 2, over all pairs of which both are known.
fn products(one: &[f32], other: &[f32]) -> (f64, f64) {
    /// Sums that do not wait for each other.
    const LANES: usize = 8;
    let (mut sums, mut squares) = ([0.0; LANES], [0.0; LANES]);
    for (one, other) in one.chunks(LANES).zip(other.chunks(LANES)) {
        for (lane, (&a, &b)) in one.iter().zip(other).enumerate() {
            let (a, b) = (f64::from(a), f64::from(b));
            let known = !(a * b).is_nan();
            sums[lane] += if known { a * b } else { 0.0 };
            squares[lane] += if known { 0.5 * (a * a + b * b) } else { 0.0 };
        }
    }
    (sums.iter().sum(), squares.iter().sum())
}

/// The division of a field into squares.
#[derive(Debug, Clone)]
pub(super) struct Blocks {
    side: usize,
    across: usize,
    sums: Vec<Normal>,
    seen: f64,
}

/// The scatter of a parameter over the left-out blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scatter {
    pub(super) variance: f64,
    /// Number of independent differences behind the variance.
    pub(super) degrees_of_freedom: f64,
}

impl Blocks {
    /// Blocks for a field whose errors reach as far as `correlation` tells.
    pub(super) fn new(rows: usize, columns: usize, correlation: &Correlation) -> Self {
        let reach = correlation.reach_px();
        let wide = (BLOCK_OVER_REACH * reach).min(rows.min(columns) / BLOCKS_ALONG);
        let side = wide.max(2 * reach).max(rows.max(columns).div_ceil(MOST_ALONG));
        let across = columns.div_ceil(side);
        let sums = vec![Normal::empty(); across * rows.div_ceil(side)];
        Self { side, across, sums, seen: correlation.seen_by(side) }
    }

    /// The sums of the block that holds the pixel.
    pub(super) fn of(&mut self, x: usize, y: usize) -> &mut Normal {
        &mut self.sums[y / self.side * self.across + x / self.side]
    }

    /// The sums of all blocks.
    pub(super) fn total(&self) -> Normal {
        let mut total = Normal::empty();
        self.sums.iter().for_each(|sums| total.accumulate(sums, 1.0));
        total
    }

    /// Standard deviations of the first `count` unknowns, whose best values are `best`; `None` for one that a
    /// single block determines alone.
    pub(super) fn scatter(&self, best: &Solution, count: usize) -> Vec<Option<Scatter>> {
        let total = self.total();
        let filled: Vec<&Normal> = self.sums.iter().filter(|sums| sums.pixels > 0).collect();
        let mut squares = vec![0.0; count];
        // Shares of the variance that blocks would have if pixels were independent: they tell how many blocks
        // matter.
        let (mut shares, mut share_squares) = (vec![0.0; count], vec![0.0; count]);
        for sums in &filled {
            let mut rest = total;
            rest.accumulate(sums, -1.0);
            let Some(without) = rest.solve(count) else { return vec![None; count] };
            let influence = &best.inverse * sums.matrix(count) * &best.inverse;
            for index in 0..count {
                squares[index] += (without.values[index] - best.values[index]).powi(2);
                shares[index] += influence[(index, index)];
                share_squares[index] += influence[(index, index)].powi(2);
            }
        }
        let blocks = filled.len() as f64;
        (0..count)
            .map(|index| {
                let mattering = shares[index].powi(2) / share_squares[index];
                // A mean over n blocks leaves n - 1 differences, and a fit of `count` unknowns over all
                // blocks as many fewer.
                let degrees_of_freedom = (mattering - 1.0).min(blocks - count as f64);
                (degrees_of_freedom >= 1.0).then(|| Scatter {
                    variance: (blocks - 1.0) / blocks * squares[index] / self.seen,
                    degrees_of_freedom,
                })
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlation_of_a_moving_average_is_a_triangle() {
        // Means over 5 columns of numbers that repeat never: correlation 1 - lag / 5 along rows, none between
        // rows.
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f32 / (1_u64 << 31) as f32 - 0.5
        };
        let noise: Vec<f32> = (0..300 * 304).map(|_| next()).collect();
        let mut field = Grid::filled(300, 300, 0.0);
        for y in 0..300 {
            for x in 0..300 {
                field.row_mut(y)[x] = noise[y * 304 + x..][..5].iter().sum();
            }
        }
        let found = Correlation::of(&field);
        assert_eq!((found.along_x.len(), found.along_y.len()), (5, 1));
        // 90 000 pixels, 18 000 of them independent: the correlation is known to 0.01.
        for (lag, value) in found.along_x.iter().enumerate() {
            assert!((value - (1.0 - lag as f64 / 5.0)).abs() < 0.03, "{lag}: {value}");
        }
        assert_eq!(found.reach_px(), 5);
        assert!((found.length_px() - 5.0).abs() < 0.15);
        // Blocks of 20 see all of lag 0 and less of others: (5 - 2 * (4*1 + 3*2 + 2*3 + 1*4) / 5 / 20) / 5.
        assert!((found.seen_by(20) - 0.92).abs() < 0.01);
    }
}
