//! The image files that are read: a line for each.

use std::path::Path;

use image::ImageFormat;

use super::fault::ImageFault;
use super::{bmp, jpeg, pnm, tiff};

/// A kind of image file.
#[derive(Debug)]
pub(super) struct Kind {
    /// As `image` calls it.
    pub(super) format: ImageFormat,
    /// As people call it.
    name: &'static str,
    /// How names of such files end, in small letters.
    endings: &'static [&'static str],
    /// Refuses what its decoder would not, from bytes, rows and columns.
    pub(super) check: fn(&[u8], usize, usize) -> Result<(), ImageFault>,
}

const KINDS: [Kind; 5] = [
    Kind { format: ImageFormat::Png, name: "PNG", endings: &["png"], check: |_, _, _| Ok(()) },
    Kind { format: ImageFormat::Tiff, name: "TIFF", endings: &["tif", "tiff"], check: tiff::check },
    Kind { format: ImageFormat::Jpeg, name: "JPEG", endings: &["jpg", "jpeg"], check: jpeg::check },
    Kind { format: ImageFormat::Bmp, name: "BMP", endings: &["bmp", "dib"], check: bmp::check },
    Kind {
        format: ImageFormat::Pnm,
        name: "PGM/PPM",
        endings: &["pgm", "ppm", "pnm", "pbm", "pam"],
        check: pnm::check,
    },
];

/// The kind of a file of this format, if such are read.
pub(super) fn kind_of(format: ImageFormat) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.format == format)
}

/// Whether the name ends as that of an image that is read.
pub(in super::super) fn is_image_name(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| KINDS.iter().any(|kind| kind.endings.contains(&&*ending)))
}

/// The kinds of images that are read, for messages: `PNG, TIFF, JPEG, ...`.
pub fn image_formats() -> String {
    KINDS.map(|kind| kind.name).join(", ")
}
