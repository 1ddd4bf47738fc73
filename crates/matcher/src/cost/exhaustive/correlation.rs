//! Normalised correlation of a window along a candidate with a model of it (paper, section 4).
//!
//! The cost is one minus the mean correlation over the frames that see the candidate. The reference frame
//! itself is left out of that mean: with its own window as the model its correlation is 1 whatever the
//! candidate.

use std::ops::Range;

use fearless_simd::{Level, dispatch};

use super::band::Band;
use super::kernels;
use super::sides::best_side;
use crate::aggregation::window_sums::window_sums;
use crate::cost::interpolation::Interpolation;
use crate::lines::{EpiLines, SeenRule, Shift, Sightings};
use crate::options::Method;

/// Fills cost rows one disparity after another.
///
/// A frame sees a candidate if it contains the window's centre; a window that sticks out is completed by
/// mirroring, but for the reference frame's own window where that is the model: such pixels have no cost. At
/// the upper and lower border the window has fewer rows.
pub(super) struct Correlation<'a> {
    band: &'a Band,
    lines: &'a EpiLines,
    interpolation: Interpolation,
    level: Level,
    mean_model: bool,
    /// Mean intensity of the band, taken off all samples to keep the sums small.
    offset: f32,
    /// The model of each held row over the columns and `half` px beyond them on both sides.
    model: Vec<Vec<f32>>,
    /// The samples of each held row for one frame and disparity, over the same columns.
    samples: Vec<Vec<f32>>,
    /// Sums over the windows of each answered row of the model, its squares, and these again.
    model_windows: Vec<[Vec<f32>; 3]>,
    /// Sum of the correlations before and after the reference frame, for each answered row.
    totals: Vec<[Vec<f32>; 2]>,
}

impl<'a> Correlation<'a> {
    pub(super) fn new(
        band: &'a Band,
        lines: &'a EpiLines,
        interpolation: Interpolation,
        method: Method,
    ) -> Self {
        let columns = lines.columns();
        let wide = columns + 2 * band.half;
        let paths = band.epis.len();
        let answered = band.answered.len();
        let mut this = Self {
            band,
            lines,
            interpolation,
            level: Level::new(),
            mean_model: method == Method::NccMean,
            offset: 0.0,
            model: vec![vec![0.0; wide]; paths],
            samples: vec![vec![0.0; wide]; paths],
            model_windows: Vec::new(),
            totals: vec![std::array::from_fn(|_| vec![0.0; columns]); answered],
        };
        this.take_reference_model();
        this
    }

    fn take_reference_model(&mut self) {
        let shift = self.lines.shift(0.0, self.lines.reference());
        self.sample_frame(self.lines.reference(), shift);
        let mean = |row: &Vec<f32>| row.iter().sum::<f32>() / row.len() as f32;
        self.offset = self.samples.iter().map(mean).sum::<f32>() / self.samples.len() as f32;
        self.sample_frame(self.lines.reference(), shift);
        for (model, samples) in self.model.iter_mut().zip(&self.samples) {
            model.copy_from_slice(samples);
        }
        self.sum_model_windows();
    }

