//! The gain of every frame, for lamps that flicker.
//!
//! The same surface points are seen in many frames, so the frames themselves show how bright the lamp was.
//! The logarithm of the mean of window w in frame t is a_w + g_t, if the window moves with the surface. All
//! windows and frames are fitted together, by weighted least squares with a robust loss. Windows that
//! scatter, because they show something that moves differently or is covered for a while, have little weight.
//!
//! Precision: the mean of P pixels of level L with noise s has the relative standard deviation s / (L sqrt
//! P). With 1.4 DN, 100 DN and 10 000 pixels in view that is 0.014 %. Texture that enters and leaves at the
//! edges of windows that are followed wrongly adds to it: for an error of e px in the place, edge pixels of
//! contrast C that are alike over l px, and n windows of W x H, e C sqrt(2 l / H) / (W sqrt n) of the mean.
//! For 0.1 px, 30 %, 2 px, and 100 windows of 16 x 16 that is 0.01 %. The standard deviations given come from
//! the scatter of the windows, so both are in them.
//!
//! Limit: vignetting that is left in the frames and grows along the way of the surface looks like flicker. It
//! has to be corrected before.

use epirig_core::statistics::{SIGMA_OF_MEDIAN_4, upper_median};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::windows::follow;
use crate::registration::{ShiftError, shift_between};
use epirig_core::frame::{Frame, FrameError, Samples};
use epirig_core::progress::Progress;
use epirig_core::rows::{RowSource, RowsError};

/// Residuals beyond this many standard deviations have linear loss (Huber).
const ROBUST_FROM: f64 = 2.0;
/// Times the weights are found anew.
const REWEIGHTINGS: usize = 12;
/// Windows that have to see a frame, so that their scatter says how well its gain is known.
const LEAST_WINDOWS: usize = 6;
/// A pivot this much smaller than its diagonal element is rounding: no window sees two groups of frames.
const PIVOT: f64 = 1e-9;
/// No window is believed to be better than this, as a share.
const LEAST_SIGMA: f64 = 1e-6;
/// Pairs of neighbouring frames from which a disparity is guessed.
const PAIRS: usize = 16;
/// Largest scatter of the disparities of pairs, in px or as a share of the disparity; with more there is no
/// dominant disparity.
const MOST_SCATTER_PX: f64 = 2.0;
const MOST_SCATTER: f64 = 0.05;

/// The brightness of every frame, against the others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameGains {
    /// By how much each frame is too bright: divide it by this. Geometric mean 1; all 1 if they are not
    /// [`significant`](Self::significant).
    pub gain: Vec<f64>,
    /// Standard deviation of each, as a share, from the scatter of the windows.
    pub sigma: Vec<f64>,
    /// Root mean square of the gains found, as a share, whether or not they are significant.
    pub flicker: f64,
    /// Whether that is larger than the standard deviations (root mean square). If not, dividing would add
    /// more than it takes away, and nothing is divided.
    pub significant: bool,
    /// Number of windows.
    pub windows: usize,
    /// Median of the disparities of the windows, in px.
    pub disparity_px: f64,
}

