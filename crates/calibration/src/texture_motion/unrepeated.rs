//! Pictures without what repeats in them: it looks the same at many places, so it does not tell where something is.
//!
//! What repeats is narrow in the spectrum, where other texture is broad. So waves are taken down to what waves of
//! about their length and direction usually have.

use rustfft::num_complex::Complex32;
use rustfft::{FftDirection, FftPlanner};

use super::frames::Frames;
use epirig_core::grid::Grid;
use epirig_core::statistics::upper_median;

/// Waves are compared with those up to so many whole waves per picture beside them, on both axes.
const BESIDE: isize = 10;
/// Side of the cells of the spectrum whose waves are compared with the same others.
const CELL: usize = 4;
/// Larger than so many times the median is not by chance: amplitudes of noise have a Rayleigh distribution, of which
/// 1.5 in 100,000 exceed four times the median.
const CHANCE: f32 = 4.0;

/// Frames without what repeats in them.
pub(super) struct Unrepeated<'a>(pub(super) &'a dyn Frames);

impl Frames for Unrepeated<'_> {
    fn count(&self) -> usize {
        self.0.count()
    }

    fn size(&self) -> (usize, usize) {
        self.0.size()
    }

    fn picture(&self, index: usize, factor: usize) -> Grid<f32> {
        unrepeated(&self.0.picture(index, factor))
    }

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// A picture without what repeats in it. It fades towards the borders: where they cut a wave, they would make it broad.
fn unrepeated(picture: &Grid<f32>) -> Grid<f32> {
    let (rows, columns) = (picture.rows(), picture.columns());
    let mean = picture.values().iter().sum::<f32>() / (rows * columns) as f32;
    let [down, across] = [rows, columns].map(faded);
    let mut waves = Grid::filled(rows, columns, Complex32::default());
    for (y, down) in down.iter().enumerate() {
        let pixels = waves.row_mut(y).iter_mut().zip(picture.row(y)).zip(&across);
        pixels.for_each(|((wave, value), across)| *wave = Complex32::from(down * across * (value - mean)));
    }
    let mut waves = transformed(transformed(waves, FftDirection::Forward), FftDirection::Forward);
    let usual = usual_amplitudes(&waves);
    for y in 0..rows {
        for (x, wave) in waves.row_mut(y).iter_mut().enumerate() {
            let usual = usual.at(x / CELL, y / CELL);
            if wave.norm() > CHANCE * usual {
                *wave *= usual / wave.norm();
            }
        }
    }
    let waves = transformed(transformed(waves, FftDirection::Inverse), FftDirection::Inverse);
    let mut found = Grid::filled(rows, columns, 0.0);
    let scale = 1.0 / (rows * columns) as f32;
    found.values_mut().iter_mut().zip(waves.values()).for_each(|(value, wave)| *value = scale * wave.re);
    found
}

/// A window that fades towards both ends (Hann 1902).
fn faded(size: usize) -> Vec<f32> {
    let turn = std::f32::consts::TAU / size as f32;
    (0..size).map(|place| 0.5 - 0.5 * (turn * (place as f32 + 0.5)).cos()).collect()
}

/// The rows transformed, and then rows and columns exchanged.
fn transformed(mut waves: Grid<Complex32>, direction: FftDirection) -> Grid<Complex32> {
    let (rows, columns) = (waves.rows(), waves.columns());
    FftPlanner::new().plan_fft(columns, direction).process(waves.values_mut());
    let mut turned = Grid::filled(columns, rows, Complex32::default());
    for y in 0..rows {
        for x in 0..columns {
            turned.row_mut(x)[y] = waves.at(x, y);
        }
    }
    turned
}

/// The median of the amplitudes around each cell.
fn usual_amplitudes(waves: &Grid<Complex32>) -> Grid<f32> {
    let (rows, columns) = (waves.rows() as isize, waves.columns() as isize);
    let around = |cell: usize| {
        let middle = (CELL * cell + CELL / 2) as isize;
        (middle - BESIDE..=middle + BESIDE).step_by(2)
    };
    let mut usual = Grid::filled(waves.rows().div_ceil(CELL), waves.columns().div_ceil(CELL), 0.0);
    for row in 0..usual.rows() {
        for (column, usual) in usual.row_mut(row).iter_mut().enumerate() {
            let places = around(row).flat_map(|y| around(column).map(move |x| (x, y)));
            let amplitude = |(x, y): (isize, isize)| {
                waves.at(x.rem_euclid(columns) as usize, y.rem_euclid(rows) as usize).norm()
            };
            *usual = upper_median(&mut places.map(amplitude).collect::<Vec<_>>()).unwrap_or(0.0);
        }
    }
    usual
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::block::Block;

    const ROWS: usize = 170;
    const COLUMNS: usize = 250;
    /// Not a whole number of pixels, nor of waves in a picture.
    const PERIOD_PX: f32 = 7.3;

    /// White noise of 5 DN.
    fn noise() -> Grid<f32> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let values = (0..ROWS * COLUMNS).map(|_| {
            let unit: f32 = StandardNormal.sample(&mut random);
            5.0 * unit
        });
        Grid::from_values(ROWS, COLUMNS, values.collect()).unwrap()
    }

    /// Noise with a lattice of 25 DN, whose period changes by 2 % over the picture, as that of an inclined surface.
    fn lattice() -> Grid<f32> {
        let mut picture = noise();
        let k = std::f32::consts::TAU / PERIOD_PX;
        for y in 0..ROWS {
            for (x, value) in picture.row_mut(y).iter_mut().enumerate() {
                let (x, y) = (x as f32, y as f32);
                *value += 100.0 + 25.0 * ((k * x * (1.0 + 4e-5 * x)).cos() + (k * (y + 0.01 * x)).cos());
            }
        }
        picture
    }

    /// The correlation of squares of two pictures that are `x` px apart: the mean over the middle.
    fn correlation(one: &Grid<f32>, other: &Grid<f32>, x: isize) -> f32 {
        let places = (40..ROWS - 52)
            .step_by(12)
            .flat_map(|top| (50..COLUMNS - 62).step_by(12).map(move |left| (top, left)));
        let correlations: Vec<f32> = places
            .filter_map(|(top, left)| Block::of(one, top, left, 12)?.correlation(other, x, 0))
            .collect();
        correlations.iter().sum::<f32>() / correlations.len() as f32
    }

    #[test]
    fn a_lattice_is_taken_off_and_noise_stays() {
        let (noise, lattice) = (noise(), lattice());
        let found = unrepeated(&lattice);
        // 22 px are three periods.
        assert!(correlation(&lattice, &lattice, 22) > 0.9);
        assert!(correlation(&found, &found, 22).abs() < 0.05, "{}", correlation(&found, &found, 22));
        assert!(correlation(&found, &noise, 0) > 0.9, "{}", correlation(&found, &noise, 0));
        // 1.5 in 100,000 waves of noise are taken for something else, and squares fade a little towards the borders.
        assert!(correlation(&unrepeated(&noise), &noise, 0) > 0.99);
    }
}
