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

    /// Gives the rows of frame `t` in DN to `take`, the first one first: their number, and their samples.
    ///
    /// # Errors
    /// [`RowsError`] if they cannot be read.
    ///
    /// # Panics
    /// If there is no such frame.
    fn each_row(&self, t: usize, take: &mut dyn FnMut(usize, &[f32])) -> Result<(), RowsError>;

    /// Frame `t` in DN: rows x columns.
    ///
    /// # Errors
    /// As [`each_row`](Self::each_row).
    ///
    /// # Panics
    /// If there is no such frame.
    fn frame(&self, t: usize) -> Result<Grid<f32>, RowsError> {
        let VolumeShape { rows, columns, .. } = self.shape();
        let mut values = Vec::with_capacity(rows * columns);
        self.each_row(t, &mut |_, row| values.extend_from_slice(row))?;
        Ok(Grid::from_values(rows, columns, values).expect("all rows of the frame"))
    }

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

    fn each_row(&self, t: usize, take: &mut dyn FnMut(usize, &[f32])) -> Result<(), RowsError> {
        let mut row = vec![0.0; self.columns()];
        for y in 0..self.rows() {
            self.copy_row(y, t, &mut row);
            take(y, &row);
        }
        Ok(())
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

    fn each_row(&self, t: usize, take: &mut dyn FnMut(usize, &[f32])) -> Result<(), RowsError> {
        (**self).each_row(t, take)
    }
}
