//! Painted scenes: frames from closed formulas, which share nothing with the simulator.
//!
//! A surface is a strip of the middle view (the view from the middle of the baseline) whose disparity is
//! linear in x and y there, as that of a plane in space is. In a frame at tau a point (u, y) lies at u +
//! (tau - 1/2) d(u, y), which is an affine map of the strip; a wave of its texture stays a wave, with another wave
//! vector, and the pixel's square and the point spread multiply it by the transform of both. So pixels within
//! a strip are exact whatever its slant. Pixels that see an edge of a strip mix the light on both sides as
//! they cover it; the integral along x is done numerically there, to 1e-4 DN. Later strips occlude earlier
//! ones.

#![allow(dead_code, reason = "each test program uses a part of this")]
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

mod aperture;
mod texture;

use std::f64::consts::TAU;

use epirig_core::frame::{Frame, Samples};
use epirig_core::grid::Grid;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

pub use aperture::Aperture;
pub use texture::{Texture, Wave};

/// A part of the scene, with what is painted on it.
#[derive(Clone)]
pub struct Strip {
    /// Where it begins and ends along x in the middle view, in px; it is endless along y.
    pub columns: (f64, f64),
    /// Disparity at column 0, row 0 of the middle view, in px.
    pub disparity_px: f64,
    /// Change of disparity along x and y of the middle view; along y only for endless strips.
    pub slant: (f64, f64),
    /// What is painted on it.
    pub texture: Texture,
}

impl Strip {
    /// A plane that fills the view, with this disparity at (x, y) of the middle view.
    pub fn plane(disparity_px: f64, (x, y): (f64, f64), slant: (f64, f64), texture: Texture) -> Self {
        let disparity_px = disparity_px - slant.0 * x - slant.1 * y;
        Self { columns: (f64::NEG_INFINITY, f64::INFINITY), disparity_px, slant, texture }
    }

    /// Disparity of the point at (u, y) of the middle view.
    fn disparity(&self, u: f64, y: f64) -> f64 {
        self.disparity_px + self.slant.0 * u + self.slant.1 * y
    }

    /// Column of the middle view that a frame `from_middle` of the baseline beyond the middle shows at (x,
    /// y).
    fn column(&self, x: f64, y: f64, from_middle: f64) -> f64 {
        (x - from_middle * (self.disparity_px + self.slant.1 * y)) / (1.0 + from_middle * self.slant.0)
    }

    fn contains(&self, u: f64) -> bool {
        self.columns.0 <= u && u < self.columns.1
    }

    /// Where the strip begins and ends along x in such a frame.
    fn extent(&self, from_middle: f64) -> (f64, f64) {
        let at = |u: f64| if u.is_finite() { u + from_middle * self.disparity(u, 0.0) } else { u };
        (at(self.columns.0), at(self.columns.1))
    }
}

/// How the scene is looked at.
#[derive(Clone, Copy)]
pub struct Camera {
    /// Rows of a frame.
    pub rows: usize,
    /// Columns of a frame.
    pub columns: usize,
    /// Number of equidistant frames.
    pub frames: usize,
    /// The point spread.
    pub aperture: Aperture,
    /// Standard deviation of the white noise that is added before rounding, in DN of 8 bit.
    pub noise_dn: f64,
    /// Bits of a sample, 8 to 16; full scale is the same light for all.
    pub bit_depth: u8,
    /// Seed of the noise.
    pub seed: u64,
}

/// A scene and its camera.
pub struct Painting {
    /// The strips, from the back to the front.
    pub strips: Vec<Strip>,
    /// How they are looked at.
    pub camera: Camera,
}

/// What is true for the pixels of a reference frame.
pub struct Truth {
    /// Disparity of the point in the pixel's middle, in px.
    pub disparity: Grid<f32>,
    /// Number of frames that show that point: it lies in the image and nothing is in front of it.
    pub visible_frames: Grid<u16>,
}

impl Truth {
    /// Shares of the pixels that at least half of `frames` see and that `found` has right within 0.1 px, and
    /// of its answers that are wrong by more than 1 px.
    pub fn right_and_wrong(&self, found: &Grid<f32>, frames: usize) -> (f64, f64) {
        let (mut visible, mut right, mut answered, mut wrong) = (0_u32, 0_u32, 0_u32, 0_u32);
        let pixels = self.disparity.values().iter().zip(found.values()).zip(self.visible_frames.values());
        for ((truth, found), &seen) in pixels {
            let error = (found - truth).abs();
            let half = 2 * usize::from(seen) >= frames;
            visible += u32::from(half);
            right += u32::from(half && error <= 0.1);
            answered += u32::from(!found.is_nan());
            wrong += u32::from(error > 1.0);
        }
        (f64::from(right) / f64::from(visible), f64::from(wrong) / f64::from(answered))
    }
}

