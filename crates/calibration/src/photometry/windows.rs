//! Large windows that move with the picture, and their means in every frame.

use rayon::prelude::*;

use epirig_core::frame::full_scale;
use epirig_core::progress::Progress;
use epirig_core::rows::{RowSource, RowsError};
use epirig_core::volume::Volume;

/// Windows across and down a frame, roughly: a few hundred, so that a few bad ones do not matter.
const PER_SIDE: usize = 12;
/// Least and largest side of a window, in px.
const SIDES: (usize, usize) = (8, 64);
/// A window in which more than this share of the samples is at full scale does not count in that frame: 1 %
/// that does not follow 0.3 % of flicker errs by 0.003 %.
const MOST_SATURATED: f64 = 0.01;
/// A window that is darker than this share of full scale does not count: the dark level would matter.
const LEAST_LEVEL: f64 = 0.02;
/// Steps by which a window finds its own disparity.
const STEPS: usize = 4;
/// Longest step, in px: gradients are valid only near their pixel ...
const LONGEST_STEP_PX: f64 = 1.0;
/// ... and no window departs farther, in px: it shows something else.
const FARTHEST_PX: f64 = 3.0;
/// Number of rows of each window that are used for that.
const ROWS_LOOKED_AT: usize = 16;

/// The disparity of a window in px, and the logarithms of its means over the frames.
type Window = (f64, Vec<f64>);

/// Follows windows through the frames that move by about `disparity_px`. Each finds its own disparity first:
/// by Gauss-Newton steps on the drift of its contents with tau, whatever the brightness. So no texture enters
/// or leaves at its edges, although the surface may be slanted.
///
/// Of each window the disparity in px, and a list over the frames of the natural logarithms of its means; NaN
/// where it is not, or not wholly, in view. A band of rows for each thread is in memory at a time.
///
/// # Errors
/// [`RowsError`] if frames cannot be read, or `progress` has cancelled it.
pub(super) fn follow(
    frames: &dyn RowSource,
    disparity_px: f64,
    progress: &dyn Progress,
) -> Result<(Vec<f64>, Vec<Vec<f64>>), RowsError> {
    let shape = frames.shape();
    let side = |size: usize| (size / PER_SIDE).clamp(SIDES.0, SIDES.1).min(size);
    let (width, height) = (side(shape.columns), side(shape.rows));
    let windows: Result<Vec<Vec<Window>>, RowsError> = (0..shape.rows / height)
        .into_par_iter()
        .map(|band| {
            progress.unless_cancelled()?;
            let rows: Vec<usize> = (band * height..(band + 1) * height).collect();
            let band = frames.rows_of_all(&rows, progress)?;
            Ok(Band::new(&band).windows(disparity_px, width))
        })
        .collect();
    Ok(windows?.into_iter().flatten().unzip())
}

/// Some rows of all frames.
struct Band<'a> {
    tau: &'a [f64],
    columns: usize,
    height: usize,
    full_scale: f32,
    /// Rows that are looked at for the disparity, each of all frames.
    rows: Vec<Vec<f32>>,
    /// For each frame the sum of all samples to the left of each column's left edge, columns + 1 of them.
    sums: Vec<Vec<f64>>,
    /// The same of samples at full scale.
    saturated: Vec<Vec<u32>>,
}

impl<'a> Band<'a> {
    fn new(volume: &'a Volume) -> Self {
        let (height, columns, frames) = (volume.rows(), volume.columns(), volume.frames());
        let full_scale = f32::from(full_scale(volume.bit_depth()));
        let every = height.div_ceil(ROWS_LOOKED_AT);
        let mut rows = Vec::new();
        let mut sums = vec![vec![0.0; columns + 1]; frames];
        let mut saturated = vec![vec![0; columns + 1]; frames];
        let mut line = vec![0.0; columns];
        for y in 0..height {
            let mut looked_at = Vec::new();
            for (t, (sums, saturated)) in sums.iter_mut().zip(&mut saturated).enumerate() {
                volume.copy_row(y, t, &mut line);
                for ((&value, sum), count) in line.iter().zip(&mut sums[1..]).zip(&mut saturated[1..]) {
                    *sum += f64::from(value);
                    *count += u32::from(value >= full_scale);
                }
                if y % every == 0 {
                    looked_at.extend_from_slice(&line);
                }
            }
            if y % every == 0 {
                rows.push(looked_at);
            }
        }
        for (sums, saturated) in sums.iter_mut().zip(&mut saturated) {
            for x in 0..columns {
                sums[x + 1] += sums[x];
                saturated[x + 1] += saturated[x];
            }
        }
        Self { tau: volume.tau().values(), columns, height, full_scale, rows, sums, saturated }
    }

