//! Image files, decoded to frames and encoded from them.

mod bmp;
mod fault;
mod focal_length;
mod foreign;
mod formats;
mod jpeg;
mod pnm;
mod taken;
mod tiff;

use std::io::Cursor;

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageEncoder, ImageFormat, ImageReader};

use epirig_core::frame::{Frame, FrameError, Samples};
use epirig_core::grid::area;
pub use fault::ImageFault;
pub use focal_length::{ExifFocalLength, ToldLength};
pub(super) use focal_length::{FocalLengths, focal_length};
pub use foreign::ForeignFormat;
pub(super) use foreign::{TELLING_BYTES, foreign_format, foreign_name};
pub use formats::image_formats;
pub(super) use formats::is_image_name;
use formats::kind_of;
pub use taken::time_taken;
pub(super) use taken::{exif_of, time_of};

/// An image as a grey frame, with its conversion.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecodedImage {
    /// The grey frame, 8 or 16 bit.
    pub frame: Frame,
    /// Whether the file is a grey PNG that can be used as it is.
    pub usable_as_is: bool,
    /// The conversion in words; `None` for a grey image in a lossless format.
    pub conversion: Option<&'static str>,
}

/// The header of an image file, before a pixel is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Rows of the frame that it makes.
    pub rows: usize,
    /// Columns of that frame.
    pub columns: usize,
    /// Bits of its stored samples: 8 or 16, or what a PGM states.
    pub bits: u8,
}

/// Reads the head of an image file alone: a small file can say that it is very large.
///
/// # Errors
/// [`ImageFault`].
pub fn header(bytes: &[u8]) -> Result<Header, ImageFault> {
    let (bytes, _) = tiff::without_palette(bytes)?;
    head(&bytes).map(|(_, _, _, header)| header)
}

/// Bytes of the largest image file that is read: room for the largest that is decoded, if it is not
/// compressed.
pub const LARGEST_IMAGE: u64 = 5 << 28;

/// Most bytes that the decoded image may take: 16 bit grey of the largest size takes half of it, colour of 8
/// bit three quarters.
const MOST_DECODED: u64 = 1 << 30;

type Head<'a> = (ImageFormat, Box<dyn ImageDecoder + 'a>, Orientation, Header);

fn head(bytes: &[u8]) -> Result<Head<'_>, ImageFault> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| ImageFault::Damaged(error.to_string()))?;
    let unknown = || ImageFault::Damaged(format!("it is none of {}", image_formats()));
    let kind = reader.format().and_then(kind_of).ok_or_else(unknown)?;
    let format = kind.format;
    if format == ImageFormat::Tiff {
        tiff::refuse_floats(bytes)?;
    }
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(match format {
        // For PNG this limits data beside the pixels, such as colour profiles.
        ImageFormat::Png => 64 << 20,
        _ => 2 * MOST_DECODED,
    });
    reader.limits(limits);
    let mut decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    let (mut rows, mut columns) = (height as usize, width as usize);
    if area(rows, columns).is_none() {
        return Err(ImageFault::TooLarge { rows, columns });
    }
    if decoder.total_bytes() > MOST_DECODED {
        let reason = "it takes more than 1 GiB decoded; save it as a grey PNG of 8 or 16 bit";
        return Err(ImageFault::Unsupported(reason.to_owned()));
    }
    (kind.check)(bytes, rows, columns)?;
    let colour = decoder.color_type();
    let stored = match colour.bytes_per_pixel() / colour.channel_count() {
        1 => 8,
        2 => 16,
        _ => {
            let reason = "its samples are not of 8 or 16 bit; save it as a grey PNG of 8 or 16 bit";
            return Err(ImageFault::Unsupported(reason.to_owned()));
        }
    };
    let stated = if format == ImageFormat::Pnm { pnm::stated_bits(bytes) } else { None };
    let bits = stated.unwrap_or(stored);
    let orientation = decoder.orientation()?;
    if turns_by_a_quarter(orientation) {
        (rows, columns) = (columns, rows);
    }
    Ok((format, Box::new(decoder), orientation, Header { rows, columns, bits }))
}

/// Whether rows become columns.
fn turns_by_a_quarter(orientation: Orientation) -> bool {
    matches!(
        orientation,
        Orientation::Rotate90
            | Orientation::Rotate270
            | Orientation::Rotate90FlipH
            | Orientation::Rotate270FlipH
    )
}