impl Painting {
    /// A plane with this disparity in the middle of the image.
    pub fn plane(camera: Camera, disparity_px: f64, slant: (f64, f64), texture: Texture) -> Self {
        let middle = (0.5 * (camera.columns as f64 - 1.0), 0.5 * (camera.rows as f64 - 1.0));
        Self { strips: vec![Strip::plane(disparity_px, middle, slant, texture)], camera }
    }

    /// A ridge at column `ridge_px` of the middle view from which disparity falls by `slope` per px to both
    /// sides.
    pub fn ridge(camera: Camera, disparity_px: f64, ridge_px: f64, slope: f64, texture: Texture) -> Self {
        let face = |slope: f64, columns: (f64, f64)| {
            let plane = Strip::plane(disparity_px, (ridge_px, 0.0), (slope, 0.0), texture.clone());
            Strip { columns, ..plane }
        };
        let left = face(slope, (f64::NEG_INFINITY, ridge_px));
        let right = face(-slope, (ridge_px, f64::INFINITY));
        Self { strips: vec![left, right], camera }
    }

    /// All frames.
    pub fn volume(&self) -> Volume {
        let Camera { rows, columns, frames, bit_depth, .. } = self.camera;
        let images: Vec<Frame> = (0..frames).into_par_iter().map(|t| self.frame(t)).collect();
        let mut volume = Volume::new(rows, columns, bit_depth, Tau::equidistant(frames).unwrap());
        for (t, image) in images.iter().enumerate() {
            volume.insert(t, image).unwrap();
        }
        volume
    }

    /// Frame `t` with its noise, rounded.
    pub fn frame(&self, t: usize) -> Frame {
        let Camera { rows, columns, noise_dn, bit_depth, seed, .. } = self.camera;
        let levels = f64::from(1_u32 << (bit_depth - 8));
        let highest = f64::from((1_u32 << bit_depth) - 1);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(t as u64);
        let light = self.light(t);
        let rounded = light.values().iter().map(|&light| {
            let unit: f64 = StandardNormal.sample(&mut random);
            (levels * (f64::from(light) + noise_dn * unit)).round().clamp(0.0, highest)
        });
        let samples = if bit_depth == 8 {
            Samples::U8(rounded.map(|value| value as u8).collect())
        } else {
            Samples::U16(rounded.map(|value| value as u16).collect())
        };
        Frame::new(rows, columns, bit_depth, samples).unwrap()
    }

    /// The light in frame `t` without noise, in DN of 8 bit.
    pub fn light(&self, t: usize) -> Grid<f32> {
        self.picture(t, false)
    }

    /// Its derivative along x, in DN/px; only for scenes of one endless strip.
    pub fn gradient(&self, t: usize) -> Grid<f32> {
        assert!(self.strips.len() == 1, "at an edge the derivative has another formula");
        self.picture(t, true)
    }

    fn picture(&self, t: usize, derivative: bool) -> Grid<f32> {
        let Camera { rows, columns, aperture, .. } = self.camera;
        let from_middle = self.beyond_middle(t);
        let reach = aperture.reach_px();
        let mut image = Grid::filled(rows, columns, 0.0_f32);
        for (index, strip) in self.strips.iter().enumerate() {
            let bare = self.bare(index, from_middle);
            let touches =
                |&x: &usize| bare.iter().any(|&(from, to)| from < x as f64 + reach && to > x as f64 - reach);
            let (Some(first), Some(last)) = ((0..columns).find(touches), (0..columns).rfind(touches)) else {
                continue;
            };
            let mut parts = vec![[0.0_f32; 2]; last + 1 - first];
            for wave in &strip.texture.waves {
                let seen = Seen::new(wave, strip, from_middle, aperture);
                for (x, part) in (first..=last).zip(&mut parts) {
                    *part = seen.at(x as f64, &bare, derivative);
                }
                let (real, imaginary): (Vec<f32>, Vec<f32>) =
                    parts.iter().map(|&[real, imaginary]| (real, imaginary)).unzip();
                for y in 0..rows {
                    let (sin, cos) = (TAU * seen.along * y as f64).sin_cos();
                    let (sin, cos) = (sin as f32, cos as f32);
                    let row = &mut image.row_mut(y)[first..=last];
                    for ((value, real), imaginary) in row.iter_mut().zip(&real).zip(&imaginary) {
                        *value += cos * real - sin * imaginary;
                    }
                }
            }
        }
        image
    }

