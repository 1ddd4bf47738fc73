//! Surface data file of ISO 25178-71, as text ("aISO-1.0"): a header of names with values, then the heights row by row
//! from the top, `BAD` for unknown. Heights are in mm, which the header says; they come back to the last bit.

use super::codec::{Codec, LengthMap, MapFacts};
use super::error::FormatError;
use epirig_core::grid::Grid;

pub(super) const CODEC: Codec =
    Codec { name: NAME, extensions: &["sdf"], encode, holds_facts: true, lengths_only: true, decode: None };

const NAME: &str = "SDF";
/// Most points of a profile, and most profiles: the standard has 16 bits for their numbers.
const MOST: usize = u16::MAX as usize;

fn encode(map: &Grid<f32>, facts: &MapFacts) -> Result<Vec<u8>, FormatError> {
    let LengthMap { pixel_mm } = LengthMap::of(NAME, map, facts)?;
    if map.rows().max(map.columns()) > MOST {
        let reason = "it has more than 65535 rows or columns; choose another format";
        return Err(FormatError::Unsuitable { format: NAME, reason });
    }
    let date = facts.taken_parts().map_or_else(
        || "0".repeat(12),
        |[year, month, day, hour, minute, _]| format!("{day:02}{month:02}{year:04}{hour:02}{minute:02}"),
    );
    let pixel_m = 1e-3 * pixel_mm;
    let (columns, rows) = (map.columns(), map.rows());
    let mut text = format!(
        "aISO-1.0\r\nManufacID = epirig\r\nCreateDate = {date}\r\nModDate = {date}\r\nNumPoints = {columns}\r\n\
         NumProfiles = {rows}\r\nXscale = {pixel_m:e}\r\nYscale = {pixel_m:e}\r\nZscale = 1e-3\r\n\
         Zresolution = -1\r\nCompression = 0\r\nDataType = 7\r\nCheckType = 0\r\n*\r\n"
    );
    for row in 0..rows {
        let words: Vec<String> = map.row(row).iter().map(|&height_mm| word(height_mm)).collect();
        text.push_str(&words.join(" "));
        text.push_str("\r\n");
    }
    // The sign ends a record.
    text.push_str(&format!("*\r\nTitle = {}\r\n*\r\n", facts.ascii_line().replace('*', " ")));
    Ok(text.into_bytes())
}

/// The shortest text that is this number.
fn word(height_mm: f32) -> String {
    if height_mm.is_finite() { format!("{height_mm:e}") } else { "BAD".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::codec::Quantity;
    use super::*;

    #[test]
    fn a_map_byte_by_byte() {
        let map = Grid::from_values(2, 2, vec![0.25, f32::NAN, -1e-7, 3.0]).unwrap();
        let facts = MapFacts {
            quantity: Quantity::LengthMm,
            pixel_mm: Some(0.125),
            title: "h\u{f6}he * a".to_owned(),
            taken: Some("2026-11-05T07:08:09.123Z".to_owned()),
        };
        let lines = [
            "aISO-1.0",
            "ManufacID = epirig",
            "CreateDate = 051120260708",
            "ModDate = 051120260708",
            "NumPoints = 2",
            "NumProfiles = 2",
            "Xscale = 1.25e-4",
            "Yscale = 1.25e-4",
            "Zscale = 1e-3",
            "Zresolution = -1",
            "Compression = 0",
            "DataType = 7",
            "CheckType = 0",
            "*",
            "2.5e-1 BAD",
            "-1e-7 3e0",
            "*",
            "Title = h?he   a",
            "*",
            "",
        ];
        assert_eq!(String::from_utf8(encode(&map, &facts).unwrap()).unwrap(), lines.join("\r\n"));
        let text =
            String::from_utf8(encode(&map, &MapFacts { taken: None, ..facts.clone() }).unwrap()).unwrap();
        assert!(text.contains("CreateDate = 000000000000\r\n"), "{text}");
        let reason = |facts: &MapFacts| encode(&map, facts).unwrap_err().to_string();
        assert!(reason(&MapFacts { pixel_mm: None, ..facts.clone() }).contains("size of its pixels"));
        assert!(reason(&MapFacts { quantity: Quantity::Number, ..facts }).contains("for heights"));
        let long = Grid::filled(1, MOST + 1, 0.0);
        let facts = MapFacts { quantity: Quantity::LengthMm, pixel_mm: Some(1.0), ..MapFacts::default() };
        assert!(encode(&long, &facts).unwrap_err().to_string().contains("65535"));
    }
}
