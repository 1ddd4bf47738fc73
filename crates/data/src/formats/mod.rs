//! Maps in the file formats that other programs read: PFM, TIFF, NumPy, CSV, GSF, X3P, SDF and SUR; surfaces of
//! triangles as PLY, STL and OBJ.
//!
//! Maps hold 32-bit floats, rows x columns. Unknown values are NaN in memory and in all formats but PFM, where
//! they are infinity, as the Middlebury benchmark has it.

mod codec;
mod csv;
mod error;
mod gsf;
mod mesh;
mod mesh_format;
mod npy;
mod obj;
mod pfm;
mod ply;
mod sdf;
mod stl;
mod sur;
mod tiff;
mod x3p;

use epirig_core::grid::Grid;

use codec::Codec;
pub use codec::{MapFacts, Quantity};
pub use error::FormatError;
use error::malformed;
pub use mesh::{Mesh, Vertex};
pub use mesh_format::MeshFormat;

macro_rules! map_formats {
    ($($(#[$about:meta])* $name:ident = $codec:path,)*) => {
        /// A format for maps.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum MapFormat {
            $($(#[$about])* $name,)*
        }

        impl MapFormat {
            /// All formats.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            fn codec(self) -> &'static Codec {
                match self {
                    $(Self::$name => &$codec,)*
                }
            }
        }
    };
}

// A new format is a file with its codec, and a line here.
map_formats! {
    /// Portable float map, as in the Middlebury benchmark: rows from the bottom up, infinity for unknown.
    Pfm = pfm::CODEC,
    /// TIFF with 32-bit float samples, deflated; the pixel size in its resolution tags, in px per cm.
    Tiff = tiff::CODEC,
    /// NumPy array, `<f4`, shape (rows, columns).
    Npy = npy::CODEC,
    /// Comma-separated values, one line for each row of the map, `nan` for unknown.
    Csv = csv::CODEC,
    /// Gwyddion Simple Field: floats with units; lengths in m.
    Gsf = gsf::CODEC,
    /// Surface texture of ISO 25178-72: floats in m. For lengths whose pixel size is known.
    X3p = x3p::CODEC,
    /// Surface data file of ISO 25178-71, as text: heights in mm. For lengths whose pixel size is known.
    Sdf = sdf::CODEC,
    /// Surface of Digital Surf: 32-bit whole numbers, lengths in mm. For lengths whose pixel size is known.
    Sur = sur::CODEC,
}

impl MapFormat {
    /// The format whose files have this ending, in any case.
    pub fn from_extension(extension: &str) -> Option<Self> {
        let extension = extension.to_ascii_lowercase();
        Self::ALL.iter().copied().find(|format| format.codec().extensions.contains(&&extension[..]))
    }

    /// The usual ending of its files, without a dot.
    pub fn extension(self) -> &'static str {
        self.codec().extensions[0]
    }

    /// Whether its files hold more than values: units, the pixel size or a title.
    pub fn holds_facts(self) -> bool {
        self.codec().holds_facts
    }

    /// Whether it is for lengths alone, whose pixels have a known size in mm.
    pub fn is_for_lengths_only(self) -> bool {
        self.codec().lengths_only
    }

    /// `map` as bytes of this format, with nothing but its values.
    ///
    /// # Errors
    /// As [`encode_with`](Self::encode_with).
    pub fn encode(self, map: &Grid<f32>) -> Result<Vec<u8>, FormatError> {
        self.encode_with(map, &MapFacts::default())
    }

    /// `map` as bytes of this format, with as much of `facts` as the format has a place for.
    ///
    /// # Errors
    /// [`FormatError`] if the encoder refuses, as TIFF does for an empty map, or if the format needs what
    /// `facts` do not tell.
    pub fn encode_with(self, map: &Grid<f32>, facts: &MapFacts) -> Result<Vec<u8>, FormatError> {
        (self.codec().encode)(map, facts)
    }

    /// The map in `bytes`.
    ///
    /// # Errors
    /// [`FormatError::Malformed`]. What is written for other programs alone is not read back: CSV,
    /// GSF, X3P, SDF and SUR.
    pub fn decode(self, bytes: &[u8]) -> Result<Grid<f32>, FormatError> {
        let Codec { name, decode, .. } = self.codec();
        let decode =
            decode.ok_or_else(|| malformed(name, "reading it is not supported; use PFM, TIFF or NPY"))?;
        decode(bytes)
    }
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

    #[test]
    fn each_format_has_endings_of_its_own() {
        for &format in MapFormat::ALL {
            for extension in format.codec().extensions {
                assert_eq!(MapFormat::from_extension(&extension.to_ascii_uppercase()), Some(format));
            }
        }
        assert_eq!(MapFormat::from_extension("tif"), Some(MapFormat::Tiff));
        assert_eq!(MapFormat::from_extension(""), None);
    }
}
