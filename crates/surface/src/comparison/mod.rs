//! Two height maps of one object, taken in two scans: their difference, its uncertainty, and where it is large.
//!
//! The caller knows where each pixel of the first map is in the second, for example by image registration. A trend of low order is removed from
//! the difference, since heights of two scans have no common zero and the object may stand differently. What is
//! left is change, and noise that the sigmas of both maps predict.

mod places;
mod resample;
#[cfg(test)]
mod tests;

use serde::Serialize;
use thiserror::Error;

use crate::{Heights, SurfaceError, Trend, TrendKind, find_extent, fit_trend};
use epirig_core::grid::Grid;
use epirig_core::statistics::{mean, median};
pub use places::Place;
use places::places;
use resample::{carried, carried_forward, slopes};

/// Fewest common pixels of a comparison: with fewer, a tilt cannot be told from a change.
const LEAST_COMMON_PX: usize = 200;
/// The median of the absolute deviations of Gaussian values, as a share of their standard deviation.
const MEDIAN_DEVIATION: f64 = 0.674_489_75;

/// Why two height maps cannot be compared.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ComparisonError {
    /// Hardly any pixel has a height in both.
    #[error(
        "only {common_px} pixels have a height in both scans ({least_px} are needed): after registration they show different parts of \
         the object; place it as in the first scan, or choose a larger region"
    )]
    NoOverlap {
        /// Pixels with both.
        common_px: usize,
        /// The fewest that are needed.
        least_px: usize,
    },
    /// A map has no region that is wide enough, or the trend of the difference cannot be fitted.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
}

/// How the differences are distributed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DifferenceStatistics {
    /// Pixels with a height in both maps.
    pub pixels: usize,
    /// Mean difference, in mm.
    pub mean_mm: f64,
    /// Median difference, in mm.
    pub median_mm: f64,
    /// Robust standard deviation, from the median of the absolute deviations from the median, in mm.
    pub scatter_mm: f64,
    /// Median standard uncertainty of a difference, in mm.
    pub median_sigma_mm: f64,
    /// Share of the differences within one sigma; 0.68 if nothing changed.
    pub within_1_sigma: f64,
    /// Share within two sigma; 0.95 if nothing changed.
    pub within_2_sigma: f64,
}

/// The difference of two height maps.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Second less first height after removal of the trend, in mm: positive where the second scan is nearer to the
    /// camera; rows x columns of the first map, NaN where a height is missing.
    pub difference_mm: Grid<f32>,
    /// Its standard uncertainty, in mm: of both heights, and of the registration on slopes. Without that of the
    /// scale, and of the trend, which is small beside them.
    pub sigma_mm: Grid<f32>,
    /// What was removed.
    pub trend: Trend,
    /// The numbers.
    pub statistics: DifferenceStatistics,
    /// Where the difference is significant, the largest volume first.
    pub places: Vec<Place>,
}

/// How two maps lie upon each other.
#[derive(Clone, Copy)]
pub struct Registration<'a> {
    /// Column and row in the second map of a column and a row of the first, in px.
    pub place: &'a dyn Fn(f64, f64) -> (f64, f64),
    /// Standard uncertainty of such a place, in px.
    pub sigma_px: f64,
}

/// Compares `second` with `first`. Only pixels of the first map that `inside` holds count, if it is given.
///
/// Of both maps the largest connected region counts, without uncertain heights and without its rim, as
/// [`find_extent`] finds it with these margins in px, one for each map: answers beside an object are wrong, and differ
/// from scan to scan. Heights between pixels are interpolated linearly along both axes, and their sigmas likewise.
///
/// # Errors
/// [`ComparisonError`].
///
/// # Panics
/// If `inside` has another size than the first map.
pub fn compare(
    [first, second]: [&Heights; 2],
    registration: Registration<'_>,
    trend: TrendKind,
    inside: Option<&Grid<bool>>,
    margins_px: [(usize, usize); 2],
) -> Result<Comparison, ComparisonError> {
    let (rows, columns) = (first.height_mm.rows(), first.height_mm.columns());
    let there = inside.map(|inside| carried_forward(inside, registration.place, &second.height_mm));
    let first = &first.only(&find_extent(first, inside, margins_px[0])?.used);
    let second = &second.only(&find_extent(second, there.as_ref(), margins_px[1])?.used);
    let [mut difference_mm, sigma_of_second] =
        [&second.height_mm, &second.sigma_mm].map(|map| carried(map, registration.place, (rows, columns)));
    let slope = slopes(&first.height_mm);
    let mut sigma_mm = Grid::filled(rows, columns, f32::NAN);
    let mut common_px = 0;
    for (index, difference) in difference_mm.values_mut().iter_mut().enumerate() {
        let sigmas = [
            first.sigma_mm.values()[index],
            sigma_of_second.values()[index],
            slope.values()[index] * registration.sigma_px as f32,
        ];
        let sigma = sigmas.iter().map(|sigma| sigma * sigma).sum::<f32>().sqrt();
        *difference -= first.height_mm.values()[index];
        if difference.is_finite() && sigma.is_finite() {
            sigma_mm.values_mut()[index] = sigma;
            common_px += 1;
        } else {
            *difference = f32::NAN;
        }
    }
    if common_px < LEAST_COMMON_PX {
        return Err(ComparisonError::NoOverlap { common_px, least_px: LEAST_COMMON_PX });
    }
    let raw = Heights {
        height_mm: difference_mm,
        sigma_mm,
        distance_mm: first.distance_mm,
        geometry: first.geometry,
    };
    let trend = fit_trend(&raw, trend)?;
    let difference_mm = trend.removed_from(&raw);
    let statistics = statistics(&difference_mm, &raw.sigma_mm);
    let places = places(&difference_mm, &raw.sigma_mm, first.pixel_mm());
    Ok(Comparison { difference_mm, sigma_mm: raw.sigma_mm, trend, statistics, places })
}

fn statistics(difference_mm: &Grid<f32>, sigma_mm: &Grid<f32>) -> DifferenceStatistics {
    let pairs = difference_mm.values().iter().zip(sigma_mm.values());
    let (mut differences, mut sigmas): (Vec<f64>, Vec<f64>) = pairs
        .filter(|(difference, _)| difference.is_finite())
        .map(|(&difference, &sigma)| (f64::from(difference), f64::from(sigma)))
        .unzip();
    let pixels = differences.len();
    let within = |factor: f64| {
        let count = differences.iter().zip(&sigmas).filter(|(d, sigma)| d.abs() <= factor * *sigma).count();
        count as f64 / pixels.max(1) as f64
    };
    let (within_1_sigma, within_2_sigma) = (within(1.0), within(2.0));
    let mean_mm = mean(&differences);
    let median_mm = median(&mut differences).unwrap_or(f64::NAN);
    let mut deviations: Vec<f64> = differences.iter().map(|value| (value - median_mm).abs()).collect();
    DifferenceStatistics {
        pixels,
        mean_mm,
        median_mm,
        scatter_mm: median(&mut deviations).unwrap_or(f64::NAN) / MEDIAN_DEVIATION,
        median_sigma_mm: median(&mut sigmas).unwrap_or(f64::NAN),
        within_1_sigma,
        within_2_sigma,
    }
}
