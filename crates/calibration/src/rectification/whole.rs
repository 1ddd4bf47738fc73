//! From raw frames to the volume, one whole frame at a time: for frames that have poses of their own, and for
//! turns that lead from one rectified row through many raw ones.

use std::array;
use std::sync::Mutex;

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::frame_kernels::{self, FrameTaps, Places, STRIP};
use super::kernels::{self, LANES, Pixel};
use super::spline::{PAD, filter_gain, mirrored};
use super::view::View;
use super::{FramePose, Mapping};
use epirig_core::spline::quintic::TAPS;

/// Samples whole frames, each in its own view. Pixels outside of a frame take the value of its border.
#[derive(Debug)]
pub(super) struct WholeFrames {
    /// The view of each frame, or the one view of all.
    views: Vec<View>,
    /// Number of frames that have poses; `None`: all have one view.
    posed: Option<usize>,
    /// Rows and columns of the raw frames.
    raw: (usize, usize),
    /// Coefficients of frames, not in use.
    planes: Mutex<Vec<Vec<f32>>>,
    level: Level,
}

/// Buffers for eight raw rows.
#[derive(Debug, Default)]
struct RawRows {
    values: Vec<f32>,
    pixels: Vec<Pixel>,
}

/// Buffers for a rectified row.
#[derive(Debug, Default)]
struct RectifiedRow {
    places: Places,
    across: Vec<f32>,
    down: Vec<f32>,
}

impl WholeFrames {
    /// Frames of these poses; without poses all are in the mean orientation.
    pub(super) fn new(mapping: &Mapping, poses: &[FramePose]) -> Self {
        Self {
            views: mapping.views(poses),
            posed: (!poses.is_empty()).then_some(poses.len()),
            raw: (mapping.raw_rows, mapping.raw_columns),
            planes: Mutex::default(),
            level: Level::new(),
        }
    }

    /// Number of frames that have poses; `None`: any number of frames goes.
    pub(super) fn posed(&self) -> Option<usize> {
        self.posed
    }

    /// Values from one row of a padded frame to the next: whole vectors.
    pub(super) fn stride(raw_columns: usize) -> usize {
        raw_columns.saturating_add(2 * PAD + LANES - 1) / LANES * LANES
    }

    /// Makes all `rows` of the rectified frame with the pose number `index`, in counts. `load` gives a raw row,
    /// corrected.
    pub(super) fn make<'a>(
        &self,
        index: usize,
        counts_per_dn: f32,
        load: impl Fn(usize, &mut [f32]) + Sync,
        rows: impl IndexedParallelIterator<Item = &'a mut [u16]>,
    ) {
        let taken = self.planes.lock().ok().and_then(|mut free| free.pop());
        let mut coefficients = taken.unwrap_or_default();
        self.find_coefficients(load, &mut coefficients);
        let stride = Self::stride(self.raw.1);
        let view = &self.views[if self.posed.is_some() { index } else { 0 }];
        let factor = counts_per_dn / filter_gain();
        rows.enumerate().for_each_init(RectifiedRow::default, |buffers, (y, out)| {
            let RectifiedRow { places, across, down } = buffers;
            let size = out.len();
            places.starts.resize(size, 0);
            places.right.resize(size, 0.0);
            places.down.resize(size, 0.0);
            across.resize(TAPS * size, 0.0);
            down.resize(TAPS * size, 0.0);
            if view.is_unfolded(y, size) {
                dispatch!(self.level, _simd => frame_kernels::places::<false>(view, y, stride, places));
            } else {
                dispatch!(self.level, _simd => frame_kernels::places::<true>(view, y, stride, places));
            }
            dispatch!(self.level, _simd => kernels::weight_rows(&places.right, 1.0, across));
            dispatch!(self.level, _simd => kernels::weight_rows(&places.down, factor, down));
            let taps =
                FrameTaps { coefficients: &coefficients, stride, starts: &places.starts, across, down };
            dispatch!(self.level, _simd => frame_kernels::sample(taps, out));
        });
        if let Ok(mut free) = self.planes.lock() {
            free.push(coefficients);
        }
    }

    /// Fills `plane` with the coefficients of a frame, mirrored by [`PAD`] pixels on each side.
    fn find_coefficients(&self, load: impl Fn(usize, &mut [f32]) + Sync, plane: &mut Vec<f32>) {
        let (rows, columns) = self.raw;
        let stride = Self::stride(columns);
        plane.resize((rows + 2 * PAD) * stride, 0.0);
        let inner = &mut plane[PAD * stride..(PAD + rows) * stride];
        let groups = inner.par_chunks_mut(LANES * stride).enumerate();
        groups.for_each_init(RawRows::default, |RawRows { values, pixels }, (group, target)| {
            values.resize(LANES * columns, 0.0);
            pixels.resize(stride, [0.0; LANES]);
            for (lane, row) in values.chunks_exact_mut(columns.max(1)).enumerate() {
                // The last row stands in for missing ones; their results are dropped.
                load((group * LANES + lane).min(rows - 1), row);
            }
            let lines: [&[f32]; LANES] = array::from_fn(|lane| &values[lane * columns..][..columns]);
            dispatch!(self.level, _simd => kernels::interleave(lines, &mut pixels[PAD..PAD + columns]));
            for outside in (0..PAD).chain(PAD + columns..stride) {
                pixels[outside] = pixels[PAD + mirrored(outside as isize - PAD as isize, columns)];
            }
            dispatch!(self.level, _simd => kernels::filter_row(pixels));
            for (lane, row) in target.chunks_exact_mut(stride).enumerate() {
                dispatch!(self.level, _simd => frame_kernels::separate(pixels, lane, row));
            }
        });
        for outside in (0..PAD).chain(PAD + rows..rows + 2 * PAD) {
            let source = (PAD + mirrored(outside as isize - PAD as isize, rows)) * stride;
            plane.copy_within(source..source + stride, outside * stride);
        }
        let mut strips: Vec<Vec<&mut [Pixel]>> = Vec::new();
        strips.resize_with(stride.div_ceil(LANES * STRIP), || Vec::with_capacity(rows + 2 * PAD));
        for row in plane.chunks_exact_mut(stride) {
            let pixels = row.as_chunks_mut::<LANES>().0;
            strips.iter_mut().zip(pixels.chunks_mut(STRIP)).for_each(|(strip, part)| strip.push(part));
        }
        strips.par_iter_mut().for_each(|strip| {
            dispatch!(self.level, _simd => frame_kernels::filter_strip(strip));
        });
    }
}
