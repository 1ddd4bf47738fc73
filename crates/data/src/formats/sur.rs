//! SUR of Digital Surf (MountainsMap), which most programs for surfaces read: a header of 512 bytes, then 32-bit whole
//! numbers, little endian, row by row from the top. Lengths in mm.

use super::codec::{Codec, LengthMap, MapFacts};
use super::error::FormatError;
use epirig_core::grid::Grid;

pub(super) const CODEC: Codec =
    Codec { name: NAME, extensions: &["sur"], encode, holds_facts: true, lengths_only: true, decode: None };

const NAME: &str = "SUR";
const HEADER: usize = 512;
/// The largest number that stands for a height: below it is room for the one that stands for none.
const LARGEST: i32 = i32::MAX - 4;

fn encode(map: &Grid<f32>, facts: &MapFacts) -> Result<Vec<u8>, FormatError> {
    let LengthMap { pixel_mm } = LengthMap::of(NAME, map, facts)?;
    let known = || map.values().iter().copied().filter(|height| height.is_finite());
    let farthest = known().fold(0.0_f32, |farthest, height| farthest.max(height.abs()));
    // What a step means is a 32-bit number, too: whole numbers must be counted in just that.
    let step_mm = match farthest > 0.0 {
        true => ((f64::from(farthest) / f64::from(LARGEST)) as f32).next_up(),
        false => 1e-6,
    };
    let whole = |height: f32| (f64::from(height) / f64::from(step_mm)).round() as i32;
    let (least, most) = known().map(whole).fold((0, 0), |(least, most), z| (least.min(z), most.max(z)));
    // Two below the least: so readers know it.
    let unknown = least - 2;
    let has_unknown = known().count() < map.values().len();

    let mut header = Header(Vec::with_capacity(HEADER));
    header.text("DIGITAL SURF", 12).short([0, 1, 1]);
    // A surface, its name, and its operator.
    header.short([2]).text(&facts.ascii_line(), 30).text("epirig", 30).short([0, 0, 0]);
    header.short([i16::from(has_unknown), 0]).float([0.0]).zeros(4).short([32]).int([least, most]);
    let (columns, rows) = (count(map.columns())?, count(map.rows())?);
    header.int([columns, rows, count(map.values().len())?]);
    header.float([pixel_mm as f32, pixel_mm as f32, step_mm]);
    for name in ["X", "Y", "Z"] {
        header.text(name, 16);
    }
    for _ in 0..6 {
        header.text("mm", 16);
    }
    header.float([1.0, 1.0, 1.0]).short([0, 0, 0]).zeros(12);
    let [year, month, day, hour, minute, second] = facts.taken_parts().unwrap_or_default();
    header.short([second, minute, hour, day, month, year, 0]);
    // Duration, size of compressed data, comments, the client's zone, and offsets: none of them is used.
    header.zeros(HEADER - header.0.len());

    let mut bytes = header.0;
    for &height in map.values() {
        bytes.extend(if height.is_finite() { whole(height) } else { unknown }.to_le_bytes());
    }
    Ok(bytes)
}

fn count(number: usize) -> Result<i32, FormatError> {
    let reason = "it has too many pixels; choose another format";
    i32::try_from(number).map_err(|_| FormatError::Unsuitable { format: NAME, reason })
}

/// A header that grows from field to field.
struct Header(Vec<u8>);

impl Header {
    /// Text of a fixed length, with spaces behind it.
    fn text(&mut self, text: &str, length: usize) -> &mut Self {
        let letters = text.bytes().chain(std::iter::repeat(b' '));
        self.0.extend(letters.take(length));
        self
    }

    fn short<const N: usize>(&mut self, numbers: [i16; N]) -> &mut Self {
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
        self
    }

    fn int<const N: usize>(&mut self, numbers: [i32; N]) -> &mut Self {
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
        self
    }

    fn float<const N: usize>(&mut self, numbers: [f32; N]) -> &mut Self {
        numbers.iter().for_each(|number| self.0.extend(number.to_le_bytes()));
        self
    }

    fn zeros(&mut self, length: usize) -> &mut Self {
        self.0.resize(self.0.len() + length, 0);
        self
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::codec::Quantity;
    use super::*;

    fn facts() -> MapFacts {
        MapFacts { quantity: Quantity::LengthMm, pixel_mm: Some(0.5), ..MapFacts::default() }
    }

    fn int(bytes: &[u8], at: usize) -> i32 {
        i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    }

    fn float(bytes: &[u8], at: usize) -> f32 {
        f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    }

    #[test]
    fn fields_stand_where_readers_look() {
        let map = Grid::from_values(1, 3, vec![0.2, f32::NAN, -0.1]).unwrap();
        let taken = Some("2026-11-05T07:08:09Z".to_owned());
        let bytes = encode(&map, &MapFacts { taken, ..facts() }).unwrap();
        assert_eq!(bytes.len(), 512 + 12);
        assert!(bytes.starts_with(b"DIGITAL SURF\0\0\x01\0\x01\0\x02\0"));
        // Points that were not measured, bits of a point, points of a line, lines, all points.
        assert_eq!(
            (bytes[86], bytes[98], int(&bytes, 108), int(&bytes, 112), int(&bytes, 116)),
            (1, 32, 3, 1, 3)
        );
        assert_eq!((float(&bytes, 120), float(&bytes, 124)), (0.5, 0.5));
        assert_eq!(
            (&bytes[132..134], &bytes[180..183], &bytes[212..215]),
            (&b"X "[..], &b"mm "[..], &b"mm "[..])
        );
        assert_eq!(float(&bytes, 276), 1.0);
        assert_eq!(bytes[306..318], [9, 0, 8, 0, 7, 0, 5, 0, 11, 0, 0xea, 7]);
        assert_eq!(int(&bytes, 512 + 4), int(&bytes, 100) - 2, "no height");
        assert_eq!(int(&bytes, 512 + 8), int(&bytes, 100), "the least");
        assert_eq!(int(&bytes, 512), int(&bytes, 104), "the most");
    }

    proptest! {
        #[test]
        fn heights_come_back(values in prop::collection::vec(
            prop_oneof![8 => -1e3_f32..1e3, 2 => -1e-6_f32..1e-6, 1 => Just(f32::NAN), 1 => Just(0.0)], 1..40,
        )) {
            let map = Grid::from_values(1, values.len(), values.clone()).unwrap();
            let bytes = encode(&map, &facts()).unwrap();
            let step_mm = f64::from(float(&bytes, 128));
            let unknown = int(&bytes, 100) - 2;
            let farthest = values.iter().copied().filter(|v| v.is_finite()).fold(0.0_f32, |a, b| a.max(b.abs()));
            for (index, &value) in values.iter().enumerate() {
                let found = int(&bytes, 512 + 4 * index);
                prop_assert_eq!(found == unknown && bytes[86] == 1, value.is_nan());
                if value.is_finite() {
                    // Half a step, which is a two thousand millionth of the highest.
                    let error = (f64::from(found) * step_mm - f64::from(value)).abs();
                    prop_assert!(error <= 0.51 * step_mm && step_mm <= f64::from(farthest) / 2.1e9 + 1e-6);
                }
            }
        }
    }
}
