//! Maps in the file formats that other programs read: PFM, TIFF and NumPy; surfaces as PLY and GSF.
//!
//! Maps hold 32-bit floats, rows x columns. Unknown values are NaN in memory, TIFF and NPY, and infinity in
//! PFM, as the Middlebury benchmark has it.

mod error;
mod gsf;
mod npy;
mod pfm;
mod ply;
mod tiff;

use epirig_core::grid::Grid;

pub use error::FormatError;
use error::malformed;
pub use gsf::gsf;
pub use ply::{Vertex, ply};

/// A format for maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapFormat {
    /// Portable float map, as in the Middlebury benchmark: rows from the bottom up, infinity for unknown.
    Pfm,
    /// TIFF with 32-bit float samples, deflated.
    Tiff,
    /// NumPy array, `<f4`, shape (rows, columns).
    Npy,
    /// Comma-separated values, one line for each row of the map, `nan` for unknown.
    Csv,
}

impl MapFormat {
    /// The format whose files have this ending, in any case.
    pub fn from_extension(extension: &str) -> Option<Self> {
        match extension.to_ascii_lowercase().as_str() {
            "pfm" => Some(Self::Pfm),
            "tif" | "tiff" => Some(Self::Tiff),
            "npy" => Some(Self::Npy),
            "csv" => Some(Self::Csv),
            _ => None,
        }
    }

    /// `map` as bytes of this format.
    ///
    /// # Errors
    /// [`FormatError`] if the encoder refuses, as TIFF does for an empty map.
    pub fn encode(self, map: &Grid<f32>) -> Result<Vec<u8>, FormatError> {
        match self {
            Self::Pfm => Ok(pfm::encode(map)),
            Self::Tiff => tiff::encode(map),
            Self::Npy => npy::encode(map),
            Self::Csv => Ok(csv(map)),
        }
    }

    /// The map in `bytes`.
    ///
    /// # Errors
    /// [`FormatError::Malformed`]. CSV is written for tables of other programs and not read back.
    pub fn decode(self, bytes: &[u8]) -> Result<Grid<f32>, FormatError> {
        match self {
            Self::Pfm => pfm::decode(bytes),
            Self::Tiff => tiff::decode(bytes),
            Self::Npy => npy::decode(bytes),
            Self::Csv => Err(malformed("CSV", "reading it is not supported; use PFM, TIFF or NPY")),
        }
    }
}

fn csv(map: &Grid<f32>) -> Vec<u8> {
    let mut text = String::new();
    for y in 0..map.rows() {
        for (x, value) in map.row(y).iter().enumerate() {
            if x > 0 {
                text.push(',');
            }
            text.push_str(&if value.is_nan() { "nan".to_owned() } else { value.to_string() });
        }
        text.push('\n');
    }
    text.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn maps_come_back(
            rows in 1_usize..7,
            columns in 1_usize..9,
            seed in prop::collection::vec(prop_oneof![5 => -1e6_f32..1e6, 1 => Just(f32::NAN)], 63),
        ) {
            let map = Grid::from_values(rows, columns, seed[..rows * columns].to_vec()).unwrap();
            for format in [MapFormat::Pfm, MapFormat::Tiff, MapFormat::Npy] {
                let back = format.decode(&format.encode(&map).unwrap()).unwrap();
                prop_assert_eq!((back.rows(), back.columns()), (rows, columns));
                let same = |(a, b): (&f32, &f32)| a == b || (a.is_nan() && b.is_nan());
                prop_assert!(back.values().iter().zip(map.values()).all(same));
            }
        }

        #[test]
        fn garbage_is_an_error_and_no_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            for (format, head) in [(MapFormat::Pfm, &b"Pf\n"[..]), (MapFormat::Tiff, b"II*\0"), (MapFormat::Npy, b"\x93NUMPY\x01\0")] {
                let _ = format.decode(&bytes);
                let mut plausible = head.to_vec();
                plausible.extend(&bytes);
                let _ = format.decode(&plausible);
            }
        }
    }
}
