//! Where frames are: in memory, or wherever their rows are read from when they are needed.

use std::fmt::Debug;
use std::sync::Arc;

use thiserror::Error;

use crate::fault::{Blame, Fault};
use crate::grid::Grid;
use crate::progress::{Cancelled, Progress};
use crate::tau::Tau;
use crate::volume::{Volume, VolumeShape};

/// Why rows are not had.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RowsError {
    /// They cannot be read.
    #[error("{message}")]
    Unread {
        /// What happened, where, and what to do.
        message: String,
        /// Who must act.
        blame: Blame,
    },
    /// The caller has cancelled the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Fault for RowsError {
    fn blame(&self) -> Blame {
        match self {
            Self::Unread { blame, .. } => *blame,
            Self::Cancelled(cancelled) => cancelled.blame(),
        }
    }
}

/// Frames of which rows are read.
pub trait RowSource: Debug + Send + Sync {
    /// Number, size and positions of the frames.
    fn shape(&self) -> VolumeShape;

    /// These rows of these frames, in their order, as a volume of its own whose frames lie at `tau`. `progress` tells
    /// whether that is still wanted; it counts nothing.
    ///
    /// # Errors
    /// [`RowsError`] if they cannot be read, or it was cancelled.
    ///
    /// # Panics
    /// If a row or a frame lies outside of them, or `tau` has another number of frames.
    fn rows(
        &self,
        rows: &[usize],
        frames: &[usize],
        tau: Tau,
        progress: &dyn Progress,
    ) -> Result<Volume, RowsError>;

    /// Frame `t` in DN: rows x columns.
    ///
    /// # Errors
    /// [`RowsError`] if it cannot be read.
    ///
    /// # Panics
    /// If there is no such frame.
    fn frame(&self, t: usize) -> Result<Grid<f32>, RowsError>;

    /// These rows of all frames.
    ///
    /// # Errors
    /// As [`rows`](Self::rows).
    ///
    /// # Panics
    /// If a row lies outside of the frames.
    fn rows_of_all(&self, rows: &[usize], progress: &dyn Progress) -> Result<Volume, RowsError> {
        let tau = self.shape().tau;
        let frames: Vec<usize> = (0..tau.frames()).collect();
        self.rows(rows, &frames, tau, progress)
    }
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
    ) -> Result<Volume, RowsError> {
        Ok(self.selected(rows, frames, tau))
    }

    fn frame(&self, t: usize) -> Result<Grid<f32>, RowsError> {
        let mut frame = Grid::filled(self.rows(), self.columns(), 0.0);
        (0..self.rows()).for_each(|y| self.copy_row(y, t, frame.row_mut(y)));
        Ok(frame)
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
    ) -> Result<Volume, RowsError> {
        (**self).rows(rows, frames, tau, progress)
    }

    fn frame(&self, t: usize) -> Result<Grid<f32>, RowsError> {
        (**self).frame(t)
    }
}
