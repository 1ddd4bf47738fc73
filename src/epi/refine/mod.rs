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

mod votes;
mod window;

use rayon::prelude::*;

use super::interpolation::{Interpolation, SampledEpi};
use super::lines::{Lines, SeenRule};
use crate::plane::Plane;
use crate::volume::Volume;
use votes::{NO_VOTE, pixel_vote};
use window::{surrounds, window_fit};

/// Quantisation alone leaves a noise of this variance, in DN^2 (uniform over one DN).
const QUANTISATION_VARIANCE: f64 = 1.0 / 12.0;

/// How the fit is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Side of the window, in px, odd.
    pub window_px: usize,
    /// Where the window leaves a larger sigma than this, in px, it grows in the last step as long as it has to ...
    pub wanted_sigma_px: f64,
    /// ... and as far as this side, in px, odd.
    pub largest_window_px: usize,
    /// Gauss-Newton steps; 0 leaves the disparity and only states its sigma.
    pub steps: usize,
    /// Which frames count.
    pub rule: SeenRule,
    /// Whether neighbours may lie on other surfaces: then only those near the pixel's own disparity vote.
    pub depth_edges: bool,
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
    let mut disparity = guess.clone();
    let mut fitted = Plane::filled(rows, columns, Fitted { disparity_px: f32::NAN, sigma_px: f32::NAN });
    let passes = options.steps.max(1);
    for pass in 1..=passes {
        let mut votes = Plane::filled(rows, columns, NO_VOTE);
        votes.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
            let epi = SampledEpi::new(volume, y, Interpolation::BSpline, 0);
            for (x, vote) in out.iter_mut().enumerate() {
                *vote = pixel_vote(&epi, lines, x, disparity.at(x, y).into(), options.rule);
            }
            report();
        });
        fitted.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
            let mut window = Vec::with_capacity(options.window_px * options.window_px);
            for (x, value) in out.iter_mut().enumerate() {
                let mut side = options.window_px;
                *value = window_fit(&votes, &disparity, (x, y), side, options.depth_edges, &mut window);
                // A NaN is no sigma that anyone wants.
                let wanted = |value: &Fitted| f64::from(value.sigma_px) <= options.wanted_sigma_px;
                let last_step = pass == passes && !disparity.at(x, y).is_nan();
                while last_step && !wanted(value) && side < options.largest_window_px {
                    side = (2 * side + 1).min(options.largest_window_px);
                    *value = window_fit(&votes, &disparity, (x, y), side, options.depth_edges, &mut window);
                    if !surrounds(&window, side) {
                        value.sigma_px = f32::NAN;
                    }
                }
            }
        });
        if pass < passes {
            disparity = fitted.map(|value| value.disparity_px);
        }
    }
    if options.steps == 0 {
        for (value, &guess) in fitted.values_mut().iter_mut().zip(guess.values()) {
            // What the fit would have moved it by is a part of its error.
            value.sigma_px = value.sigma_px.hypot(value.disparity_px - guess);
            value.disparity_px = guess;
        }
    }
    fitted
}
