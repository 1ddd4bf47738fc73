//! What is true of the photographs.

use epirig_core::grid::Grid;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::Series;

/// A point of the surface, in mm in the common camera's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint(pub Vector3<f64>);

impl SurfacePoint {
    /// 1 / Z along the axis of the common camera, in 1 / mm.
    pub fn inverse_depth(&self) -> f64 {
        1.0 / self.0.z
    }

    /// Depth along another axis through the common camera, in mm; `axis` has length 1.
    pub fn depth_along(&self, axis: &Vector3<f64>) -> f64 {
        self.0.dot(axis)
    }
}

impl Series {
    /// Number of photographs that are there. Frames are counted from 0 in their order.
    pub fn count(&self) -> usize {
        self.motion.numbers.len()
    }

    /// The point of the surface at X and Y.
    pub fn point_at(&self, x_mm: f64, y_mm: f64) -> SurfacePoint {
        SurfacePoint(Vector3::new(x_mm, y_mm, self.surface.depth_at(x_mm, y_mm)))
    }

    /// What the pixel (x, y) of a frame sees; need not be whole, nor inside the picture.
    pub fn seen(&self, frame: usize, x: f64, y: f64) -> SurfacePoint {
        let view = &self.motion.views[frame];
        let direction = view.rotation.tr_mul(&self.camera.direction(x, y));
        let along = self.surface.hit(&view.centre, &direction, self.surface.distance_mm);
        SurfacePoint(view.centre + along * direction)
    }

    /// The pixel of a frame at which a point is seen; it need not lie inside the picture.
    pub fn pixel_in(&self, frame: usize, point: &SurfacePoint) -> (f64, f64) {
        self.camera.pixel(&self.motion.views[frame].sees(&point.0))
    }

    /// Whether a pixel lies in the picture, up to its outermost pixel centres.
    pub fn has_pixel(&self, (x, y): (f64, f64)) -> bool {
        let (columns, rows) = (self.camera.columns as f64, self.camera.rows as f64);
        x >= 0.0 && y >= 0.0 && x <= columns - 1.0 && y <= rows - 1.0
    }

    /// Whether all frames see a point.
    pub fn is_in_all(&self, point: &SurfacePoint) -> bool {
        (0..self.count()).all(|frame| self.has_pixel(self.pixel_in(frame, point)))
    }

    /// The disparity of a point in an ideal rectified camera, in px: its column in the last frame less
    /// that in the first. Such a camera has its rows along the rail, the axis of view `axis` across the
    /// motion, and its own focal length.
    pub fn disparity_px(&self, point: &SurfacePoint, axis: &Vector3<f64>, focal_length_px: f64) -> f64 {
        // A camera that moves along its rows sees the scene go the other way.
        let sign = -self.motion.rail_axes().row(0).dot(&self.motion.direction.transpose()).signum();
        sign * focal_length_px * self.motion.baseline_mm() / point.depth_along(axis)
    }

    /// The disparity of each pixel of a rectified frame, whose pixels `raw` finds in the photograph
    /// `frame`; NaN outside of it. `axis`: the rectified camera's axis of view.
    pub fn true_disparity(
        &self,
        frame: usize,
        (rows, columns): (usize, usize),
        raw: impl Fn(f64, f64) -> (f64, f64) + Sync,
        axis: &Vector3<f64>,
        focal_length_px: f64,
    ) -> Grid<f64> {
        let mut truth = Grid::filled(rows, columns, f64::NAN);
        truth.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                let (x, y) = raw(x as f64, y as f64);
                if self.has_pixel((x, y)) {
                    *value = self.disparity_px(&self.seen(frame, x, y), axis, focal_length_px);
                }
            }
        });
        truth
    }

    /// The disparity of each pixel of a frame of a straightened series, in px.
    pub fn straight_disparity(&self, frame: usize) -> Grid<f64> {
        let camera = &self.camera;
        let axis = self.motion.rail_axes().row(2).transpose();
        let size = (camera.rows, camera.columns);
        self.true_disparity(frame, size, |x, y| (x, y), &axis, camera.focal_length_px)
    }

    /// f (s_last - s_first) / Z of each pixel of a photograph, Z along the axis of the common camera,
    /// in px.
    pub fn parallax(&self, frame: usize) -> Grid<f64> {
        let camera = &self.camera;
        let scale = camera.focal_length_px * self.motion.baseline_mm();
        let mut parallax = Grid::filled(camera.rows, camera.columns, 0.0);
        parallax.values_mut().par_chunks_mut(camera.columns).enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                *value = scale * self.seen(frame, x as f64, y as f64).inverse_depth();
            }
        });
        parallax
    }

    /// 1 / Z in the middle of the picture of the frame in the middle, in 1 / mm.
    pub fn middle_inverse_depth(&self) -> f64 {
        let (x, y) = self.camera.centre();
        self.seen(self.motion.middle(), x, y).inverse_depth()
    }
}
