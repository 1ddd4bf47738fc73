//! Pictures inside the page.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::imageops::FilterType::Triangle;
use image::imageops::resize;
use image::{ExtendedColorType, ImageEncoder as _, ImageFormat, Rgb, RgbImage};
use maud::{Markup, Render, html};

use super::markup::scroll;
use crate::report::map_picture::reduced;
use crate::report::{Chart, MapPicture, ReportError};
use epirig_core::frame::Frame;
use epirig_core::grid::Grid;

/// Wider maps are reduced by whole numbers, so that the page stays small: with its scale bar a map is then as
/// wide as the text.
const WIDEST_MAP_PX: usize = 700;
/// The same for a map with a photograph beside it.
const WIDEST_PAIR_PX: usize = 400;

/// Wider pictures that were drawn before are resized to this: as wide as the text.
const WIDEST_PICTURE_PX: u32 = 960;

/// A picture as it stands in the page.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Picture {
    source: String,
    /// Whether it may be enlarged without harm, and has fine text.
    is_chart: bool,
    /// A sentence behind the caption; empty for none.
    remark: String,
}

impl Picture {
    /// A picture that was drawn before, from its file, not wider than the text; `None` if it cannot be read.
    pub(super) fn drawn(file: &[u8]) -> Option<Self> {
        let picture = image::load_from_memory_with_format(file, ImageFormat::Png).ok()?.into_rgb8();
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
        Self {
            source: format!("data:image/png;base64,{}", STANDARD.encode(bytes)),
            is_chart: false,
            remark: String::new(),
        }
    }

    /// The source of a picture in a file of PNG or JPEG.
    ///
    /// # Errors
    /// Why it is none, in words.
    pub(super) fn logo(file: &[u8]) -> Result<String, String> {
        let format = image::guess_format(file).ok();
        let format = format.filter(|format| matches!(format, ImageFormat::Png | ImageFormat::Jpeg));
        let format = format.ok_or("it is neither PNG nor JPEG")?;
        image::load_from_memory_with_format(file, format).map_err(|error| error.to_string())?;
        Ok(format!("data:{};base64,{}", format.to_mime_type(), STANDARD.encode(file)))
    }

    pub(super) fn chart(chart: &Chart) -> Result<Self, ReportError> {
        let svg = STANDARD.encode(chart.svg()?);
        let source = format!("data:image/svg+xml;base64,{svg}");
        Ok(Self { source, is_chart: true, remark: String::new() })
    }

    /// A map, at most as large as the page has room for.
    pub(super) fn map(picture: MapPicture<'_>, title: &str) -> Result<Self, ReportError> {
        let beside = picture.has_photograph();
        let picture = picture.at_most(if beside { WIDEST_PAIR_PX } else { WIDEST_MAP_PX });
        let remark = match picture.reduced_by() {
            1 => String::new(),
            factor => format!(" A pixel of the picture is the mean of {factor} x {factor} pixels."),
        };
        Ok(Self { remark, ..Self::rgb(&picture.picture()?, title)? })
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
        let means = reduced(&grey.map(f32::from), grey.columns().div_ceil(WIDEST_MAP_PX).max(1));
        let at = |x: u32, y: u32| Rgb([means.at(x as usize, y as usize).round() as u8; 3]);
        Self::rgb(&RgbImage::from_fn(means.columns() as u32, means.rows() as u32, at), title)
    }

    pub(super) fn rgb(picture: &RgbImage, title: &str) -> Result<Self, ReportError> {
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
            .write_image(picture.as_raw(), picture.width(), picture.height(), ExtendedColorType::Rgb8)
            .map_err(|error| ReportError::new(title, error))?;
        Ok(Self::png(&bytes))
    }

    /// The picture with its text for those who do not see it, and a caption.
    pub(super) fn figure(&self, alt: &str, caption: impl Render) -> Markup {
        let class = if self.is_chart { "chart" } else { "map" };
        let picture = html! { img src=(self.source) alt=(alt) class=(class); };
        // The text of a chart would be too small on a narrow screen, so it keeps a width and scrolls.
        let picture = if self.is_chart { scroll(alt, picture) } else { picture };
        html! { figure { (picture) figcaption { (caption) (self.remark) } } }
    }
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
