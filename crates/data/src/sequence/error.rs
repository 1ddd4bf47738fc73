//! What can go wrong with a folder of frames.

use std::path::PathBuf;

use thiserror::Error;

use super::pixels::{ForeignFormat, image_formats};
use crate::storage::{ReadError, RecordError, advice};
use epirig_core::fault::{Blame, Fault};
use epirig_core::frame::FrameError;
use epirig_core::progress::Cancelled;
use epirig_core::shell::quoted;
use epirig_core::tau::TauError;
use epirig_core::volume::VolumeError;

/// Why a sequence cannot be written, read or imported. Every message names the file and what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SequenceError {
    /// The caller has cancelled the work.
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
    /// A file that cannot be read, or is not a regular file.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The folder to be made exists and is not empty.
    #[error("{} exists already and is not empty; choose another folder, or move it away", .0.display())]
    Exists(PathBuf),
    /// A link where the folder is to be made.
    #[error("{} is a link, and a sequence is made as a folder; give the folder that it leads to, or another name", .0.display())]
    Link(PathBuf),
    /// A place without a name of its own.
    #[error("{} cannot be made anew as a whole; give the folder by its name", .0.display())]
    NoName(PathBuf),
    /// The folder to be made holds a scan that has not ended.
    #[error("{} holds a scan that was interrupted; `epirig resume {}` goes on with it", .0.display(), quoted(.0))]
    Unfinished(PathBuf),
    /// An image that cannot get a second name.
    #[error("{} cannot be linked: {source}; leave --link out, and the images are copied", path.display())]
    CannotLink {
        /// The image.
        path: PathBuf,
        /// The operating system's message.
        source: std::io::Error,
    },
    /// Another program writes the sequence.
    #[error("{} is being written by another epirig; wait until it has ended", .0.display())]
    Busy(PathBuf),
    /// Another program has changed the sequence that this one writes.
    #[error("{}: {what} by another program while the sequence was written; {advice}", folder.display())]
    Disturbed {
        /// The folder.
        folder: PathBuf,
        /// What was done to which of its files.
        what: String,
        /// What to do.
        advice: &'static str,
    },
    /// Another program has renamed the sequence that this one wrote.
    #[error("{} was renamed while the sequence was written; all of it is in {}", folder.display(), quoted(now))]
    Renamed {
        /// The former name.
        folder: PathBuf,
        /// The present name.
        now: PathBuf,
    },
    /// Something was to be written after an error had ended the writing.
    #[error("nothing more is written after an error; see the one before")]
    Closed,
    /// A folder without images.
    #[error("{} holds no images that are read ({}); give the folder that holds the frames", .0.display(), image_formats())]
    NoImages(PathBuf),
    /// Files of a format that is not read.
    #[error(
        "{} is {}{}, which is not read; make images of {} ({}), and import those: {}",
        path.display(), format.name, others(*count), if *count > 1 { "all" } else { "it" }, image_formats(), format.convert
    )]
    ForeignFormat {
        /// The first of them.
        path: PathBuf,
        /// What it is.
        format: &'static ForeignFormat,
        /// How many there are.
        count: usize,
    },
    /// A pattern that no file fits.
    #[error("{}: {reason}; check the folder and the ending", pattern.display())]
    NoMatch {
        /// The pattern.
        pattern: PathBuf,
        /// Why there is no file.
        reason: String,
    },
    /// Names of images that are not files.
    #[error("{}: {}; each name has to be one image: put it there, or move the name away, or every later frame would be one step off", folder.display(), found.join(", "))]
    NotFiles {
        /// The folder.
        folder: PathBuf,
        /// Each name with what is wrong with it.
        found: Vec<String>,
    },
    /// An image of a kind that cannot be used.
    #[error("{} cannot be used: {reason}", path.display())]
    Unusable {
        /// The file.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// Fewer than two frames.
    #[error("{} holds {count} frame(s) to use; a sequence needs at least 2", path.display())]
    TooFewFrames {
        /// The folder.
        path: PathBuf,
        /// Number found.
        count: usize,
    },
    /// More frames than a sequence can have.
    #[error("{} holds {count} images, a sequence has {most} at most; take a part with --frames", path.display())]
    TooManyFrames {
        /// The folder.
        path: PathBuf,
        /// Number found.
        count: usize,
        /// Largest number allowed.
        most: usize,
    },
    /// A span that ends before it begins.
    #[error("{option} {first}..{last} ends before it begins; give {option} {last}..{first}")]
    BackwardsSpan {
        /// First index asked for.
        first: usize,
        /// Last index asked for.
        last: usize,
        /// The option that asked.
        option: &'static str,
    },
    /// A selection of frames that do not exist.
    #[error("images {first}..{last} are not all there: {} holds {count} images, 0 to {}; change {option}", path.display(), count.saturating_sub(1))]
    NoSuchFrames {
        /// The folder.
        path: PathBuf,
        /// First index asked for.
        first: usize,
        /// Last index asked for.
        last: usize,
        /// Images in the folder.
        count: usize,
        /// The option.
        option: &'static str,
    },
    /// An image that cannot be decoded.
    #[error("{} is damaged or no image: {reason}; copy it again from its source, or import the frames without it", path.display())]
    BadImage {
        /// The file.
        path: PathBuf,
        /// The decoder's message.
        reason: String,
    },
    /// An image unlike the first.
    #[error("{} is {found}, but {} is {expected}; all frames must be alike: `--exclude {unlike_most}` leaves out what differs from most images, --frames selects a part", path.display(), first.display())]
    Unlike {
        /// The file.
        path: PathBuf,
        /// Its size and format.
        found: Box<str>,
        /// The first file.
        first: PathBuf,
        /// Size and format of the first.
        expected: Box<str>,
        /// Numbers of the images that differ from most, as --exclude takes them.
        unlike_most: Box<str>,
    },
    /// A calibration image unlike the frames.
    #[error("{} is {found}, but the frames are {expected}; calibration images are valid for the frames only if the same camera took them with \
             the same setting: take them again, or import without them", path.display())]
    CalibrationUnlike {
        /// The file.
        path: PathBuf,
        /// Its size and format.
        found: String,
        /// Size and format of the frames.
        expected: String,
    },
    /// Samples that contradict the stated bit depth.
    #[error("{}: {source}", path.display())]
    BitDepth {
        /// The file.
        path: PathBuf,
        /// The contradiction.
        source: FrameError,
    },
    /// A table of positions that cannot be read.
    #[error("{}, line {line}: {reason}; give one position in mm for each frame, one a line", path.display())]
    BadPositions {
        /// The file.
        path: PathBuf,
        /// Line in it, from 1.
        line: u64,
        /// What is wrong.
        reason: String,
    },
    /// The new sequence would lie among the images it is made of.
    #[error("{} lies in {}, whose images must stay as they are; choose a folder elsewhere", out.display(), folder.display())]
    InsideSource {
        /// The folder to be made.
        out: PathBuf,
        /// The folder of the images.
        folder: PathBuf,
    },
    /// A number of positions that is not that of the frames.
    #[error("{} holds {positions} position(s) for {frames} frame(s); give one for each frame that is imported", path.display())]
    PositionCount {
        /// The file.
        path: PathBuf,
        /// Positions found.
        positions: usize,
        /// Frames to be placed.
        frames: usize,
    },
    /// Positions that do not make a baseline.
    #[error("{}: {source}", path.display())]
    Positions {
        /// The file that holds them.
        path: PathBuf,
        /// What is wrong.
        source: TauError,
    },
    /// A scan whose positions are known to be wrong.
    #[error("{}: the scan was not closed, so the positions of its frames are wrong ({reason}); take the scan again, or use it all the same with --anyway", folder.display())]
    NotClosed {
        /// The sequence.
        folder: PathBuf,
        /// The finding at its end.
        reason: String,
    },
    /// A record that contradicts a frame that is as it was written.
    #[error("{}: {reason}; the frame is as it was written, so the record is wrong: restore it from a copy", path.display())]
    RecordAtFault {
        /// The record.
        path: PathBuf,
        /// The contradiction.
        reason: String,
    },
    /// Records that contradict each other.
    #[error("{}, {file}: {problem}{}", folder.display(), if *others > 0 { format!(" (and {others} more, which `epirig verify` lists)") } else { String::new() })]
    Contradiction {
        /// The sequence.
        folder: PathBuf,
        /// The record or frame that it concerns.
        file: String,
        /// What is wrong and what to do.
        problem: String,
        /// Further contradictions.
        others: usize,
    },
    /// A record that cannot be understood.
    #[error("{}{}: {reason}; restore it from a copy, or import the frames again", path.display(), line.map_or(String::new(), |line| format!(", line {line}")))]
    BadRecord {
        /// The file.
        path: PathBuf,
        /// Line in it, from 1, where it has lines.
        line: Option<usize>,
        /// What is wrong.
        reason: String,
    },
    /// A record of another format version.
    #[error("{} has format version {found}, this program reads version {expected}; use the program that wrote it", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Version found.
        found: u64,
        /// Version understood.
        expected: u32,
    },
    /// A folder that is no sequence.
    #[error("{} is no sequence: it has no sequence.json; make one of a folder of images with `epirig import`", .0.display())]
    NotASequence(PathBuf),
    /// A file whose bytes are not those that were recorded.
    #[error("{} does not have the hash in the journal: it was changed or damaged; restore it from a copy", .0.display())]
    HashMismatch(PathBuf),
    /// A file that the journal names is not there.
    #[error("{} is missing; restore it from a copy, or import the frames again", .0.display())]
    MissingFrame(PathBuf),
    /// Frames that do not make a volume.
    #[error(transparent)]
    Volume(#[from] VolumeError),
}

