//! Textures that are drawn on surfaces. Nothing here is the simulator's: a bench that rendered with it would
//! share its mistakes.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a surface is painted with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Paint {
    /// Grains of some 2 px.
    Grains,
    /// Detail of all sizes, the larger the stronger.
    Clouds,
    /// Cells of one shade with sharp borders, some 5 px wide.
    Cells,
    /// Grains whose contrast varies 12-fold over 60 px.
    Uneven,
}

/// Lattice cells after which a texture repeats, a power of two.
const PERIOD: usize = 512;

/// A texture, ready to be looked up.
pub(super) struct Texture {
    paint: Paint,
    random: Vec<f32>,
}

impl Texture {
    pub(super) fn new(paint: Paint, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        Self { paint, random: (0..PERIOD * PERIOD).map(|_| random.random()).collect() }
    }

    /// The shade at a place of the surface, in px: 0 to 1.
    pub(super) fn shade(&self, x: f64, y: f64) -> f64 {
        match self.paint {
            Paint::Grains => spread(self.smooth(x, y, 1.3), 1.6),
            Paint::Uneven => {
                let contrast = (0.5 + 0.5 * (x / 9.5).sin() * (y / 9.5).cos()).powi(2) * 0.92 + 0.08;
                0.5 + contrast * (spread(self.smooth(x, y, 1.3), 1.6) - 0.5)
            }
            Paint::Clouds => {
                let octaves = [(1.2, 0.18), (2.4, 0.22), (4.8, 0.27), (9.6, 0.33)];
                spread(octaves.iter().map(|(cell, share)| share * self.smooth(x, y, *cell)).sum(), 2.2)
            }
            Paint::Cells => self.cell(x, y),
        }
    }

    fn at(&self, column: i64, row: i64) -> f64 {
        let place = |index: i64| index.rem_euclid(PERIOD as i64) as usize;
        f64::from(self.random[place(row) * PERIOD + place(column)])
    }

    /// Random numbers on a lattice of `cell` px, joined by cubic B-splines.
    fn smooth(&self, x: f64, y: f64, cell: f64) -> f64 {
        let (x, y) = (x / cell, y / cell);
        let (left, top) = (x.floor(), y.floor());
        let (across, down) = (weights(x - left), weights(y - top));
        let mut sum = 0.0;
        for (v, down) in (-1..).zip(down) {
            for (u, across) in (-1..).zip(across) {
                sum += down * across * self.at(left as i64 + u, top as i64 + v);
            }
        }
        sum
    }

    /// The shade of the nearest of points that are scattered, one in each square of 5 px.
    fn cell(&self, x: f64, y: f64) -> f64 {
        const SIDE_PX: f64 = 5.0;
        let (column, row) = ((x / SIDE_PX).floor() as i64, (y / SIDE_PX).floor() as i64);
        let mut nearest = (f64::INFINITY, 0.0);
        for (u, v) in (-1..=1).flat_map(|v| (-1..=1).map(move |u| (column + u, row + v))) {
            // Three independent numbers of the same table.
            let [place_x, place_y, shade] = [0, 171, 342].map(|shift| self.at(u + shift, v + shift));
            let (point_x, point_y) = ((u as f64 + place_x) * SIDE_PX, (v as f64 + place_y) * SIDE_PX);
            let distance = (point_x - x).hypot(point_y - y);
            if distance < nearest.0 {
                nearest = (distance, shade);
            }
        }
        nearest.1
    }
}

/// Contrast about the middle, within 0 to 1.
fn spread(value: f64, contrast: f64) -> f64 {
    (0.5 + contrast * (value - 0.5)).clamp(0.0, 1.0)
}

fn weights(f: f64) -> [f64; 4] {
    let g = 1.0 - f;
    [
        g * g * g / 6.0,
        (4.0 + f * f * (3.0 * f - 6.0)) / 6.0,
        (4.0 + g * g * (3.0 * g - 6.0)) / 6.0,
        f * f * f / 6.0,
    ]
}