    /// Disparity and logarithms of the means of all windows that at least two frames see.
    fn windows(&self, disparity_px: f64, width: usize) -> Vec<Window> {
        // A window's place is that of its left edge where tau is 0.
        let leftmost = -disparity_px.max(0.0);
        let count = ((self.columns as f64 + disparity_px.abs()) / width as f64) as usize;
        (0..count)
            .filter_map(|index| {
                let start = leftmost + (index * width) as f64;
                let own = self.own_disparity(start, disparity_px, width);
                let logarithms = self.logarithms(start, own, width);
                let seen = logarithms.iter().filter(|logarithm| logarithm.is_finite()).count();
                (seen >= 2).then_some((own, logarithms))
            })
            .collect()
    }

    /// Where the left edge lies in frame `t`, if the whole window is in view.
    fn edge(&self, t: usize, start: f64, disparity_px: f64, width: usize) -> Option<f64> {
        let edge = start + disparity_px * self.tau[t];
        (edge >= 0.0 && edge + width as f64 <= self.columns as f64).then_some(edge)
    }

    /// Mean over the window, in DN; a pixel that is cut counts in part.
    fn mean(&self, t: usize, edge: f64, width: usize) -> f64 {
        let sums = &self.sums[t];
        let left_of = |place: f64| {
            let whole = (place as usize).min(self.columns - 1);
            sums[whole] + (place - whole as f64) * (sums[whole + 1] - sums[whole])
        };
        (left_of(edge + width as f64) - left_of(edge)) / (width * self.height) as f64
    }

    fn logarithms(&self, start: f64, disparity_px: f64, width: usize) -> Vec<f64> {
        let least_dn = LEAST_LEVEL * f64::from(self.full_scale);
        let most_saturated = MOST_SATURATED * (width * self.height) as f64;
        let of_frame = |t: usize| {
            let edge = self.edge(t, start, disparity_px, width)?;
            let (left, right) = (edge as usize, ((edge + width as f64).ceil() as usize).min(self.columns));
            let saturated = self.saturated[t][right] - self.saturated[t][left];
            let mean = self.mean(t, edge, width);
            (mean >= least_dn && f64::from(saturated) <= most_saturated).then(|| mean.ln())
        };
        (0..self.tau.len()).map(|t| of_frame(t).unwrap_or(f64::NAN)).collect()
    }

    /// The disparity at which the contents of a window stay where they are in it, from `disparity_px` on.
    fn own_disparity(&self, start: f64, disparity_px: f64, width: usize) -> f64 {
        let mut own = disparity_px;
        for _ in 0..STEPS {
            let Some(step) = self.drift(start, own, width) else { return disparity_px };
            own += step.clamp(-LONGEST_STEP_PX, LONGEST_STEP_PX);
        }
        own.clamp(disparity_px - FARTHEST_PX, disparity_px + FARTHEST_PX)
    }

    /// How much more disparity the contents have than they are followed with, in px. They are f(k) in the
    /// mean; in frame t, f(k - step (tau - mean tau)): so the regression of the samples on tau is -step
    /// f'(k).
    fn drift(&self, start: f64, disparity_px: f64, width: usize) -> Option<f64> {
        let seen: Vec<(usize, f64, f64)> = (0..self.tau.len())
            .filter_map(|t| {
                let edge = self.edge(t, start, disparity_px, width)?;
                let mean = self.mean(t, edge, width);
                (mean > 0.0).then_some((t, edge, mean))
            })
            .collect();
        let count = seen.len() as f64;
        let middle = seen.iter().map(|&(t, ..)| self.tau[t]).sum::<f64>() / count;
        let spread: f64 = seen.iter().map(|&(t, ..)| (self.tau[t] - middle).powi(2)).sum();
        let (mut along, mut across) = (0.0, 0.0);
        for row in &self.rows {
            let mut mean = vec![0.0; width];
            let mut slope = vec![0.0; width];
            for &(t, edge, level) in &seen {
                let samples = &row[t * self.columns..(t + 1) * self.columns];
                let (first, right) = (edge as usize, edge.fract());
                let by_tau = (self.tau[t] - middle) / level;
                for (k, (mean, slope)) in mean.iter_mut().zip(&mut slope).enumerate() {
                    let next = (first + k + 1).min(self.columns - 1);
                    let value =
                        (1.0 - right) * f64::from(samples[first + k]) + right * f64::from(samples[next]);
                    *mean += value / (count * level);
                    *slope += by_tau * value;
                }
            }
            for (around, slope) in mean.windows(3).zip(&slope[1..]) {
                let gradient = 0.5 * (around[2] - around[0]);
                along += gradient * gradient;
                across += gradient * slope;
            }
        }
        let step = -across / (along * spread);
        step.is_finite().then_some(step)
    }
}
