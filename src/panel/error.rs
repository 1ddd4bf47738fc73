//! Why something cannot be shown.

use std::path::PathBuf;

use thiserror::Error;

use crate::capture::CaptureError;
use crate::memory::Bound;
use crate::pipeline::{CompareError, PipelineError};
use crate::profile::{ProfileError, RecordedRigError};
use crate::results::{MaskError, ResultsError};
use crate::rig::RigError;
use epirig_calibration::rectification::RectifyError;
use epirig_core::fault::{Blame, Fault};
use epirig_core::tau::TauError;
use epirig_core::volume::VolumeError;
use epirig_data::storage::ReadError;
use epirig_server::{Refusal, RefusalKind};

/// Errors of the panel.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PanelError {
    /// A sequence, its calibration or its results cannot be used.
    #[error(transparent)]
    Pipeline(PipelineError),
    /// The system gives no threads.
    #[error("the system allows no more threads: {0}; end other programs, or raise the limit (ulimit -u)")]
    Threads(#[source] std::io::Error),
    /// The positions of the frames cannot be.
    #[error(transparent)]
    Positions(#[from] TauError),
    /// A frame is unlike the others.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// A frame cannot be rectified.
    #[error(transparent)]
    Rectify(#[from] RectifyError),
    /// A file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A picture is no mask for the results.
    #[error(transparent)]
    Mask(#[from] MaskError),
    /// Frames cannot be kept for quick access.
    #[error("cannot keep the frames for quick access: {0}; make room on the disk")]
    Keep(#[source] std::io::Error),
    /// Frames are being read.
    #[error("the frames are being read, {done} of {all}; this answer comes when all are there")]
    Reading {
        /// Frames that are there.
        done: usize,
        /// All frames.
        all: usize,
    },
    /// The profile has mistakes.
    #[error(transparent)]
    Profile(#[from] ProfileError),
    /// The rig of a sequence cannot be read.
    #[error(transparent)]
    RecordedRig(#[from] RecordedRigError),
    /// Two scans cannot be compared.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// The plan leads out of the travel.
    #[error(transparent)]
    Plan(#[from] CaptureError),
    /// The plan is not complete, or a device cannot be what the profile says.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A profile cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Save {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// There is not enough memory.
    #[error("{work} needs {:.1} GB of memory, and {:.1} GB {bound}; take fewer or smaller frames", *needed as f64 / 1e9, *available as f64 / 1e9)]
    Memory {
        /// What needs it.
        work: &'static str,
        /// Bytes that are needed.
        needed: u64,
        /// Bytes that can be allocated.
        available: u64,
        /// What limits them.
        bound: Bound,
    },
    /// Something else is being done.
    #[error("{0}")]
    Busy(String),
    /// Something outside of the picture, or that does not exist.
    #[error("{0}")]
    NotThere(String),
    /// A request that makes no sense.
    #[error("{0}")]
    Wrong(String),
}

impl Fault for PanelError {
    fn blame(&self) -> Blame {
        match self {
            Self::Pipeline(error) => error.blame(),
            Self::Read(error) => error.blame(),
            Self::Mask(error) => error.blame(),
            Self::Profile(error) => error.blame(),
            Self::RecordedRig(error) => error.blame(),
            Self::Compare(error) => error.blame(),
            Self::Plan(error) => error.blame(),
            Self::Rig(error) => error.blame(),
            Self::Positions(_) | Self::Volume(_) | Self::Rectify(_) => Blame::Data,
            Self::Threads(_) | Self::Keep(_) | Self::Save { .. } | Self::Memory { .. } => Blame::System,
            Self::Reading { .. } | Self::Busy(_) | Self::NotThere(_) | Self::Wrong(_) => Blame::Request,
        }
    }
}

impl<E: Into<PipelineError>> From<E> for PanelError {
    fn from(error: E) -> Self {
        Self::Pipeline(error.into())
    }
}

impl From<PanelError> for Refusal {
    fn from(error: PanelError) -> Self {
        let kind = match &error {
            PanelError::Read(gone)
            | PanelError::Pipeline(PipelineError::Results(ResultsError::Read(gone)))
                if gone.is_missing() =>
            {
                RefusalKind::NotFound
            }
            PanelError::Reading { .. } | PanelError::Busy(_) => RefusalKind::Busy,
            PanelError::NotThere(_) => RefusalKind::NotFound,
            PanelError::Wrong(_)
            | PanelError::Profile(_)
            | PanelError::Rig(_)
            | PanelError::Plan(_)
            | PanelError::Compare(_)
            | PanelError::Mask(_)
            | PanelError::Pipeline(PipelineError::Surface(_)) => RefusalKind::Wrong,
            _ => RefusalKind::Failed,
        };
        Self::new(kind, error.to_string())
    }
}
