//! The flat field: vignetting and the fixed gain of pixels, from frames of a uniform target.

use serde::{Deserialize, Serialize};

use super::average::{Sums, check_alike};
use super::cross_validation::{Halves, Trial, TrialModel, best, trials_between_halves, trials_over_cells};
use super::flat_checks::{check_frames, check_light, check_saturation, check_uniformity};
use super::grid::CellGrid;
use super::outliers::{Outlier, OutlierKind, departing, replace};
use super::polynomial::{HIGHEST_ORDER, Polynomial};
use super::{DarkFrame, DarkModel, PhotometryError};
use epirig_core::frame::Frame;
use epirig_core::grid::Grid;
use epirig_core::statistics::{mean, root_mean_square};

/// A pixel's gain departs from its neighbours' by more than this share, or the pixel may be used: less drowns
/// in a frame's noise of about 1 %.
const LEAST_GAIN_DEPARTURE: f64 = 0.02;

/// How the flat field is modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FlatMethod {
    /// A polynomial of this total order, 0 to [`HIGHEST_ORDER`], fitted to the means of 10 x 10 cells; order
    /// 3 is the paper's.
    Polynomial(usize),
    /// The simplest of all polynomials and the map whose error is not significantly larger than the least, by
    /// cross-validation.
    Automatic,
    /// The mean of every pixel, with the noise of the flat frames in it.
    PerPixel,
}

/// The gain that was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FlatModel {
    /// A polynomial with mean 1 over the image.
    Polynomial(Polynomial),
    /// A map with mean 1, which is stored in a file of its own.
    PerPixel,
}

/// A flat field and its quality. The gain has mean 1 over the image: the brightness of the flat frames is
/// that of their lamp, not of the camera. So a corrected frame keeps its mean level and fits its bit depth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlatField {
    /// The method chosen.
    pub method: FlatMethod,
    /// The gain.
    pub model: FlatModel,
    /// Number of flat frames.
    pub frames: usize,
    /// Residuals of the cells' means against the model, in % of the model there; a list for each row of
    /// cells.
    pub residual_percent: Vec<Vec<f64>>,
    /// Root mean square of these.
    pub residual_rms_percent: f64,
    /// How much darker the darkest corner is than the brightest place, in %, as a polynomial has it: the
    /// model, or for a map the polynomial of the highest order that its cells determine.
    pub vignetting_percent: f64,
    /// The cross-validation, simplest model first; empty unless the method is [`FlatMethod::Automatic`].
    pub trials: Vec<Trial>,
    /// Standard deviation of the correction by the noise of the flat frames, in %, root mean square over the
    /// image; for a single flat frame that of a polynomial is from the residuals, that of a map unknown.
    pub sigma_percent: Option<f64>,
    /// Pixels whose gain is far from their neighbours', by row and column.
    pub outliers: Vec<Outlier>,
}

/// The mean of flat frames, and the means of their halves.
struct Flat {
    mean: Grid<f32>,
    grid: CellGrid,
    halves: Option<Halves>,
    /// Variance of a sample, in squared DN.
    variance_dn2: Option<f64>,
    frames: usize,
    outliers: Vec<Outlier>,
}

