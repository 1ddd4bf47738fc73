//! Image registration: how far the picture has moved between two frames.
//!
//! One translation of the whole image, by the method of Lucas and Kanade (1981): Gauss-Newton steps from
//! coarse to fine, with contrast and offset of the intensities eliminated. The second frame is interpolated
//! by a cubic B-spline. The gradient is that of the first frame at its pixels, where the noise of value and
//! gradient is uncorrelated; so noise scatters the answer and does not bias it. Pixels at full scale, in
//! either frame, do not count.

mod pair;
mod pyramid;
mod similarity;
mod spline;

use thiserror::Error;

use epirig_core::frame::Frame;
use epirig_core::grid::Grid;
use epirig_core::image::reduced_frame;
use pair::{BORDER, Pair, Sums};
use pyramid::{best_whole_shift, pyramid};
pub use similarity::{Similarity, similarity_between};
use spline::noise_share;

/// Steps at one size, at most. Four are usual; noise in the gradients makes them short.
const STEPS: usize = 60;
/// Most steps from zero; for larger shifts the pyramid leads there.
const STEPS_FROM_ZERO: usize = 8;
/// Longest step, in px: gradients are valid only near their pixel.
const LONGEST_STEP_PX: f64 = 1.0;
/// A step that is shorter than this is the last, in px, at the size of the frames ...
const FINE_PX: f64 = 1e-4;
/// ... and where the shift is a start only.
const COARSE_PX: f64 = 0.02;
/// Two frames show the same thing if half of the variance that they show is common, i.e. from this
/// correlation on.
const LEAST_CORRELATION: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// No shift that is known worse than this is one, in px.
const WORST_SIGMA_PX: f64 = 0.5;
/// Variance by rounding to whole DN, of two frames, in squared DN.
const ROUNDING_DN2: f64 = 2.0 / 12.0;
/// Where a texture repeats, frames agree at several shifts. The one near zero is meant if it leaves less than
/// this unexplained (1 less the correlation) ...
const MOST_UNEXPLAINED: f64 = 0.1;
/// ... and no more than this many times the residual of the other: noise and rounding differ between any two
/// shifts.
const CLEARLY_BETTER: f64 = 1.5;
/// A clipped pixel spoils the spline around it: its two taps on either side, and by 0.27 the coefficient
/// beyond.
const SPREAD: usize = 3;

/// The translation of a second frame against a first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// How far the contents have moved to higher columns, in px.
    pub x_px: f64,
    /// How far the contents have moved to higher rows, in px.
    pub y_px: f64,
    /// Standard deviation of either, whichever is known worse, in px: from the residual (at least that of
    /// rounding to whole DN) and the gradients. Interpolation errs besides, by up to some 0.001 px for
    /// texture that lens and pixel have blurred as the simulator's.
    pub sigma_px: f64,
    /// Ratio of the contrasts, second over first: that of the light, whatever black level is added to it.
    pub light: f64,
    /// Root mean square of the residuals after shift, light and offset are fitted, in DN: the noise of both
    /// frames.
    pub residual_dn: f64,
}

/// Why no shift could be found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ShiftError {
    /// Frames of different shapes.
    #[error("frames of {first} and {second} cannot be compared; take both with the same settings")]
    Shapes {
        /// Columns x rows and bits of the first.
        first: String,
        /// Size of the second.
        second: String,
    },
    /// Frames with too few pixels.
    #[error("frames of {columns} x {rows} are too small to find a shift in; {least} x {least} is the least")]
    TooSmall {
        /// Columns of the frames.
        columns: usize,
        /// Rows of the frames.
        rows: usize,
        /// The least of either.
        least: usize,
    },
    /// Nothing, or nothing that varies in both directions, is seen.
    #[error(
        "the frames have too little texture to see a movement: a shift would be known to {sigma_px:.2} px only; check light, exposure, focus \
         and that the object is in view"
    )]
    TooLittleTexture {
        /// Standard deviation that a shift would have, in px; infinite if a direction is left open.
        sigma_px: f64,
    },
    /// No shift makes the frames alike.
    #[error(
        "the frames do not show the same thing moved: at best their correlation is {correlation:.2} ({least:.2} is the least), and \
         {residual_dn:.1} DN are unexplained; check that the object is in view, that it moved by less than a quarter of the image, and that \
         noise does not drown it"
    )]
    Unlike {
        /// Correlation at the best shift.
        correlation: f64,
        /// The least that is accepted.
        least: f64,
        /// Root mean square of the differences there, in DN.
        residual_dn: f64,
    },
}

