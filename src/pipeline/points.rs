//! A surface as points in space with triangles between them.

use crate::report::{ValueRange, height_colour};
use epirig_core::grid::Grid;
use epirig_data::formats::{Mesh, Vertex};
use epirig_surface::Heights;

/// `z_mm` (rows x columns, NaN for no point) as a surface: x to the right, y up and z towards the camera, in mm; and
/// two triangles between any four neighbours that have points. Colours are those of the pictures over
/// `range`. Sigma, X and Y are those of `heights`, which have the same size. `title` says what it shows.
pub fn surface_mesh(heights: &Heights, z_mm: &Grid<f32>, range: ValueRange, title: String) -> Mesh {
    let (rows, columns) = (z_mm.rows(), z_mm.columns());
    let mut numbers = Grid::filled(rows, columns, None);
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for y in 0..rows {
        for x in 0..columns {
            let (z, sigma_mm) = (z_mm.at(x, y), heights.sigma_mm.at(x, y));
            let (x_mm, y_mm) = heights.lateral_mm(x, y);
            if !(z.is_finite() && x_mm.is_finite() && y_mm.is_finite()) {
                continue;
            }
            numbers.row_mut(y)[x] = Some(vertices.len() as u32);
            let place_mm = [x_mm as f32, -y_mm as f32, z];
            vertices.push(Vertex { place_mm, sigma_mm, colour: height_colour(z, range) });
            if x == 0 || y == 0 {
                continue;
            }
            let corners =
                (numbers.at(x - 1, y - 1), numbers.at(x - 1, y), numbers.at(x, y), numbers.at(x, y - 1));
            if let (Some(a), Some(b), Some(c), Some(d)) = corners {
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    Mesh { vertices, triangles, title }
}
