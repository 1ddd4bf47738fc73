//! An EPI with linear interpolation between pixels.

use epirig_core::volume::Volume;

/// An EPI: frames x columns, in DN.
pub(crate) struct LinearEpi {
    columns: usize,
    samples: Vec<f32>,
}

impl LinearEpi {
    /// Row `y` of all frames.
    pub(crate) fn new(volume: &Volume, y: usize) -> Self {
        Self::of_frames(volume, y, 0..volume.frames())
    }

    /// Row `y` of the given frames, which are counted from 0 on.
    pub(crate) fn of_frames(volume: &Volume, y: usize, frames: impl ExactSizeIterator<Item = usize>) -> Self {
        let columns = volume.columns();
        let mut samples = vec![0.0; columns * frames.len()];
        for (t, row) in frames.zip(samples.chunks_exact_mut(columns)) {
            volume.copy_row(y, t, row);
        }
        Self { columns, samples }
    }

    /// Frame `t`'s samples.
    pub(crate) fn frame(&self, t: usize) -> &[f32] {
        &self.samples[t * self.columns..(t + 1) * self.columns]
    }

    /// Intensity of frame `t` at column `place`, in DN; `None` outside the image.
    pub(crate) fn at(&self, t: usize, place: f32) -> Option<f32> {
        let last = (self.columns - 1) as f32;
        if !(0.0..=last).contains(&place) {
            return None;
        }
        let whole = (place as usize).min(self.columns - 2);
        let pair = &self.frame(t)[whole..whole + 2];
        Some(pair[0] + (place - whole as f32) * (pair[1] - pair[0]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::tau::Tau;

    #[test]
    fn samples_lie_on_the_lines_between_pixels() {
        let mut volume = Volume::fine(2, 8, 8, Tau::equidistant(3).unwrap());
        // Row y of frame t: the squares of the columns, plus 10 y and t.
        let counts = volume.fine_counts_mut().unwrap().iter_mut().enumerate();
        counts.for_each(|(index, count)| {
            let (x, t, y) = (index % 8, index / 8 % 3, index / 24);
            *count = 128 * (x * x + 10 * y + t) as u16;
        });
        let epi = LinearEpi::new(&volume, 1);
        assert_eq!(epi.frame(2), [12.0, 13.0, 16.0, 21.0, 28.0, 37.0, 48.0, 61.0]);
        for (place, value) in [(0.0, 11.0), (2.5, 17.5), (6.75, 56.75), (7.0, 60.0)] {
            assert_eq!(epi.at(1, place), Some(value), "{place}");
        }
        for place in [-0.01, 7.01, f32::NAN] {
            assert_eq!(epi.at(0, place), None);
        }
        let some = LinearEpi::of_frames(&volume, 1, [0, 2].into_iter());
        assert_eq!((some.frame(1), some.samples.len()), (epi.frame(2), 16));
    }
}
