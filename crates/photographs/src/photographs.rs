//! What is photographed, and how.

use rand_chacha::ChaCha8Rng;

use super::exif::Orientation;
use super::random::{Purpose, random};
use super::relief::Relief;
use super::texture::Texture;

/// What is photographed, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Photographs {
    /// Rows of a photograph.
    pub rows: usize,
    /// Columns of a photograph.
    pub columns: usize,
    /// Photographs that are taken, those among them that are left out included.
    pub frames: usize,
    /// Focal length, in px.
    pub focal_length_px: f64,
    /// Distance of the middle plane of the relief from the common camera, in mm.
    pub distance_mm: f64,
    /// Form of what is photographed.
    pub relief: Relief,
    /// Difference of the movements of the nearest and the farthest point over the baseline, in px.
    pub relief_px: f64,
    /// What is painted on it.
    pub texture: Texture,
    /// Chooses relief, texture, motion, light and noise; each has random numbers of its own.
    pub seed: u64,
    /// Movement of a point in the middle plane of the relief from the first frame to the last, in
    /// px, with nothing left out.
    pub baseline_px: f64,
    /// Angle of the direction of motion in the image plane, from the rows towards the columns: 90
    /// is down, 180 to the left.
    pub roll_deg: f64,
    /// Angle of the direction of motion out of the image plane, into the scene.
    pub pan_deg: f64,
    /// Root mean square of the rotation of the frames about each of the three axes of the camera;
    /// its mean is zero.
    pub wobble_deg: f64,
    /// Root mean square of the displacement of the frames across the path, downwards and in depth,
    /// in px of a point in the middle plane. Mean and drift along the path are zero.
    pub offset_px: f64,
    /// Steps differ from their mean by up to this share of it.
    pub uneven_steps: f64,
    /// Numbers of photographs that are left out; the first is 1.
    pub missing: Vec<usize>,
    /// Number of a photograph that is taken where the one before it was taken.
    pub repeated: Option<usize>,
    /// Number of a photograph before which the camera goes back, by 0.7 of a mean step.
    pub step_back: Option<usize>,
    /// Light of each photograph differs by up to this share.
    pub light: f64,
    /// Standard deviation of the noise, in grey values.
    pub noise: f64,
    /// How far a point in the middle plane moves while a photograph is exposed, in px.
    pub motion_blur_px: f64,
    /// Radial distortion of the lens, as in [`Camera`](super::Camera).
    pub k1: f64,
    /// Quality of the JPEG images; `None` for PNG.
    pub jpeg_quality: Option<u8>,
    /// How the JPEG images are stored; everything else here is about the upright photograph.
    pub orientation: Orientation,
    /// Whether the JPEG images tell the focal length.
    pub exif_focal_length: bool,
    /// Whether the names of the files are numbered without gaps, whatever is missing.
    pub renumbered: bool,
}

impl Photographs {
    /// A perfect slider in the proportions of the study: at 1500 x 1000, f = 3000 px, 261 px of
    /// movement and a relief of 13 px.
    pub fn sized(rows: usize, columns: usize, frames: usize) -> Self {
        let baseline_px = 0.174 * columns as f64;
        Self {
            rows,
            columns,
            frames,
            focal_length_px: 2.0 * columns as f64,
            distance_mm: 1000.0,
            relief: Relief::Hills,
            relief_px: 0.05 * baseline_px,
            texture: Texture::Noise,
            seed: 1,
            baseline_px,
            roll_deg: 0.0,
            pan_deg: 0.0,
            wobble_deg: 0.0,
            offset_px: 0.0,
            uneven_steps: 0.0,
            missing: Vec::new(),
            repeated: None,
            step_back: None,
            light: 0.0,
            noise: 2.0,
            motion_blur_px: 0.0,
            k1: 0.0,
            jpeg_quality: Some(92),
            orientation: Orientation::Upright,
            exif_focal_length: false,
            renumbered: false,
        }
    }

    /// Size of a pixel in the middle plane of the relief, in mm.
    pub fn pixel_mm(&self) -> f64 {
        self.distance_mm / self.focal_length_px
    }

    /// Random numbers for one purpose.
    pub(crate) fn random(&self, purpose: Purpose) -> ChaCha8Rng {
        random(self.seed, purpose, 0)
    }
}
