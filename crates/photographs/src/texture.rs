//! What is painted on the surface, as a function of its X and Y.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::random::{Purpose, random};
use super::relief::Area;

/// The texture. Lengths are in px of the middle plane.
#[derive(Debug, Clone, PartialEq)]
pub enum Texture {
    /// Noise of seven octaves, the finest with waves of 3 px: 30 grey values RMS.
    Noise,
    /// Flat discs of many sizes and grey values over each other, with little noise.
    Patches,
    /// A grid of lines that repeats every 25 px, with little noise.
    Repeating,
    /// Noise of 4.5 grey values RMS.
    Weak,
    /// Slanted stripes every 14 px, and noise of 10 grey values RMS.
    Stripes,
    /// Round blobs in a lattice, for the test of this generator.
    Blobs,
}

/// Distance of the blobs of [`Texture::Blobs`], in px.
pub const BLOB_PITCH_PX: f64 = 40.0;
/// Size (sigma) of a blob, in px: a larger one is bent by the relief, which moves its middle.
pub const BLOB_SIGMA_PX: f64 = 1.0;
/// Grey value between the blobs.
pub const BLOB_GROUND: f32 = 20.0;

/// Nodes of the painting in a pixel.
const OVERSAMPLING: usize = 2;
/// Nodes from one random number to the next in the finest octave: 1.5 px, so that the shortest wave
/// has 3 px.
const FINEST: usize = 3;
const OCTAVES: u32 = 7;
/// Root mean square of a sum of cubic B-splines with random coefficients of variance 1: 151 / 315
/// for each of two axes.
const SPLINE_RMS: f32 = 0.479_365;
const MIDDLE: f32 = 128.0;

/// A texture over a part of the surface: coefficients of a cubic B-spline (twice differentiable),
/// which *is* the texture.
#[derive(Debug, Clone)]
pub struct Painting {
    coefficients: Vec<f32>,
    columns: usize,
    rows: usize,
    node_mm: f64,
    /// X and Y of the first node.
    first_mm: Vector2<f64>,
}

impl Painting {
    /// A texture over `area`.
    pub(super) fn new(texture: &Texture, area: &Area, pixel_mm: f64, seed: u64) -> Self {
        let node_mm = pixel_mm / OVERSAMPLING as f64;
        // Nodes have whole numbers of steps from X = Y = 0.
        let before = |low: f64| (low / node_mm).floor() - 4.0;
        let count = |(low, high): (f64, f64)| ((high / node_mm).ceil() + 5.0 - before(low)) as usize;
        let (columns, rows) = (count(area.x), count(area.y));
        let first_mm = Vector2::new(before(area.x.0), before(area.y.0)) * node_mm;
        let mut painting =
            Self { coefficients: vec![MIDDLE; rows * columns], columns, rows, node_mm, first_mm };
        match texture {
            Texture::Noise => painting.add_noise(30.0, seed),
            Texture::Weak => painting.add_noise(4.5, seed),
            Texture::Patches => {
                painting.lay_discs(seed);
                painting.add_noise(5.0, seed);
            }
            Texture::Repeating => {
                let k = TAU / 25.0;
                painting.fill(|x, y| {
                    let (x, y) = ((k * x).cos(), (k * y).cos());
                    25.0 * (x + y) + 12.0 * (x * x + y * y - 1.0)
                });
                painting.add_noise(5.0, seed);
            }
            Texture::Stripes => {
                let angle = random(seed, Purpose::Texture, 100).random_range(0.3..1.2_f64);
                let (kx, ky) = (TAU / 14.0 * angle.cos(), TAU / 14.0 * angle.sin());
                painting.fill(|x, y| 40.0 * (kx * x + ky * y).cos());
                painting.add_noise(10.0, seed);
            }
            Texture::Blobs => {
                let ground = f64::from(BLOB_GROUND - MIDDLE);
                let off = |x: f64| x - BLOB_PITCH_PX * (x / BLOB_PITCH_PX).round();
                painting.fill(|x, y| {
                    let square = off(x).powi(2) + off(y).powi(2);
                    ground + 200.0 * (-0.5 * square / BLOB_SIGMA_PX.powi(2)).exp()
                });
            }
        }
        painting
    }

    /// The grey value at a point of the surface.
    pub fn at(&self, x_mm: f64, y_mm: f64) -> f32 {
        let (x, y) = ((x_mm - self.first_mm.x) / self.node_mm, (y_mm - self.first_mm.y) / self.node_mm);
        let (i, j) = (x.floor(), y.floor());
        let (wx, wy) = (weights((x - i) as f32), weights((y - j) as f32));
        // A point before the first node wraps round to a place that no painting has, and stops
        // there.
        let start = (j as isize - 1) as usize * self.columns + (i as isize - 1) as usize;
        let mut sum = 0.0;
        for (row, wy) in wy.into_iter().enumerate() {
            let taps = &self.coefficients[start + row * self.columns..][..4];
            sum += wy * (wx[0] * taps[0] + wx[1] * taps[1] + wx[2] * taps[2] + wx[3] * taps[3]);
        }
        sum
    }

