//! Pooling: a variance that no single pixel shows, from many pixels together.
//!
//! Each pixel has an estimate that is far noisier than its value. The means over long pools through a pixel,
//! along its column and along its row, tell the variance in either; the mean over the square around it tells
//! the variance in general. The pixel's value is the product of the first two over the last. So stripes in
//! either direction keep their place, and what is the same everywhere is found by all pixels.

use rayon::prelude::*;

use crate::refine::padded::{PAD, Padded};
use crate::refine::planes::SurfacePlanes;

/// Pools reach this far to both sides, in px.
pub(super) const POOL_REACH: usize = 40;
/// A square is significant if its mean is this many of its standard deviations; chance lets it once in a hundred
/// and fifty.
const SIGNIFICANT_SIGMAS: f64 = 2.5;
/// Rows that are worked through together.
const BAND_ROWS: usize = 64;

/// An estimate, or the sum of several, weighted by one over their variances.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Excess {
    weighted: f64,
    weight: f64,
}

impl Excess {
    pub(super) fn new(value: f64, variance: f64) -> Self {
        Self { weighted: value / variance, weight: 1.0 / variance }
    }

    fn add(&mut self, other: &Self) {
        self.weighted += other.weighted;
        self.weight += other.weight;
    }

    fn subtract(&mut self, other: &Self) {
        self.weighted -= other.weighted;
        self.weight -= other.weight;
    }

    fn mean(&self) -> f64 {
        self.weighted / self.weight
    }

    /// The standard deviation of the mean if every `alike` summands are one.
    fn deviation(&self, alike: usize) -> f64 {
        (alike as f64 / self.weight).sqrt()
    }
}

/// The variance at each pixel, from the estimates `own` of all pixels, by place in the padded row and row.
/// Estimates are alike within `alike_px` along rows and columns. NaN where none is significant.
pub(super) fn pooled(
    surface: &SurfacePlanes,
    alike_px: usize,
    own: impl Fn(usize, usize) -> Excess + Sync,
) -> Padded {
    let rows = surface.rows();
    let places = surface.variance.row(0).len();
    let mut found = Padded::filled(rows, places - 2 * PAD, f32::NAN);
    let own: Vec<Vec<Excess>> =
        (0..rows).into_par_iter().map(|y| (PAD..places - PAD).map(|place| own(place, y)).collect()).collect();
    found.par_rows().chunks(BAND_ROWS).enumerate().for_each(|(band, mut found)| {
        let first = band * BAND_ROWS;
        let mut columns = vec![Excess::default(); places - 2 * PAD];
        let add = |columns: &mut [Excess], y: usize| {
            columns.iter_mut().zip(&own[y]).for_each(|(column, pixel)| column.add(pixel));
        };
        (first.saturating_sub(POOL_REACH)..rows.min(first + POOL_REACH)).for_each(|y| add(&mut columns, y));
        for (y, found) in (first..).zip(&mut found) {
            if y + POOL_REACH < rows {
                add(&mut columns, y + POOL_REACH);
            }
            if y > first && y > POOL_REACH {
                let gone = &own[y - POOL_REACH - 1];
                columns.iter_mut().zip(gone).for_each(|(column, pixel)| column.subtract(pixel));
            }
            pool_row(&own[y], &columns, alike_px, &mut found[PAD..places - PAD]);
        }
    });
    found
}

/// The same for a row whose estimates are `own`; the sums of the columns' pools are known.
fn pool_row(own: &[Excess], columns: &[Excess], alike_px: usize, found: &mut [f32]) {
    let (mut line, mut square) = (Excess::default(), Excess::default());
    own.iter().take(POOL_REACH).for_each(|pixel| line.add(pixel));
    columns.iter().take(POOL_REACH).for_each(|column| square.add(column));
    for (x, found) in found.iter_mut().enumerate() {
        if let (Some(pixel), Some(column)) = (own.get(x + POOL_REACH), columns.get(x + POOL_REACH)) {
            line.add(pixel);
            square.add(column);
        }
        if x > POOL_REACH {
            line.subtract(&own[x - POOL_REACH - 1]);
            square.subtract(&columns[x - POOL_REACH - 1]);
        }
        *found = at_crossing(&columns[x], &line, &square, alike_px) as f32;
    }
}

/// The variance where two pools cross within a square.
fn at_crossing(column: &Excess, line: &Excess, square: &Excess, alike_px: usize) -> f64 {
    let mean = square.mean();
    let significant = mean > SIGNIFICANT_SIGMAS * square.deviation(alike_px * alike_px);
    // Pools that could not tell the square's mean from nothing cannot tell where it is.
    let pools_tell = mean > column.deviation(alike_px) && mean > line.deviation(alike_px);
    match (significant, pools_tell) {
        (false, _) => f64::NAN,
        (true, false) => mean,
        (true, true) => column.mean().max(0.0) * line.mean().max(0.0) / mean,
    }
}
