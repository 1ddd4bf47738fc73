//! The last digits of the disparity, and its sigma: a fit of the line over all frames that see it.
//!
//! Model: the intensities of a window are one template, unknown, moving along the line; the disparity varies linearly over
//! the window (slant). Around a first guess d0 of each pixel, its samples are I_t = T + g (d0 - d) tau'_t + noise, where g
//! is the template's gradient along x, the mean of the frames' gradients along the line, and tau' = tau - tau_r. The
//! regression of I on tau' has the slope b = g (d0 - d). Each pixel thus votes for d = d0 - b / g with the weight
//! w = g^2 S, S = sum of (tau' - mean)^2, and the least-squares solution of all pixels of the window is the plane
//! d + p u + q v fitted to their votes: a Gauss-Newton step of the joint problem, template eliminated (`votes`). A second step starts from the new
//! disparities. Frames that do not see a point, because it has left the image or something nearer hides it, are left out (`visibility`), the drift
//! that slant gives to the blur is taken off (`stretch`), pixels at rims go to the surface that has more of them (`mixing`), and windows follow the
//! surface (`joining`, `support`).
//!
//! For noise s the covariance of the solution is s^2 times the inverse of the normal matrix, which for one pixel or an
//! upright window is the Cramer-Rao bound var(d) = s^2 / (sum of w) (equidistant frames: 12 s^2 / (N sum of g^2)). What supports smooth away, and what
//! credible windows disagree by, comes on top (`smoothing`).

mod carried;
mod creases;
mod doubt;
mod gains;
mod joining;
mod locking;
mod mixing;
mod moments;
mod neighbours;
mod planes;
mod smoothing;
mod spline;
mod stretch;
mod support;
mod visibility;
mod votes;
mod widening;

use fearless_simd::Level;
use rayon::prelude::*;

use super::lines::{Lines, SeenRule};
use super::locking::LockingAmplitudes;
use super::options::HiddenPoints;
use crate::plane::Plane;
use crate::volume::Volume;
use doubt::doubtful_row;
use gains::corrections;
use joining::join_votes;
use locking::{Amplitudes, Prediction, RowLines, RowSums, Turns, is_sampled};
use mixing::RowSamples;
use planes::{PAD, Padded, VotePlanes};
use spline::{RESAMPLED_NOISE_GAIN, SLOPE_NOISE_GAIN, Spline, SplineEpi, VALUE_NOISE_GAIN};
use visibility::stretches;
use votes::{NO_VOTE, Stretches, row_votes};

/// Quantisation alone leaves a noise of this variance, in DN^2 (uniform over one DN).
const QUANTISATION_VARIANCE: f64 = 1.0 / 12.0;
/// Texture must raise the mean squared gradient this far above what noise alone does.
const TEXTURE_OVER_NOISE: f64 = 4.0;
/// Frames that the steps before the last look at.
const COARSE_FRAMES: usize = 33;
/// The noise is averaged over this reach, in px.
const NOISE_REACH: usize = 3;

/// How the fit is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Side of the smallest window, in px, odd.
    pub window_px: usize,
    /// Where a window leaves a larger sigma than this, in px, it grows as far as it has to, up to 11 px, and on surfaces without relief
    /// up to 21 px.
    pub wanted_sigma_px: f64,
    /// Gauss-Newton steps; 0 leaves the disparity and only states its sigma.
    pub steps: usize,
    /// Which frames count.
    pub rule: SeenRule,
    /// Where points may be hidden: the largest squared deviation of a frame that agrees, as a share of the contrast around a point.
    pub deviation_share: Option<f32>,
}

/// A fitted pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// Disparity in px.
    pub disparity_px: f32,
    /// Its standard deviation in px; NaN where noise alone explains the gradients.
    pub sigma_px: f32,
    /// Whether the pixel lies beside another surface and its frames show something else than its line.
    pub doubtful: bool,
    /// Predicted bias by pixel locking in px, which is a part of sigma; 0 where none stands out from chance.
    pub locking_px: f32,
}

