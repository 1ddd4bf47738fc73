//! Pictures inside the page.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::imageops::FilterType::Triangle;
use image::imageops::resize;
use image::{ExtendedColorType, ImageEncoder as _, Rgb, RgbImage};

use super::markup::{Markup, element, joined, void, with};
use crate::report::{Chart, ReportError, ValueRange, map_picture};
use epirig_core::frame::Frame;
use epirig_core::grid::Grid;

/// Wider maps are reduced by whole numbers, so that the page stays small: with its scale bar a map is then as
/// wide as the text.
const WIDEST_MAP_PX: usize = 700;

/// Wider pictures that were drawn before are resized to this: as wide as the text.
const WIDEST_PICTURE_PX: u32 = 960;

/// A picture as it stands in the page.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Picture {
    source: String,
    /// Whether it may be enlarged without harm, and has fine text.
    is_chart: bool,
}

impl Picture {
    /// A picture that was drawn before, from its file, not wider than the text; `None` if it cannot be read.
    pub(super) fn drawn(file: &[u8]) -> Option<Self> {
        let picture = image::load_from_memory_with_format(file, image::ImageFormat::Png).ok()?.into_rgb8();
        let wide = picture.width() > WIDEST_PICTURE_PX;
        let height = |width: u32| (picture.height() * WIDEST_PICTURE_PX).div_ceil(width).max(1);
        let drawn = match wide {
            true => {
                Self::rgb(&resize(&picture, WIDEST_PICTURE_PX, height(picture.width()), Triangle), "").ok()?
            }
            false => Self::png(file),
        };
        Some(Self { is_chart: true, ..drawn })
    }

    fn png(bytes: &[u8]) -> Self {
        Self { source: format!("data:image/png;base64,{}", STANDARD.encode(bytes)), is_chart: false }
    }

    pub(super) fn chart(chart: &Chart) -> Result<Self, ReportError> {
        let svg = STANDARD.encode(chart.svg()?);
        Ok(Self { source: format!("data:image/svg+xml;base64,{svg}"), is_chart: true })
    }

    /// A map with its scale bar, and how many pixels of the map are one of the picture along a side.
    pub(super) fn map(
        map: &Grid<f32>,
        title: &str,
        unit: &str,
        range: ValueRange,
    ) -> Result<(Self, usize), ReportError> {
        let factor = factor(map.columns());
        let picture = map_picture(&reduced(map, factor), title, unit, range)?;
        Ok((Self::rgb(&picture, title)?, factor))
    }

    /// Grey values; of those that make a pixel of the picture the first is taken, because codes have no mean.
    pub(super) fn codes(values: &Grid<u8>, title: &str) -> Result<Self, ReportError> {
        let factor = factor(values.columns());
        let size = (values.columns().div_ceil(factor) as u32, values.rows().div_ceil(factor) as u32);
        let at = |x: u32, y: u32| Rgb([values.at(x as usize * factor, y as usize * factor); 3]);
        Self::rgb(&RgbImage::from_fn(size.0, size.1, at), title)
    }

    /// A frame as the sensor gave it.
    pub(super) fn frame(frame: &Frame, title: &str) -> Result<Self, ReportError> {
        let count = frame.rows() * frame.columns();
        let mut samples = vec![0.0; count];
        frame.samples().copy_to_f32(0, &mut samples);
        let full = f32::from(frame.full_scale());
        let values = samples.iter().map(|sample| (255.0 * sample / full).round() as u8).collect();
        let grey = Grid::from_values(frame.rows(), frame.columns(), values)
            .ok_or_else(|| ReportError::new(title, "its size is wrong"))?;
        let factor = factor(grey.columns());
        let means = reduced(&grey.map(f32::from), factor);
        Self::codes(&means.map(|mean| mean.round() as u8), title)
    }

    fn rgb(picture: &RgbImage, title: &str) -> Result<Self, ReportError> {
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
            .write_image(picture.as_raw(), picture.width(), picture.height(), ExtendedColorType::Rgb8)
            .map_err(|error| ReportError::new(title, error))?;
        Ok(Self::png(&bytes))
    }

