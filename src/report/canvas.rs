//! Pictures that plotters draws into, with a font of our own.

use image::{Rgb, RgbImage};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use super::ReportError;

/// The name of the font in charts.
pub(super) const FONT: &str = "sans-serif";

/// All pixels of a picture.
pub(super) type Canvas<'a> = DrawingArea<BitMapBackend<'a>, Shift>;

/// Whether something was drawn; else why not.
pub(super) type Drawn = Result<(), String>;

/// What `draw` draws on a white picture of this width and height.
pub(super) fn drawn(
    title: &str,
    (width, height): (u32, u32),
    draw: impl FnOnce(&Canvas<'_>) -> Drawn,
) -> Result<RgbImage, ReportError> {
    let white = RgbImage::from_pixel(width, height, Rgb([255; 3]));
    drawn_over(white, draw).map_err(|reason| ReportError::new(title, reason))
}

/// What `draw` draws over a picture.
pub(super) fn drawn_over(
    mut picture: RgbImage,
    draw: impl FnOnce(&Canvas<'_>) -> Drawn,
) -> Result<RgbImage, String> {
    use_own_font();
    let size = picture.dimensions();
    let canvas = BitMapBackend::with_buffer(&mut picture, size).into_drawing_area();
    draw(&canvas)?;
    canvas.present().map_err(say)?;
    drop(canvas);
    Ok(picture)
}

/// Registers the embedded font, so that no installed font is needed.
pub(super) fn use_own_font() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    // A broken font is reported by the first picture that draws text.
    ONCE.call_once(|| {
        let _ = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
    });
}

/// Why something was not drawn, in words.
pub(super) fn say(error: impl std::fmt::Display) -> String {
    error.to_string()
}
