//! Photographs that were taken: the camera, where it stood, and what it saw.

use super::camera::Camera;
use super::exif::Orientation;
use super::motion::Motion;
use super::photographs::Photographs;
use super::random::Purpose;
use super::relief::Surface;
use super::seen::seen_mm;
use super::texture::Painting;

/// Photographs with their truth.
#[derive(Debug, Clone)]
pub struct Series {
    /// What was asked for.
    pub taken: Photographs,
    /// The camera.
    pub camera: Camera,
    /// Where it stood in each frame, and the light.
    pub motion: Motion,
    /// What was photographed.
    pub surface: Surface,
    pub(crate) painting: std::sync::Arc<Painting>,
}

impl Series {
    /// The same scene from the same places with the same light and noise, by an ideal camera whose
    /// rows lie along the motion: no distortion, no wobble, no offsets. It says how well any
    /// rectification can do.
    pub fn straightened(&self) -> Self {
        Self { camera: Camera { k1: 0.0, ..self.camera }, motion: self.motion.straightened(), ..self.clone() }
    }
}

impl Photographs {
    /// Takes the photographs, as far as that needs no pictures: those are drawn when asked for.
    ///
    /// # Panics
    /// If the numbers contradict each other: fewer than two frames left, or a relief that hides
    /// parts of itself.
    pub fn take(&self) -> Series {
        let has_tags = self.orientation != Orientation::Upright || self.exif_focal_length;
        assert!(!has_tags || self.jpeg_quality.is_some(), "only JPEG images are stored turned, with tags");
        let camera = Camera {
            rows: self.rows,
            columns: self.columns,
            focal_length_px: self.focal_length_px,
            k1: self.k1,
        };
        let motion = Motion::drawn(self);
        let width_mm = self.columns as f64 * self.pixel_mm();
        let surface = Surface::new(
            self.relief,
            self.distance_mm,
            self.relief_px / self.baseline_px,
            width_mm,
            &mut self.random(Purpose::Relief),
        );
        let straight = motion.straightened();
        let ideal = Camera { k1: 0.0, ..camera };
        let views = motion.views.iter().map(|view| (&camera, view));
        let views = views.chain(straight.views.iter().map(|view| (&ideal, view)));
        let seen = seen_mm(views, &surface, self.motion_blur_px * self.pixel_mm());
        surface.check(&seen, 0.5 * width_mm / self.distance_mm);
        let painting = Painting::new(&self.texture, &seen, self.pixel_mm(), self.seed);
        Series { taken: self.clone(), camera, motion, surface, painting: std::sync::Arc::new(painting) }
    }
}
