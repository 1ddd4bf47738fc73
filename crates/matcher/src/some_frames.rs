//! Some of the frames that are somewhere.

use epirig_core::progress::Progress;
use epirig_core::rows::{RowSource, RowsError};
use epirig_core::tau::Tau;
use epirig_core::volume::{Volume, VolumeShape};

/// Some of the frames of a source, which lie at positions of their own.
#[derive(Debug)]
pub(super) struct SomeFrames<S> {
    pub(super) of: S,
    pub(super) frames: Vec<usize>,
    pub(super) tau: Tau,
}

impl<S: RowSource> RowSource for SomeFrames<S> {
    fn shape(&self) -> VolumeShape {
        let all = self.of.shape();
        let frame_gains = self.frames.iter().map(|&t| all.frame_gains[t]).collect();
        VolumeShape { tau: self.tau.clone(), frame_gains, ..all }
    }

    fn rows(
        &self,
        rows: &[usize],
        frames: &[usize],
        tau: Tau,
        progress: &dyn Progress,
    ) -> Result<Volume, RowsError> {
        let frames: Vec<usize> = frames.iter().map(|&t| self.frames[t]).collect();
        self.of.rows(rows, &frames, tau, progress)
    }

    fn each_row(&self, t: usize, take: &mut dyn FnMut(usize, &[f32])) -> Result<(), RowsError> {
        self.of.each_row(self.frames[t], take)
    }
}
