//! Gwyddion Simple Field, as <http://gwyddion.net/documentation/user-guide-en/gsf.html> specifies it: a text
//! header, zeros up to the next multiple of four bytes (one at least), then 32-bit floats, little endian, row
//! by row from the top. Lengths in m. NaN means unknown, as Gwyddion reads it.

use super::codec::{Codec, MapFacts, Quantity};
use epirig_core::grid::Grid;

pub(super) const CODEC: Codec = Codec {
    name: "GSF",
    extensions: &["gsf"],
    encode: |map, facts| Ok(encode(map, facts)),
    holds_facts: true,
    lengths_only: false,
    decode: None,
};

fn encode(map: &Grid<f32>, facts: &MapFacts) -> Vec<u8> {
    let (pixel, lateral) = facts.usable_pixel_mm().map_or((1.0, "px"), |pixel_mm| (pixel_mm * 1e-3, "m"));
    let real = |pixels: usize| pixels as f64 * pixel;
    let (scale, unit) = match facts.quantity {
        Quantity::LengthMm => (1e-3, "m"),
        Quantity::ImagePx => (1.0, "px"),
        Quantity::Number => (1.0, ""),
    };
    let mut bytes = format!(
        "Gwyddion Simple Field 1.0\nXRes = {}\nYRes = {}\nXReal = {:e}\nYReal = {:e}\n\
         XYUnits = {lateral}\nZUnits = {unit}\nTitle = {}\n",
        map.columns(),
        map.rows(),
        real(map.columns()),
        real(map.rows()),
        facts.line(),
    )
    .into_bytes();
    bytes.resize(bytes.len() / 4 * 4 + 4, 0);
    for &value in map.values() {
        bytes.extend(((f64::from(value) * scale) as f32).to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_begin_at_a_multiple_of_four_after_at_least_one_zero() {
        let map = Grid::from_values(1, 2, vec![0.25, f32::NAN]).unwrap();
        for length in 0..8 {
            let facts = MapFacts {
                quantity: Quantity::LengthMm,
                pixel_mm: Some(0.5),
                title: "t".repeat(length),
                taken: None,
            };
            let bytes = encode(&map, &facts);
            let header = bytes.iter().position(|&byte| byte == 0).unwrap();
            let text = std::str::from_utf8(&bytes[..header]).unwrap();
            assert!(
                text.starts_with(
                    "Gwyddion Simple Field 1.0\nXRes = 2\nYRes = 1\nXReal = 1e-3\nYReal = 5e-4\n"
                )
            );
            assert!(text.ends_with('\n'));
            let start = bytes.len() - 8;
            assert_eq!(start % 4, 0);
            assert!((1..=4).contains(&(start - header)));
            assert!(bytes[header..start].iter().all(|&byte| byte == 0));
            assert_eq!(bytes[start..start + 4], 2.5e-4_f32.to_le_bytes());
            assert!(f32::from_le_bytes(bytes[start + 4..].try_into().unwrap()).is_nan());
        }
    }

    #[test]
    fn pixels_without_a_size_stay_pixels_and_a_title_cannot_end_its_line() {
        let map = Grid::from_values(1, 2, vec![8.0, 9.0]).unwrap();
        let title = "a\nXRes = 7\0".to_owned();
        let bytes = encode(&map, &MapFacts { quantity: Quantity::ImagePx, title, ..MapFacts::default() });
        let text = String::from_utf8_lossy(&bytes[..bytes.len() - 8]);
        assert!(text.contains("\nXReal = 2e0\nYReal = 1e0\nXYUnits = px\nZUnits = px\n"), "{text}");
        assert!(text.contains("\nTitle = a XRes = 7 \n"), "{text}");
        assert_eq!(bytes[bytes.len() - 4..], 9.0_f32.to_le_bytes());
    }
}