/// The translation of `second` against `first`.
///
/// Found are shifts of at least a quarter of the shorter side, and no more than half of any (up to some 120
/// px at 640 x 480). Where a texture repeats, of several shifts that agree equally well the one that is
/// reached from zero counts.
///
/// # Errors
/// [`ShiftError`] if the shapes differ, the frames are smaller than 16 x 16, have too little texture, or do
/// not show the same.
///
/// ```
/// use epirig_calibration::registration::shift_between;
/// use epirig_simulator::{Simulator, SimulatorConfig};
///
/// // 128 px of focal length, 500 mm away: 3.9 mm are 1 px.
/// let simulator = Simulator::new(SimulatorConfig::textured_plane(64, 48, 9))?;
/// let shift = shift_between(&simulator.expose(20.0, 0), &simulator.expose(20.0 + 500.0 / 128.0, 0))?;
/// assert!((shift.x_px - 1.0).abs() < 0.01 && shift.y_px.abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn shift_between(first: &Frame, second: &Frame) -> Result<Shift, ShiftError> {
    check_shapes(first, second)?;
    let mean = first.samples().mean() as f32;
    let levels = pyramid(image(first, mean), image(second, mean));
    let mut start = levels.last().map_or([0.0; 2], best_whole_shift);
    for images in levels[1..].iter().rev() {
        let pair = Pair::new(&images[0], &images[1], None);
        let found = nearest_of_equals(&pair, converge(&pair, start, COARSE_PX, STEPS));
        start = found.map_or(start, |found| found.shift).map(|pixels| 2.0 * pixels);
    }
    let pair = Pair::new(&levels[0][0], &levels[0][1], usable(first, second));
    let found = nearest_of_equals(&pair, converge(&pair, start, FINE_PX, STEPS));
    let found = match found {
        Some(found) if found.step_px >= FINE_PX => converge(&pair, found.shift, FINE_PX, STEPS),
        done => done,
    };
    judge(&pair, found)
}

fn check_shapes(first: &Frame, second: &Frame) -> Result<(), ShiftError> {
    let shape = |frame: &Frame| (frame.columns(), frame.rows(), frame.bit_depth());
    let (columns, rows, _) = shape(first);
    if shape(first) != shape(second) {
        let words =
            |frame: &Frame| format!("{} x {} with {} bit", frame.columns(), frame.rows(), frame.bit_depth());
        return Err(ShiftError::Shapes { first: words(first), second: words(second) });
    }
    let least = 4 * BORDER;
    if columns.min(rows) < least { Err(ShiftError::TooSmall { columns, rows, least }) } else { Ok(()) }
}

/// The samples less `mean`, so that sums of squares keep their digits.
fn image(frame: &Frame, mean: f32) -> Grid<f32> {
    reduced_frame(frame, 1).map(|value| value - mean)
}

/// 0 at and around pixels at full scale, 1 elsewhere, for both frames; `None` if no pixel is at full scale.
fn usable(first: &Frame, second: &Frame) -> Option<[Grid<f32>; 2]> {
    let clipped = |frame: &Frame| frame.samples().count_at_least(frame.full_scale()) > 0;
    (clipped(first) || clipped(second)).then(|| [first, second].map(below_full_scale))
}

fn below_full_scale(frame: &Frame) -> Grid<f32> {
    let full = f32::from(frame.full_scale());
    let samples = image(frame, 0.0);
    let (rows, columns) = (frame.rows(), frame.columns());
    let mut usable = Grid::filled(rows, columns, 1.0);
    for y in 0..rows {
        for x in (0..columns).filter(|&x| samples.row(y)[x] >= full) {
            for row in y.saturating_sub(SPREAD)..=(y + SPREAD).min(rows - 1) {
                usable.row_mut(row)[x.saturating_sub(SPREAD)..=(x + SPREAD).min(columns - 1)].fill(0.0);
            }
        }
    }
    usable
}

/// A shift that the steps led to.
#[derive(Debug, Clone, Copy)]
struct Found {
    shift: [f64; 2],
    sums: Sums,
    /// Length of the last step, in px.
    step_px: f64,
}

