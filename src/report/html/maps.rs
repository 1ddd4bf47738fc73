//! The maps.

use super::contents::Report;
use super::markup::{cells, table};
use super::picture::Picture;
use crate::number::share;
use crate::report::{MapPicture, Millimetres, ReportError, ValueRange, Window, class_picture};
use crate::results::{ResultMap, class_of, reason};
use epirig_core::choice::Choice as _;
use epirig_core::statistics::upper_median;
use epirig_matcher::Validity;
use maud::{Markup, html};

/// Colours of uncertainties reach to this many times the median: at borders they are many times that of the
/// surface.
const SIGMA_SPAN: f32 = 3.0;

/// The picture of the heights, beside the reference frame.
pub(super) fn height(report: &Report<'_>) -> Result<Markup, ReportError> {
    let maps = &report.maps;
    let Window { columns, rows } = Window::around(maps.rest_mm);
    let heights = MapPicture::of(ResultMap::HeightWithoutForm, maps.rest_mm);
    let heights = heights.in_mm(Some(millimetres(report))).beside(maps.matched_frame);
    let beside = if heights.has_photograph() { "Left: the reference frame. Right: height" } else { "Height" };
    let height = Picture::map(heights, ResultMap::HeightWithoutForm.row().title)?;
    Ok(height.figure(
        "Map of the height after removal of the form, in colours from dark (low) to bright (high)",
        format!(
            "{beside} after removal of the form, positive towards the camera: columns {} to {}, rows {} to {}, {:.4} mm \
             for a pixel. Dark is low, bright is high; walls are shaded. Triangles at the scale mean that some heights lie \
             beyond it. Grey pixels have no height or are not part of the field.",
            columns.start,
            columns.end.saturating_sub(1),
            rows.start,
            rows.end.saturating_sub(1),
            report.surface.pixel_mm
        ),
    ))
}

fn millimetres(report: &Report<'_>) -> Millimetres {
    Millimetres { pixel_mm: report.surface.pixel_mm, origin_px: report.surface.origin_px }
}

pub(super) fn maps(report: &Report<'_>) -> Result<Markup, ReportError> {
    let maps = &report.maps;
    let window = Window::around(maps.rest_mm);
    let millimetres = Some(self::millimetres(report));
    let shown = window.of(maps.sigma_mm);
    let mut known: Vec<f32> = shown.values().iter().copied().filter(|value| value.is_finite()).collect();
    let range = ValueRange { low: 0.0, high: SIGMA_SPAN * upper_median(&mut known).unwrap_or(1.0) };
    let sigmas = MapPicture::over(ResultMap::HeightSigma, maps.sigma_mm, range).in_mm(millimetres);
    let title = ResultMap::HeightSigma.row().title;
    let uncertainty = Picture::map(sigmas.within(window.clone()), title)?;
    let uncertainty = uncertainty.figure(
        "Map of the standard uncertainty of the height; bright pixels are known worst",
        "Standard uncertainty of each height, without that of the scale, up to three times its median. Bright pixels \
         are known worst.",
    );
    let whole = Window::whole(maps.disparity_px.rows(), maps.disparity_px.columns());
    let disparity = MapPicture::of(ResultMap::Disparity, maps.disparity_px).in_mm(millimetres).within(whole);
    let disparity = Picture::map(disparity, ResultMap::Disparity.row().title)?;
    let disparity = disparity.figure(
        "Map of the disparity of the whole picture, as matched",
        "Disparity over the whole baseline in the whole picture, as matched.",
    );
    let used = class_picture(ResultMap::Used, maps.used, (&window, millimetres))?;
    let used = Picture::rgb(&used, ResultMap::Used.row().title)?.figure(
        "Picture of the pixels that were used, in a colour for each use, with a legend",
        "Which heights were used. Walls: too near to a wall for the levels. Left out: uncertain, apart or at the rim.",
    );
    let photograph = match maps.photograph {
        Some(frame) => Picture::frame(frame, "reference frame")?.figure(
            "Photograph of the object: the reference frame",
            format!("The reference frame (frame {}), as the sensor gave it.", report.matched.reference),
        ),
        None => html! { p { "The reference frame cannot be read now, so it is not shown." } },
    };
    Ok(html! {
        div.beside { (photograph) (uncertainty) (used) (disparity) }
        (answers(report))
    })
}

/// Why pixels have no answer.
fn answers(report: &Report<'_>) -> Markup {
    table(
        "Pixels with and without an answer",
        &["answer", "share of all pixels", "why"],
        html! {
            @for validity in Validity::ALL {
                (cells(class_of(*validity).name, [&share(report.matched.share(*validity)), &reason(*validity)]))
            }
        },
    )
}