/// The flat field from `frames` of a uniform target, less the dark level of `dark`, and the map of the gain
/// if the model is a map. Frames with even and with odd places are summed up apart, one after the other.
///
/// # Errors
/// [`PhotometryError`] if there are no frames, they are not alike, saturated, too dark, or not uniform, or
/// the order is too high.
pub fn flat_field(
    frames: &[Frame],
    dark: Option<&DarkFrame>,
    method: FlatMethod,
) -> Result<(FlatField, Option<Grid<f32>>), PhotometryError> {
    let flat = take_up(frames, dark)?;
    let (rows, columns) = (flat.mean.rows(), flat.mean.columns());
    let trials = match (method, &flat.halves) {
        (FlatMethod::Automatic, Some(halves)) => trials_between_halves(halves),
        (FlatMethod::Automatic, None) => trials_over_cells(&flat.grid, rows, columns),
        _ => Vec::new(),
    };
    let chosen = match method {
        FlatMethod::Polynomial(order) => TrialModel::Polynomial(order),
        FlatMethod::PerPixel => TrialModel::PerPixel,
        FlatMethod::Automatic => best(&trials).unwrap_or(TrialModel::Polynomial(0)),
    };
    let fit = |order| Polynomial::fit(order, rows, columns, flat.grid.cells());
    let (model, smooth, map) = match chosen {
        TrialModel::Polynomial(order) => {
            let cells = flat.grid.cells().len();
            let fitted =
                fit(order).ok_or(PhotometryError::Undetermined { order, cells, highest: HIGHEST_ORDER })?;
            let mean = fitted.mean();
            let polynomial = fitted.scaled(1.0 / mean);
            (FlatModel::Polynomial(polynomial.clone()), Some(polynomial), None)
        }
        TrialModel::PerPixel => {
            let mut map = flat.mean.clone();
            let scale = (1.0 / mean_of(&map)) as f32;
            map.values_mut().iter_mut().for_each(|value| *value *= scale);
            (FlatModel::PerPixel, (0..=HIGHEST_ORDER).rev().find_map(fit), Some(map))
        }
    };
    let gain = map.clone().or_else(|| smooth.as_ref().map(Polynomial::image));
    let positive = |gain: &Grid<f32>| gain.values().iter().all(|&gain| gain > 0.0 && gain.is_finite());
    let Some(gain) = gain.filter(positive) else { return Err(PhotometryError::NotPositive) };
    let residuals = residuals_percent(&flat.grid, &gain);
    let field = FlatField {
        method,
        vignetting_percent: smooth.as_ref().map_or(0.0, vignetting_percent),
        residual_rms_percent: root_mean_square(&residuals),
        residual_percent: flat.grid.table(&residuals),
        sigma_percent: sigma_percent(&flat, &model, &residuals),
        model,
        frames: flat.frames,
        trials,
        outliers: flat.outliers,
    };
    Ok((field, map))
}

/// Sums the frames up, less the dark level, and refuses those that will not do.
fn take_up(frames: &[Frame], dark: Option<&DarkFrame>) -> Result<Flat, PhotometryError> {
    check_alike("flat", frames)?;
    check_saturation(frames)?;
    let (rows, columns) = (frames[0].rows(), frames[0].columns());
    let mut sums = Sums::of(rows, columns, frames.iter().step_by(2));
    let odd = Sums::of(rows, columns, frames.iter().skip(1).step_by(2));
    let halves = (frames.len() > 1).then(|| (less_dark(sums.mean(), dark), less_dark(odd.mean(), dark)));
    let even_frames = sums.frames;
    sums.merge(&odd);
    let as_it_is = sums.mean();
    let mut mean = less_dark(as_it_is.clone(), dark);
    let kinds = [OutlierKind::Sensitive, OutlierKind::Dead];
    let outliers = departing(&mean, LEAST_GAIN_DEPARTURE, true, kinds);
    let defective = dark.iter().flat_map(|dark| &dark.outliers);
    let mut bad: Vec<(usize, usize)> =
        outliers.iter().chain(defective).map(|outlier| (outlier.x, outlier.y)).collect();
    bad.sort_unstable();
    bad.dedup();
    replace(&mut mean, &bad);
    let grid = CellGrid::of(&mean);
    let variance_dn2 =
        sums.variance_dn2(&bad).map(|variance| (variance - lamp_variance_dn2(frames)).max(0.0));
    let noise_dn = variance_dn2.unwrap_or(0.0).sqrt();
    check_light(&grid, frames[0].full_scale())?;
    check_frames(frames, &CellGrid::of_all_pixels(&as_it_is), noise_dn)?;
    check_uniformity(&grid, rows, columns, noise_dn / (frames.len() as f64).sqrt())?;
    let halves = halves.map(|(mut even, mut odd_mean)| {
        replace(&mut even, &bad);
        replace(&mut odd_mean, &bad);
        Halves::new([even, odd_mean], [even_frames, odd.frames])
    });
    Ok(Flat { mean, grid, halves, variance_dn2, frames: frames.len(), outliers })
}

