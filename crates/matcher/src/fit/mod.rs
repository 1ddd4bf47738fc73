//! Sub-pixel fit: the disparity and its sigma, by a fit of the line over all frames that see it.
//!
//! Model: the intensities of a window are one unknown template that moves along the line; the disparity
//! varies linearly over the window (slant). Around a first guess d0 of each pixel, its samples are I_t = T +
//! g (d0 - d) tau'_t + noise, where g is the template's gradient along x, the mean of the frames' gradients
//! along the line, and tau' = tau - tau_r. The regression of I on tau' has the slope b = g (d0 - d). So each
//! pixel gives one observation of the disparity, d0 - b / g, with the weight w = g^2 S, S = sum of (tau' -
//! mean)^2 (`observations`). The least-squares solution of all pixels of the window is the plane d + p u + q
//! v fitted to their observations: a Gauss-Newton step of the joint problem with the template eliminated. A
//! second step starts from the new disparities (`steps`).
//!
//! - Frames that do not see a point, because it has left the image or is occluded, are left out
//!   (`visibility`).
//! - Light that changes slowly is told from the surface and taken off (`light`), once as fields
//!   over the image and once, after the first step, as a gain of each frame (`gains`).
//! - The drift that slant gives to the blur is subtracted (`foreshortening`).
//! - Pixels at rims go to the surface that has more of them (`mixed_pixels`).
//! - In discs around each pixel the surface is a plane, or a plane with edges (`local_surface`).
//!
//! For noise s the covariance of the solution is s^2 times the inverse of the normal matrix. For
//! one pixel that is the Cramer-Rao bound var(d) = s^2 / (sum of w) (equidistant frames: 12 s^2 /
//! (N sum of g^2)). Added to it is the variance of what discs smooth away, and of what discs of two
//! sizes disagree by.

mod foreshortening;
mod gains;
mod in_view;
mod light;
mod local_surface;
mod locking;
mod mixed_pixels;
mod moments;
mod observations;
mod padded;
mod planes;
mod spline;
mod steps;

use rayon::prelude::*;

use super::light_change::LightChange;
use super::lines::{EpiLines, SeenRule};
use super::locking::LockingAmplitudes;
use super::validity::outlier_test::TestedRow;
use super::validity::visibility::visible_intervals;
use epirig_core::grid::Grid;
use epirig_core::progress::{Cancelled, Progress};
use epirig_core::volume::Volume;
use light::Drift;
use local_surface::{Fused, fused};
pub(crate) use local_surface::{Sizes, largest_disc_px};
use locking::{Amplitudes, Prediction, RowLines, RowSums, Turns, is_sampled};
use padded::{PAD, Padded};
use planes::{Guess, Observations};
use spline::GRADIENT_NOISE_GAIN;
use steps::{Steps, extremes};

/// Texture must raise the mean squared gradient to this many times that of noise alone.
const TEXTURE_OVER_NOISE: f64 = 4.0;

/// How the fit is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fit {
    /// The discs in which the surface is fitted.
    pub(crate) sizes: Sizes,
    /// Gauss-Newton steps; 0 leaves the disparity and only states its sigma.
    pub(crate) steps: usize,
    /// Which frames count.
    pub(crate) rule: SeenRule,
    /// The largest squared deviation of a frame that agrees, as a share of the contrast around a point;
    /// `None` if points are not occluded.
    pub(crate) deviation_share: Option<f32>,
}

/// The result of the fit: maps of rows x columns.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FitResult {
    /// Disparity in px; NaN where there was no guess.
    pub(crate) disparity: Grid<f32>,
    /// Its standard deviation in px; NaN where noise alone explains the gradients.
    pub(crate) sigma: Grid<f32>,
    /// Whether a pixel lies beside another surface and its frames deviate from its line (outlier test);
    /// `None` if that was not tested.
    pub(crate) outliers: Option<Grid<bool>>,
    /// Predicted bias by pixel locking in px, which is a part of sigma; `None` if it is not significant.
    pub(crate) locking_px: Option<Grid<f32>>,
    /// Amplitudes of pixel locking; `None` if too few frames, rows or points show them, or nothing was
    /// fitted.
    pub(crate) locking: Option<LockingAmplitudes>,
    /// How the light changed; `None` if nothing shows it.
    pub(crate) light: Option<LightChange>,
}

/// `guess` after one step by some of the frames, for a fit that starts nearer; NaN stays NaN. `progress`
/// counts each row.
pub(crate) fn gauss_newton_step(
    volume: &Volume,
    lines: &EpiLines,
    guess: Grid<f32>,
    rule: SeenRule,
    progress: &dyn Progress,
) -> Result<Grid<f32>, Cancelled> {
    let mut current = guess;
    Steps::rough(volume, lines, &current, rule, progress).take(&mut current)?;
    Ok(current)
}

