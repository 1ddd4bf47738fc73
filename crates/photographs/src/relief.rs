//! The surface Z(X, Y) of the scene, and where rays meet it.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The form of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relief {
    /// A plane that faces the common camera.
    Flat,
    /// Waves of several lengths and directions.
    Hills,
    /// Round mounds and hollows.
    Mounds,
    /// A bowed tile: raised squares, and grooves with sloped walls between them.
    Grooves,
    /// A plane that leans, with low waves.
    Slope,
}

/// A term of the height.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Term {
    /// amplitude * sin(kx X + ky Y + phase)
    Wave { amplitude: f64, kx: f64, ky: f64, phase: f64 },
    /// amplitude * exp(-((X - x)^2 + (Y - y)^2) / (2 size^2))
    Mound { amplitude: f64, x: f64, y: f64, size: f64 },
    /// amplitude * smooth(cos kX) * smooth(cos kY), where smooth rises from 0 at -half to 1 at half
    Squares { amplitude: f64, k: f64, half: f64 },
    /// gx X + gy Y
    Plane { gx: f64, gy: f64 },
}

/// Z(X, Y) = distance - depth * (sum of terms), in mm in the common camera's coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Distance of its middle plane from the common camera, in mm.
    pub distance_mm: f64,
    /// Height of the highest point over the lowest, in mm.
    pub depth_mm: f64,
    terms: Vec<Term>,
    /// Height that the sum of terms is at, in units of the depth.
    level: f64,
    /// Sum of terms to units of the depth.
    scale: f64,
}

/// A part of the plane of X and Y, in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// From and to along X.
    pub x: (f64, f64),
    /// From and to along Y.
    pub y: (f64, f64),
}

impl Surface {
    /// A surface whose parallax is `share` of the movement of its middle plane. `width_mm` is the
    /// width of a picture.
    pub(super) fn new(
        relief: Relief,
        distance_mm: f64,
        share: f64,
        width_mm: f64,
        random: &mut ChaCha8Rng,
    ) -> Self {
        let terms = relief.terms(width_mm, random);
        let mut surface = Self { distance_mm, depth_mm: 0.0, terms, level: 0.0, scale: 1.0 };
        // From 1 / (1 - q / 2) - 1 / (1 + q / 2) = share, q: depth over distance.
        if relief != Relief::Flat && share > 0.0 {
            surface.depth_mm = distance_mm * 2.0 * ((1.0 + share * share).sqrt() - 1.0) / share;
        }
        let half = 0.6 * width_mm;
        let (low, high) = surface.extremes(&Area { x: (-half, half), y: (-half, half) });
        surface.level = 0.5 * (low + high);
        surface.scale = if high > low { 1.0 / (high - low) } else { 0.0 };
        surface
    }

    /// Height over the middle plane in units of the depth, about -0.5 to 0.5, and its gradient by X
    /// and Y.
    fn height(&self, x: f64, y: f64) -> [f64; 3] {
        let mut sum = [-self.level, 0.0, 0.0];
        for term in &self.terms {
            term.add(x, y, &mut sum);
        }
        sum.map(|value| self.scale * value)
    }

    /// Z, in mm.
    pub fn depth_at(&self, x: f64, y: f64) -> f64 {
        self.distance_mm - self.depth_mm * self.height(x, y)[0]
    }

    /// Where the ray from `origin` along `direction`, both in the common camera's coordinates,
    /// meets the surface, as a multiple of the direction; by Newton's method from `start`, to 1e-10
    /// of the distance.
    pub fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, start: f64) -> f64 {
        let mut along = start;
        for _ in 0..50 {
            let at = origin + along * direction;
            let [height, by_x, by_y] = self.height(at.x, at.y);
            let above = at.z - self.distance_mm + self.depth_mm * height;
            let slope = direction.z + self.depth_mm * (by_x * direction.x + by_y * direction.y);
            along -= above / slope;
            // What is left then is the square of this, times a curvature of some 0.01 / mm.
            if above.abs() < 1e-6 * self.distance_mm {
                return along;
            }
        }
        panic!("a ray does not meet the surface");
    }

    /// Nearest and farthest Z of any point, in mm, with some room.
    pub(super) fn depths(&self) -> (f64, f64) {
        (self.distance_mm - 0.6 * self.depth_mm, self.distance_mm + 0.6 * self.depth_mm)
    }

    /// Checks that no ray, up to `tangent` away from the axis, meets the surface twice in `seen`.
    pub(super) fn check(&self, seen: &Area, tangent: f64) {
        let steepest = grid(seen).map(|(x, y)| {
            let [_, by_x, by_y] = self.height(x, y);
            self.depth_mm * by_x.hypot(by_y)
        });
        let steepest = steepest.fold(0.0, f64::max);
        let slope = 1.3 * steepest * tangent;
        assert!(slope < 0.9, "the relief is too steep: slopes of {steepest:.2} hide parts of it");
    }

    fn extremes(&self, area: &Area) -> (f64, f64) {
        grid(area)
            .map(|(x, y)| self.height(x, y)[0])
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    }
}

