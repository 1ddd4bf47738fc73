//! Photographs of a relief from a camera that moves along a straight line, drawn for tests. What is
//! true is known in closed form.
//!
//! A point X of the scene, in mm in the coordinates of the **common camera**, is seen by frame t at
//!
//! ```text
//! y = R(w_t) (X - s_t m - d_t)
//! pixel = centre + f pi(y) (1 + k1 r^2)
//! r = |pi(y)|,  centre = ((columns - 1) / 2, (rows - 1) / 2)
//! ```
//!
//! with the unit direction of motion m, the offset d_t across it, and a small rotation w_t.
//!
//! The common camera stands at the middle of the motion and is turned as the frames are in the
//! mean. Nothing here comes from the program's own simulator, rectification or matcher, as it is to
//! judge them.

#![allow(dead_code, reason = "each test program uses a part of this")]
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

pub mod camera;
pub mod exif;
pub mod files;
pub mod motion;
pub mod relief;
pub mod render;
pub mod resample;
pub mod texture;
pub mod truth;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub use camera::Camera;
pub use exif::Orientation;
pub use motion::Motion;
pub use relief::{Relief, Surface};
pub use resample::Region;
pub use texture::{Painting, Texture};

/// What is photographed, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Photographs {
    pub rows: usize,
    pub columns: usize,
    /// Photographs that are taken, those among them that are left out included.
    pub frames: usize,
    pub focal_length_px: f64,
    /// Distance of the middle plane of the relief from the common camera, in mm.
    pub distance_mm: f64,
    pub relief: Relief,
    /// Difference of the movements of the nearest and the farthest point over the baseline, in px.
    pub relief_px: f64,
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
        let seen = truth::seen_mm(views, &surface, self.motion_blur_px * self.pixel_mm());
        surface.check(&seen, 0.5 * width_mm / self.distance_mm);
        let painting = Painting::new(&self.texture, &seen, self.pixel_mm(), self.seed);
        Series { taken: self.clone(), camera, motion, surface, painting: std::sync::Arc::new(painting) }
    }

    /// Random numbers for one purpose.
    fn random(&self, purpose: Purpose) -> ChaCha8Rng {
        random(self.seed, purpose, 0)
    }
}

/// What random numbers are for.
#[derive(Debug, Clone, Copy)]
enum Purpose {
    Relief = 1,
    Steps,
    Wobble,
    Offset,
    Light,
    Noise,
    Texture,
}

/// Random numbers for one purpose; `part` numbers its parts.
fn random(seed: u64, purpose: Purpose, part: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(((purpose as u64) << 40) + part);
    random
}

/// Photographs with their truth.
#[derive(Debug, Clone)]
pub struct Series {
    pub taken: Photographs,
    pub camera: Camera,
    pub motion: Motion,
    pub surface: Surface,
    painting: std::sync::Arc<Painting>,
}

impl Series {
    /// The same scene from the same places with the same light and noise, by an ideal camera whose
    /// rows lie along the motion: no distortion, no wobble, no offsets. It says how well any
    /// rectification can do.
    pub fn straightened(&self) -> Self {
        Self { camera: Camera { k1: 0.0, ..self.camera }, motion: self.motion.straightened(), ..self.clone() }
    }
}
