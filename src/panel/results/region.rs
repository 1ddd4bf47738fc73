//! A region of the heights in numbers.

use serde::Serialize;

use super::levelled::{shown_heights, tilt_mrad};
use super::surface::{heights, region_of};
use super::view::ResultsView;
use crate::panel::PanelError;
#[cfg(test)]
use crate::panel::page_type_tests;
use crate::panel::requests::requests;
use epirig_surface::{RegionStatistics, Roughness};

requests! {
    /// A region of a map of heights, in px: it ends before `x1` and `y1`.
    RegionQuery {
        map: String,
        x0: usize,
        y0: usize,
        x1: usize,
        y1: usize,
        /// By what the map is levelled, as in `LevelledQuery`.
        levelled_by: Option<String>,
    }
}

/// Mean height, tilt, and roughness about the least-squares plane. Uncertainties come from the scatter between
/// independent parts of the region; `None` if it has too few.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct RegionInfo {
    /// Pixels of the region; those of `roughness` are answered.
    pixels: usize,
    mean_mm: f64,
    mean_sigma_mm: Option<f64>,
    /// Positive where the right or the lower side is nearer to the camera.
    tilt_x_mrad: f64,
    tilt_x_sigma_mrad: Option<f64>,
    tilt_y_mrad: f64,
    tilt_y_sigma_mrad: Option<f64>,
    #[cfg_attr(test, ts(as = "page_type_tests::Roughness"))]
    roughness: Roughness,
}

/// The region in numbers.
pub(super) fn region(view: &ResultsView, asked: &RegionQuery) -> Result<RegionInfo, PanelError> {
    let shown = shown_heights(view, &asked.map, asked.levelled_by.as_deref())?;
    let region = region_of([asked.x0, asked.y0, asked.x1, asked.y1], &shown)?;
    let found = RegionStatistics::of(heights(view)?, &shown, region)?;
    let (tilt_x_mrad, tilt_y_mrad) = tilt_mrad(&found.plane);
    // The tilt is small: an angle errs as its slope does.
    let mrad = |slope: Option<f64>| slope.map(|slope| 1e3 * slope);
    Ok(RegionInfo {
        pixels: found.pixels,
        mean_mm: found.mean_mm,
        mean_sigma_mm: found.mean_sigma_mm,
        tilt_x_mrad,
        tilt_x_sigma_mrad: mrad(found.slope_sigmas[0]),
        tilt_y_mrad,
        tilt_y_sigma_mrad: mrad(found.slope_sigmas[1]),
        roughness: found.roughness,
    })
}
