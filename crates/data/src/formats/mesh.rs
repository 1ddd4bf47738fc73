//! A surface of triangles.

use super::codec::ascii;

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// x, y, z in mm.
    pub place_mm: [f32; 3],
    /// Standard deviation along z, in mm.
    pub sigma_mm: f32,
    /// Red, green and blue.
    pub colour: [u8; 3],
}

/// Points, and triangles between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// The points.
    pub vertices: Vec<Vertex>,
    /// Triangles, by the numbers of their points from 0; seen from outside, they go round against the clock.
    pub triangles: Vec<[u32; 3]>,
    /// What it shows, in one line.
    pub title: String,
}

impl Mesh {
    /// The title in one line of ASCII.
    pub(super) fn line(&self) -> String {
        ascii(&self.title)
    }
}
