//! What can go wrong with packed volumes and arrays of other software.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::storage::{RecordError, advice};
use epirig_core::fault::{Blame, Fault};
use epirig_core::frame::FrameError;
use epirig_core::progress::Cancelled;
use epirig_core::shell::quoted;
use epirig_core::tau::TauError;
use epirig_core::volume::VolumeError;

/// Why a volume cannot be packed, or an array not be read. Every message names the folder and says what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PackedError {
    /// The caller has cancelled the work. What is packed stays, and the next run goes on with it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The operating system refused.
    #[error("cannot {action} {}: {source}; {}", path.display(), advice(source))]
    Io {
        /// The action that failed.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The operating system's message.
        source: std::io::Error,
    },
    /// Something else is where the volume is to be packed.
    #[error("{} is there already, and no volume of this sequence; move it away, or give another name", .0.display())]
    Taken(PathBuf),
    /// Another program packs the same volume.
    #[error("{} is being packed by another epirig; wait until it has ended", .0.display())]
    Busy(PathBuf),
    /// Its record cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The record contradicts the array or itself.
    #[error("{}: {reason}; remove it, and run `epirig pack` again", folder.display())]
    Contradiction {
        /// The folder.
        folder: PathBuf,
        /// What does not fit.
        reason: String,
    },
    /// A frame cannot be read.
    #[error("frame {frame} of {} is missing or damaged ({reason}); {advice}", folder.display())]
    Frame {
        /// The array.
        folder: PathBuf,
        /// Index of the frame, from 0.
        frame: usize,
        /// What the reader says.
        reason: String,
        /// What to do.
        advice: &'static str,
    },
    /// It is no Zarr array.
    #[error("{} cannot be read as a Zarr array ({reason}); give the folder of an array, or of a group with one array", folder.display())]
    NoArray {
        /// The folder.
        folder: PathBuf,
        /// What the reader says.
        reason: String,
    },
    /// A group of several arrays.
    #[error("{} holds several arrays ({}); give one of them, such as {}", folder.display(), arrays.join(", "), quoted(&folder.join(&arrays[0])))]
    Several {
        /// The folder.
        folder: PathBuf,
        /// Their names.
        arrays: Vec<String>,
    },
    /// An array of another kind than frames.
    #[error("{} has {found}; frames are an array of frames x rows x columns of uint8 or uint16", folder.display())]
    Kind {
        /// The array.
        folder: PathBuf,
        /// What it has.
        found: String,
    },
    /// Positions of the record that are none.
    #[error(transparent)]
    Tau(#[from] TauError),
    /// Samples that are no frame.
    #[error(transparent)]
    Samples(#[from] FrameError),
    /// A frame that does not fit the volume.
    #[error(transparent)]
    Volume(#[from] VolumeError),
}

impl PackedError {
    pub(super) fn io(action: &'static str, path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { action, path, source }
    }

    pub(super) fn no_array(folder: &Path, reason: impl ToString) -> Self {
        Self::NoArray { folder: folder.to_owned(), reason: reason.to_string() }
    }

    pub(super) fn contradiction(folder: &Path, reason: impl ToString) -> Self {
        Self::Contradiction { folder: folder.to_owned(), reason: reason.to_string() }
    }
}

impl Fault for PackedError {
    fn blame(&self) -> Blame {
        match self {
            Self::Cancelled(error) => error.blame(),
            Self::Io { .. } => Blame::System,
            Self::Taken(_) | Self::Busy(_) | Self::Several { .. } => Blame::Request,
            Self::Record(RecordError::Read(error)) => error.blame(),
            Self::Record(_)
            | Self::Contradiction { .. }
            | Self::Frame { .. }
            | Self::NoArray { .. }
            | Self::Kind { .. }
            | Self::Tau(_)
            | Self::Samples(_)
            | Self::Volume(_) => Blame::Data,
        }
    }
}