/// Why the gains of the frames cannot be found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GainError {
    /// Too few windows see a frame.
    #[error(
        "frame {frame} shares only {windows} windows of surface with other frames, {least} are needed to separate its brightness from texture; take \
         smaller steps, or leave the frames' brightness as it is"
    )]
    TooFewWindows {
        /// Index of the frame, from 0.
        frame: usize,
        /// Windows that it sees.
        windows: usize,
        /// Windows that are needed.
        least: usize,
    },
    /// No window connects the frames before and after some place.
    #[error(
        "frame {frame} has no surface in common with the frames before it, so its brightness cannot be compared; take smaller steps, or leave \
         the frames' brightness as it is"
    )]
    Apart {
        /// Index of a frame that is not connected with those before it.
        frame: usize,
    },
    /// A disparity that is no number.
    #[error("a disparity of {0} px is no number that windows can follow")]
    NoDisparity(f64),
    /// The movement between two frames cannot be seen.
    #[error("how far the picture moves from frame {frame} to the next cannot be measured: {source}")]
    Shift {
        /// Index of the first of the two, from 0.
        frame: usize,
        /// Why.
        source: ShiftError,
    },
    /// Neighbouring frames contradict each other.
    #[error(
        "neighbouring frames show disparities that scatter by {scatter_px:.1} px around {disparity_px:.1} px, so none dominates; \
         give the disparity, or leave the frames' brightness as it is"
    )]
    NoneDominates {
        /// Median of their disparities, in px.
        disparity_px: f64,
        /// Its robust standard deviation, in px.
        scatter_px: f64,
    },
    /// Frames that cannot be read.
    #[error(transparent)]
    Rows(#[from] RowsError),
    /// Samples that make no frame.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// The gain of every frame from `frames` that are rectified and corrected for dark level and vignetting, and
/// whose surface mainly has a disparity of `disparity_px`, which need be right to about a px (signed, over
/// the whole baseline).
///
/// # Errors
/// [`GainError`] if frames have too little in common, or cannot be read.
pub fn frame_gains(
    frames: &dyn RowSource,
    disparity_px: f64,
    progress: &dyn Progress,
) -> Result<FrameGains, GainError> {
    if !disparity_px.is_finite() {
        return Err(GainError::NoDisparity(disparity_px));
    }
    let (mut disparities_px, logarithms) = follow(frames, disparity_px, progress)?;
    let (frames, windows) = (frames.shape().tau.frames(), logarithms.len());
    for frame in 0..frames {
        let windows = logarithms.iter().filter(|window| window[frame].is_finite()).count();
        if windows < LEAST_WINDOWS {
            return Err(GainError::TooFewWindows { frame, windows, least: LEAST_WINDOWS });
        }
    }
    let (gains, variances) = fit(&logarithms, frames)?;
    let root_mean = |squares: f64| (squares / frames as f64).sqrt();
    let flicker = root_mean(gains.iter().map(|gain| gain * gain).sum());
    let significant = flicker > root_mean(variances.iter().sum());
    let middle = windows / 2;
    Ok(FrameGains {
        gain: gains.iter().map(|gain| if significant { gain.exp() } else { 1.0 }).collect(),
        sigma: variances.iter().map(|variance| variance.sqrt()).collect(),
        flicker,
        significant,
        windows,
        disparity_px: *disparities_px.select_nth_unstable_by(middle, f64::total_cmp).1,
    })
}

/// Logarithms of the gains, with mean 0, and their variances, by sums over windows that hold whatever their
/// errors have in common over the frames (the "sandwich" of Liang and Zeger 1986).
fn fit(logarithms: &[Vec<f64>], frames: usize) -> Result<(Vec<f64>, Vec<f64>), GainError> {
    let none = DVector::zeros(frames);
    let mut gains = none.clone();
    let mut weights: Vec<Vec<f64>> = logarithms
        .iter()
        .map(|window| window.iter().map(|value| f64::from(u8::from(value.is_finite()))).collect())
        .collect();
    let mut solver = normal(&weights, frames)?;
    for _ in 0..REWEIGHTINGS {
        let mut right = DVector::zeros(frames);
        for (window, weights) in logarithms.iter().zip(&weights) {
            add_weighted(&mut right, window, weights, &none);
        }
        gains = solver.solve(&right);
        let mean = gains.mean();
        gains.iter_mut().for_each(|gain| *gain -= mean);
        weights = reweighted(logarithms, &weights, &gains);
        solver = normal(&weights, frames)?;
    }
    let mut variances = vec![0.0; frames];
    for (window, weights) in logarithms.iter().zip(&weights) {
        let mut pull = DVector::zeros(frames);
        add_weighted(&mut pull, window, weights, &gains);
        let moved = solver.solve(&pull);
        variances.iter_mut().zip(moved.iter()).for_each(|(variance, moved)| *variance += moved * moved);
    }
    let windows = logarithms.len() as f64;
    variances.iter_mut().for_each(|variance| *variance *= windows / (windows - 1.0).max(1.0));
    Ok((gains.as_slice().to_vec(), variances))
}

/// A window's own level: the weighted mean of its logarithms, less the gains.
fn level_of(window: &[f64], weights: &[f64], gains: &DVector<f64>) -> f64 {
    let seen = window.iter().zip(weights).enumerate().filter(|(_, (value, _))| value.is_finite());
    let (sum, weight) = seen.fold((0.0, 0.0), |(sum, all), (t, (value, weight))| {
        (sum + weight * (value - gains[t]), all + weight)
    });
    sum / weight
}

/// Adds the weighted logarithms of a window, less its level and the gains.
fn add_weighted(to: &mut DVector<f64>, window: &[f64], weights: &[f64], gains: &DVector<f64>) {
    let level = level_of(window, weights, gains);
    let seen = window.iter().zip(weights).enumerate().filter(|(_, (value, _))| value.is_finite());
    seen.for_each(|(t, (value, weight))| to[t] += weight * (value - level - gains[t]));
}

/// The normal equations of the gains with the windows' levels eliminated; that the gains have mean 0 is
/// added, which their matrix leaves open.
fn normal(weights: &[Vec<f64>], frames: usize) -> Result<Cholesky<f64, Dyn>, GainError> {
    let mut matrix = DMatrix::<f64>::zeros(frames, frames);
    for weights in weights {
        let all: f64 = weights.iter().sum();
        for (i, one) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            matrix[(i, i)] += one;
            for (j, other) in weights.iter().enumerate() {
                matrix[(i, j)] -= one * other / all;
            }
        }
    }
    let scale: f64 = matrix.diagonal().mean() / frames as f64;
    matrix.add_scalar_mut(scale);
    let diagonal = matrix.diagonal();
    let factor = Cholesky::new(matrix).ok_or(GainError::Apart { frame: frames - 1 })?;
    let lower = factor.l_dirty();
    let open = (0..frames).find(|&frame| lower[(frame, frame)].powi(2) < PIVOT * diagonal[frame]);
    open.map_or(Ok(()), |frame| Err(GainError::Apart { frame }))?;
    Ok(factor)
}

