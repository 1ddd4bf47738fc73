//! The luma of JPEG images, with strict checks.
//!
//! Decoders invent missing data: `zune-jpeg`, strict or not, fills an image whose compressed data end early,
//! as after a lost USB packet. So headers and Huffman codes are read first, and only whole images are
//! decoded. Damage that gives valid codes and the right number of blocks cannot be found, because JPEG has no
//! checksum.

mod entropy;
mod header;
mod huffman;
mod standard_tables;

use std::borrow::Cow;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use header::Header;

/// The luma of a baseline JPEG image of `rows` x `columns`, row by row.
///
/// # Errors
/// Why it cannot be used: it is incomplete, of another kind or of another size.
pub(super) fn whole_luma(bytes: &[u8], rows: usize, columns: usize) -> Result<Vec<u8>, String> {
    let header = Header::parse(bytes)?;
    if (header.rows, header.columns) != (rows, columns) {
        return Err(format!(
            "it is {} rows x {} columns, but the camera is set to {rows} x {columns}",
            header.rows, header.columns
        ));
    }
    let scan = bytes.get(header.scan_start..).unwrap_or_default();
    let end = header.scan_start + entropy::end_of_image(&header, scan)?;
    let (image, padding) = bytes.split_at_checked(end).unwrap_or((bytes, &[]));
    if padding.iter().any(|&byte| byte != 0) {
        return Err("bytes follow its end".to_owned());
    }
    let image = match header.tables_missing_at {
        Some(start_of_scan) => {
            let (before, after) = image.split_at_checked(start_of_scan).unwrap_or((image, &[]));
            Cow::Owned([before, &standard_tables::segment(), after].concat())
        }
        None => Cow::Borrowed(image),
    };
    decoded(&image, rows, columns)
}

/// Decodes an image that is complete.
fn decoded(image: &[u8], rows: usize, columns: usize) -> Result<Vec<u8>, String> {
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(columns)
        .set_max_height(rows)
        .jpeg_set_out_colorspace(ColorSpace::Luma);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(image), options);
    let samples = decoder.decode().map_err(|error| error.to_string())?;
    if samples.len() == rows * columns {
        Ok(samples)
    } else {
        Err(format!("its decoder gave {} samples", samples.len()))
    }
}

#[cfg(test)]
mod tests;