    /// The picture with its text for those who do not see it, and a caption.
    pub(super) fn figure(&self, alt: &str, caption: impl Into<Markup>) -> Markup {
        let class = if self.is_chart { "chart" } else { "map" };
        let picture = void("img", &[("src", &self.source), ("alt", alt), ("class", class)]);
        let picture = match self.is_chart {
            // The text of a chart would be too small on a narrow screen, so it keeps a width and scrolls.
            true => with(
                "div",
                &[("class", "scroll"), ("tabindex", "0"), ("role", "region"), ("aria-label", alt)],
                picture,
            ),
            false => picture,
        };
        element("figure", joined([picture, element("figcaption", caption)]))
    }
}

fn factor(columns: usize) -> usize {
    columns.div_ceil(WIDEST_MAP_PX).max(1)
}

/// Means of the known values of `factor` x `factor` pixels; unknown where more than half of them are.
fn reduced(map: &Grid<f32>, factor: usize) -> Grid<f32> {
    if factor == 1 {
        return map.clone();
    }
    let mut small = Grid::filled(map.rows().div_ceil(factor), map.columns().div_ceil(factor), f32::NAN);
    for y in 0..small.rows() {
        let rows = y * factor..((y + 1) * factor).min(map.rows());
        for (x, value) in small.row_mut(y).iter_mut().enumerate() {
            let columns = x * factor..((x + 1) * factor).min(map.columns());
            let (mut sum, mut known) = (0.0, 0);
            for y in rows.clone() {
                for here in &map.row(y)[columns.clone()] {
                    if here.is_finite() {
                        sum += here;
                        known += 1;
                    }
                }
            }
            if known > 0 && 2 * known >= rows.len() * columns.len() {
                *value = sum / known as f32;
            }
        }
    }
    small
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::frame::Samples;

    fn decoded(picture: &Picture) -> image::DynamicImage {
        let bytes = STANDARD.decode(picture.source.strip_prefix("data:image/png;base64,").unwrap()).unwrap();
        image::load_from_memory(&bytes).unwrap()
    }

    #[test]
    fn wide_maps_are_reduced_to_means_of_what_is_known() {
        assert_eq!([1, 700, 701, 1400, 1401, 4096].map(factor), [1, 1, 2, 2, 3, 6]);
        let mut map = Grid::from_values(3, 4, (0..12).map(|index| index as f32).collect()).unwrap();
        map.row_mut(0)[0] = f32::NAN;
        (map.row_mut(0)[2], map.row_mut(0)[3], map.row_mut(1)[2]) = (f32::NAN, f32::NAN, f32::NAN);
        let small = reduced(&map, 2);
        // Means of 1, 4, 5, of 8, 9 and of 10, 11; three of four are unknown at the upper right.
        assert_eq!((small.rows(), small.columns()), (2, 2));
        assert!((small.at(0, 0) - 10.0 / 3.0).abs() < 1e-6 && small.at(1, 0).is_nan());
        assert_eq!((small.at(0, 1), small.at(1, 1)), (8.5, 10.5));
    }

    #[test]
    fn pictures_that_were_drawn_are_not_wider_than_the_text() {
        let file = |width: u32| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            RgbImage::new(width, 300).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            bytes.into_inner()
        };
        let size = |width: u32| decoded(&Picture::drawn(&file(width)).unwrap()).into_rgb8().dimensions();
        assert_eq!((size(900), size(1920)), ((900, 300), (960, 150)));
        assert_eq!(Picture::drawn(b"no picture"), None);
    }

    #[test]
    fn a_frame_is_shown_from_black_to_its_full_scale() {
        let frame = Frame::new(1, 2, 12, Samples::U16(vec![0, 4095])).unwrap();
        let shown = Picture::frame(&frame, "frame").unwrap();
        assert_eq!(decoded(&shown).into_luma8().into_raw(), [0, 255]);
    }
}
