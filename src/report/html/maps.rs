//! The maps.

use std::ops::Range;

use super::contents::Report;
use super::markup::{Markup, joined, paragraph, table};
use super::number::percent;
use super::picture::Picture;
use crate::report::{ReportError, ValueRange};
use epirig_core::grid::Grid;
use epirig_core::statistics::upper_median;

/// Least span of the colours of heights, in mm, and of disparities, in px: as in the pictures of the results.
const HEIGHT_SPAN_MM: f32 = 0.01;
const DISPARITY_SPAN_PX: f32 = 0.05;
/// Colours of uncertainties reach to this many times the median: at borders they are many times that of the
/// surface.
const SIGMA_SPAN: f32 = 3.0;
/// What is shown around the field, in px.
const MARGIN_PX: usize = 16;

pub(super) fn maps(report: &Report<'_>) -> Result<Markup, ReportError> {
    let maps = &report.maps;
    let (columns, rows) = field(maps.rest_mm);
    let place = format!(
        "columns {} to {}, rows {} to {}",
        columns.start,
        columns.end.saturating_sub(1),
        rows.start,
        rows.end.saturating_sub(1)
    );
    let part = |map: &Grid<f32>| map.cropped(columns.clone(), rows.clone());
    let reduced = |factor: usize| match factor {
        1 => String::new(),
        factor => format!(" A pixel of the picture is the mean of {factor} x {factor} pixels."),
    };
    let heights = part(maps.rest_mm);
    let range = ValueRange::of(&heights, HEIGHT_SPAN_MM);
    let (height, factor) = Picture::map(&heights, "Height after the form", "mm", range)?;
    let height = height.figure(
        "Map of the height after removal of the form, in colours from dark (low) to bright (high)",
        format!(
            "Height after removal of the form, positive towards the camera: {place}, {:.4} mm for a pixel. Dark is \
             low, bright is high. Grey pixels have no height or are not part of the field.{}",
            report.surface.pixel_mm,
            reduced(factor)
        ),
    );
    let sigmas = part(maps.sigma_mm);
    let (uncertainty, factor) =
        Picture::map(&sigmas, "Standard uncertainty of the height", "mm", range_of_sigmas(&sigmas))?;
    let uncertainty = uncertainty.figure(
        "Map of the standard uncertainty of the height; bright pixels are known worst",
        format!(
            "Standard uncertainty of each height, without that of the scale, up to three times its median. Bright \
             pixels are known worst.{}",
            reduced(factor)
        ),
    );
    let range = ValueRange::of(maps.disparity_px, DISPARITY_SPAN_PX);
    let (disparity, factor) = Picture::map(maps.disparity_px, "Disparity", "px", range)?;
    let disparity = disparity.figure(
        "Map of the disparity of the whole picture, as matched",
        format!("Disparity over the whole baseline in the whole picture, as matched.{}", reduced(factor)),
    );
    let used = Picture::codes(&maps.used.cropped(columns, rows), "used pixels")?.figure(
        "Picture of the pixels that were used: white used, light grey walls and outliers, dark grey left out",
        "Which heights were used. White: used. Light grey: too near to a wall, or an outlier. Dark grey: \
         uncertain, apart or at the rim. Black: no height, or the target.",
    );
    let photograph = match maps.photograph {
        Some(frame) => Picture::frame(frame, "reference frame")?.figure(
            "Photograph of the object: the reference frame",
            format!("The reference frame (frame {}), as the sensor gave it.", report.matched.reference),
        ),
        None => paragraph("The reference frame cannot be read now, so it is not shown."),
    };
    Ok(joined([photograph, height, uncertainty, used, disparity, answers(report)]))
}

/// Columns and rows of the field, with a margin; all of the map if nothing is known.
fn field(map: &Grid<f32>) -> (Range<usize>, Range<usize>) {
    let known = |x: usize, y: usize| map.at(x, y).is_finite();
    let around = |size: usize, occupied: &dyn Fn(usize) -> bool| {
        let first = (0..size).find(|&index| occupied(index)).unwrap_or(0);
        let last = (0..size).rfind(|&index| occupied(index)).unwrap_or(size - 1);
        first.saturating_sub(MARGIN_PX)..(last + 1 + MARGIN_PX).min(size)
    };
    let (width, height) = (map.columns(), map.rows());
    (
        around(width, &|x| (0..height).any(|y| known(x, y))),
        around(height, &|y| (0..width).any(|x| known(x, y))),
    )
}

fn range_of_sigmas(map: &Grid<f32>) -> ValueRange {
    let mut known: Vec<f32> = map.values().iter().copied().filter(|value| value.is_finite()).collect();
    ValueRange { low: 0.0, high: SIGMA_SPAN * upper_median(&mut known).unwrap_or(1.0) }
}

/// Why pixels have no answer.
fn answers(report: &Report<'_>) -> Markup {
    let matched = report.matched;
    let rows = [
        ("answered", matched.answered),
        ("the point leaves the image", matched.leaves_image),
        ("best candidate at an end of the range", matched.beyond_range),
        ("too little texture", matched.no_texture),
        ("occluded in too many frames", matched.occluded),
        ("ambiguous", matched.ambiguous),
    ];
    table(
        "Pixels with and without an answer",
        &["answer", "share of all pixels"],
        rows.map(|(name, share)| vec![name.into(), percent(share).into()]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_cut_to_the_field_and_its_margin() {
        let mut map = Grid::filled(60, 100, f32::NAN);
        assert_eq!(field(&map), (0..100, 0..60));
        (map.row_mut(20)[40], map.row_mut(22)[90]) = (1.0, 2.0);
        assert_eq!(field(&map), (24..100, 4..39));
    }
}
