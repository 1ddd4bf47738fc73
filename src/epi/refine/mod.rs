//! The last digits of the disparity, and its sigma: a fit of the line over all frames that see it.
//!
//! Model: the intensities of a window are one template, unknown, moving along the line; the disparity varies linearly over
//! the window (slant). Around a first guess d0 of each pixel, its samples are I_t = T + g (d0 - d) tau'_t + noise, where g
//! is the template's gradient along x, the mean of the frames' gradients along the line, and tau' = tau - tau_r. The
//! regression of I on tau' has the slope b = g (d0 - d). Each pixel thus votes for d = d0 - b / g with the weight
//! w = g^2 S, S = sum of (tau' - mean)^2, and the least-squares solution of all pixels of the window is the plane
//! d + p u + q v fitted to their votes: a Gauss-Newton step of the joint problem, template eliminated. Steps are repeated
//! from the new disparities.
//!
//! For noise s the covariance of the solution is s^2 times the inverse of the normal matrix, which for one pixel or an
//! upright window is the Cramer-Rao bound var(d) = s^2 / (sum of w) (equidistant frames: 12 s^2 / (N sum of g^2)).

mod moments;
mod planes;
mod smoothing;
mod spline;
mod stretch;
mod support;
mod visibility;
mod votes;

use fearless_simd::Level;
use rayon::prelude::*;

use super::lines::{Lines, SeenRule};
use super::options::HiddenPoints;
use crate::plane::Plane;
use crate::volume::Volume;
use planes::{PAD, Padded, SurfacePlanes, VotePlanes};
use smoothing::raise_smoothed;
use spline::{SLOPE_NOISE_GAIN, Spline, SplineEpi};
use stretch::take_off_drift;
use support::{Joining, join_row, take_best_window};
use visibility::stretches;
use votes::{NO_VOTE, Stretches, row_votes};

/// Quantisation alone leaves a noise of this variance, in DN^2 (uniform over one DN).
const QUANTISATION_VARIANCE: f64 = 1.0 / 12.0;
/// Texture must raise the mean squared gradient this far above what noise alone does.
const TEXTURE_OVER_NOISE: f64 = 4.0;
/// Reaches of the rounds, in px.
const REACHES: [usize; 7] = [1, 2, 3, 4, 5, 7, 10];
/// Windows disagree if the variance between them is this many times that of the best one; on a plane it is about as large.
const DISAGREEING: f32 = 16.0;
const FIRST_REACH: (usize, usize) = (2, 2);
/// Frames that the steps before the last look at.
const COARSE_FRAMES: usize = 33;
/// The noise is averaged over this reach, in px.
const NOISE_REACH: usize = 3;
const SURVEYED_REACHES: [(usize, usize); 5] = [(3, 3), (3, 8), (8, 3), (1, 8), (8, 1)];
const SMALL_REACHES: [usize; 3] = [1, 2, 3];
const MAP_REACHES: [usize; 0] = [];
const GUESS_SLACK: (f32, f32) = (0.5, 0.3);
const NO_SLACK: (f32, f32) = (0.0, 0.0);

/// How the fit is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Side of the smallest window, in px, odd.
    pub window_px: usize,
    /// Where a window leaves a larger sigma than this, in px, it grows as long as it has to ...
    pub wanted_sigma_px: f64,
    /// ... and as far as this side, in px, odd.
    pub largest_window_px: usize,
    /// Gauss-Newton steps; 0 leaves the disparity and only states its sigma.
    pub steps: usize,
    /// Which frames count.
    pub rule: SeenRule,
}

/// A fitted pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// Disparity in px.
    pub disparity_px: f32,
    /// Its standard deviation in px; NaN where noise alone explains the gradients.
    pub sigma_px: f32,
}

