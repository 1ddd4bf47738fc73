//! Rectified frames as the search for the motion in the texture looks at them.

use std::sync::OnceLock;

use epirig_calibration::texture_motion::Frames;
use epirig_core::frame::full_scale;
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::rows::{RowSource, RowsError};
use epirig_core::volume::VolumeShape;

/// Rectified frames as frames of 8 bit.
pub(super) struct RectifiedFrames<'a> {
    source: &'a dyn RowSource,
    shape: VolumeShape,
    progress: &'a dyn Progress,
    /// Why a frame could not be read. Then the work ends as if it was cancelled.
    unread: OnceLock<RowsError>,
}

impl<'a> RectifiedFrames<'a> {
    /// The frames of `source`; nobody waits for them any more once `progress` has cancelled the work.
    pub(super) fn of(source: &'a dyn RowSource, progress: &'a dyn Progress) -> Self {
        Self { source, shape: source.shape(), progress, unread: OnceLock::new() }
    }

    /// # Errors
    /// Why a frame could not be read, if one could not. What was found by then means nothing.
    pub(super) fn unless_unread(&self) -> Result<(), RowsError> {
        self.unread.get().map_or(Ok(()), |error| Err(error.clone()))
    }
}

impl Frames for RectifiedFrames<'_> {
    fn count(&self) -> usize {
        self.shape.tau.frames()
    }

    fn size(&self) -> (usize, usize) {
        (self.shape.rows, self.shape.columns)
    }

    fn picture(&self, index: usize, factor: usize) -> Grid<f32> {
        let VolumeShape { rows, columns, bit_depth, .. } = self.shape;
        let (rows, columns) = (rows / factor, columns / factor);
        let share = 255.0 / (f32::from(full_scale(bit_depth)) * (factor * factor) as f32);
        let mut pixels = Vec::with_capacity(rows * columns);
        let mut means = vec![0.0_f32; columns];
        let read = self.source.each_row(index, &mut |y, row| {
            for (mean, values) in means.iter_mut().zip(row.chunks_exact(factor)) {
                *mean += share * values.iter().sum::<f32>();
            }
            if y % factor == factor - 1 {
                pixels.extend_from_slice(&means);
                means.fill(0.0);
            }
        });
        if let Err(error) = read {
            self.unread.get_or_init(|| error);
        }
        pixels.resize(rows * columns, 0.0);
        Grid::from_values(rows, columns, pixels).expect("as many values as pixels")
    }

    fn cancelled(&self) -> bool {
        self.unread.get().is_some() || self.progress.cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_calibration::texture_motion::{MotionOptions, TextureMotionError, texture_motion};
    use epirig_core::fault::Blame;
    use epirig_core::progress::Silent;
    use epirig_core::tau::Tau;
    use epirig_core::volume::Volume;

    /// Frames of a disk that fails at one of them.
    #[derive(Debug)]
    struct Failing;

    impl RowSource for Failing {
        fn shape(&self) -> VolumeShape {
            let tau = Tau::equidistant(5).unwrap();
            VolumeShape { rows: 64, columns: 96, bit_depth: 8, fine: true, frame_gains: vec![1.0; 5], tau }
        }

        fn rows(&self, _: &[usize], _: &[usize], _: Tau, _: &dyn Progress) -> Result<Volume, RowsError> {
            unreachable!("whole frames are looked at")
        }

        fn each_row(&self, t: usize, take: &mut dyn FnMut(usize, &[f32])) -> Result<(), RowsError> {
            (0..32).for_each(|y| take(y, &[100.0; 96]));
            match t {
                3 => Err(RowsError::Unread { message: "frame 3 is damaged".to_owned(), blame: Blame::Data }),
                _ => Ok(()),
            }
        }
    }

    #[test]
    fn a_frame_that_cannot_be_read_ends_the_search() {
        let frames = RectifiedFrames::of(&Failing, &Silent);
        let ended = texture_motion(&frames, &MotionOptions::of_positions(100));
        assert!(matches!(ended, Err(TextureMotionError::Cancelled(_))), "{ended:?}");
        assert_eq!(
            frames.unless_unread().map_err(|error| error.to_string()),
            Err("frame 3 is damaged".to_owned())
        );
    }
}