/// Goes on from `start` until a step is shorter than `limit_px`; `None` if the images have too little in
/// common there.
fn converge(pair: &Pair, start: [f64; 2], limit_px: f64, steps: usize) -> Option<Found> {
    let mut found = Found { shift: start, sums: pair.sums(start)?, step_px: f64::INFINITY };
    for _ in 0..steps {
        let Some(step) = found.sums.step() else { break };
        let length = step[0].hypot(step[1]);
        let shorten = (LONGEST_STEP_PX / length).min(1.0);
        let shift = [found.shift[0] + shorten * step[0], found.shift[1] + shorten * step[1]];
        let Some(sums) = pair.sums(shift) else { break };
        found = Found { shift, sums, step_px: length };
        if length < limit_px {
            break;
        }
    }
    Some(found)
}

/// The shift reached from zero, if the frames agree there as well as at `far`; else `far`.
fn nearest_of_equals(pair: &Pair, far: Option<Found>) -> Option<Found> {
    let is_near = |found: &Found| found.shift[0].hypot(found.shift[1]) < LONGEST_STEP_PX;
    if far.as_ref().is_some_and(is_near) {
        return far;
    }
    let near = converge(pair, [0.0; 2], COARSE_PX, STEPS_FROM_ZERO)?;
    let unexplained = 1.0 - near.sums.correlation();
    let clearly_worse =
        |far: &Found| unexplained > MOST_UNEXPLAINED.min(CLEARLY_BETTER * (1.0 - far.sums.correlation()));
    Some(far.filter(clearly_worse).unwrap_or(near))
}

/// A shift with its sigma, if it is one.
fn judge(pair: &Pair, found: Option<Found>) -> Result<Shift, ShiftError> {
    const OPEN: ShiftError = ShiftError::TooLittleTexture { sigma_px: f64::INFINITY };
    let Found { shift, sums, step_px } = found.ok_or(OPEN)?;
    let agreement = pair.agreement(shift, &sums).ok_or(OPEN)?;
    let light = sums.light();
    // Rounding limits the precision by weak gradients, however well the frames agree.
    let [xx, xy, yy] = agreement.squares;
    let rounding_px = sigma(agreement.squares, &[xx, xy, xy, yy], ROUNDING_DN2);
    if rounding_px > WORST_SIGMA_PX {
        return Err(ShiftError::TooLittleTexture { sigma_px: rounding_px });
    }
    let residual_dn = agreement.residual2.sqrt();
    if agreement.correlation < LEAST_CORRELATION || step_px >= COARSE_PX {
        return Err(ShiftError::Unlike {
            correlation: agreement.correlation,
            least: LEAST_CORRELATION,
            residual_dn,
        });
    }
    // Between pixels the spline smooths the noise of the second frame. Its correlation is neglected.
    let share: f64 = shift.iter().map(|pixels| noise_share(pixels.rem_euclid(1.0))).product();
    let smoothing = (1.0 + light * light) / (share + light * light);
    let variance = (agreement.residual2 * smoothing).max(ROUNDING_DN2);
    let sigma_px = sigma(agreement.squares, &agreement.products, variance);
    if sigma_px > WORST_SIGMA_PX {
        return Err(ShiftError::TooLittleTexture { sigma_px });
    }
    Ok(Shift { x_px: shift[0], y_px: shift[1], sigma_px, light, residual_dn })
}

/// The larger standard deviation of the two coordinates, for residuals of `variance`: the shift is P^-1 times
/// the sum of gradients times residuals, whose covariance is the variance times the squared gradients S; so
/// the shift's is variance P^-1 S P^-T.
fn sigma([sxx, sxy, syy]: [f64; 3], [xx, xy, yx, yy]: &[f64; 4], variance: f64) -> f64 {
    let determinant = xx * yy - xy * yx;
    // Rows of P^-1.
    let [a, b] = [[yy / determinant, -xy / determinant], [-yx / determinant, xx / determinant]];
    let form = |[u, v]: [f64; 2]| u * u * sxx + 2.0 * u * v * sxy + v * v * syy;
    let worst = (variance * form(a).max(form(b))).sqrt();
    if worst.is_nan() { f64::INFINITY } else { worst }
}

#[cfg(test)]
mod tests;
