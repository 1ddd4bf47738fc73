//! The inner loops. The caller dispatches them: they are compiled for each instruction set and chosen at run
//! time.
//!
//! The map is the same for all frames, so eight frames are processed together: a pixel is eight samples, one
//! of each frame, and each operation on a pixel is one vector operation. There are no gathers, and weights
//! are found once for eight frames. Products and sums are not fused, so that the results are the same with
//! every instruction set. The recursive filter runs over these pixels, so only its poles are shared with
//! [`epirig_core::spline`].

use std::array;

use epirig_core::spline::quintic::{POLES, TAPS, weights};

/// Frames that are worked on together.
pub(super) const LANES: usize = 8;
/// The samples of one pixel in as many frames.
pub(super) type Pixel = [f32; LANES];
/// Pixels of a row that are filtered down the columns together: with 150 rows they are 150 kB, which a core's
/// own cache holds.
const BLOCK: usize = 32;

/// The same row of eight frames as pixels.
#[inline(always)]
pub(super) fn interleave<T: Copy + Into<f32>>(rows: [&[T]; LANES], out: &mut [Pixel]) {
    let rows = rows.map(|row| &row[..out.len()]);
    for (x, pixel) in out.iter_mut().enumerate() {
        *pixel = array::from_fn(|lane| rows[lane][x].into());
    }
}

/// Subtracts from each pixel its value of `dark`.
#[inline(always)]
pub(super) fn subtract(row: &mut [Pixel], dark: &[f32]) {
    row.iter_mut().zip(dark).for_each(|(pixel, dark)| pixel.iter_mut().for_each(|value| *value -= dark));
}

/// Multiplies each pixel by its value of `gain`.
#[inline(always)]
pub(super) fn multiply(row: &mut [Pixel], gain: &[f32]) {
    row.iter_mut().zip(gain).for_each(|(pixel, gain)| pixel.iter_mut().for_each(|value| *value *= gain));
}

/// The recursive filter along a row, forth and back, begun as if the row went on as it begins and ends.
#[inline(always)]
pub(super) fn filter_row(row: &mut [Pixel]) {
    let Some(&first) = row.first() else { return };
    let mut states = constant_before(first);
    row.iter_mut().for_each(|pixel| step(pixel, &mut states));
    states = constant_before(row[row.len() - 1]);
    row.iter_mut().rev().for_each(|pixel| step(pixel, &mut states));
}

/// The same down the columns of a buffer of rows of `stride` pixels.
#[inline(always)]
pub(super) fn filter_columns(buffer: &mut [Pixel], stride: usize) {
    let mut states = [[[0.0; LANES]; POLES.len()]; BLOCK];
    for start in (0..stride).step_by(BLOCK) {
        let end = (start + BLOCK).min(stride);
        let mut pass = |rows: &mut dyn Iterator<Item = &mut [Pixel]>| {
            let mut begun = false;
            for row in rows {
                let block = &mut row[start..end];
                if !begun {
                    states
                        .iter_mut()
                        .zip(&*block)
                        .for_each(|(state, &pixel)| *state = constant_before(pixel));
                    begun = true;
                }
                block.iter_mut().zip(&mut states).for_each(|(pixel, state)| step(pixel, state));
            }
        };
        pass(&mut buffer.chunks_exact_mut(stride));
        pass(&mut buffer.chunks_exact_mut(stride).rev());
    }
}

/// State of each pole after a long row of equal pixels.
#[inline(always)]
pub(super) fn constant_before(mut pixel: Pixel) -> [Pixel; POLES.len()] {
    POLES.map(|pole| {
        let sum = 1.0 / (1.0 - pole);
        pixel.iter_mut().for_each(|value| *value *= sum);
        pixel
    })
}

/// One pixel through all poles: y = x + pole * (the y before).
#[inline(always)]
pub(super) fn step(pixel: &mut Pixel, states: &mut [Pixel; POLES.len()]) {
    for (pole, state) in POLES.iter().zip(states) {
        for lane in 0..LANES {
            state[lane] = pixel[lane] + pole * state[lane];
        }
        *pixel = *state;
    }
}

/// The weights for each of the `fractions` times `factor`: all those of the first tap, then of the second,
/// and so on.
#[inline(always)]
pub(super) fn weight_rows(fractions: &[f32], factor: f32, out: &mut [f32]) {
    let count = fractions.len();
    let mut rest = out;
    let rows: [&mut [f32]; TAPS] = array::from_fn(|_| {
        let (row, after) = std::mem::take(&mut rest).split_at_mut(count);
        rest = after;
        row
    });
    for x in 0..count {
        let weights = weights(fractions[x]);
        for tap in 0..TAPS {
            rows[tap][x] = factor * weights[tap];
        }
    }
}

/// The places of the samples of one rectified row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Taps<'a> {
    /// Coefficients, rows of `stride` pixels.
    pub(super) coefficients: &'a [Pixel],
    /// Pixels from one row to the next.
    pub(super) stride: usize,
    /// For each sample the first of its coefficients, ...
    pub(super) starts: &'a [u32],
    /// ... counted from as many pixels before the first that is there.
    pub(super) offset: usize,
    /// Weights along the row, as [`weight_rows`] gives them.
    pub(super) across: &'a [f32],
    /// Weights down the columns.
    pub(super) down: &'a [f32],
}

/// Samples of one rectified row, in counts.
#[inline(always)]
pub(super) fn sample(taps: Taps, out: &mut [[u16; LANES]]) {
    let count = out.len();
    let starts = &taps.starts[..count];
    let across: [&[f32]; TAPS] = array::from_fn(|tap| &taps.across[tap * count..][..count]);
    let down: [&[f32]; TAPS] = array::from_fn(|tap| &taps.down[tap * count..][..count]);
    for x in 0..count {
        let start = starts[x] as usize - taps.offset;
        let mut sum = [0.0; LANES];
        for (j, down) in down.iter().enumerate() {
            let row = &taps.coefficients[start + j * taps.stride..][..TAPS];
            let mut line = [0.0; LANES];
            for i in 0..TAPS {
                for lane in 0..LANES {
                    line[lane] += across[i][x] * row[i][lane];
                }
            }
            for lane in 0..LANES {
                sum[lane] += down[x] * line[lane];
            }
        }
        out[x] = rounded(sum);
    }
}

/// Pixels times `factor`, in counts.
#[inline(always)]
pub(super) fn scale(row: &[Pixel], factor: f32, out: &mut [[u16; LANES]]) {
    for (out, pixel) in out.iter_mut().zip(row) {
        *out = rounded(pixel.map(|value| factor * value));
    }
}

/// The nearest counts that 16 bit hold.
#[inline(always)]
fn rounded(pixel: Pixel) -> [u16; LANES] {
    pixel.map(count)
}

/// The nearest count that 16 bit hold.
#[inline(always)]
pub(super) fn count(value: f32) -> u16 {
    // From 2^23 on an f32 has no fraction, so that the sum is rounded, and its lowest bits are the count.
    const WHOLE: f32 = 8_388_608.0;
    (value.clamp(0.0, 65535.0) + WHOLE).to_bits() as u16
}

/// Each frame's own row out of pixels of counts; there may be fewer than eight frames.
pub(super) fn separate<'a>(row: &[[u16; LANES]], targets: impl Iterator<Item = &'a mut [u16]>) {
    for (lane, target) in targets.enumerate() {
        target.iter_mut().zip(row).for_each(|(out, pixel)| *out = pixel[lane]);
    }
}
