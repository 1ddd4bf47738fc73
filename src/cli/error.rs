//! Errors of the command line: a line on stderr, an exit code, and with `--json` a
//! [`Failure`](super::failure::Failure).

use std::path::PathBuf;

use thiserror::Error;

use super::failure::{
    DEVICE, INTEGRITY, INTERRUPTED, NO_ANSWER, NO_DEVICE, REJECTED, RESUMABLE, TROUBLE, USAGE,
};
use crate::calibrate::CalibrateError;
use crate::capture::CaptureError;
use crate::doctor::DoctorError;
use crate::memory::Bound;
use crate::panel::PanelError;
use crate::pipeline::{CompareError, PipelineError};
use crate::profile::{ProfileError, RecordedRigError};
use crate::report::ReportError;
use crate::results::{MaskError, ResultsError};
use crate::rig::RigError;
use epirig_calibration::target::TargetError;
use epirig_data::formats::FormatError;
use epirig_data::sequence::SequenceError;
use epirig_data::storage::ReadError;
use epirig_devices::Blame;
use epirig_devices::camera::CameraError;
use epirig_devices::link::LinkError;
use epirig_devices::stage::StageError;
use epirig_matcher::MatchError;
use epirig_matcher::evaluate::{LeaveOutError, SizeMismatch, SplitHalfError};
use epirig_matcher::surface::SurfaceError;
use epirig_server::ServerError;
use epirig_simulator::SimulatorError;