/// Decodes an image file, whatever its name says, and makes it grey: Rec. 709 luma of the stored
/// values, transparency ignored.
///
/// # Errors
/// [`ImageFault`].
pub fn decode_grey(bytes: &[u8]) -> Result<DecodedImage, ImageFault> {
    let (bytes, palette) = tiff::without_palette(bytes)?;
    let (format, decoder, orientation, Header { bits, .. }) = head(&bytes)?;
    let mut image = DynamicImage::from_decoder(decoder)?;
    if let Some(palette) = palette {
        image = palette.colours(&image)?;
    }
    let turned = orientation != Orientation::NoTransforms;
    image.apply_orientation(orientation);
    let (width, height) = (image.width(), image.height());
    let lossy = format == ImageFormat::Jpeg;
    let colour = image.color().has_color();
    let alpha = image.color().has_alpha();
    let conversion = match (colour, lossy) {
        _ if turned => Some(
            "turned upright as its orientation tag says, converted to grey if it was colour, without transparency",
        ),
        (true, true) => {
            Some("colour JPEG converted to grey (Rec. 709 luma); lossy compression limits accuracy")
        }
        (true, false) if alpha => Some("colour converted to grey (Rec. 709 luma), transparency dropped"),
        (true, false) => Some("colour converted to grey (Rec. 709 luma)"),
        (false, true) => Some("JPEG decoded; lossy compression limits accuracy"),
        (false, false) => alpha.then_some("transparency dropped"),
    };
    let mut samples = match image {
        DynamicImage::ImageLuma8(grey) => Samples::U8(grey.into_raw()),
        DynamicImage::ImageLuma16(grey) => Samples::U16(grey.into_raw()),
        wide @ (DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_)) => Samples::U16(wide.to_luma16().into_raw()),
        narrow => Samples::U8(narrow.to_luma8().into_raw()),
    };
    match &mut samples {
        Samples::U8(values) if bits < 8 => pnm::unscale(values, 0xff, bits),
        Samples::U16(values) if bits < 16 => pnm::unscale(values, 0xffff, bits),
        _ => {}
    }
    let frame = Frame::new(height as usize, width as usize, bits, samples)
        .map_err(|error| ImageFault::Damaged(error.to_string()))?;
    let usable_as_is = format == ImageFormat::Png && conversion.is_none();
    Ok(DecodedImage { frame, usable_as_is, conversion })
}

/// The same frame with a stated bit depth; samples above 8 bit stay in 16.
///
/// # Errors
/// [`FrameError::BitDepth`] if the samples do not fit.
pub(super) fn with_bit_depth(frame: Frame, bit_depth: u8) -> Result<Frame, FrameError> {
    if frame.bit_depth() == bit_depth {
        return Ok(frame);
    }
    if (frame.bit_depth() <= 8) != (bit_depth <= 8) {
        return Err(FrameError::Width { stored: frame.bit_depth(), stated: bit_depth });
    }
    Frame::new(frame.rows(), frame.columns(), bit_depth, frame.samples().clone())
}

/// A grey PNG of 8 bit, or of 16 bit for bit depths above 8, with the samples as they are.
///
/// # Errors
/// What the encoder says; in memory it has no reason to.
pub fn encode_png(frame: &Frame) -> Result<Vec<u8>, image::ImageError> {
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new_with_quality(
        &mut bytes,
        image::codecs::png::CompressionType::Fast,
        image::codecs::png::FilterType::Adaptive,
    );
    let (width, height) = (frame.columns() as u32, frame.rows() as u32);
    match frame.samples() {
        Samples::U8(values) => encoder.write_image(values, width, height, image::ExtendedColorType::L8)?,
        Samples::U16(values) => {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_ne_bytes()).collect();
            encoder.write_image(&bytes, width, height, image::ExtendedColorType::L16)?;
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_survive_a_png() {
        for (bit_depth, samples) in [
            (8, Samples::U8(vec![0, 7, 255, 128, 3, 9])),
            (16, Samples::U16(vec![0, 256, 65535, 1, 2, 40_000])),
        ] {
            let frame = Frame::new(2, 3, bit_depth, samples).unwrap();
            let decoded = decode_grey(&encode_png(&frame).unwrap()).unwrap();
            assert_eq!(decoded.frame, frame);
            assert!(decoded.usable_as_is && decoded.conversion.is_none());
        }
    }

    #[test]
    fn colour_becomes_rec_709_luma_and_says_so() {
        let mut bytes = Vec::new();
        let red = image::RgbImage::from_pixel(4, 2, image::Rgb([200, 100, 50]));
        red.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
        let decoded = decode_grey(&bytes).unwrap();
        // 0.2126 R + 0.7152 G + 0.0722 B = 117.7
        assert!(
            matches!(decoded.frame.samples(), Samples::U8(values) if values.iter().all(|v| v.abs_diff(118) <= 1))
        );
        assert!(decoded.conversion.is_some_and(|words| words.contains("colour")));
        assert!(!decoded.usable_as_is);
    }

    #[test]
    fn transparency_that_is_dropped_is_told_with_and_without_colour() {
        let words = |image: DynamicImage| {
            let mut bytes = Vec::new();
            image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
            decode_grey(&bytes).unwrap().conversion.unwrap_or_default()
        };
        let colour = image::RgbaImage::from_pixel(4, 2, image::Rgba([200, 100, 50, 128]));
        let told = words(colour.into());
        assert!(told.contains("colour") && told.contains("transparency dropped"), "{told}");
        let grey = image::GrayAlphaImage::from_pixel(4, 2, image::LumaA([200, 128]));
        assert_eq!(words(grey.into()), "transparency dropped");
        assert!(!words(image::RgbImage::new(4, 2).into()).contains("transparency"));
    }

    #[test]
    fn damage_is_an_error() {
        let frame =
            Frame::new(64, 64, 8, Samples::U8((0..4096).map(|v| (v * 31 % 256) as u8).collect())).unwrap();
        let bytes = encode_png(&frame).unwrap();
        assert!(decode_grey(&bytes[..bytes.len() / 2]).is_err());
        assert!(decode_grey(b"no image").is_err());
        assert!(decode_grey(&[]).is_err());
    }
}