/// Fits every pixel whose guess is a number; the others stay NaN. `report` is called once for each row and step.
pub fn fit(
    volume: &Volume,
    lines: &Lines,
    guess: &Plane<f32>,
    options: Fit,
    report: impl Fn() + Sync,
) -> Plane<Fitted> {
    let (rows, columns) = (guess.rows(), guess.columns());
    let spline = Spline::new();
    let level = Level::new();
    let origin = middle(guess);
    let mut current = guess.clone();
    let mut surface = SurfacePlanes::unknown(rows, columns);
    let passes = options.steps.max(1);
    for pass in 1..=passes {
        let last = pass == passes;
        // The first steps need not be exact.
        let every = if last { 1 } else { (volume.frames() / COARSE_FRAMES).max(1) };
        let mut planes = VotePlanes::empty(rows, columns);
        planes.par_rows().enumerate().for_each_init(
            || (SplineEpi::default(), vec![NO_VOTE; columns]),
            |(epi, votes), (y, out)| {
                let frames = (0..volume.frames()).filter(|t| t.abs_diff(lines.reference()) % every == 0);
                epi.take(&spline, volume, y, frames);
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
                out.put(votes, origin);
                report();
            },
        );
        planes.average_noise(NOISE_REACH, QUANTISATION_VARIANCE as f32);
        surface = join_votes(level, &mut planes, &current, origin, if last { Some(options) } else { None });
        if !last {
            for y in 0..rows {
                let found = &surface.disparity.row(y)[PAD..PAD + columns];
                for (value, found) in current.row_mut(y).iter_mut().zip(found) {
                    // NaN stays NaN; a step beyond a pixel is no step of a linearisation.
                    *value += (found + origin - *value).clamp(-1.0, 1.0);
                }
            }
        }
    }
    let least_texture = (TEXTURE_OVER_NOISE * texture_of_noise(lines)) as f32;
    let mut fitted = Plane::filled(rows, columns, Fitted { disparity_px: f32::NAN, sigma_px: f32::NAN });
    for y in 0..rows {
        let row = |plane: &Padded, x: usize| plane.row(y)[PAD + x];
        for x in 0..columns {
            let guess = current.at(x, y);
            if guess.is_nan() {
                continue;
            }
            let found = row(&surface.disparity, x) + origin;
            let variance = row(&surface.variance, x);
            let textured = row(&surface.texture, x) > least_texture && variance.is_finite();
            let sigma = if textured { variance.sqrt() } else { f32::NAN };
            fitted.row_mut(y)[x] = if options.steps == 0 {
                // What the fit would have moved it by is a part of its error.
                Fitted { disparity_px: guess, sigma_px: sigma.hypot(found - guess) }
            } else {
                Fitted { disparity_px: found, sigma_px: sigma }
            };
        }
    }
    fitted
}

/// The surface through the votes: supports of the smallest window, or as `options` say.
fn join_votes(
    level: Level,
    votes: &mut VotePlanes,
    guess: &Plane<f32>,
    origin: f32,
    options: Option<Fit>,
) -> SurfacePlanes {
    let (rows, columns) = (guess.rows(), guess.columns());
    let joining = |reach, slack| Joining { reach, slack };
    let joined = |votes: &VotePlanes, map: &SurfacePlanes, joining: Joining| {
        let mut next = SurfacePlanes::unknown(rows, columns);
        next.par_rows().enumerate().for_each(|(y, out)| {
            join_row(level, (votes, map), joining, y, None, out);
        });
        next
    };
    let guesses = SurfacePlanes::of_guesses(votes, guess, origin);
    let survey = |votes: &VotePlanes, reaches: &[(usize, usize)]| {
        let mut map = SurfacePlanes::unknown(rows, columns);
        for &reach in reaches {
            let windows = joined(votes, &guesses, joining(reach, GUESS_SLACK));
            map.par_rows()
                .enumerate()
                .for_each(|(y, out)| take_best_window(level, (&windows, &guesses), reach, y, out));
        }
        map
    };
    let Some(options) = options else {
        let map = survey(votes, &[FIRST_REACH]);
        return joined(votes, &map, joining(FIRST_REACH, NO_SLACK));
    };
    let map = survey(votes, &SURVEYED_REACHES[..1]);
    take_off_drift(votes, &map);
    drop(map);
    let mut map = survey(votes, &SURVEYED_REACHES);
    for reach in MAP_REACHES {
        map = joined(votes, &map, joining((reach, reach), NO_SLACK));
    }
    let votes = &*votes;
    let smallest = options.window_px / 2;
    let mut surface = joined(votes, &map, joining((smallest, smallest), NO_SLACK));
    let wanted = options.wanted_sigma_px.powi(2) as f32;
    for reach in
        REACHES.into_iter().filter(|&reach| reach > smallest && 2 * reach < options.largest_window_px)
    {
        surface.par_rows().enumerate().for_each(|(y, out)| {
            join_row(level, (votes, &map), joining((reach, reach), NO_SLACK), y, Some(wanted), out);
        });
    }
    let mut smoothed = Padded::filled(rows, columns, 0.0);
    map.par_rows().zip(smoothed.par_rows()).for_each(|(map, smoothed)| {
        for ((smoothed, between), variance) in smoothed.iter_mut().zip(map.texture).zip(map.variance) {
            if *between > DISAGREEING * *variance {
                *smoothed = *between;
            }
        }
    });
    drop(map);
    for reach in SMALL_REACHES {
        let small = joined(votes, &guesses, joining((reach, reach), GUESS_SLACK));
        raise_smoothed(&mut smoothed, &surface, &small, 2 * reach + 1);
    }
    surface.raise_variance(&smoothed);
    surface
}

/// The weight that noise of variance 1 alone makes on average, for points seen in all frames.
fn texture_of_noise(lines: &Lines) -> f64 {
    let count = lines.frames() as f64;
    let mean = lines.offsets().iter().sum::<f64>() / count;
    let spread: f64 = lines.offsets().iter().map(|tau| (tau - mean).powi(2)).sum();
    SLOPE_NOISE_GAIN / count * spread
}

/// A disparity in the middle of all, so that sums of differences from it are exact enough in single precision.
fn middle(guess: &Plane<f32>) -> f32 {
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for &value in guess.values().iter().filter(|value| !value.is_nan()) {
        low = low.min(value);
        high = high.max(value);
    }
    if low <= high { 0.5 * (low + high) } else { 0.0 }
}