#[derive(Debug, Error)]
pub(super) enum CliError {
    #[error(transparent)]
    Sequence(#[from] SequenceError),
    #[error(transparent)]
    Calibrate(CalibrateError),
    #[error(transparent)]
    Match(#[from] MatchError),
    #[error(transparent)]
    Results(#[from] ResultsError),
    #[error(transparent)]
    Mask(#[from] MaskError),
    #[error(transparent)]
    Report(#[from] ReportError),
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    #[error(transparent)]
    Simulator(#[from] SimulatorError),
    #[error(transparent)]
    Profile(#[from] ProfileError),
    #[error(transparent)]
    RecordedRig(#[from] RecordedRigError),
    #[error(transparent)]
    Doctor(#[from] DoctorError),
    #[error(
        "the rig is not ready for this scan ({bad}); follow the advice, or measure with `epirig run --anyway`"
    )]
    NotReady { bad: String, report: serde_json::Value },
    #[error("{0}, or begin with --anyway: PNG often takes less")]
    NoRoom(String),
    #[error(transparent)]
    Capture(#[from] CaptureError),
    #[error(transparent)]
    LeaveOut(#[from] LeaveOutError),
    #[error(transparent)]
    SplitHalf(#[from] SplitHalfError),
    #[error(transparent)]
    Size(#[from] SizeMismatch),
    #[error(transparent)]
    Rig(RigError),
    #[error("{0}")]
    Stage(StageError),
    #[error(transparent)]
    Link(#[from] LinkError),
    #[error(transparent)]
    Camera(#[from] CameraError),
    #[error(transparent)]
    Target(#[from] TargetError),
    #[error("{path}: cannot {action}: {source}")]
    File { path: PathBuf, action: &'static str, source: std::io::Error },
    #[error("{what} needs up to {needed} of memory, and {available} {bound}; {advice}")]
    Memory { what: String, needed: String, available: String, bound: Bound, advice: String },
    #[error("the system allows no more threads: {0}; end other programs, or raise the limit (ulimit -u)")]
    Threads(std::io::Error),
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Server(#[from] ServerError),
    #[error("{0}")]
    Usage(String),
    #[error("{0}")]
    Integrity(String),
    /// A match in which no pixel has an answer.
    #[error("{0}")]
    NoAnswer(String),
    #[error("cannot print the result: {0}")]
    Output(#[from] std::io::Error),
}

impl From<PipelineError> for CliError {
    fn from(error: PipelineError) -> Self {
        match error {
            PipelineError::Sequence(error) => Self::Sequence(error),
            PipelineError::Calibrate(error) => Self::from(error),
            PipelineError::Match(error) => Self::Match(error),
            PipelineError::Halves(SplitHalfError::Match(error)) => Self::Match(error),
            PipelineError::Halves(error) => Self::Integrity(error.to_string()),
            PipelineError::Results(error) => Self::Results(error),
            PipelineError::Mismatch(error) => Self::Integrity(error.to_string()),
            PipelineError::NoSuchFrame { .. } => Self::Integrity(error.to_string()),
            PipelineError::Report(error) => Self::Report(error),
            PipelineError::Surface(error) => Self::Surface(error),
        }
    }
}

impl From<CompareError> for CliError {
    fn from(error: CompareError) -> Self {
        match error {
            CompareError::Pipeline(error) => Self::from(error),
            CompareError::Report(error) => Self::Report(error),
            CompareError::Results(error) => Self::Results(error),
            CompareError::Sizes { .. } => Self::Usage(error.to_string()),
            other => Self::Integrity(other.to_string()),
        }
    }
}

impl From<PanelError> for CliError {
    fn from(error: PanelError) -> Self {
        match error {
            PanelError::Sequence(error) => Self::Sequence(error),
            PanelError::Pipeline(error) => Self::from(error),
            PanelError::Calibrate(error) => Self::from(error),
            PanelError::Results(error) => Self::Results(error),
            PanelError::Read(error) => Self::Read(error),
            PanelError::Threads(error) => Self::Threads(error),
            other => Self::Integrity(other.to_string()),
        }
    }
}

impl From<CalibrateError> for CliError {
    fn from(error: CalibrateError) -> Self {
        match error {
            CalibrateError::Sequence(error) => Self::Sequence(error),
            other => Self::Calibrate(other),
        }
    }
}

impl From<StageError> for CliError {
    fn from(error: StageError) -> Self {
        match error {
            StageError::Link(error) => Self::Link(error),
            other => Self::Stage(other),
        }
    }
}

impl From<RigError> for CliError {
    fn from(error: RigError) -> Self {
        match error {
            RigError::Stage(error) => Self::from(error),
            RigError::Camera(error) => Self::Camera(error),
            RigError::Simulator(error) => Self::Simulator(error),
            other => Self::Rig(other),
        }
    }
}

impl CliError {
    /// The message: one line, with line breaks in names replaced. A profile error has one line per mistake.
    pub(super) fn in_words(&self) -> String {
        match self {
            Self::Profile(error) => error.to_string(),
            other => other.to_string().replace('\n', "\u{fffd}"),
        }
    }

    /// What was measured before the failure.
    pub(super) fn report(&self) -> Option<&serde_json::Value> {
        match self {
            Self::NotReady { report, .. } => Some(report),
            _ => None,
        }
    }

    /// The exit code of the error's kind, as listed in `--help`.
    pub(super) fn exit_code(&self) -> u8 {
        match self {
            Self::Sequence(error) => sequence_code(error),
            Self::Capture(error) => capture_code(error),
            Self::Doctor(error) => match error {
                DoctorError::Stage(error) => code(error.consequence().blame),
                DoctorError::Camera(error) => camera_code(error),
                _ => USAGE,
            },
            Self::Calibrate(error) => calibrate_code(error),
            Self::NotReady { .. } => DEVICE,
            Self::Match(error)
            | Self::LeaveOut(LeaveOutError::Match(error))
            | Self::SplitHalf(SplitHalfError::Match(error)) => match error {
                MatchError::NoRange => NO_ANSWER,
                MatchError::TooSmall { .. } => INTEGRITY,
                _ => USAGE,
            },
            Self::Results(error) => match error {
                ResultsError::Exists { .. }
                | ResultsError::Foreign { .. }
                | ResultsError::OtherResults { .. }
                | ResultsError::NoSummary { .. }
                | ResultsError::Link { .. }
                | ResultsError::NotAFolder { .. }
                | ResultsError::NoName { .. }
                | ResultsError::UnknownFormat { .. }
                | ResultsError::Format { source: FormatError::Unsuitable { .. }, .. } => USAGE,
                ResultsError::Format { .. }
                | ResultsError::BadSummary { .. }
                | ResultsError::Changed { .. }
                | ResultsError::Missing { .. } => INTEGRITY,
                ResultsError::Read(error) => read_code(error),
                _ => TROUBLE,
            },
            Self::Mask(error) => match error {
                MaskError::Size { .. } | MaskError::Empty { .. } | MaskError::Apart { .. } => USAGE,
                MaskError::Picture { .. } => INTEGRITY,
                MaskError::Read(error) => read_code(error),
            },
            Self::Profile(_)
            | Self::Simulator(_)
            | Self::Rig(_)
            | Self::Target(_)
            | Self::LeaveOut(_)
            | Self::SplitHalf(_)
            | Self::Size(_)
            | Self::Usage(_) => USAGE,
            Self::Stage(error) => code(error.consequence().blame),
            Self::Camera(error) => camera_code(error),
            Self::Link(error) => code(error.blame()),
            Self::Surface(error) => match error {
                SurfaceError::EmptyLine { .. } | SurfaceError::LineOutside { .. } => USAGE,
                _ => INTEGRITY,
            },
            Self::Read(error) => read_code(error),
            Self::RecordedRig(_) | Self::Integrity(_) => INTEGRITY,
            Self::NoAnswer(_) => NO_ANSWER,
            Self::Server(ServerError::Listen { .. }) => USAGE,
            Self::Server(_)
            | Self::Report(_)
            | Self::Output(_)
            | Self::File { .. }
            | Self::Memory { .. }
            | Self::NoRoom(_)
            | Self::Threads(_) => TROUBLE,
        }
    }
}

fn capture_code(error: &CaptureError) -> u8 {
    match error {
        CaptureError::Interrupted { .. } => RESUMABLE,
        CaptureError::Stage(error)
        | CaptureError::StageReconnectTimeout { source: error, .. }
        | CaptureError::CannotHome { source: error, .. } => code(error.consequence().blame),
        CaptureError::Camera(error) => camera_code(error),
        CaptureError::Sequence(error) => sequence_code(error),
        CaptureError::ReplayEnded { source, .. } => capture_code(source),
        CaptureError::NotAsRecorded { .. } => INTEGRITY,
        CaptureError::Paused | CaptureError::NotBegun => INTERRUPTED,
        CaptureError::NotArranged { .. }
        | CaptureError::EmptyPlan(_)
        | CaptureError::BeyondTravel { .. }
        | CaptureError::NotThisScan { .. } => USAGE,
        _ => DEVICE,
    }
}

fn calibrate_code(error: &CalibrateError) -> u8 {
    match error {
        CalibrateError::Sequence(error) => sequence_code(error),
        CalibrateError::Exists { .. }
        | CalibrateError::NoTarget
        | CalibrateError::NoBaseline
        | CalibrateError::BoardNotDescribed { .. }
        | CalibrateError::LensSize { .. } => USAGE,
        CalibrateError::Io { .. } => TROUBLE,
        CalibrateError::Read(error) => read_code(error),
        error if error.is_rejection() => REJECTED,
        _ => INTEGRITY,
    }
}

fn read_code(error: &ReadError) -> u8 {
    if error.is_trouble() { TROUBLE } else { INTEGRITY }
}

fn sequence_code(error: &SequenceError) -> u8 {
    match error {
        error if error.is_trouble() => TROUBLE,
        SequenceError::Busy { .. }
        | SequenceError::Closed
        | SequenceError::CannotLink { .. }
        | SequenceError::Renamed { .. } => TROUBLE,
        SequenceError::Exists { .. }
        | SequenceError::Unfinished { .. }
        | SequenceError::NoName { .. }
        | SequenceError::Link { .. }
        | SequenceError::NoImages { .. }
        | SequenceError::NoMatch { .. }
        | SequenceError::InsideSource { .. }
        | SequenceError::NoSuchFrames { .. }
        | SequenceError::BackwardsSpan { .. }
        | SequenceError::TooManyFrames { .. }
        | SequenceError::NotASequence { .. } => USAGE,
        _ => INTEGRITY,
    }
}

fn camera_code(error: &CameraError) -> u8 {
    match error {
        CameraError::Sequence(error) => sequence_code(error),
        other => code(other.blame()),
    }
}

/// The exit code for a [`Blame`].
fn code(blame: Blame) -> u8 {
    match blame {
        Blame::Request => USAGE,
        Blame::System => TROUBLE,
        Blame::NoDevice => NO_DEVICE,
        Blame::Device => DEVICE,
        Blame::Data => INTEGRITY,
        Blame::Interruption => INTERRUPTED,
    }
}
