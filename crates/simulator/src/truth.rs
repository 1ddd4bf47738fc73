//! The truth of a simulated scan, in closed form.

use super::pinhole::Pinhole;
use super::scene::Scene;
use epirig_core::grid::Grid;

/// The truth for the pixels of one reference frame, seen by an ideal pinhole in the rectified frame, for the
/// true positions of the carriage; maps of rows x columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Disparity in px over the whole true baseline, signed; NaN where a pixel's middle sees the featureless
    /// ground.
    pub disparity: Grid<f32>,
    /// Height towards the camera over the scene's nearest level, in mm; NaN as above.
    pub height_mm: Grid<f32>,
    /// Number of frames of the pinhole whose image contains the pixel's surface point; 0 for the ground. No
    /// part of the simulator's scenes occludes another, so every point in the image is seen.
    pub visible_frames: Grid<u16>,
    /// Index of the first of them.
    first_visible: Grid<u16>,
}

impl Truth {
    /// Whether frame `t` sees the surface point of pixel (x, y). A point moves to one side only, so that the
    /// frames that see it follow each other.
    ///
    /// # Panics
    /// If the pixel lies outside the image.
    pub fn sees(&self, x: usize, y: usize, t: usize) -> bool {
        let first = usize::from(self.first_visible.at(x, y));
        (first..first + usize::from(self.visible_frames.at(x, y))).contains(&t)
    }
}

/// The truth of a scan in whose frames the scene's origin lies at `offsets` along x, in mm.
pub(super) fn truth(scene: &Scene, offsets: &[f64], camera: &Pinhole, reference: usize) -> Truth {
    let here = offsets[reference];
    let baseline_mm = offsets[offsets.len() - 1] - offsets[0];
    let (rows, columns) = (camera.rows, camera.columns);
    let mut disparity = Grid::filled(rows, columns, f32::NAN);
    let mut height_mm = Grid::filled(rows, columns, f32::NAN);
    let mut visible_frames = Grid::filled(rows, columns, 0);
    let mut first_visible = Grid::filled(rows, columns, 0);
    for y in 0..rows {
        for x in 0..columns {
            let Some(hit) = scene.hit(camera.ray(x as f64, y as f64), here) else { continue };
            let px_per_mm = camera.focal_length_px / hit.depth_mm;
            disparity.row_mut(y)[x] = (baseline_mm * px_per_mm) as f32;
            height_mm.row_mut(y)[x] = (scene.distance_mm() - hit.depth_mm) as f32;
            let in_view = |&&offset: &&f64| {
                let column = x as f64 + (offset - here) * px_per_mm;
                (0.0..=(columns - 1) as f64).contains(&column)
            };
            first_visible.row_mut(y)[x] =
                offsets.iter().position(|offset| in_view(&offset)).unwrap_or(0) as u16;
            visible_frames.row_mut(y)[x] = offsets.iter().filter(in_view).count() as u16;
        }
    }
    Truth { disparity, height_mm, visible_frames, first_visible }
}
