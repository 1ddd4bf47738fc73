//! Image files, decoded to frames and encoded from them.

use std::io::Cursor;

use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageEncoder, ImageReader};
use thiserror::Error;

use epirig_core::frame::{Frame, FrameError, Samples};
use epirig_core::grid::area;

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

/// Why an image file makes no frame.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ImageFault {
    /// The bytes do not follow their format.
    #[error("{0}")]
    Damaged(String),
    /// A sound file of a kind that is not read.
    #[error("{0}")]
    Unsupported(String),
    /// More pixels than can be measured.
    #[error("{columns} x {rows} pixels are more than can be measured (16384 x 16384)")]
    TooLarge {
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
}

impl From<image::ImageError> for ImageFault {
    fn from(error: image::ImageError) -> Self {
        match error {
            image::ImageError::Unsupported(_) => {
                Self::Unsupported(format!("{error}; save it as a grey PNG of 8 or 16 bit"))
            }
            other => Self::Damaged(other.to_string()),
        }
    }
}

/// The header of an image file, before a pixel is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Rows of the frame that it makes.
    pub rows: usize,
    /// Columns of that frame.
    pub columns: usize,
    /// Bits of its stored samples: 8 or 16.
    pub bits: u8,
}

/// Reads the head of a PNG, TIFF or JPEG alone: a small file can say that it is very large.
///
/// # Errors
/// [`ImageFault`].
pub fn header(bytes: &[u8]) -> Result<Header, ImageFault> {
    head(bytes).map(|(_, _, _, header)| header)
}

/// Bytes of the largest image file that is read: room for the largest that is decoded, if it is not
/// compressed.
pub const LARGEST_IMAGE: u64 = 5 << 28;

/// Most bytes that the decoded image may take: 16 bit grey of the largest size takes half of it, colour of 8
/// bit three quarters.
const MOST_DECODED: u64 = 1 << 30;

type Head<'a> = (image::ImageFormat, Box<dyn ImageDecoder + 'a>, Orientation, Header);

fn head(bytes: &[u8]) -> Result<Head<'_>, ImageFault> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| ImageFault::Damaged(error.to_string()))?;
    let format = reader.format().ok_or_else(|| ImageFault::Damaged("not a PNG, TIFF or JPEG".to_owned()))?;
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(match format {
        // For PNG this limits data beside the pixels, such as colour profiles.
        image::ImageFormat::Png => 64 << 20,
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
    match format {
        image::ImageFormat::Jpeg => check_jpeg(bytes, rows, columns)?,
        image::ImageFormat::Tiff => check_single(bytes)?,
        _ => {}
    }
    let colour = decoder.color_type();
    let bits = match colour.bytes_per_pixel() / colour.channel_count() {
        1 => 8,
        2 => 16,
        _ => {
            let reason = "floating-point samples are not read; save it as a grey PNG of 8 or 16 bit";
            return Err(ImageFault::Unsupported(reason.to_owned()));
        }
    };
    let orientation = decoder.orientation()?;
    if turns_by_a_quarter(orientation) {
        (rows, columns) = (columns, rows);
    }
    Ok((format, Box::new(decoder), orientation, Header { rows, columns, bits }))
}

/// Refuses images that a decoder would complete: their end is missing, or they are too large for their bytes.
fn check_jpeg(bytes: &[u8], rows: usize, columns: usize) -> Result<(), ImageFault> {
    /// A block of 64 pixels takes a bit at least.
    const PIXELS_OF_A_BYTE: usize = 8 * 64;
    /// Larger sides overflow in the decoder.
    const LONGEST: usize = 65_528;
    const START_OF_SCAN: u8 = 0xda;
    const END: u8 = 0xd9;
    if rows.max(columns) > LONGEST {
        return Err(ImageFault::TooLarge { rows, columns });
    }
    // Segments up to the first scan: marker, length, contents.
    let mut place = 2;
    while let Some(&[0xff, marker, high, low]) = bytes.get(place..place + 4) {
        place += 2 + usize::from(u16::from_be_bytes([high, low]));
        if marker == START_OF_SCAN {
            break;
        }
    }
    let data = bytes.get(place..).unwrap_or_default();
    // Within the compressed data 0xff is followed by 0 or by a restart.
    let has_end = data.windows(2).any(|pair| pair == [0xff, END]);
    if !has_end || rows * columns > PIXELS_OF_A_BYTE * data.len() {
        return Err(ImageFault::Damaged("it ends before its last pixel".to_owned()));
    }
    Ok(())
}

/// Refuses a file of several images: it is not known which of them is the frame.
fn check_single(bytes: &[u8]) -> Result<(), ImageFault> {
    let several = tiff::decoder::Decoder::new(Cursor::new(bytes)).is_ok_and(|decoder| decoder.more_images());
    if several {
        let reason = "it holds several images; save each as a file of its own";
        return Err(ImageFault::Unsupported(reason.to_owned()));
    }
    Ok(())
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

/// Decodes a PNG, TIFF or JPEG, whatever its name says, and makes it grey: Rec. 709 luma of the stored
/// values, transparency ignored.
///
/// # Errors
/// [`ImageFault`].
pub fn decode_grey(bytes: &[u8]) -> Result<DecodedImage, ImageFault> {
    let (format, decoder, orientation, _) = head(bytes)?;
    let mut image = DynamicImage::from_decoder(decoder)?;
    let turned = orientation != Orientation::NoTransforms;
    image.apply_orientation(orientation);
    let (width, height) = (image.width(), image.height());
    let lossy = format == image::ImageFormat::Jpeg;
    let colour = image.color().has_color();
    let alpha = image.color().has_alpha();
    let conversion = match (colour, lossy) {
        _ if turned => {
            Some("turned upright as its orientation tag says, and converted to grey if it was colour")
        }
        (true, true) => {
            Some("colour JPEG converted to grey (Rec. 709 luma); lossy compression limits accuracy")
        }
        (true, false) => Some("colour converted to grey (Rec. 709 luma)"),
        (false, true) => Some("JPEG decoded; lossy compression limits accuracy"),
        (false, false) => alpha.then_some("transparency dropped"),
    };
    let (bit_depth, samples) = match image {
        DynamicImage::ImageLuma8(grey) => (8, Samples::U8(grey.into_raw())),
        DynamicImage::ImageLuma16(grey) => (16, Samples::U16(grey.into_raw())),
        wide @ (DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_)) => (16, Samples::U16(wide.to_luma16().into_raw())),
        narrow => (8, Samples::U8(narrow.to_luma8().into_raw())),
    };
    let frame = Frame::new(height as usize, width as usize, bit_depth, samples)
        .map_err(|error| ImageFault::Damaged(error.to_string()))?;
    let usable_as_is = format == image::ImageFormat::Png && conversion.is_none();
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
    fn damage_is_an_error() {
        let frame =
            Frame::new(64, 64, 8, Samples::U8((0..4096).map(|v| (v * 31 % 256) as u8).collect())).unwrap();
        let bytes = encode_png(&frame).unwrap();
        assert!(decode_grey(&bytes[..bytes.len() / 2]).is_err());
        assert!(decode_grey(b"no image").is_err());
        assert!(decode_grey(&[]).is_err());
    }
}
