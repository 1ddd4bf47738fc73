//! The cubic B-spline: four neighbours, error of fourth order.

use rayon::prelude::*;

use super::Real;
use crate::grid::Grid;

/// Number of coefficients that a sample is made of, along each axis: those at offsets -1, 0, 1 and 2.
pub const TAPS: usize = 4;
/// Pole of the filter from samples to coefficients: sqrt 3 - 2.
pub const POLE: f64 = -0.267_949_192_431_122_8;
/// Factor of the filter, which makes its answer to a constant that constant.
const GAIN: f64 = 6.0;
/// Terms of the filter's first value in double precision: |pole|^28 is below the resolution of f32.
const HORIZON: usize = 28;
/// Terms of the filter's first value in single precision: |pole|^16 is below the resolution of the sum.
pub const SINGLE_HORIZON: usize = 16;

/// Weights of the coefficients at offsets -1, 0, 1 and 2 for the value at `fraction` in [0, 1) beyond offset
/// 0.
///
/// ```
/// use epirig_core::spline::cubic::weights;
///
/// assert_eq!(weights(0.0_f64), [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0]);
/// ```
#[inline]
pub fn weights<T: Real>(fraction: T) -> [T; TAPS] {
    let [three, four, six] = [3, 4, 6].map(T::from);
    let (f, g) = (fraction, T::from(1) - fraction);
    [
        g * g * g / six,
        (four + f * f * (three * f - six)) / six,
        (four + g * g * (three * g - six)) / six,
        f * f * f / six,
    ]
}

/// Weights of the same coefficients for the first derivative there, per px.
#[inline]
pub fn gradient_weights<T: Real>(fraction: T) -> [T; TAPS] {
    let [one, two, three, four] = [1, 2, 3, 4].map(T::from);
    let half = one / two;
    let (f, g) = (fraction, one - fraction);
    [-half * g * g, half * f * (three * f - four), half * g * (four - three * g), half * f * f]
}

/// Value at `distance` px from a single pixel of value 1 of the filter from samples to coefficients, for this
/// pole (Unser 1999, equation 11).
pub fn impulse_response(pole: f64, distance: i32) -> f64 {
    -GAIN * pole / (1.0 - pole * pole) * pole.powi(distance.abs())
}

/// Replaces the samples of a row by the coefficients of the spline through them, mirrored at the borders
/// (Unser 1999, box 2). The filter runs in double precision; at least two samples.
pub fn filter_row(row: &mut [f32]) {
    let count = row.len();
    let mut power = 1.0;
    let mut sum = 0.0;
    for &value in &row[..count.min(HORIZON)] {
        sum += power * f64::from(value);
        power *= POLE;
    }
    let mut previous = sum;
    row[0] = (GAIN * previous) as f32;
    for value in &mut row[1..] {
        previous = f64::from(*value) + POLE * previous;
        *value = (GAIN * previous) as f32;
    }
    let last = f64::from(row[count - 1]);
    let before = f64::from(row[count - 2]);
    let mut next = POLE / (POLE * POLE - 1.0) * (last + POLE * before);
    row[count - 1] = next as f32;
    for value in row[..count - 1].iter_mut().rev() {
        next = POLE * (next - f64::from(*value));
        *value = next as f32;
    }
}

/// Replaces the samples of an image by the coefficients of the spline through them, mirrored at the borders.
///
/// The same filter as [`filter_row`] along rows and columns, in single precision: rounding to 1e-7 of the
/// samples is less than the noise of an image, and columns are filtered a row at a time. The two round
/// differently, so they do not share their loops.
pub fn filter_image(image: &mut Grid<f32>) {
    let columns = image.columns();
    image.values_mut().par_chunks_mut(columns).for_each(filter_row_single);
    filter_columns_single(image.values_mut(), columns);
}

const SINGLE_POLE: f32 = POLE as f32;
const SINGLE_GAIN: f32 = GAIN as f32;

