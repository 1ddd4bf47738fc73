//! Why results cannot be written or read.

use std::path::PathBuf;

use thiserror::Error;

use super::kind::ResultsKind;
use epirig_data::storage::ReadError;

/// Why results cannot be written or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResultsError {
    /// The folder holds something already.
    #[error("{} holds results already; add --overwrite to replace them, or choose another folder with --out", path.display())]
    Exists {
        /// The folder.
        path: PathBuf,
    },
    /// The folder holds something that is no result.
    #[error("{} holds {name}, which is no result of this program, so it is not replaced; choose another folder with --out", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// Name of what it holds.
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
        /// What is there.
        found: ResultsKind,
        /// What was to be put there.
        wanted: ResultsKind,
    },
    /// The folder has files of such names, but not the one that tells whose they are.
    #[error(
        "{} has no {}, so nobody knows whether `epirig {}` has written it, and it is not replaced; choose another folder with --out", path.display(),
        kind.summary(), kind.verb()
    )]
    NoSummary {
        /// The folder.
        path: PathBuf,
        /// What was to be put there.
        kind: ResultsKind,
    },
    /// There is a link where a folder should be.
    #[error("{} is a link, and results take the place of a folder; give the folder that it leads to, with --out", path.display())]
    Link {
        /// What is there.
        path: PathBuf,
    },
    /// There is a file where a folder should be.
    #[error("{} is not a folder; choose another folder with --out", path.display())]
    NotAFolder {
        /// What is there.
        path: PathBuf,
    },
    /// A place without a name of its own.
    #[error("{} cannot be made anew as a whole; give the folder by its name, with --out", path.display())]
    NoName {
        /// As it was given.
        path: PathBuf,
    },
    /// Another program writes there.
    #[error("{} is being written by another epirig; wait until it has ended", path.display())]
    Busy {
        /// The folder in the making.
        path: PathBuf,
    },
    /// A file that cannot be read, or is none.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The operating system refused.
    #[error("cannot {action} {}: {source}; {}", path.display(), advice(action, source))]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A map that cannot be read or written.
    #[error("{}: {source}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: epirig_data::formats::FormatError,
    },
    /// A file whose name tells no format.
    #[error("{} has no known ending; maps end in .pfm, .tiff or .npy", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A summary that cannot be understood.
    #[error("{}: {reason}; match the sequence again", path.display())]
    BadSummary {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
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

/// What a person can do about an error of the operating system.
fn advice(action: &str, error: &std::io::Error) -> &'static str {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "make room or choose another disk with --out; nothing was left half-written"
        }
        ErrorKind::NotFound if action == "read" => "check the path; `epirig match` makes the results",
        _ if action == "read" => "check the path and the access to it",
        _ => "choose a folder that you may write to with --out, or check the path",
    }
}
