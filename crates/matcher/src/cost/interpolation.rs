//! Sampling an EPI between its pixels.
//!
//! Within an EPI the shift of frame t under a disparity is the same for all x, so a shifted row is the row
//! convolved with four constant weights: no gathers, no table per pixel.

use epirig_core::spline::cubic;
use epirig_core::volume::Volume;

epirig_core::choices! {
    /// The interpolation of intensities between pixel centres.
    ///
    /// Worst bias of a disparity over 100 frames by interpolation alone, for texture blurred by 0.7 px:
    /// linear 0.044 px, cubic 0.005 px, B-spline 0.0016 px (measured on simulated EPIs).
    pub enum Interpolation {
        /// Straight line between the two neighbours.
        Linear = "linear",
        /// Cubic convolution over four neighbours (Keys 1981, a = -1/2).
        Cubic = "cubic",
        /// Cubic B-spline through all pixels of the row (Unser 1999), the most accurate.
        BSpline = "b-spline",
    }
}

/// Number of neighbours that a sample is made of.
pub(crate) const TAPS: usize = cubic::TAPS;

impl Interpolation {
    /// Weights of the neighbours at offsets -1, 0, 1 and 2 for a sample at `fraction` in [0, 1) beyond offset
    /// 0.
    pub(crate) fn weights(self, fraction: f64) -> [f32; TAPS] {
        let f = fraction;
        let weights = match self {
            Self::Linear => [0.0, 1.0 - f, f, 0.0],
            Self::Cubic => [
                f * (-0.5 + f * (1.0 - 0.5 * f)),
                1.0 + f * f * (-2.5 + 1.5 * f),
                f * (0.5 + f * (2.0 - 1.5 * f)),
                f * f * (-0.5 + 0.5 * f),
            ],
            Self::BSpline => cubic::weights(f),
        };
        weights.map(|weight| weight as f32)
    }
}

/// One EPI prepared for sampling: frames x (columns + 2 margin) coefficients, mirrored beyond the borders.
#[derive(Debug, Clone)]
pub(crate) struct SampledEpi {
    columns: usize,
    margin: usize,
    interpolation: Interpolation,
    coefficients: Vec<f32>,
}

impl SampledEpi {
    /// Prepares row `y` of `volume`. Samples up to `reach` px beyond the borders can be asked for; they
    /// mirror the image.
    ///
    /// # Panics
    /// If `y` lies outside the volume.
    pub(crate) fn new(volume: &Volume, y: usize, interpolation: Interpolation, reach: usize) -> Self {
        let columns = volume.columns();
        let margin = (reach + TAPS / 2).min(columns - 1);
        let stride = columns + 2 * margin;
        let mut coefficients = vec![0.0; stride * volume.frames()];
        for (t, row) in coefficients.chunks_exact_mut(stride).enumerate() {
            volume.copy_row(y, t, &mut row[margin..margin + columns]);
            if interpolation == Interpolation::BSpline {
                cubic::filter_row(&mut row[margin..margin + columns]);
            }
            for offset in 1..=margin {
                row[margin - offset] = row[margin + offset];
                row[margin + columns - 1 + offset] = row[margin + columns - 1 - offset];
            }
        }
        Self { columns, margin, interpolation, coefficients }
    }

    /// Intensity of frame `t` at column `position`, in DN; `None` outside the image, and for NaN.
    pub(crate) fn at(&self, t: usize, position: f64) -> Option<f32> {
        (0.0..=(self.columns - 1) as f64).contains(&position).then(|| {
            let whole = position.floor();
            let weights = self.interpolation.weights(position - whole);
            weights.iter().zip(self.taps(t, whole as isize, 1)).map(|(weight, tap)| weight * tap).sum()
        })
    }

    /// The coefficients of frame `t` from offset -1 of pixel `x` on, as many as `count` samples need.
    ///
    /// # Panics
    /// If the range leaves the prepared reach.
    pub(crate) fn taps(&self, t: usize, x: isize, count: usize) -> &[f32] {
        let stride = self.columns + 2 * self.margin;
        let start = (self.margin as isize + x - 1) as usize;
        assert!(start + count + TAPS - 1 <= stride, "the sample lies beyond the prepared reach");
        &self.coefficients[t * stride + start..t * stride + start + count + TAPS - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::frame::{Frame, Samples};
    use epirig_core::tau::Tau;

    fn sampled(values: &[u16], interpolation: Interpolation) -> SampledEpi {
        let mut volume = Volume::new(1, values.len(), 16, Tau::equidistant(2).unwrap());
        let frame = Frame::new(1, values.len(), 16, Samples::U16(values.to_vec())).unwrap();
        volume.insert(0, &frame).unwrap();
        SampledEpi::new(&volume, 0, interpolation, 2)
    }

    fn value(epi: &SampledEpi, interpolation: Interpolation, position: f64) -> f64 {
        let whole = position.floor();
        let weights = interpolation.weights(position - whole);
        let taps = epi.taps(0, whole as isize, 1);
        weights.iter().zip(taps).map(|(w, c)| f64::from(w * c)).sum()
    }

    #[test]
    fn pixels_are_reproduced_by_every_interpolation() {
        let values: Vec<u16> = (0..40).map(|x| (x * 7919 % 251) as u16).collect();
        for interpolation in [Interpolation::Linear, Interpolation::Cubic, Interpolation::BSpline] {
            let epi = sampled(&values, interpolation);
            for (x, &expected) in values.iter().enumerate() {
                let found = value(&epi, interpolation, x as f64);
                assert!((found - f64::from(expected)).abs() < 1e-3, "{interpolation:?} at {x}: {found}");
            }
        }
    }

    #[test]
    fn smooth_functions_are_followed_to_the_order_of_the_interpolation() {
        // A sinusoid of period 16 px: the relative error of linear interpolation is at most (2 pi / 16)^2 /
        // 8 = 1.9 %, of Keys' cubic (error of third order) and of the B-spline (fourth order) much less.
        let amplitude = 10_000.0;
        let wave = |x: f64| amplitude * (1.0 + (x * std::f64::consts::TAU / 16.0).sin());
        let values: Vec<u16> = (0..64).map(|x| wave(f64::from(x)).round() as u16).collect();
        for (interpolation, bound) in [
            (Interpolation::Linear, 0.0193),
            (Interpolation::Cubic, 0.0035),
            (Interpolation::BSpline, 0.0005),
        ] {
            let epi = sampled(&values, interpolation);
            for step in 0..160 {
                let position = 20.0 + f64::from(step) * 0.1;
                let error = (value(&epi, interpolation, position) - wave(position)).abs() / amplitude;
                assert!(error < bound, "{interpolation:?} at {position}: {error}");
            }
        }
    }

    #[test]
    fn the_gradient_is_the_derivative_of_the_value() {
        let values: Vec<u16> = (0..40).map(|x| (x * 7919 % 251) as u16).collect();
        let epi = sampled(&values, Interpolation::BSpline);
        for step in 0..100 {
            let position = 10.05 + f64::from(step) * 0.1;
            let whole = position.floor();
            let weights = cubic::gradient_weights((position - whole) as f32);
            let gradient: f32 = weights.iter().zip(epi.taps(0, whole as isize, 1)).map(|(w, c)| w * c).sum();
            let h = 0.01;
            let difference = (value(&epi, Interpolation::BSpline, position + h)
                - value(&epi, Interpolation::BSpline, position - h))
                / (2.0 * h);
            assert!((f64::from(gradient) - difference).abs() < 0.1, "{gradient} {difference}");
        }
    }
}
