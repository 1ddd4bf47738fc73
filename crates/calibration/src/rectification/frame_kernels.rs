//! The inner loops for one frame at a time. The caller dispatches them, as those for eight frames.
//!
//! Rows are filtered eight at a time, as pixels of eight frames are; down the columns a pixel is eight
//! neighbours of a row. Places are found in f64 and used at once: a table of them for each frame would be
//! several times as large as the frames.

use std::array;

use epirig_core::spline::quintic::{POLES, TAPS};

use super::kernels::{LANES, Pixel, constant_before, count, step};
use super::spline::{BEFORE, PAD};
use super::view::View;

/// Pixels of eight samples that are filtered down the columns together: with 2000 rows they are 1 MB.
pub(super) const STRIP: usize = 16;
/// Least depth of a ray: those from behind the camera go far out of the frame instead.
const NEAREST: f64 = 1e-9;

/// One lane of `pixels` as a row.
#[inline(always)]
pub(super) fn separate(pixels: &[Pixel], lane: usize, row: &mut [f32]) {
    row.iter_mut().zip(pixels).for_each(|(value, pixel)| *value = pixel[lane]);
}

/// The recursive filter down the columns of a strip of at most [`STRIP`] pixels, begun as if the columns went
/// on as they begin and end.
#[inline(always)]
pub(super) fn filter_strip(rows: &mut [&mut [Pixel]]) {
    let mut states = [[[0.0; LANES]; POLES.len()]; STRIP];
    if let Some(row) = rows.first() {
        states.iter_mut().zip(&**row).for_each(|(state, &pixel)| *state = constant_before(pixel));
    }
    for row in rows.iter_mut() {
        row.iter_mut().zip(&mut states).for_each(|(pixel, state)| step(pixel, state));
    }
    if let Some(row) = rows.last() {
        states.iter_mut().zip(&**row).for_each(|(state, &pixel)| *state = constant_before(pixel));
    }
    for row in rows.iter_mut().rev() {
        row.iter_mut().zip(&mut states).for_each(|(pixel, state)| step(pixel, state));
    }
}

/// Where the pixels of one rectified row lie in a frame.
#[derive(Debug, Default)]
pub(super) struct Places {
    /// For each pixel the first of its coefficients in the padded frame.
    pub(super) starts: Vec<u32>,
    /// Its column less the whole part.
    pub(super) right: Vec<f32>,
    /// Its row less the whole part.
    pub(super) down: Vec<f32>,
}

/// Finds the places of the pixels of row `y`; outside of the frame the nearest ones of its border. `FOLDED`:
/// whether rays may lie beyond the fold of the lens, where the one at the fold in the same direction stands
/// for them.
#[inline(always)]
pub(super) fn places<const FOLDED: bool>(view: &View, y: usize, stride: usize, out: &mut Places) {
    // From 2^52 on an f64 has no fraction: the lowest bits of the sum are the number.
    const WHOLE: f64 = 4_503_599_627_370_496.0;
    let [first, second, third] = view.to_ray;
    let at = |row: [f64; 3]| row[1] * y as f64 + row[2];
    let begin = [at(first), at(second), at(third)];
    let first_tap = (PAD - BEFORE) as f64;
    let stride = stride as f64;
    let size = out.starts.len();
    let (starts, right, down) = (&mut out.starts[..size], &mut out.right[..size], &mut out.down[..size]);
    for x in 0..size {
        let t = f64::from(x as i32);
        let depth = (third[0] * t + begin[2]).max(NEAREST);
        let mut a = (first[0] * t + begin[0]) / depth;
        let mut b = (second[0] * t + begin[1]) / depth;
        if FOLDED {
            let shrunk = (view.fold / (a * a + b * b)).sqrt().min(1.0);
            a *= shrunk;
            b *= shrunk;
        }
        let (raw_x, raw_y) = view.lens.pixel(a, b);
        // In this order a place that is no number becomes 0.
        let raw_x = raw_x.max(0.0).min(view.last[0]);
        let raw_y = raw_y.max(0.0).min(view.last[1]);
        let (column, row) = (raw_x.floor(), raw_y.floor());
        let start = (row + first_tap) * stride + (column + first_tap);
        starts[x] = (start + WHOLE).to_bits() as u32;
        right[x] = (raw_x - column) as f32;
        down[x] = (raw_y - row) as f32;
    }
}

/// The coefficients of a padded frame and the weights of the samples of one rectified row.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameTaps<'a> {
    /// Coefficients, rows of `stride` values.
    pub(super) coefficients: &'a [f32],
    /// Values from one row to the next.
    pub(super) stride: usize,
    /// For each sample the first of its coefficients.
    pub(super) starts: &'a [u32],
    /// Weights along the row, as [`weight_rows`](super::kernels::weight_rows) gives them.
    pub(super) across: &'a [f32],
    /// Weights down the columns.
    pub(super) down: &'a [f32],
}

/// Samples of one rectified row, in counts.
#[inline(always)]
pub(super) fn sample(taps: FrameTaps, out: &mut [u16]) {
    let size = out.len();
    let starts = &taps.starts[..size];
    let across: [&[f32]; TAPS] = array::from_fn(|tap| &taps.across[tap * size..][..size]);
    let down: [&[f32]; TAPS] = array::from_fn(|tap| &taps.down[tap * size..][..size]);
    for x in 0..size {
        let start = starts[x] as usize;
        // Eight columns are added up, one vector, of which six are used.
        let mut columns = [0.0; LANES];
        for (j, down) in down.iter().enumerate() {
            let row = &taps.coefficients[start + j * taps.stride..][..LANES];
            for i in 0..LANES {
                columns[i] += down[x] * row[i];
            }
        }
        let mut sum = 0.0;
        for i in 0..TAPS {
            sum += across[i][x] * columns[i];
        }
        out[x] = count(sum);
    }
}
