//! Checks of flat frames: those that would give a wrong flat field are refused.

use super::PhotometryError;
use super::grid::CellGrid;
use super::polynomial::{Cell, HIGHEST_ORDER, Polynomial};
use epirig_core::frame::Frame;
use epirig_core::image::reduced_frame;
use epirig_core::statistics::median;

/// Samples at full scale that are allowed, in %: defective pixels of a poor sensor. More means that light was
/// cut off.
const MOST_SATURATED_PERCENT: f64 = 0.1;
/// The darkest cell has at least this share of full scale: a dark level that is wrong by 0.04 DN of 8 bit
/// moves the gain there by 0.3 %.
const LEAST_LEVEL: f64 = 0.05;
/// Largest deviation of a frame's brightness from the median of all, in %. Lamps on mains flicker by several
/// per cent, and the overall brightness does not matter. A larger deviation is another exposure, or a lamp
/// that warms up and changes its pattern, too.
const MOST_LAMP_PERCENT: f64 = 10.0;
/// A cell of a frame may differ from the mean of all by this, apart from the brightness as a whole, in %: of
/// eight frames or more one alone then moves the gain by less than 0.13 %.
const MOST_CHANGE_PERCENT: f64 = 1.0;
/// A cell may depart from the smooth field by this, in %. Order 8 follows cos^4 with 40 % of vignetting to
/// 0.03 %; dust on the sensor, 30 px wide and 10 % dark, changes the mean of a cell of 100 x 100 px by 0.7 %.
const MOST_STRUCTURE_PERCENT: f64 = 1.0;
/// Largest share of the cells that may deviate: dust and scratches. The edge of a shadow crosses ten cells of
/// a hundred and more.
const MOST_CELLS: f64 = 0.05;
/// Or by this many standard deviations of the noise, whichever is more: of 100 cells in 100 frames none does.
const SIGMAS: f64 = 6.0;

/// No samples at full scale but for defective pixels.
pub(super) fn check_saturation(frames: &[Frame]) -> Result<(), PhotometryError> {
    let samples: usize = frames.iter().map(|frame| frame.samples().len()).sum();
    let full: usize = frames.iter().map(|frame| frame.samples().count_at_least(frame.full_scale())).sum();
    let percent = 100.0 * full as f64 / samples.max(1) as f64;
    if percent > MOST_SATURATED_PERCENT {
        return Err(PhotometryError::Saturated { percent, most_percent: MOST_SATURATED_PERCENT });
    }
    Ok(())
}

/// Light in every cell; the grid is of the mean of the frames less the dark level.
pub(super) fn check_light(grid: &CellGrid, full_scale: u16) -> Result<(), PhotometryError> {
    let least_dn = LEAST_LEVEL * f64::from(full_scale);
    let darkest = grid.cells().iter().min_by(|one, other| one.mean.total_cmp(&other.mean));
    match darkest {
        // Not a number is too dark as well.
        Some(cell) if cell.mean.is_nan() || cell.mean < least_dn => {
            Err(PhotometryError::TooDark { level_dn: cell.mean, least_dn, at: cell.middle() })
        }
        _ => Ok(()),
    }
}

/// Frames that show the same but for brightness and noise; `grid` is of all pixels of their mean as it is,
/// `noise_dn` of a sample.
pub(super) fn check_frames(frames: &[Frame], grid: &CellGrid, noise_dn: f64) -> Result<(), PhotometryError> {
    if frames.len() < 2 {
        return Ok(());
    }
    let shares: Vec<Vec<f64>> = frames
        .iter()
        .map(|frame| shares_of(&CellGrid::of_all_pixels(&reduced_frame(frame, 1)), grid))
        .collect();
    let levels: Vec<f64> =
        shares.iter().map(|shares| median(&mut shares.to_vec()).unwrap_or(f64::NAN)).collect();
    let typical = median(&mut levels.clone()).unwrap_or(f64::NAN);
    let worst = (0..frames.len())
        .max_by(|&a, &b| (levels[a] - typical).abs().total_cmp(&(levels[b] - typical).abs()));
    if let Some(index) = worst {
        let percent = 100.0 * (levels[index] / typical - 1.0);
        if percent.abs() > MOST_LAMP_PERCENT {
            return Err(PhotometryError::LampUnsteady { index, percent, most_percent: MOST_LAMP_PERCENT });
        }
    }
    // The frame that differs most, before those that differ because the mean has it in it.
    let mut worst: Option<(f64, PhotometryError)> = None;
    for (index, (shares, level)) in shares.iter().zip(&levels).enumerate() {
        for (cell, share) in grid.cells().iter().zip(shares) {
            let percent = 100.0 * (share / level - 1.0);
            let most_percent = MOST_CHANGE_PERCENT.max(SIGMAS * cell_noise_percent(cell, noise_dn));
            let excess = percent.abs() / most_percent;
            if excess > worst.as_ref().map_or(1.0, |(excess, _)| *excess) {
                let at = cell.middle();
                worst = Some((excess, PhotometryError::FrameDiffers { index, percent, most_percent, at }));
            }
        }
    }
    worst.map_or(Ok(()), |(_, error)| Err(error))
}

/// No more structure than a lens and dust make; the grid is of the mean less the dark level, `noise_dn` is
/// that of the mean's pixels.
pub(super) fn check_uniformity(
    grid: &CellGrid,
    rows: usize,
    columns: usize,
    noise_dn: f64,
) -> Result<(), PhotometryError> {
    // With fewer than one and a half cells for each coefficient, residuals are too small by more than half.
    let enough = |order: &usize| 3 * (order + 1) * (order + 2) / 2 <= 2 * grid.cells().len();
    let smooth = (0..=HIGHEST_ORDER)
        .rev()
        .filter(enough)
        .find_map(|order| Polynomial::fit(order, rows, columns, grid.cells()));
    let Some(smooth) = smooth else { return Ok(()) };
    let residuals = grid.residuals(&smooth);
    let limit = |cell: &Cell| MOST_STRUCTURE_PERCENT.max(SIGMAS * cell_noise_percent(cell, noise_dn));
    let departing: Vec<(&Cell, f64)> = grid
        .cells()
        .iter()
        .zip(residuals.iter().map(|share| 100.0 * share))
        .filter(|(cell, percent)| percent.abs() > limit(cell))
        .collect();
    let most = departing.iter().max_by(|one, other| one.1.abs().total_cmp(&other.1.abs()));
    match most {
        Some(&(cell, percent)) if departing.len() as f64 > MOST_CELLS * grid.cells().len() as f64 => {
            Err(PhotometryError::NotUniform {
                cells: departing.len(),
                all_cells: grid.cells().len(),
                limit_percent: limit(cell),
                percent,
                at: cell.middle(),
            })
        }
        _ => Ok(()),
    }
}

fn shares_of(grid: &CellGrid, mean: &CellGrid) -> Vec<f64> {
    grid.cells().iter().zip(mean.cells()).map(|(cell, mean)| cell.mean / mean.mean).collect()
}

/// Standard deviation of a cell's mean, in % of it.
fn cell_noise_percent(cell: &Cell, noise_dn: f64) -> f64 {
    100.0 * noise_dn / (cell.mean * (cell.pixels as f64).sqrt())
}