/// Weights from the residuals. A window's scatter counts, at least that of the typical window; residuals that
/// deviate from the rest of their window have less weight.
fn reweighted(logarithms: &[Vec<f64>], weights: &[Vec<f64>], gains: &DVector<f64>) -> Vec<Vec<f64>> {
    let residuals: Vec<Vec<f64>> = logarithms
        .iter()
        .zip(weights)
        .map(|(window, weights)| {
            let level = level_of(window, weights, gains);
            window.iter().zip(gains.iter()).map(|(value, gain)| value - level - gain).collect()
        })
        .collect();
    let scatter: Vec<f64> = residuals
        .iter()
        .map(|residuals| {
            let seen =
                residuals.iter().filter(|residual| residual.is_finite()).map(|residual| residual.abs());
            SIGMA_OF_MEDIAN_4 * upper_median(&mut seen.collect::<Vec<_>>()).unwrap_or(0.0)
        })
        .collect();
    let typical = upper_median(&mut scatter.clone()).unwrap_or(0.0).max(LEAST_SIGMA);
    let of_window = |(residuals, scatter): (&Vec<f64>, &f64)| {
        let sigma = scatter.max(typical);
        let weight = |residual: &f64| {
            let robust = (ROBUST_FROM * sigma / residual.abs().max(f64::MIN_POSITIVE)).min(1.0);
            if residual.is_finite() { robust / (sigma * sigma) } else { 0.0 }
        };
        residuals.iter().map(weight).collect()
    };
    residuals.iter().zip(&scatter).map(of_window).collect()
}

/// The disparity that most of the picture has, over the whole baseline and signed, in px: from the shifts
/// between neighbouring frames, up to 16 pairs spread over all of them.
///
/// # Errors
/// [`GainError::Shift`] if a pair shows no movement that can be told, [`GainError::NoneDominates`] if pairs
/// contradict each other, [`GainError::Rows`] if frames cannot be read.
pub fn dominant_disparity(frames: &dyn RowSource, progress: &dyn Progress) -> Result<f64, GainError> {
    let shape = frames.shape();
    let tau = shape.tau.values();
    let pairs = tau.len() - 1;
    let count = pairs.min(PAIRS);
    let disparities = (0..count).map(|index| {
        let frame = index * pairs / count;
        progress.unless_cancelled().map_err(RowsError::from)?;
        let [from, to] = [frame, frame + 1].map(|t| frame_of(frames, t, shape.bit_depth));
        let shift = shift_between(&from?, &to?).map_err(|source| GainError::Shift { frame, source })?;
        Ok(shift.x_px / (tau[frame + 1] - tau[frame]))
    });
    let disparities: Vec<f64> = disparities.collect::<Result<_, GainError>>()?;
    let disparity_px = upper_median(&mut disparities.clone()).unwrap_or(0.0);
    let mut deviations: Vec<f64> = disparities.iter().map(|other| (other - disparity_px).abs()).collect();
    let scatter_px = SIGMA_OF_MEDIAN_4 * upper_median(&mut deviations).unwrap_or(0.0);
    if scatter_px > MOST_SCATTER_PX.max(MOST_SCATTER * disparity_px.abs()) {
        return Err(GainError::NoneDominates { disparity_px, scatter_px });
    }
    Ok(disparity_px)
}

/// Frame `t` as a camera gives it.
fn frame_of(frames: &dyn RowSource, t: usize, bit_depth: u8) -> Result<Frame, GainError> {
    let frame = frames.frame(t)?;
    let (rows, columns, values) = (frame.rows(), frame.columns(), frame.values().iter());
    let samples = match bit_depth {
        ..=8 => Samples::U8(values.map(|&value| value as u8).collect()),
        _ => Samples::U16(values.map(|&value| value as u16).collect()),
    };
    Ok(Frame::new(rows, columns, bit_depth, samples)?)
}

#[cfg(test)]
mod tests;
