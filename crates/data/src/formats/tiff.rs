//! TIFF with one 32-bit float sample a pixel, and the pixel size in its resolution tags.

use std::io::Cursor;

use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression, Rational, TiffEncoder, colortype::Gray32Float};
use tiff::tags::{ResolutionUnit, Tag};

use super::codec::{Codec, MapFacts};
use super::error::{FormatError, malformed};
use epirig_core::grid::{Grid, area};

pub(super) const CODEC: Codec = Codec {
    name: "TIFF",
    extensions: &["tiff", "tif"],
    encode,
    holds_facts: true,
    lengths_only: false,
    decode: Some(decode),
};

fn encode(map: &Grid<f32>, facts: &MapFacts) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Cursor::new(Vec::new());
    let bad = |error| malformed("TIFF", error);
    let encoder = TiffEncoder::new(&mut bytes).map_err(bad)?;
    // Floats hardly become smaller, whatever effort is made: noise is all that most of their bits hold.
    let mut encoder = encoder.with_compression(Compression::Deflate(DeflateLevel::Fast));
    let mut image = encoder.new_image::<Gray32Float>(map.columns() as u32, map.rows() as u32).map_err(bad)?;
    if let Some(resolution) = facts.usable_pixel_mm().and_then(pixels_per_cm) {
        image.resolution(ResolutionUnit::Centimeter, resolution);
    }
    if !facts.title.is_empty() {
        // The tag holds 7-bit text.
        let title = facts.line().replace(|letter: char| !letter.is_ascii(), "?");
        image.encoder().write_tag(Tag::ImageDescription, &title[..]).map_err(bad)?;
    }
    image.write_data(map.values()).map_err(bad)?;
    Ok(bytes.into_inner())
}

/// Pixels per cm, as a fraction of 32-bit numbers with as many digits as fit; `None` if the size of a pixel
/// is out of its range.
fn pixels_per_cm(pixel_mm: f64) -> Option<Rational> {
    let wanted = 10.0 / pixel_mm;
    let d = (0..=9)
        .rev()
        .map(|power| 10_u32.pow(power))
        .find(|&d| wanted * f64::from(d) < f64::from(u32::MAX))?;
    let n = (wanted * f64::from(d)).round() as u32;
    (n > 0).then_some(Rational { n, d })
}

fn decode(bytes: &[u8]) -> Result<Grid<f32>, FormatError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_have_as_many_digits_as_fit() {
        // 0.25 mm are 40 px per cm, and 0.0375 mm are 266.66 ...
        for (pixel_mm, per_cm) in [(0.25, 40.0), (0.0375, 800.0 / 3.0), (1e-5, 1e6), (3e7, 1.0 / 3e6)] {
            let Rational { n, d } = pixels_per_cm(pixel_mm).unwrap();
            let found = f64::from(n) / f64::from(d);
            // Of 3 x 10^7 mm only the first three digits are left.
            assert!((found / per_cm - 1.0).abs() < if pixel_mm > 1.0 { 2e-3 } else { 1e-8 }, "{found}");
        }
        assert!(pixels_per_cm(1e-9).is_none() && pixels_per_cm(1e12).is_none());
    }

    #[test]
    fn the_size_of_a_pixel_stands_in_its_tags() {
        let map = Grid::from_values(1, 2, vec![0.5, f32::NAN]).unwrap();
        let title = "a \u{b5}\nb".to_owned();
        let facts = MapFacts { pixel_mm: Some(0.25), title, ..MapFacts::default() };
        let bytes = encode(&map, &facts).unwrap();
        assert_eq!(decode(&bytes).unwrap().at(0, 0), 0.5);
        let mut decoder = Decoder::new(Cursor::new(&bytes)).unwrap();
        assert_eq!(decoder.get_tag_u32(Tag::ResolutionUnit).unwrap(), 3, "3 is cm");
        for tag in [Tag::XResolution, Tag::YResolution] {
            let fraction = decoder.get_tag_u32_vec(tag).unwrap();
            assert_eq!(fraction[0], 40 * fraction[1]);
        }
        assert_eq!(decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap(), "a ? b");
    }
}
