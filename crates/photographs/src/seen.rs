//! The part of the surface that cameras see.

use super::camera::Camera;
use super::motion::View;
use super::relief::{Area, Surface};

/// What the views see of the plane of X and Y, whatever the relief, and `room_mm` more.
pub(crate) fn seen_mm<'a>(
    views: impl Iterator<Item = (&'a Camera, &'a View)>,
    surface: &Surface,
    room_mm: f64,
) -> Area {
    /// Places along each edge of a picture: with distortion, corners are not always farthest.
    const STEPS: usize = 8;
    let (near, far) = surface.depths();
    let mut area = Area { x: (f64::INFINITY, f64::NEG_INFINITY), y: (f64::INFINITY, f64::NEG_INFINITY) };
    for (camera, view) in views {
        let (width, height) = (camera.columns as f64 - 1.0, camera.rows as f64 - 1.0);
        for step in 0..=STEPS {
            let share = step as f64 / STEPS as f64;
            let (x, y) = (share * width, share * height);
            for (x, y) in [(x, 0.0), (x, height), (0.0, y), (width, y)] {
                let direction = view.rotation.tr_mul(&camera.direction(x, y));
                for depth in [near, far] {
                    let at = view.centre + direction * ((depth - view.centre.z) / direction.z);
                    area.x = (area.x.0.min(at.x - room_mm), area.x.1.max(at.x + room_mm));
                    area.y = (area.y.0.min(at.y - room_mm), area.y.1.max(at.y + room_mm));
                }
            }
        }
    }
    area
}