const NOT_FITTED: Fitted =
    Fitted { disparity_px: f32::NAN, sigma_px: f32::NAN, doubtful: false, locking_px: 0.0 };

/// What the fit found.
#[derive(Debug, Clone, PartialEq)]
pub struct FitResult {
    /// Rows x columns.
    pub pixels: Plane<Fitted>,
    /// How far interpolation displaces points; `None` if too few frames, rows or points tell, or nothing was fitted.
    pub locking: Option<LockingAmplitudes>,
}

/// Fits every pixel whose guess is a number; the others stay NaN. `report` is called once for each row and step.
pub fn fit(
    volume: &Volume,
    lines: &Lines,
    guess: &Plane<f32>,
    options: Fit,
    report: impl Fn() + Sync,
) -> FitResult {
    let (rows, columns) = (guess.rows(), guess.columns());
    let spline = Spline::new();
    let level = Level::new();
    let origin = middle(guess);
    let gains = corrections(volume, lines, guess);
    let mut current = guess.clone();
    // Columns to the surface that a pixel belongs to; 0 if that is its own.
    let mut misplaced = Plane::filled(rows, columns, 0_i8);
    let mut doubtful = Plane::filled(rows, columns, false);
    let turns = Turns::new();
    let passes = options.steps.max(1);
    let mut pass = 0;
    // A pass's surface is dropped before the next: it takes six planes of memory.
    let (surface, amplitudes) = loop {
        pass += 1;
        let last = pass == passes;
        // The first steps need not be exact.
        let every = if last { 1 } else { (volume.frames() / COARSE_FRAMES).max(1) };
        let mut planes = VotePlanes::empty(rows, columns);
        let rows_to_fill = planes.par_rows().zip(misplaced.values_mut().par_chunks_mut(columns));
        let sums = rows_to_fill.enumerate().map_init(
            || (SplineEpi::default(), vec![NO_VOTE; columns]),
            |(epi, votes), (y, (out, misplaced))| {
                let frames = (0..volume.frames()).filter(|t| t.abs_diff(lines.reference()) % every == 0);
                epi.take(&spline, (volume, gains.as_deref()), y, frames);
                let guesses = current.row(y);
                let hidden =
                    (options.rule.hidden_points == HiddenPoints::OneSide).then(|| stretches(guesses, lines));
                let seen = Stretches {
                    // Near an occluder frames are given away, so as not to take its blur for the point.
                    minimum_frames: options.rule.minimum_frames
                        / (every * if hidden.is_some() { 2 } else { 1 }),
                    every,
                    stretches: hidden.as_deref(),
                };
                row_votes((&spline, level), epi, lines, guesses, seen, votes);
                if !last && hidden.is_some() {
                    let samples = RowSamples { spline: &spline, epi, lines, every };
                    samples.find_misplaced(guesses, votes, misplaced);
                }
                out.put(votes, origin);
                report();
                let minimum_frames = options.rule.minimum_frames;
                let row =
                    RowLines { lines, disparities: guesses, stretches: hidden.as_deref(), minimum_frames };
                if last && options.steps > 0 && is_sampled(y, rows) {
                    Some(row.sums(&spline, &turns, epi))
                } else {
                    None
                }
            },
        );
        let sums: Vec<RowSums> = sums.collect::<Vec<_>>().into_iter().flatten().collect();
        let freedom = (volume.frames() / every).saturating_sub(2).max(1) as f32;
        planes.settle_noise(NOISE_REACH, noise_gain(volume), QUANTISATION_VARIANCE as f32, freedom);
        if last && let Some(share) = options.deviation_share {
            let rows = doubtful.values_mut().par_chunks_mut(columns).enumerate();
            rows.for_each(|(y, out)| doubtful_row(volume, lines, (&planes, &current), share, y, out));
        }
        planes.forget_residuals();
        let surface =
            join_votes(level, &mut planes, &current, origin, if last { Some(options) } else { None });
        if last {
            break (surface, Amplitudes::of(&sums));
        }
        for y in 0..rows {
            let found = &surface.disparity.row(y)[PAD..PAD + columns];
            for (value, found) in current.row_mut(y).iter_mut().zip(found) {
                // NaN stays NaN; a step beyond a pixel is no step of a linearisation.
                *value += (found + origin - *value).clamp(-1.0, 1.0);
            }
            let stepped = current.row(y).to_vec();
            for (x, &away) in misplaced.row(y).iter().enumerate().filter(|(_, away)| **away != 0) {
                current.row_mut(y)[x] = stepped[x.wrapping_add_signed(isize::from(away))];
            }
        }
    };
    let least_texture = (TEXTURE_OVER_NOISE * texture_of_noise(lines)) as f32;
    let mut fitted = Plane::filled(rows, columns, NOT_FITTED);
    let outstanding = amplitudes.as_ref().filter(|amplitudes| amplitudes.stand_out());
    let prediction =
        outstanding.map(|amplitudes| Prediction::new(amplitudes, &turns, lines, extremes(&current)));
    fitted.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, fitted)| {
        let row = |plane: &Padded, x: usize| plane.row(y)[PAD + x];
        let guesses = current.row(y);
        let mut biases = vec![0.0; columns];
        if let Some(prediction) = &prediction {
            let hidden =
                (options.rule.hidden_points == HiddenPoints::OneSide).then(|| stretches(guesses, lines));
            let minimum_frames = options.rule.minimum_frames;
            let row = RowLines { lines, disparities: guesses, stretches: hidden.as_deref(), minimum_frames };
            prediction.row(row, &mut biases);
        }
        for (x, fitted) in fitted.iter_mut().enumerate() {
            let guess = guesses[x];
            if guess.is_nan() {
                continue;
            }
            let doubtful = doubtful.at(x, y);
            let found = row(&surface.disparity, x) + origin;
            let variance = row(&surface.variance, x);
            let textured = row(&surface.texture, x) > least_texture && variance.is_finite();
            let sigma = if textured { variance.sqrt().hypot(biases[x]) } else { f32::NAN };
            // What the fit would have moved a disparity by that it leaves is a part of its error.
            let (disparity_px, sigma_px) =
                if options.steps == 0 { (guess, sigma.hypot(found - guess)) } else { (found, sigma) };
            *fitted = Fitted { disparity_px, sigma_px, doubtful, locking_px: biases[x] };
        }
    });
    FitResult { pixels: fitted, locking: amplitudes.map(|amplitudes| amplitudes.stated()) }
}

