//! The kernel of the resampling: the quintic B-spline through all pixels (Unser 1999).
//!
//! Shift of a wave by the resampling, worst of windows of 9 px, and time for a sample beside that of a plain bilinear remap:
//!
//! | | 6.3 px | 4.2 px | 3.1 px | time |
//! | --- | --- | --- | --- | --- |
//! | cubic | 0.0011 px | 0.0062 px | 0.0235 px | 0.6 |
//! | quintic | 0.0001 px | 0.0007 px | 0.0056 px | 0.9 |
//!
//! Measured with roll 0.7 deg, pan 0.4 deg and k1 = -0.02, which take every fraction of a pixel in turn.

/// Number of coefficients that a sample is made of, along each axis.
pub(super) const TAPS: usize = 6;
/// Poles of the filter from samples to coefficients: roots of z^4 + 26 z^3 + 66 z^2 + 26 z + 1 within the unit circle.
pub(super) const POLES: [f32; 2] = [-0.430_575_35, -0.043_096_29];
/// After as many pixels nothing is left of where the filter began: 0.4306^17 = 6e-7, a fiftieth of a count of a fine volume at
/// full scale.
pub(super) const HORIZON: usize = 17;

/// How far inside the raw image rectified pixels stay, in px.
///
/// The filter mirrors the image at its borders, which bends a ramp there. So far inside, the spline is off by 0.0002 of what the
/// ramp rises in a pixel, which is to say by 0.0002 px, and by 0.43 times that a pixel farther in.
pub const BORDER_PX: f64 = 8.0;

/// Weights of the coefficients at offsets -2 to 3 for a sample at `fraction` in [0, 1] beyond offset 0.
#[inline(always)]
pub(super) fn weights(fraction: f32) -> [f32; TAPS] {
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

/// What the filter's answer to a constant is, as it leaves out the factor (1 - z)^2 of each pole: that squared, for both axes.
pub(super) fn filter_gain() -> f32 {
    let along_one_axis: f64 = POLES.iter().map(|&pole| (1.0 - f64::from(pole)).powi(-2)).product();
    (along_one_axis * along_one_axis) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quintic B-spline as a sum of truncated powers (Schoenberg 1946).
    fn truncated_powers(x: f64) -> f64 {
        let binomials = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
        (0..).zip(binomials).map(|(k, sign)| sign * (x + 3.0 - f64::from(k)).max(0.0).powi(5) / 120.0).sum()
    }

    #[test]
    fn weights_are_those_of_the_quintic_b_spline() {
        for step in 0..=32 {
            let fraction = step as f32 / 32.0;
            for (offset, weight) in (-2..).zip(weights(fraction)) {
                let expected = truncated_powers(f64::from(fraction) - f64::from(offset));
                assert!((f64::from(weight) - expected).abs() < 1e-7, "{fraction} {offset}: {weight}");
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
        // The sum of the coefficients of the polynomial, 120, is reached at z = 1, each axis once.
        let product: f64 =
            POLES.iter().map(|&pole| (1.0 - f64::from(pole)).powi(2) / -f64::from(pole)).product();
        assert!((product - 120.0).abs() < 1e-4, "{product}");
    }
}
