//! Averages several frames of one view into one of 16 bit.

use super::{Camera, CameraError, FrameFacts, Moment};
use epirig_core::frame::{Frame, Samples, full_scale};
use epirig_core::grid::Grid;

const BITS: u8 = 16;

/// The mean of several frames.
#[derive(Debug, Clone)]
pub struct AveragedFrame {
    /// The mean, scaled so that the camera's full scale becomes that of 16 bit: times 257 for 8 bit. Rounding
    /// costs at most half a DN of 16 bit.
    pub frame: Frame,
    /// Variance of a single frame's samples about the mean (unbiased, divisor K - 1), rows x columns, in
    /// squared DN of the camera; NaN for a single frame. The variance of the mean is 1 / K of it.
    pub variance_dn2: Grid<f32>,
    /// Number of pixels that were at full scale in any of the frames: their mean is too small.
    pub saturated: usize,
    /// How each frame was taken.
    pub facts: Vec<FrameFacts>,
}

/// Takes `count` frames (at least 1) that began after `moment`, and averages them. `go_on` is asked before
/// each further frame.
///
/// # Errors
/// [`CameraError`] if a frame fails, [`CameraError::Interrupted`] if `go_on` returns `false`.
pub fn average(
    camera: &mut dyn Camera,
    moment: Moment,
    count: usize,
    go_on: &dyn Fn() -> bool,
) -> Result<AveragedFrame, CameraError> {
    let first = camera.grab_after(moment)?;
    let mut sums = Sums::new(&first.frame);
    let mut facts = vec![first.facts];
    for _ in 1..count {
        if !go_on() {
            return Err(CameraError::Interrupted(camera.identity().name()));
        }
        let next = camera.grab_after(moment)?;
        if !sums.add(&next.frame) {
            let asked = format!("{} x {} of {} bit", sums.columns, sums.rows, sums.bit_depth);
            let camera = camera.identity().name();
            return Err(CameraError::substituted(&camera, asked, "frames of another shape"));
        }
        facts.push(next.facts);
    }
    sums.finish(facts)
}

/// For each pixel: sum of samples, sum of their squares, and whether a sample was at full scale.
struct Sums {
    rows: usize,
    columns: usize,
    bit_depth: u8,
    frames: u64,
    /// 2^48 frames of 16 bit fit, and 2^32 of their squares.
    sum: Vec<u64>,
    squares: Vec<u64>,
    saturated: Vec<bool>,
}

impl Sums {
    fn new(frame: &Frame) -> Self {
        let count = frame.rows() * frame.columns();
        let mut sums = Self {
            rows: frame.rows(),
            columns: frame.columns(),
            bit_depth: frame.bit_depth(),
            frames: 0,
            sum: vec![0; count],
            squares: vec![0; count],
            saturated: vec![false; count],
        };
        sums.add(frame);
        sums
    }

    /// Adds a frame. Returns `false` if its size differs.
    fn add(&mut self, frame: &Frame) -> bool {
        if (frame.rows(), frame.columns(), frame.bit_depth()) != (self.rows, self.columns, self.bit_depth) {
            return false;
        }
        match frame.samples() {
            Samples::U8(samples) => self.add_samples(samples),
            Samples::U16(samples) => self.add_samples(samples),
        }
        self.frames += 1;
        true
    }

    fn add_samples<T: Copy + Into<u64>>(&mut self, samples: &[T]) {
        let full = u64::from(full_scale(self.bit_depth));
        let sums = self.sum.iter_mut().zip(&mut self.squares).zip(&mut self.saturated);
        for (((sum, square), saturated), &sample) in sums.zip(samples) {
            let sample: u64 = sample.into();
            *sum += sample;
            *square += sample * sample;
            *saturated |= sample >= full;
        }
    }

    fn finish(self, facts: Vec<FrameFacts>) -> Result<AveragedFrame, CameraError> {
        let frames = self.frames as f64;
        let scale = f64::from(full_scale(BITS)) / f64::from(full_scale(self.bit_depth)) / frames;
        let mean = self.sum.iter().map(|&sum| (sum as f64 * scale).round() as u16);
        let frame = Frame::new(self.rows, self.columns, BITS, Samples::U16(mean.collect()))?;
        let mut variance_dn2 = Grid::filled(self.rows, self.columns, f32::NAN);
        if self.frames > 1 {
            let pixels = self.sum.iter().zip(&self.squares);
            for (variance, (&sum, &squares)) in variance_dn2.values_mut().iter_mut().zip(pixels) {
                // K times the sum of squared deviations, exact in integers.
                let deviations =
                    u128::from(squares) * u128::from(self.frames) - u128::from(sum) * u128::from(sum);
                *variance = (deviations as f64 / (frames * (frames - 1.0))) as f32;
            }
        }
        Ok(AveragedFrame {
            frame,
            variance_dn2,
            saturated: self.saturated.iter().filter(|saturated| **saturated).count(),
            facts,
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frame(bit_depth: u8, samples: &[u16]) -> Frame {
        let samples = if bit_depth <= 8 {
            Samples::U8(samples.iter().map(|&sample| sample as u8).collect())
        } else {
            Samples::U16(samples.to_vec())
        };
        let columns = samples.len();
        Frame::new(1, columns, bit_depth, samples).unwrap()
    }

    fn averaged(bit_depth: u8, frames: &[&[u16]]) -> AveragedFrame {
        let mut sums = Sums::new(&frame(bit_depth, frames[0]));
        frames[1..].iter().for_each(|samples| assert!(sums.add(&frame(bit_depth, samples))));
        sums.finish(Vec::new()).unwrap()
    }

    #[test]
    fn full_scale_stays_full_scale_and_quarters_of_a_level_are_kept() {
        let mean = averaged(8, &[&[0, 255, 10], &[0, 255, 11], &[0, 255, 10], &[0, 254, 10]]);
        // 257 * 10.25 = 2634.25; 257 * 254.75 = 65470.75.
        assert_eq!(*mean.frame.samples(), Samples::U16(vec![0, 65471, 2634]));
        assert_eq!(mean.saturated, 1);
        assert_eq!(mean.variance_dn2.values(), [0.0, 0.25, 0.25]);
        let single = averaged(12, &[&[4095, 1]]);
        assert_eq!(*single.frame.samples(), Samples::U16(vec![65535, 16]));
        assert!(single.variance_dn2.values().iter().all(|variance| variance.is_nan()));
        assert!(!Sums::new(&frame(8, &[1])).add(&frame(12, &[1])));
    }

    proptest! {
        #[test]
        fn mean_and_variance_are_those_of_the_definition(
            samples in prop::collection::vec(prop::collection::vec(0_u16..=65535, 3), 2..12),
        ) {
            let views: Vec<&[u16]> = samples.iter().map(Vec::as_slice).collect();
            let found = averaged(16, &views);
            for x in 0..3 {
                let values: Vec<f64> = samples.iter().map(|frame| f64::from(frame[x])).collect();
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                let variance =
                    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
                let Samples::U16(means) = found.frame.samples() else { panic!() };
                prop_assert!((f64::from(means[x]) - mean).abs() <= 0.5 + 1e-9);
                let got = f64::from(found.variance_dn2.values()[x]);
                // 24 bits of mantissa.
                prop_assert!((got - variance).abs() <= 1e-6 * variance.max(1.0), "{got} {variance}");
            }
        }
    }
}
