//! Interpolation of images by the cubic B-spline (Unser 1999).

use epirig_core::grid::Grid;
use epirig_core::spline::cubic::{self, SINGLE_HORIZON, TAPS};

/// Weights of the coefficients at offsets -1, 0, 1 and 2 for a sample at `fraction` in [0, 1) beyond offset
/// 0.
pub(super) fn weights(fraction: f64) -> [f32; TAPS] {
    cubic::weights(fraction).map(|weight| weight as f32)
}

/// Weights of the same coefficients for the derivative there, per px.
pub(super) fn gradient_weights(fraction: f64) -> [f32; TAPS] {
    cubic::gradient_weights(fraction).map(|weight| weight as f32)
}

/// Variance of a sample at `fraction` made of pixels with independent noise of variance 1: 1 at the pixels,
/// least between them.
pub(super) fn noise_share(fraction: f64) -> f64 {
    // The pole of the filter in single precision.
    let pole = f64::from(cubic::POLE as f32);
    let response = |distance: i32| cubic::impulse_response(pole, distance);
    let weights = cubic::weights(fraction);
    let reach = SINGLE_HORIZON as i32;
    let of_pixel = |pixel: i32| -> f64 {
        weights.iter().zip(-1..).map(|(weight, offset)| weight * response(pixel - offset)).sum()
    };
    (-reach..=reach).map(|pixel| of_pixel(pixel).powi(2)).sum()
}

/// Combines rows `row - 1` to `row + 2` of `coefficients`, from column `start` on, into `out`.
pub(super) fn combine_rows(
    coefficients: &Grid<f32>,
    row: usize,
    start: usize,
    weights: [f32; TAPS],
    out: &mut [f32],
) {
    let rows = [0, 1, 2, 3].map(|offset| &coefficients.row(row - 1 + offset)[start..start + out.len()]);
    combine(rows, weights, out);
}

/// Combines each four neighbours of `line`, which is longer than `out` by three.
pub(super) fn combine_along(line: &[f32], weights: [f32; TAPS], out: &mut [f32]) {
    combine([0, 1, 2, 3].map(|offset| &line[offset..offset + out.len()]), weights, out);
}

fn combine([a, b, c, d]: [&[f32]; TAPS], [wa, wb, wc, wd]: [f32; TAPS], out: &mut [f32]) {
    let taps = a.iter().zip(b).zip(c).zip(d);
    out.iter_mut().zip(taps).for_each(|(out, (((a, b), c), d))| *out = wa * a + wb * b + wc * c + wd * d);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(rows: usize, columns: usize) -> Grid<f32> {
        let mut image = Grid::filled(rows, columns, 0.0);
        for (index, value) in image.values_mut().iter_mut().enumerate() {
            *value = wave((index % columns) as f64, (index / columns) as f64) as f32;
        }
        image
    }

    fn wave(x: f64, y: f64) -> f64 {
        (0.7 * x + 0.3 * y).sin() + (0.4 * y - 0.2 * x).cos()
    }

    fn sample(coefficients: &Grid<f32>, x: f64, y: f64, by_x: bool) -> f64 {
        let mut line = [0.0; TAPS];
        let start = x.floor() as usize - 1;
        combine_rows(coefficients, y.floor() as usize, start, weights(y.fract()), &mut line);
        let mut out = [0.0];
        let across = if by_x { gradient_weights(x.fract()) } else { weights(x.fract()) };
        combine_along(&line, across, &mut out);
        out[0].into()
    }

    #[test]
    fn the_spline_goes_through_all_pixels() {
        let image = waves(20, 30);
        let mut coefficients = image.clone();
        cubic::filter_image(&mut coefficients);
        for y in 1..18 {
            for x in 1..28 {
                let found = sample(&coefficients, x as f64, y as f64, false);
                assert!((found - f64::from(image.at(x, y))).abs() < 1e-5, "({x}, {y})");
            }
        }
    }

    #[test]
    fn waves_and_their_gradients_are_found_between_the_pixels() {
        let mut coefficients = waves(40, 40);
        cubic::filter_image(&mut coefficients);
        // Error of a cubic spline: (w / 2 pi)^4 * 2 pi^4 / 45 of a wave of w rad per px, 0.7 at most, and ten
        // times that of its gradient.
        let bound = 2.0 * (0.7_f64 / std::f64::consts::TAU).powi(4) * 4.4;
        for (x, y) in [(12.3, 15.8), (20.5, 20.5), (25.9, 11.1)] {
            assert!((sample(&coefficients, x, y, false) - wave(x, y)).abs() < bound, "({x}, {y})");
            let gradient = 0.7 * (0.7 * x + 0.3 * y).cos() + 0.2 * (0.4 * y - 0.2 * x).sin();
            assert!((sample(&coefficients, x, y, true) - gradient).abs() < 10.0 * bound, "({x}, {y})");
        }
    }

    #[test]
    fn noise_is_weakened_between_the_pixels_as_the_weights_say() {
        // The pole is known to f32.
        assert!((noise_share(0.0) - 1.0).abs() < 1e-6);
        assert!((noise_share(0.3) - noise_share(0.7)).abs() < 1e-9);
        // The same from single bright pixels: the squared samples of the splines through each of them.
        let of_pixel = |pixel: usize| {
            // All rows are alike, so that columns change nothing.
            let mut image = Grid::filled(41, 41, 0.0);
            (0..41).for_each(|y| image.row_mut(y)[pixel] = 1.0);
            cubic::filter_image(&mut image);
            let mut out = [0.0];
            combine_along(&image.row(20)[19..23], weights(0.5), &mut out);
            f64::from(out[0]).powi(2)
        };
        let sum: f64 = (0..41).map(of_pixel).sum();
        assert!((noise_share(0.5) - sum).abs() < 1e-6, "{} {sum}", noise_share(0.5));
    }
}
