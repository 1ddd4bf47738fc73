//! The formats for surfaces of triangles.

use super::mesh::Mesh;
use super::{obj, ply, stl};

type Encode = fn(&Mesh) -> Vec<u8>;

macro_rules! mesh_formats {
    ($($(#[$about:meta])* $name:ident = $extension:literal, $encode:path;)*) => {
        /// A format for surfaces of triangles.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum MeshFormat {
            $($(#[$about])* $name,)*
        }

        impl MeshFormat {
            /// All formats.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            const fn row(self) -> (&'static str, Encode) {
                match self {
                    $(Self::$name => ($extension, $encode),)*
                }
            }
        }
    };
}

// A new format is a file with its bytes, and a line here.
mesh_formats! {
    /// PLY, binary: places with sigma and colour, and triangles.
    Ply = "ply", ply::encode;
    /// STL, binary: triangles alone.
    Stl = "stl", stl::encode;
    /// Wavefront OBJ, text: places with colour, and triangles.
    Obj = "obj", obj::encode;
}

impl MeshFormat {
    /// The format whose files have this ending, in any case.
    pub fn from_extension(extension: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|format| format.extension().eq_ignore_ascii_case(extension))
    }

    /// The ending of its files, without a dot.
    pub fn extension(self) -> &'static str {
        self.row().0
    }

    /// `mesh` as bytes of this format, with as much of it as the format has a place for. Lengths are in mm.
    pub fn encode(self, mesh: &Mesh) -> Vec<u8> {
        self.row().1(mesh)
    }
}