/// The weight that noise of variance 1 alone makes on average, for points seen in all frames.
fn texture_of_noise(lines: &Lines) -> f64 {
    let count = lines.frames() as f64;
    let mean = lines.offsets().iter().sum::<f64>() / count;
    let spread: f64 = lines.offsets().iter().map(|tau| (tau - mean).powi(2)).sum();
    SLOPE_NOISE_GAIN / count * spread
}

/// Variance of the residuals along the lines over that of the noise at the frequencies of the texture.
fn noise_gain(volume: &Volume) -> f32 {
    // Frames that were rectified have been resampled before, and their noise is no longer white.
    (if volume.is_fine() { RESAMPLED_NOISE_GAIN } else { VALUE_NOISE_GAIN }) as f32
}

/// A disparity in the middle of all, so that sums of differences from it are exact enough in single precision.
fn middle(guess: &Plane<f32>) -> f32 {
    let (low, high) = extremes(guess);
    0.5 * (low + high)
}

/// Smallest and largest disparity; zeros if there are none.
fn extremes(guess: &Plane<f32>) -> (f32, f32) {
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for &value in guess.values().iter().filter(|value| !value.is_nan()) {
        low = low.min(value);
        high = high.max(value);
    }
    if low <= high { (low, high) } else { (0.0, 0.0) }
}