/// Fits every pixel whose guess is a number; the others stay NaN. `progress` counts each row and step.
pub(crate) fn fit(
    volume: &Volume,
    lines: &EpiLines,
    guess: Grid<f32>,
    options: Fit,
    progress: &dyn Progress,
) -> Result<FitResult, Cancelled> {
    let (rows, columns) = (guess.rows(), guess.columns());
    let mut steps = Steps::new(volume, lines, &guess, (options.rule, options.sizes), progress);
    let mut current = guess;
    for _ in 1..options.steps {
        steps.take(&mut current)?;
    }
    progress.unless_cancelled()?;
    steps.find_gains(&current);
    progress.unless_cancelled()?;
    let turns = Turns::new();
    let minimum_frames = options.rule.minimum_frames;
    let (Observations { maps, template, residual }, sums) = steps.observations(&current, 1, |row| {
        let columns = &lines.shown(row.y);
        let of_lines =
            RowLines { lines, disparities: row.guesses, columns, visible: row.visible, minimum_frames };
        let sampled = options.steps > 0 && is_sampled(row.y, rows);
        sampled.then(|| of_lines.sums(&steps.spline, &turns, row.epi))
    })?;
    let sums: Vec<RowSums> = sums.into_iter().flatten().collect();
    let outliers = options.deviation_share.map(|share| {
        let mut outliers = Grid::filled(rows, columns, false);
        let rows = outliers.values_mut().par_chunks_mut(columns).enumerate();
        rows.for_each(|(y, out)| {
            if progress.cancelled() {
                return;
            }
            let mut intensities = vec![0.0; columns];
            volume.copy_row(y, lines.reference(), &mut intensities);
            let [residual, noise] = [&residual, &maps.noise].map(|map| &map.row(y)[PAD..]);
            TestedRow { intensities: &intensities, guesses: current.row(y), residual, noise }
                .find_outliers(share, out);
        });
        outliers
    });
    drop(residual);
    progress.unless_cancelled()?;
    let guess = Guess { map: &current, origin: steps.origin };
    let least_texture = (TEXTURE_OVER_NOISE * texture_of_noise(lines)) as f32;
    let Fused { disparity: found, variance, texture, light } = fused(
        (steps.level, progress),
        maps,
        template,
        guess,
        options.steps > 0,
        options.sizes,
        least_texture,
    )?;
    let amplitudes = Amplitudes::of(&sums);
    let significant = amplitudes.as_ref().filter(|amplitudes| amplitudes.are_significant());
    let locking_px = significant.map(|amplitudes| {
        let prediction = Prediction::new(amplitudes, &turns, lines, extremes(&current));
        let mut biases = Grid::filled(rows, columns, 0.0);
        biases.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
            if progress.cancelled() {
                return;
            }
            let guesses = current.row(y);
            let visible = steps.points_may_be_occluded().then(|| visible_intervals(guesses, lines));
            let columns = &lines.shown(y);
            let visible = visible.as_deref();
            let row = RowLines { lines, disparities: guesses, columns, visible, minimum_frames };
            prediction.row(row, out);
        });
        biases
    });
    progress.unless_cancelled()?;
    let mut disparity = current;
    let mut sigma = Grid::filled(rows, columns, 0.0);
    let out = disparity.values_mut().par_chunks_mut(columns).zip(sigma.values_mut().par_chunks_mut(columns));
    out.enumerate().for_each(|(y, (disparity, sigma))| {
        let row = |plane: &Padded, x: usize| plane.row(y)[PAD + x];
        for x in 0..columns {
            let (guess, found) = (disparity[x], row(&found, x) + steps.origin);
            let bias = locking_px.as_ref().map_or(0.0, |biases| biases.row(y)[x]);
            let variance = row(&variance, x) + bias * bias;
            let textured = row(&texture, x) > least_texture && variance.is_finite();
            sigma[x] = if textured && !guess.is_nan() { variance.sqrt() } else { f32::NAN };
            if options.steps == 0 {
                // The step that the fit would have made, and did not, is a part of the error.
                sigma[x] = sigma[x].hypot(found - guess);
            } else if !guess.is_nan() {
                disparity[x] = found;
            }
        }
    });
    let locking = amplitudes.map(|amplitudes| amplitudes.stated());
    let light = light.map(|Drift { dn, effect_px, significance }| LightChange {
        frames: steps.variation_of_gains(),
        drift_dn: dn,
        effect_px,
        significance,
    });
    Ok(FitResult { disparity, sigma, outliers, locking_px, locking, light })
}

/// The weight that noise of variance 1 alone makes on average, for points seen in all frames.
fn texture_of_noise(lines: &EpiLines) -> f64 {
    let count = lines.frames() as f64;
    let mean = lines.offsets().iter().sum::<f64>() / count;
    let spread: f64 = lines.offsets().iter().map(|tau| (tau - mean).powi(2)).sum();
    GRADIENT_NOISE_GAIN / count * spread
}
