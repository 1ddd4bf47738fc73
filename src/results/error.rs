//! Errors of results.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::kind::ResultsKind;
use epirig_core::fault::{Blame, Fault};
use epirig_data::formats::FormatError;
use epirig_data::storage::{ReadError, is_in_place};

/// Error when results are written or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResultsError {
    /// The folder holds results already.
    #[error("{} holds results already; add --overwrite to replace them, or choose another folder with --out", .0.display())]
    Exists(PathBuf),
    /// The folder holds something that is not a result.
    #[error("{} holds {name}, which is not a result of this program, so it is not replaced; choose another folder with --out", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// Name of the foreign file or folder.
        name: String,
    },
    /// The folder holds results of another verb.
    #[error(
        "{} holds results of `epirig {}` ({}), which `epirig {}` does not replace; choose another folder with --out", path.display(), found.verb(),
        found.summary(), wanted.verb()
    )]
    OtherResults {
        /// The folder.
        path: PathBuf,
        /// The kind that is there.
        found: ResultsKind,
        /// The kind that was to be written.
        wanted: ResultsKind,
    },
    /// The folder has files with names of results, but not the summary that identifies them.
    #[error(
        "{} has no {}, which would show that `epirig {}` wrote it, so it is not replaced; choose another folder with --out", path.display(),
        kind.summary(), kind.verb()
    )]
    NoSummary {
        /// The folder.
        path: PathBuf,
        /// The kind that was to be written.
        kind: ResultsKind,
    },
    /// There is a link where a folder should be.
    #[error("{} is a link; give the folder that it points to, with --out", .0.display())]
    Link(PathBuf),
    /// There is a file where a folder should be.
    #[error("{} is not a folder; choose another folder with --out", .0.display())]
    NotAFolder(PathBuf),
    /// A path without a name of its own.
    #[error("{} cannot be replaced as a whole; give the folder by its name, with --out", .0.display())]
    NoName(PathBuf),
    /// Another program writes there.
    #[error("{} is being written by another epirig; wait until it has ended", .0.display())]
    Busy(PathBuf),
    /// A file cannot be read, or is not of the right kind.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The operating system refused.
    #[error("cannot {action} {}: {source}; {}", path.display(), advice(action, source))]
    Io {
        /// The operation.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A map that cannot be read or written.
    #[error("{}: {source}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: FormatError,
    },
    /// A file whose extension is unknown.
    #[error("{} has an unknown extension; maps have .pfm, .tiff or .npy", .0.display())]
    UnknownFormat(PathBuf),
    /// A record that is invalid.
    #[error("{}: {reason}; run `epirig {} --overwrite` again", path.display(), kind.verb())]
    BadSummary {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
        /// What it is the record of.
        kind: ResultsKind,
    },
    /// A file that is another one than when it was written.
    #[error(
        "{} was changed after it was written, or exchanged: {} has the hash of another file; restore it from a copy, or run `epirig {} --overwrite` again",
        path.display(), kind.summary(), kind.verb()
    )]
    Changed {
        /// The file.
        path: PathBuf,
        /// What it belongs to.
        kind: ResultsKind,
    },
    /// A file that is no longer there.
    #[error("{} is missing; restore it from a copy, or run `epirig {} --overwrite` again", path.display(), kind.verb())]
    Missing {
        /// The file.
        path: PathBuf,
        /// What it belongs to.
        kind: ResultsKind,
    },
    /// A picture that cannot be drawn.
    #[error("cannot draw {}: {reason}", path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

impl Fault for ResultsError {
    fn blame(&self) -> Blame {
        match self {
            Self::Exists(_)
            | Self::Foreign { .. }
            | Self::OtherResults { .. }
            | Self::NoSummary { .. }
            | Self::Link(_)
            | Self::NotAFolder(_)
            | Self::NoName(_)
            | Self::UnknownFormat(_)
            | Self::Format { source: FormatError::Unsuitable { .. }, .. } => Blame::Request,
            Self::Format { .. } | Self::BadSummary { .. } | Self::Changed { .. } | Self::Missing { .. } => {
                Blame::Data
            }
            Self::Read(error) => error.blame(),
            Self::Busy(_) | Self::Io { .. } | Self::Picture { .. } => Blame::System,
        }
    }
}

impl ResultsError {
    /// Whether there is no such file.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Read(error) if error.is_missing())
    }

    /// What the operating system refused to do with `path`.
    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Io { action, path, source }
    }
}

/// Advice for an error of the operating system.
fn advice(action: &str, error: &std::io::Error) -> &'static str {
    use std::io::ErrorKind;
    match error.kind() {
        _ if is_in_place(error) => "check the disk",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            "make room or choose another disk with --out; no partial output was left"
        }
        ErrorKind::FileTooLarge => "raise the limit of file sizes (ulimit -f); no partial output was left",
        ErrorKind::NotFound if action == "read" => "check the path; `epirig match` writes the results",
        _ if action == "read" => "check the path and its permissions",
        _ => "choose a folder that you may write to with --out, or check the path",
    }
}