/// Variance of a sample that comes from the brightness of the frames as wholes, in squared DN.
fn lamp_variance_dn2(frames: &[Frame]) -> f64 {
    let levels: Vec<f64> = frames.iter().map(|frame| frame.samples().mean()).collect();
    let mean = mean(&levels);
    levels.iter().map(|level| (level - mean).powi(2)).sum::<f64>()
        / levels.len().saturating_sub(1).max(1) as f64
}

fn less_dark(mut mean: Grid<f32>, dark: Option<&DarkFrame>) -> Grid<f32> {
    let Some(dark) = dark else { return mean };
    match dark.record.model {
        DarkModel::LevelDn(level_dn) => {
            mean.values_mut().iter_mut().for_each(|value| *value -= level_dn as f32);
        }
        DarkModel::Map => {
            mean.values_mut().iter_mut().zip(dark.mean.values()).for_each(|(value, dark)| *value -= dark);
        }
        DarkModel::CutOff(_) => {}
    }
    mean
}

/// Residuals of the cells after correction by the gain, in %, each against the mean of all.
fn residuals_percent(grid: &CellGrid, gain: &Grid<f32>) -> Vec<f64> {
    let left: Vec<f64> = grid
        .cells()
        .iter()
        .map(|cell| {
            let rows = cell.rows.clone().map(|y| &gain.row(y)[cell.columns.clone()]);
            let sum: f64 = rows.flatten().map(|&gain| f64::from(gain)).sum();
            cell.mean * (cell.rows.len() * cell.columns.len()) as f64 / sum
        })
        .collect();
    let mean = mean(&left);
    left.iter().map(|left| 100.0 * (left / mean - 1.0)).collect()
}

/// Standard deviation of the correction by the frames' noise. A least squares fit of p coefficients to n
/// cells has, on the average over the cells, the variance of a cell times p / n (the trace of the hat matrix
/// is p).
fn sigma_percent(flat: &Flat, model: &FlatModel, residuals_percent: &[f64]) -> Option<f64> {
    let level = flat.grid.mean();
    let of_pixel = flat.variance_dn2.map(|variance| 100.0 * (variance / flat.frames as f64).sqrt() / level);
    match model {
        FlatModel::PerPixel => of_pixel,
        FlatModel::Polynomial(polynomial) => {
            let cells = flat.grid.cells();
            let (count, terms) = (cells.len() as f64, polynomial.coefficients().len() as f64);
            let of_cell = match of_pixel {
                Some(of_pixel) => {
                    let pixels = cells.iter().map(|cell| cell.pixels).sum::<usize>() as f64 / count;
                    of_pixel / pixels.sqrt()
                }
                None if count > terms => {
                    root_mean_square(residuals_percent) * (count / (count - terms)).sqrt()
                }
                None => return None,
            };
            Some(of_cell * (terms / count).sqrt())
        }
    }
}

/// Vignetting in %: the darkest corner against the brightest of all pixels.
fn vignetting_percent(model: &Polynomial) -> f64 {
    let (right, bottom) = ((model.columns() - 1) as f64, (model.rows() - 1) as f64);
    let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
    let darkest = corners.map(|(x, y)| model.at(x, y)).into_iter().fold(f64::INFINITY, f64::min);
    let brightest =
        model.image().values().iter().fold(f64::MIN_POSITIVE, |most, &value| most.max(value.into()));
    100.0 * (1.0 - darkest / brightest)
}

fn mean_of(image: &Grid<f32>) -> f64 {
    image.values().iter().map(|&value| f64::from(value)).sum::<f64>() / image.values().len().max(1) as f64
}
