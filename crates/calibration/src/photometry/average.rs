//! Mean and noise of every pixel over frames, summed up one frame after the other.

use super::PhotometryError;
use epirig_core::frame::{Frame, Samples};
use epirig_core::grid::Grid;

/// Sums of the samples and of their squares. 65 536 frames of 16 bit fit.
pub(super) struct Sums {
    rows: usize,
    columns: usize,
    pub(super) frames: usize,
    samples: Vec<u32>,
    squares: Vec<u64>,
}

/// Checks that there are frames, and that all have the same size and bit depth.
pub(super) fn check_alike(what: &'static str, frames: &[Frame]) -> Result<(), PhotometryError> {
    let first = frames.first().ok_or(PhotometryError::NoFrames { what })?;
    for (index, frame) in frames.iter().enumerate() {
        let (found, expected) = (frame.format(), first.format());
        if found != expected {
            return Err(PhotometryError::Shapes { what, index, found, expected });
        }
    }
    Ok(())
}

impl Sums {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        Self { rows, columns, frames: 0, samples: vec![0; rows * columns], squares: vec![0; rows * columns] }
    }

    /// Sums over frames of the same size; empty for no frames.
    pub(super) fn of<'a>(rows: usize, columns: usize, frames: impl Iterator<Item = &'a Frame>) -> Self {
        let mut sums = Self::new(rows, columns);
        frames.for_each(|frame| sums.add(frame));
        sums
    }

    fn add(&mut self, frame: &Frame) {
        self.frames += 1;
        match frame.samples() {
            Samples::U8(values) => self.add_values(values),
            Samples::U16(values) => self.add_values(values),
        }
    }

    fn add_values<T: Copy + Into<u32>>(&mut self, values: &[T]) {
        for ((sum, square), &value) in self.samples.iter_mut().zip(&mut self.squares).zip(values) {
            let value: u32 = value.into();
            *sum += value;
            *square += u64::from(value) * u64::from(value);
        }
    }

    /// Adds the sums of another.
    pub(super) fn merge(&mut self, other: &Self) {
        self.frames += other.frames;
        self.samples.iter_mut().zip(&other.samples).for_each(|(sum, other)| *sum += other);
        self.squares.iter_mut().zip(&other.squares).for_each(|(sum, other)| *sum += other);
    }

    /// Mean of every pixel, in DN.
    pub(super) fn mean(&self) -> Grid<f32> {
        let mut mean = Grid::filled(self.rows, self.columns, 0.0);
        let share = 1.0 / self.frames.max(1) as f64;
        let sums = mean.values_mut().iter_mut().zip(&self.samples);
        sums.for_each(|(mean, &sum)| *mean = (f64::from(sum) * share) as f32);
        mean
    }

    /// Mean over the pixels of the variance of one frame's samples, in squared DN; pixels listed in `without`
    /// do not count. `None` for a single frame.
    pub(super) fn variance_dn2(&self, without: &[(usize, usize)]) -> Option<f64> {
        if self.frames < 2 {
            return None;
        }
        let frames = self.frames as f64;
        let of_pixel = |index: usize| {
            let sum = f64::from(self.samples[index]);
            (self.squares[index] as f64 - sum * sum / frames) / (frames - 1.0)
        };
        let all: f64 = (0..self.samples.len()).map(of_pixel).sum();
        let left_out: f64 = without.iter().map(|&(x, y)| of_pixel(y * self.columns + x)).sum();
        Some((all - left_out).max(0.0) / (self.samples.len() - without.len()).max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(samples: [u8; 2]) -> Frame {
        Frame::new(1, 2, 8, Samples::U8(samples.to_vec())).unwrap()
    }

    #[test]
    fn means_and_variances_are_those_of_the_samples() {
        let frames = [frame([1, 10]), frame([3, 10]), frame([8, 40])];
        let mut sums = Sums::of(1, 2, frames[..1].iter());
        sums.merge(&Sums::of(1, 2, frames[1..].iter()));
        assert_eq!((sums.frames, sums.mean().values()), (3, &[4.0, 20.0][..]));
        // (9 + 1 + 16) / 2 = 13 and (100 + 100 + 400) / 2 = 300.
        assert_eq!(sums.variance_dn2(&[]), Some(156.5));
        assert_eq!(sums.variance_dn2(&[(1, 0)]), Some(13.0));
        assert_eq!(Sums::of(1, 2, frames[..1].iter()).variance_dn2(&[]), None);
    }

    #[test]
    fn frames_of_two_shapes_are_refused_by_name() {
        let other = Frame::new(2, 1, 8, Samples::U8(vec![0, 0])).unwrap();
        let error = check_alike("flat", &[frame([0, 0]), other]).unwrap_err().to_string();
        assert_eq!(
            error,
            "flat frame 1 is 1 x 2 of 8 bit, but must be 2 x 1 of 8 bit as the others; take all with the same settings"
        );
        assert_eq!(check_alike("dark", &[]), Err(PhotometryError::NoFrames { what: "dark" }));
    }
}
