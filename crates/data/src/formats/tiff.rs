//! TIFF with one 32-bit float sample a pixel.

use std::io::Cursor;

use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression, TiffEncoder, colortype::Gray32Float};

use super::error::{FormatError, malformed};
use epirig_core::grid::{Grid, area};

pub(super) fn encode(map: &Grid<f32>) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Cursor::new(Vec::new());
    let bad = |error| malformed("TIFF", error);
    let encoder = TiffEncoder::new(&mut bytes).map_err(bad)?;
    // Floats hardly become smaller, whatever effort is made: noise is all that most of their bits hold.
    let mut encoder = encoder.with_compression(Compression::Deflate(DeflateLevel::Fast));
    encoder.write_image::<Gray32Float>(map.columns() as u32, map.rows() as u32, map.values()).map_err(bad)?;
    Ok(bytes.into_inner())
}

pub(super) fn decode(bytes: &[u8]) -> Result<Grid<f32>, FormatError> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(|error| malformed("TIFF", error))?;
    let (columns, rows) = decoder.dimensions().map_err(|error| malformed("TIFF", error))?;
    let pixels = area(rows as usize, columns as usize)
        .ok_or_else(|| malformed("TIFF", format!("a map of {columns} x {rows} cannot be")))?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = 4 * pixels;
    limits.intermediate_buffer_size = 4 * pixels + (1 << 20);
    decoder = decoder.with_limits(limits);
    match decoder.read_image().map_err(|error| malformed("TIFF", error))? {
        DecodingResult::F32(values) => Grid::from_values(rows as usize, columns as usize, values)
            .ok_or_else(|| malformed("TIFF", "it has more than one channel")),
        _ => Err(malformed("TIFF", "its samples are not 32-bit floats")),
    }
}