/// Places that cover an area.
fn grid(area: &Area) -> impl Iterator<Item = (f64, f64)> {
    const STEPS: usize = 64;
    let at = |(low, high): (f64, f64), step: usize| low + (high - low) * step as f64 / STEPS as f64;
    let area = *area;
    (0..=STEPS).flat_map(move |j| (0..=STEPS).map(move |i| (at(area.x, i), at(area.y, j))))
}

impl Relief {
    fn terms(self, width_mm: f64, random: &mut ChaCha8Rng) -> Vec<Term> {
        let mut wave = |amplitude: f64, length: f64| {
            let (angle, phase) = (random.random_range(0.0..TAU), random.random_range(0.0..TAU));
            let k = TAU / (length * width_mm);
            Term::Wave { amplitude, kx: k * angle.cos(), ky: k * angle.sin(), phase }
        };
        match self {
            Self::Flat => Vec::new(),
            Self::Hills => vec![wave(1.0, 1.0), wave(0.5, 0.7), wave(0.3, 0.5), wave(0.2, 0.4)],
            Self::Slope => {
                let plane = Term::Plane { gx: 2.0 / width_mm, gy: 1.0 / width_mm };
                vec![plane, wave(0.2, 0.6), wave(0.1, 0.4)]
            }
            Self::Grooves => {
                let squares = Term::Squares { amplitude: 0.25, k: TAU / (0.3 * width_mm), half: 0.6 };
                vec![wave(0.5, 1.6), squares]
            }
            Self::Mounds => (0..7)
                .map(|index| Term::Mound {
                    amplitude: if index % 2 == 0 { 1.0 } else { -1.0 },
                    x: width_mm * random.random_range(-0.6..0.6),
                    y: width_mm * random.random_range(-0.4..0.4),
                    size: width_mm * random.random_range(0.1..0.2),
                })
                .collect(),
        }
    }
}

impl Term {
    /// Adds value and gradient.
    fn add(&self, x: f64, y: f64, sum: &mut [f64; 3]) {
        match *self {
            Self::Wave { amplitude, kx, ky, phase } => {
                let (sine, cosine) = (kx * x + ky * y + phase).sin_cos();
                sum[0] += amplitude * sine;
                sum[1] += amplitude * kx * cosine;
                sum[2] += amplitude * ky * cosine;
            }
            Self::Mound { amplitude, x: x0, y: y0, size } => {
                let (dx, dy) = ((x - x0) / size, (y - y0) / size);
                let value = amplitude * (-0.5 * (dx * dx + dy * dy)).exp();
                sum[0] += value;
                sum[1] -= value * dx / size;
                sum[2] -= value * dy / size;
            }
            Self::Squares { amplitude, k, half } => {
                let ((f, df), (g, dg)) = (wall(k * x, half), wall(k * y, half));
                sum[0] += amplitude * f * g;
                sum[1] += amplitude * k * df * g;
                sum[2] += amplitude * k * f * dg;
            }
            Self::Plane { gx, gy } => {
                sum[0] += gx * x + gy * y;
                sum[1] += gx;
                sum[2] += gy;
            }
        }
    }
}

/// A smooth step (with two continuous derivatives) of cos(angle) from 0 at -half to 1 at half, and
/// its derivative by the angle.
fn wall(angle: f64, half: f64) -> (f64, f64) {
    let (sine, cosine) = angle.sin_cos();
    let t = (0.5 * (cosine / half + 1.0)).clamp(0.0, 1.0);
    let value = t * t * t * (10.0 + t * (6.0 * t - 15.0));
    let slope = 30.0 * t * t * (1.0 - t) * (1.0 - t);
    (value, -slope * 0.5 / half * sine)
}