    pub(super) fn fill<'r>(
        &mut self,
        disparity_px: f64,
        rule: SeenRule,
        rows: impl Iterator<Item = &'r mut [f32]>,
    ) {
        if self.mean_model {
            self.take_mean_model(disparity_px);
        }
        self.totals.iter_mut().flatten().for_each(|total| total.fill(0.0));
        for t in 0..self.lines.frames() {
            let shift = self.lines.shift(disparity_px, t);
            if shift.first < shift.end {
                self.sample_frame(t, shift);
                self.add_frame(t, shift);
            }
        }
        let sightings = Sightings::count(self.lines, disparity_px);
        for (out, [before, after]) in rows.zip(&self.totals) {
            // A model that sticks out of the reference frame is half mirror image, which does not move with
            // the scene.
            let margin = if self.mean_model { 0 } else { self.band.half };
            let whole = margin..out.len() - margin;
            for (x, cost) in out.iter_mut().enumerate().filter(|(x, _)| whole.contains(x)) {
                let frames = [sightings.before[x], sightings.after[x]];
                *cost = best_side([before[x]], [after[x]], frames, rule, |[sum], count| {
                    1.0 - sum / (count - 1.0)
                });
            }
        }
    }

    /// Samples frame `t` of all held rows at the columns that see the candidate and `half` px around them.
    fn sample_frame(&mut self, t: usize, shift: Shift) {
        let half = self.band.half;
        let weights = self.interpolation.weights(shift.fraction);
        let count = shift.end - shift.first + 2 * half;
        for (epi, samples) in self.band.epis.iter().zip(&mut self.samples) {
            let start = shift.first as isize + shift.whole - half as isize;
            let out = &mut samples[shift.first..shift.first + count];
            let taps = epi.taps(t, start, count);
            dispatch!(self.level, _simd => kernels::sample(taps, weights, out));
            out.iter_mut().for_each(|sample| *sample -= self.offset);
        }
    }

    fn take_mean_model(&mut self, disparity_px: f64) {
        let wide = self.model[0].len();
        let half = self.band.half;
        let mut counts = vec![0.0_f32; wide];
        self.model.iter_mut().for_each(|row| row.fill(0.0));
        for t in 0..self.lines.frames() {
            let shift = self.lines.shift(disparity_px, t);
            if shift.first == shift.end {
                continue;
            }
            self.sample_frame(t, shift);
            let columns = shift.first..shift.end + 2 * half;
            counts[columns.clone()].iter_mut().for_each(|count| *count += 1.0);
            for (model, samples) in self.model.iter_mut().zip(&self.samples) {
                let sums = model[columns.clone()].iter_mut().zip(&samples[columns.clone()]);
                sums.for_each(|(sum, sample)| *sum += sample);
            }
        }
        for model in &mut self.model {
            model.iter_mut().zip(&counts).for_each(|(sum, count)| *sum /= count.max(1.0));
        }
        self.sum_model_windows();
    }

    fn sum_model_windows(&mut self) {
        let wide = 0..self.model[0].len();
        let windows = |index| self.windows(index, &self.model, wide.clone());
        self.model_windows = (0..self.totals.len()).map(windows).collect();
    }

    /// Sums over the windows around the pixels of an answered row, which cover the `wide` columns: of these
    /// rows, their squares and their products with the model.
    fn windows(&self, index: usize, rows: &[Vec<f32>], wide: Range<usize>) -> [Vec<f32>; 3] {
        let mut vertical: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; wide.len()]);
        for row in self.band.window_rows(index) {
            let (values, model) = (&rows[row][wide.clone()], &self.model[row][wide.clone()]);
            let sums = vertical.each_mut().map(Vec::as_mut_slice);
            dispatch!(self.level, _simd => kernels::add_products(values, model, sums));
        }
        vertical.map(|sums| {
            let mut windows = vec![0.0; wide.len() - 2 * self.band.half];
            dispatch!(self.level, _simd => window_sums(&sums, 2 * self.band.half + 1, &mut windows));
            windows
        })
    }

    fn add_frame(&mut self, t: usize, shift: Shift) {
        if t == self.lines.reference() {
            return;
        }
        let columns = shift.first..shift.end;
        for index in 0..self.totals.len() {
            let pixels = (self.band.window_rows(index).len() * (2 * self.band.half + 1)) as f32;
            let windows = self.windows(index, &self.samples, shift.first..shift.end + 2 * self.band.half);
            let windows = windows.each_ref().map(Vec::as_slice);
            let [sum, squares, _] = self.model_windows[index].each_ref().map(|sums| &sums[columns.clone()]);
            let total = &mut self.totals[index][usize::from(t > self.lines.reference())][columns.clone()];
            dispatch!(self.level, _simd => kernels::add_correlation(windows, [sum, squares], pixels, total));
        }
    }
}