    /// What is true for the pixels of frame `reference`.
    pub fn truth(&self, reference: usize) -> Truth {
        let Camera { rows, columns, frames, .. } = self.camera;
        let here = self.beyond_middle(reference);
        let mut disparity = Grid::filled(rows, columns, f32::NAN);
        let mut visible_frames = Grid::filled(rows, columns, 0);
        for y in 0..rows {
            for x in 0..columns {
                let Some(index) = self.in_front(x as f64, y as f64, here) else { continue };
                let strip = &self.strips[index];
                let u = strip.column(x as f64, y as f64, here);
                let own = strip.disparity(u, y as f64);
                let shows = |t: &usize| {
                    let there = self.beyond_middle(*t);
                    let place = x as f64 + (there - here) * own;
                    (0.0..=(columns - 1) as f64).contains(&place)
                        && self.strips[index + 1..]
                            .iter()
                            .all(|strip| !strip.contains(strip.column(place, y as f64, there)))
                };
                disparity.row_mut(y)[x] = own as f32;
                visible_frames.row_mut(y)[x] = (0..frames).filter(shows).count() as u16;
            }
        }
        Truth { disparity, visible_frames }
    }

    /// How far frame `t` lies beyond the middle of the baseline, as a share of it.
    fn beyond_middle(&self, t: usize) -> f64 {
        t as f64 / (self.camera.frames - 1) as f64 - 0.5
    }

    /// The strip that such a frame shows at (x, y).
    fn in_front(&self, x: f64, y: f64, from_middle: f64) -> Option<usize> {
        self.strips.iter().rposition(|strip| strip.contains(strip.column(x, y, from_middle)))
    }

    /// The visible intervals along x where such a frame shows strip `index`.
    fn bare(&self, index: usize, from_middle: f64) -> Vec<(f64, f64)> {
        let strip = &self.strips[index];
        let endless = strip.columns.0 == f64::NEG_INFINITY && strip.columns.1 == f64::INFINITY;
        assert!(endless || strip.slant.1 == 0.0, "the ends of a strip are upright");
        assert!(self.strips.len() == 1 || strip.slant.1 == 0.0, "whatever occludes a strip is upright");
        let mut bare = vec![strip.extent(from_middle)];
        for before in &self.strips[index + 1..] {
            let (from, to) = before.extent(from_middle);
            bare = bare
                .into_iter()
                .flat_map(|(left, right)| [(left, right.min(from)), (left.max(to), right)])
                .filter(|(left, right)| left < right)
                .collect();
        }
        bare
    }
}

/// A wave as a frame shows it.
struct Seen {
    aperture: Aperture,
    across: f64,
    along: f64,
    /// With what the aperture leaves along y.
    amplitude_dn: f64,
    phase: f64,
}

impl Seen {
    /// The wave's argument at u = (x - c (d0 + q y)) / (1 + c p), c the frame's place from the middle, p and
    /// q the slants.
    fn new(wave: &Wave, strip: &Strip, from_middle: f64, aperture: Aperture) -> Self {
        let across = wave.across / (1.0 + from_middle * strip.slant.0);
        let along = wave.along - across * from_middle * strip.slant.1;
        let phase = wave.phase - TAU * across * from_middle * strip.disparity_px;
        let amplitude_dn = wave.amplitude_dn * aperture.response(along);
        Self { aperture, across, along, amplitude_dn, phase }
    }

    /// Complex amplitude of the pixels of column `x`, of the light or of its derivative along x.
    fn at(&self, x: f64, bare: &[(f64, f64)], derivative: bool) -> [f32; 2] {
        let reach = self.aperture.reach_px();
        let whole = bare.iter().any(|&(from, to)| from <= x - reach && to >= x + reach);
        let (real, imaginary) = if whole {
            (self.aperture.response(self.across), 0.0)
        } else {
            bare.iter().fold((0.0, 0.0), |sum, &interval| {
                let part = self.aperture.part_response(self.across, x, interval);
                (sum.0 + part.0, sum.1 + part.1)
            })
        };
        let (sin, cos) = (TAU * self.across * x + self.phase).sin_cos();
        let turned = (real * cos - imaginary * sin, real * sin + imaginary * cos);
        // The derivative of exp(i k x) is i k exp(i k x).
        let factor = TAU * self.across;
        let (real, imaginary) = if derivative { (-factor * turned.1, factor * turned.0) } else { turned };
        [(self.amplitude_dn * real) as f32, (self.amplitude_dn * imaginary) as f32]
    }
}