fn filter_row_single(row: &mut [f32]) {
    let mut sum = 0.0;
    for &value in row.iter().take(SINGLE_HORIZON).rev() {
        sum = value + SINGLE_POLE * sum;
    }
    row[0] = sum;
    let mut previous = sum;
    for value in &mut row[1..] {
        previous = *value + SINGLE_POLE * previous;
        *value = previous;
    }
    let last = row.len() - 1;
    let before = row[last.saturating_sub(1)];
    previous = SINGLE_POLE / (SINGLE_POLE * SINGLE_POLE - 1.0) * (row[last] + SINGLE_POLE * before);
    row[last] = SINGLE_GAIN * previous;
    for value in row[..last].iter_mut().rev() {
        previous = SINGLE_POLE * (previous - *value);
        *value = SINGLE_GAIN * previous;
    }
}

/// The same down the columns, a row at a time.
fn filter_columns_single(values: &mut [f32], columns: usize) {
    let rows = values.len() / columns;
    let mut sum = vec![0.0; columns];
    for row in values.chunks_exact(columns).take(SINGLE_HORIZON).rev() {
        sum.iter_mut().zip(row).for_each(|(sum, value)| *sum = value + SINGLE_POLE * *sum);
    }
    values[..columns].copy_from_slice(&sum);
    for y in 1..rows {
        let (above, here) = values[(y - 1) * columns..(y + 1) * columns].split_at_mut(columns);
        here.iter_mut().zip(above).for_each(|(value, above)| *value += SINGLE_POLE * *above);
    }
    let last = rows - 1;
    let before = last.saturating_sub(1);
    for x in 0..columns {
        let end = values[last * columns + x] + SINGLE_POLE * values[before * columns + x];
        values[last * columns + x] = SINGLE_POLE / (SINGLE_POLE * SINGLE_POLE - 1.0) * end;
    }
    for y in (0..last).rev() {
        let (here, below) = values[y * columns..(y + 2) * columns].split_at_mut(columns);
        here.iter_mut().zip(below).for_each(|(value, below)| *value = SINGLE_POLE * (*below - *value));
    }
    values.iter_mut().for_each(|value| *value *= SINGLE_GAIN);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pole_is_the_root_of_the_samples_of_the_b_spline() {
        // (1, 4, 1) / 6 as a polynomial.
        assert_eq!(POLE, 3.0_f64.sqrt() - 2.0);
        assert!((POLE * (POLE + 4.0) + 1.0).abs() < 1e-15);
    }

    #[test]
    fn weights_sum_to_one_and_their_derivatives_are_those_of_the_value() {
        for step in 1..32 {
            let fraction = f64::from(step) / 32.0;
            assert!((weights(fraction).iter().sum::<f64>() - 1.0).abs() < 1e-15);
            let h = 1e-5;
            let (ahead, behind) = (weights(fraction + h), weights(fraction - h));
            for (tap, gradient) in gradient_weights(fraction).into_iter().enumerate() {
                assert!((gradient - (ahead[tap] - behind[tap]) / (2.0 * h)).abs() < 1e-9, "{fraction} {tap}");
            }
        }
    }

    #[test]
    fn both_filters_give_coefficients_whose_spline_goes_through_the_samples() {
        let samples: Vec<f32> = (0..60).map(|x| (x * 7919 % 251) as f32).collect();
        let mut row = samples.clone();
        filter_row(&mut row);
        // An image of equal rows has the coefficients of its row.
        let repeated = samples.iter().copied().cycle().take(60 * 40).collect();
        let mut image = Grid::from_values(40, 60, repeated).unwrap();
        filter_image(&mut image);
        for coefficients in [&row[..], image.row(20)] {
            for x in 1..58 {
                let value: f32 =
                    weights(0.0_f32).iter().zip(&coefficients[x - 1..]).map(|(w, c)| w * c).sum();
                assert!((value - samples[x]).abs() < 1e-3, "{x}: {value}");
            }
        }
    }

    #[test]
    fn the_impulse_response_is_what_the_filter_makes_of_a_single_pixel() {
        let mut row = vec![0.0; 61];
        row[30] = 1.0;
        filter_row(&mut row);
        for distance in -8..=8 {
            let found = f64::from(row[(30 + distance) as usize]);
            assert!((found - impulse_response(POLE, distance)).abs() < 1e-6, "{distance}: {found}");
        }
    }
}