    /// Adds a function of X and Y, in px.
    fn fill(&mut self, value: impl Fn(f64, f64) -> f64 + Sync) {
        let first = self.first_mm / self.node_mm;
        let px = 1.0 / OVERSAMPLING as f64;
        self.coefficients.par_chunks_mut(self.columns).enumerate().for_each(|(j, row)| {
            for (i, node) in row.iter_mut().enumerate() {
                *node += value((first.x + i as f64) * px, (first.y + j as f64) * px) as f32;
            }
        });
    }

    /// Adds noise of all octaves, each as strong as the next.
    fn add_noise(&mut self, rms: f32, seed: u64) {
        let amplitude = rms / SPLINE_RMS / (OCTAVES as f32).sqrt();
        let octaves: Vec<Octave> = (0..OCTAVES)
            .map(|octave| {
                let pitch = FINEST << octave;
                let (rows, columns) = (self.rows / pitch + 5, self.columns / pitch + 5);
                let mut random = random(seed, Purpose::Texture, u64::from(octave));
                let mut number = || {
                    let value: f32 = StandardNormal.sample(&mut random);
                    amplitude * value
                };
                let values = (0..rows * columns).map(|_| number()).collect();
                let phases = (0..pitch).map(|phase| weights(phase as f32 / pitch as f32)).collect();
                Octave { pitch, columns, values, phases }
            })
            .collect();
        self.coefficients.par_chunks_mut(self.columns).enumerate().for_each(|(j, row)| {
            octaves.iter().for_each(|octave| octave.add_row(j, row));
        });
    }

    /// Lays discs on the ground, later ones over earlier ones. Each place lies under some four of
    /// them.
    fn lay_discs(&mut self, seed: u64) {
        let mut random = random(seed, Purpose::Texture, 200);
        let (width, height) = (self.columns as f32, self.rows as f32);
        let (smallest, largest) = (5.0 * OVERSAMPLING as f32, 60.0 * OVERSAMPLING as f32);
        let (a, b) = (smallest.powi(-2), largest.powi(-2));
        // Sizes are distributed as size^-3.
        let mean_area = TAU as f32 * (largest / smallest).ln() / (a - b);
        let count = (4.0 * width * height / mean_area) as usize;
        let discs: Vec<Disc> = (0..count)
            .map(|_| Disc {
                x: width * random.random_range(0.0..1.0_f32),
                y: height * random.random_range(0.0..1.0_f32),
                radius: (a - (a - b) * random.random_range(0.0..1.0_f32)).powf(-0.5),
                grey: random.random_range(50.0..206.0),
            })
            .collect();
        let columns = self.columns;
        self.coefficients.par_chunks_mut(columns).enumerate().for_each(|(j, row)| {
            discs.iter().for_each(|disc| disc.paint_row(j, row));
        });
    }
}

/// Random coefficients with a wider spacing than the nodes of the painting.
struct Octave {
    /// Nodes from one coefficient to the next.
    pitch: usize,
    columns: usize,
    values: Vec<f32>,
    /// Weights of the spline for each node between two coefficients.
    phases: Vec<[f32; 4]>,
}

impl Octave {
    fn add_row(&self, j: usize, row: &mut [f32]) {
        let down = self.phases[j % self.pitch];
        let lines = &self.values[j / self.pitch * self.columns..];
        let line: Vec<f32> = (0..self.columns)
            .map(|i| (0..4).map(|line| down[line] * lines[line * self.columns + i]).sum())
            .collect();
        for (chunk, taps) in row.chunks_mut(self.pitch).zip(line.windows(4)) {
            for (node, across) in chunk.iter_mut().zip(&self.phases) {
                *node +=
                    across[0] * taps[0] + across[1] * taps[1] + across[2] * taps[2] + across[3] * taps[3];
            }
        }
    }
}

/// A disc, in nodes, with an edge that is smooth over 2 px.
struct Disc {
    x: f32,
    y: f32,
    radius: f32,
    grey: f32,
}

impl Disc {
    fn paint_row(&self, j: usize, row: &mut [f32]) {
        let half_edge = OVERSAMPLING as f32;
        let reach = self.radius + half_edge;
        let dy = j as f32 - self.y;
        if dy.abs() >= reach {
            return;
        }
        let half = (reach * reach - dy * dy).sqrt();
        let first = (self.x - half).ceil().max(0.0) as usize;
        let end = ((self.x + half).floor().max(-1.0) + 1.0) as usize;
        let end = end.min(row.len());
        for (i, node) in row.iter_mut().enumerate().take(end).skip(first) {
            let inside = self.radius - (i as f32 - self.x).hypot(dy);
            let t = (0.5 * (inside / half_edge + 1.0)).clamp(0.0, 1.0);
            *node += t * t * (3.0 - 2.0 * t) * (self.grey - *node);
        }
    }
}

/// Weights of a cubic B-spline at `a` (0 to 1) after its second coefficient.
fn weights(a: f32) -> [f32; 4] {
    let b = 1.0 - a;
    let (first, last) = (b * b * b / 6.0, a * a * a / 6.0);
    let second = 2.0 / 3.0 - 0.5 * a * a * (2.0 - a);
    [first, second, 1.0 - first - second - last, last]
}
