//! Where the frames of a match are: in memory, or wherever their rows are read from when they are needed.

use std::fmt::Debug;
use std::sync::Arc;

use super::options::MatchError;
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_core::volume::{Volume, VolumeShape};

/// Frames of which rows are read.
pub trait RowSource: Debug + Send + Sync {
    /// Number, size and positions of the frames.
    fn shape(&self) -> VolumeShape;

    /// These rows of these frames, in their order, as a volume of its own whose frames lie at `tau`. `progress` tells
    /// whether that is still wanted; it counts nothing.
    ///
    /// # Errors
    /// [`MatchError::Unread`] if they cannot be read; [`MatchError::Cancelled`].
    ///
    /// # Panics
    /// If a row or a frame lies outside of them, or `tau` has another number of frames.
    fn rows(
        &self,
        rows: &[usize],
        frames: &[usize],
        tau: Tau,
        progress: &dyn Progress,
    ) -> Result<Volume, MatchError>;
}

impl RowSource for Volume {
    fn shape(&self) -> VolumeShape {
        Self::shape(self)
    }

    fn rows(
        &self,
        rows: &[usize],
        frames: &[usize],
        tau: Tau,
        _progress: &dyn Progress,
    ) -> Result<Volume, MatchError> {
        Ok(self.selected(rows, frames, tau))
    }
}

impl<S: RowSource + ?Sized> RowSource for Arc<S> {
    fn shape(&self) -> VolumeShape {
        (**self).shape()
    }

    fn rows(
        &self,
        rows: &[usize],
        frames: &[usize],
        tau: Tau,
        progress: &dyn Progress,
    ) -> Result<Volume, MatchError> {
        (**self).rows(rows, frames, tau, progress)
    }
}

/// These rows of all frames.
pub(super) fn rows_of_all(
    source: &dyn RowSource,
    rows: impl Iterator<Item = usize>,
    progress: &dyn Progress,
) -> Result<Volume, MatchError> {
    let tau = source.shape().tau;
    let frames: Vec<usize> = (0..tau.frames()).collect();
    source.rows(&rows.collect::<Vec<_>>(), &frames, tau, progress)
}

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
    ) -> Result<Volume, MatchError> {
        let frames: Vec<usize> = frames.iter().map(|&t| self.frames[t]).collect();
        self.of.rows(rows, &frames, tau, progress)
    }
}
