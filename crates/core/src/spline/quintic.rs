//! The quintic B-spline: six neighbours, error of sixth order.

/// Number of coefficients that a sample is made of, along each axis: those at offsets -2 to 3.
pub const TAPS: usize = 6;
/// Neighbours before the sample's whole pixel.
pub const TAPS_BEFORE: usize = 2;
/// Poles of the filter from samples to coefficients: roots of z^4 + 26 z^3 + 66 z^2 + 26 z + 1 within the
/// unit circle.
pub const POLES: [f32; 2] = [-0.430_575_35, -0.043_096_29];

/// Weights of the coefficients at offsets -2 to 3 for the value at `fraction` in [0, 1] beyond offset 0.
///
/// In single precision, as fast as vectors allow: for fractions that differ from sample to sample. Tables are
/// made of [`basis`].
#[inline(always)]
pub fn weights(fraction: f32) -> [f32; TAPS] {
    let side = |t: f32| {
        let t2 = t * t;
        let t4 = t2 * t2;
        [
            t4 * t,
            1.0 + 5.0 * (t + 2.0 * t2 + 2.0 * t2 * t + t4 - t4 * t),
            26.0 + 50.0 * t + 20.0 * (t2 - t2 * t - t4) + 10.0 * t4 * t,
        ]
    };
    let ([a, b, c], [d, e, f]) = (side(1.0 - fraction), side(fraction));
    [a, b, c, f, e, d].map(|weight| weight * (1.0 / 120.0))
}

/// The quintic B-spline, or its derivative of `order` 1 or 2 (with respect to the place where it is
/// evaluated, hence the sign), at `offset` = neighbour - place, in px (Unser 1999, equation 4).
///
/// # Panics
/// If `order` is above 2.
pub fn basis(offset: f64, order: usize) -> f64 {
    let factors = [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0];
    let binomials = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
    let x = -offset;
    let term = |(k, binomial): (usize, &f64)| binomial * (x + 3.0 - k as f64).max(0.0).powi(5 - order as i32);
    factors[order] * binomials.iter().enumerate().map(term).sum::<f64>()
}

/// Frequency response of the B-spline's samples (1, 26, 66, 26, 1) / 120 at `omega` rad per px. The filter
/// from samples to coefficients has its inverse.
pub fn samples_response(omega: f64) -> f64 {
    (66.0 + 52.0 * omega.cos() + 2.0 * (2.0 * omega).cos()) / 120.0
}

/// Impulse response of the filter from samples to coefficients, from the middle outwards, for a filter
/// without recursion: `N` values, of which each is -0.43 times the one before.
pub fn impulse_response<const N: usize>() -> [f64; N] {
    let steps = 256;
    std::array::from_fn(|n| {
        let term = |k: usize| {
            let omega = std::f64::consts::TAU * k as f64 / steps as f64;
            (omega * n as f64).cos() / samples_response(omega)
        };
        (0..steps).map(term).sum::<f64>() / steps as f64
    })
}

/// The value of a constant 1 after the recursive filter y(n) = x(n) + pole y(n - 1), forth and back for each
/// pole along one axis. The filter without its factor (1 - pole)^2 is multiplied by one over this.
pub fn recursion_gain() -> f64 {
    POLES.iter().map(|&pole| (1.0 - f64::from(pole)).powi(-2)).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_truncated_powers() {
        for step in 0..=32 {
            let fraction = step as f32 / 32.0;
            for (offset, weight) in (-2..).zip(weights(fraction)) {
                let expected = basis(f64::from(offset) - f64::from(fraction), 0);
                assert!((f64::from(weight) - expected).abs() < 1e-7, "{fraction} {offset}: {weight}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_value() {
        let h = 1e-5;
        for step in -30..30 {
            let offset = 0.1 * f64::from(step) + 0.03;
            for order in 0..2 {
                // The place moves against the offset.
                let difference = (basis(offset - h, order) - basis(offset + h, order)) / (2.0 * h);
                assert!((basis(offset, order + 1) - difference).abs() < 1e-8, "{offset} {order}");
            }
        }
    }

    #[test]
    fn poles_are_the_roots_of_the_samples_of_the_b_spline() {
        for pole in POLES.map(f64::from) {
            // The slope of the polynomial there is -50 at most, an f32 is exact to 3e-8 of the pole.
            let value = 1.0 + pole * (26.0 + pole * (66.0 + pole * (26.0 + pole)));
            assert!(value.abs() < 1e-6, "{pole}: {value}");
        }
        // The sum of the coefficients of the polynomial, 120, is reached at z = 1.
        let product: f64 = POLES.iter().map(|&pole| -f64::from(pole)).product();
        assert!((1.0 / (recursion_gain() * product) - 120.0).abs() < 1e-4);
    }

    #[test]
    fn the_impulse_response_decays_by_the_larger_pole() {
        let response = impulse_response::<15>();
        // Its sum over both sides is the answer to a constant, which is the constant.
        let sum: f64 = response[0] + 2.0 * response[1..].iter().sum::<f64>();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        let ratio = response[14] / response[13];
        assert!((ratio - f64::from(POLES[0])).abs() < 1e-6, "{ratio}");
    }
}