impl Fault for SequenceError {
    fn blame(&self) -> Blame {
        match self {
            Self::Io { .. }
            | Self::Busy { .. }
            | Self::Closed
            | Self::CannotLink { .. }
            | Self::Renamed { .. } => Blame::System,
            Self::Cancelled(_) => Blame::Interruption,
            Self::Read(error) => error.blame(),
            Self::Exists { .. }
            | Self::Unfinished { .. }
            | Self::NoName { .. }
            | Self::Link { .. }
            | Self::NoImages { .. }
            | Self::NoMatch { .. }
            | Self::InsideSource { .. }
            | Self::NoSuchFrames { .. }
            | Self::BackwardsSpan { .. }
            | Self::TooManyFrames { .. }
            | Self::NotASequence { .. } => Blame::Request,
            Self::Disturbed { .. }
            | Self::ForeignFormat { .. }
            | Self::NotFiles { .. }
            | Self::Unusable { .. }
            | Self::TooFewFrames { .. }
            | Self::BadImage { .. }
            | Self::Unlike { .. }
            | Self::CalibrationUnlike { .. }
            | Self::BitDepth { .. }
            | Self::BadPositions { .. }
            | Self::PositionCount { .. }
            | Self::Positions { .. }
            | Self::NotClosed { .. }
            | Self::RecordAtFault { .. }
            | Self::Contradiction { .. }
            | Self::BadRecord { .. }
            | Self::Version { .. }
            | Self::HashMismatch { .. }
            | Self::MissingFrame { .. }
            | Self::Volume(_) => Blame::Data,
        }
    }
}

impl From<RecordError> for SequenceError {
    fn from(error: RecordError) -> Self {
        match error {
            RecordError::Read(error) => Self::Read(error),
            RecordError::Version { path, found, expected } => Self::Version { path, found, expected },
            RecordError::Content { path, fault } => {
                Self::BadRecord { path, line: Some(fault.line), reason: fault.to_string() }
            }
        }
    }
}

impl SequenceError {
    /// Whether a frame's file is not the one that was written, so that taking the frame again is right. For
    /// all other errors it is not known whether the file is at fault.
    pub fn is_of_the_file(&self) -> bool {
        matches!(self, Self::MissingFrame { .. } | Self::HashMismatch { .. })
    }

    pub(super) fn io(action: &'static str, path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { action, path, source }
    }
}

/// Files of the same kind beside the one that is named.
fn others(count: usize) -> String {
    match count {
        0 | 1 => String::new(),
        2 => " (and so is 1 other)".to_owned(),
        count => format!(" (and so are {} others)", count - 1),
    }
}
