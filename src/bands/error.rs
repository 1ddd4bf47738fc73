//! What can go wrong with a match in bands.

use std::path::PathBuf;

use thiserror::Error;

use super::PartFault;
use crate::results::{MaskError, ResultsError};
use epirig_core::fault::{Blame, Fault};
use epirig_data::storage::{RecordError, advice};

/// Why bands cannot be planned, matched or merged.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BandError {
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
    /// There is no plan.
    #[error("{} has no plan; run `epirig match SEQ --survey` first", .0.display())]
    NoPlan(PathBuf),
    /// The plan cannot be read.
    #[error("{0}; run `epirig match SEQ --survey --overwrite` again")]
    Record(#[from] RecordError),
    /// Its mask cannot be read.
    #[error("{0}; run `epirig match SEQ --survey --overwrite` again")]
    Mask(#[from] MaskError),
    /// Its mask cannot be written.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// A plan of another match is there.
    #[error(
        "{} is the plan of another match ({what}); give --overwrite to replace it and its parts", folder.display()
    )]
    OtherMatch {
        /// The folder.
        folder: PathBuf,
        /// What differs.
        what: &'static str,
    },
    /// Something has changed since the survey.
    #[error(
        "{} was made with {what}; run `epirig match SEQ --survey --overwrite` again, or undo the change", folder.display()
    )]
    Changed {
        /// The folder.
        folder: PathBuf,
        /// What is another one now.
        what: &'static str,
    },
    /// The plan was changed by hand, or is damaged.
    #[error("{}: {reason}; run `epirig match SEQ --survey --overwrite` again", folder.display())]
    Contradiction {
        /// The folder.
        folder: PathBuf,
        /// What does not fit.
        reason: &'static str,
    },
    /// Something else is in the folder of the plan.
    #[error("{} holds {name}, which is no part of a match in bands; move it away", folder.display())]
    Taken {
        /// The folder.
        folder: PathBuf,
        /// A file or folder in it.
        name: String,
    },
    /// Parts without a plan are in the folder.
    #[error("{} holds parts without their plan; give --overwrite to remove them", .0.display())]
    PartsAlone(PathBuf),
    /// The frames are no longer packed.
    #[error(
        "the packed frames are gone or of something else, and bands read their rows of them; run `epirig match SEQ --survey` again, with \
         the same options"
    )]
    NotPacked,
    /// The plan has no such band.
    #[error("there is no band {band}; the last is {last}")]
    NoSuchBand {
        /// Its number, from 0.
        band: usize,
        /// The last of the plan.
        last: usize,
    },
    /// Bands are not matched yet, or their parts are not to be used.
    #[error(
        "of {bands} bands these are missing or not to be used: {}; match each by `epirig match SEQ --band K`, or run `epirig submit` \
         again, then merge",
        listed(faults)
    )]
    Incomplete {
        /// Number of bands.
        bands: usize,
        /// The bands, each with the reason.
        faults: Vec<(usize, PartFault)>,
    },
    /// A part that was there is not to be used any more.
    #[error("the part of block {block} is {fault}; run the command again")]
    Part {
        /// The block.
        block: usize,
        /// The reason.
        fault: PartFault,
    },
}

fn listed(faults: &[(usize, PartFault)]) -> String {
    // Neighbours with the same fault are one entry.
    let runs = faults.chunk_by(|(one, fault), (next, other)| one + 1 == *next && fault == other);
    let words = runs.map(|run| match run {
        [(band, fault)] => format!("{band} ({fault})"),
        [(first, fault), .., (last, _)] => format!("{first} to {last} ({fault})"),
        [] => String::new(),
    });
    words.collect::<Vec<_>>().join(", ")
}

impl BandError {
    pub(super) fn io(action: &'static str, path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { action, path, source }
    }
}

impl Fault for BandError {
    fn blame(&self) -> Blame {
        match self {
            Self::Io { .. } => Blame::System,
            Self::NoPlan(_)
            | Self::OtherMatch { .. }
            | Self::Taken { .. }
            | Self::PartsAlone(_)
            | Self::NoSuchBand { .. }
            | Self::NotPacked => Blame::Request,
            Self::Record(RecordError::Read(error)) => error.blame(),
            Self::Mask(error) => error.blame(),
            Self::Results(error) => error.blame(),
            Self::Record(_)
            | Self::Contradiction { .. }
            | Self::Changed { .. }
            | Self::Incomplete { .. }
            | Self::Part { .. } => Blame::Data,
        }
    }
}
