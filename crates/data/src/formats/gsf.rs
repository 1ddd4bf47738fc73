//! Gwyddion Simple Field, as <http://gwyddion.net/documentation/user-guide-en/gsf.html> specifies it: a text
//! header, zeros up to the next multiple of four bytes (one at least), then 32-bit floats, little endian, row
//! by row from the top. Lengths in m.

use epirig_core::grid::Grid;

/// `height_mm` as a field whose pixels are `pixel_mm` wide and high. NaN means unknown, as Gwyddion reads it.
///
/// `title` is shown by Gwyddion; line breaks in it become spaces, since they would end the entry.
pub fn gsf(height_mm: &Grid<f32>, pixel_mm: f64, title: &str) -> Vec<u8> {
    let real = |pixels: usize| pixels as f64 * pixel_mm * 1e-3;
    let mut bytes = format!(
        "Gwyddion Simple Field 1.0\nXRes = {}\nYRes = {}\nXReal = {:e}\nYReal = {:e}\nXYUnits = m\nZUnits = m\nTitle = {}\n",
        height_mm.columns(),
        height_mm.rows(),
        real(height_mm.columns()),
        real(height_mm.rows()),
        title.replace(['\n', '\r', '\0'], " "),
    )
    .into_bytes();
    bytes.resize(bytes.len() / 4 * 4 + 4, 0);
    for &value in height_mm.values() {
        bytes.extend(((f64::from(value) * 1e-3) as f32).to_le_bytes());
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
            let bytes = gsf(&map, 0.5, &"t".repeat(length));
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
}
