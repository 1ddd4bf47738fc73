//! Why a scan stopped.

use std::path::PathBuf;

use thiserror::Error;

use epirig_data::sequence::SequenceError;
use epirig_devices::camera::CameraError;
use epirig_devices::stage::StageError;

/// Why a scan stopped, or did not begin.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// The stage failed.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The camera failed.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A frame could not be written.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
    /// The plan has fewer than two positions.
    #[error("a plan of {0} position(s) makes no sequence; give at least 2")]
    EmptyPlan(usize),
    /// The plan goes where the stage cannot.
    #[error(
        "the scan would go to {position_mm:.3} mm; the stage goes from 0 to {travel_mm} mm: change the plan's start, step or frames"
    )]
    BeyondTravel {
        /// The farthest position, in mm from home.
        position_mm: f64,
        /// Length of the travel, in mm.
        travel_mm: f64,
    },
    /// Too much of a frame is at full scale.
    #[error(
        "frame {index}: {:.2} % of the samples are at full scale, {:.2} % are allowed (limits.saturated); dim the lamp, or \
         begin a new scan with a shorter exposure", 100.0 * share, 100.0 * limit
    )]
    Saturated {
        /// Index of the frame.
        index: usize,
        /// Share of the samples, 0 to 1.
        share: f64,
        /// What is allowed.
        limit: f64,
    },
    /// The picture stays the same although the stage says that it has moved.
    #[error(
        "frame {index} shows what the frame before shows, although the stage says that it has moved by {step_mm} mm; does the \
         motor stall, or slip on its shaft?"
    )]
    NoMotion {
        /// Index of the frame.
        index: usize,
        /// Distance from the frame before, in mm.
        step_mm: f64,
    },
    /// After homing, the last good frame shows something else.
    #[error(
        "after homing, frame {frame} taken again differs from what it was: {how}; something has moved: put it back and resume, \
         or begin a new scan"
    )]
    Moved {
        /// Index of the frame.
        frame: usize,
        /// How it differs.
        how: String,
    },
    /// A frame could not be had, however often it was tried.
    #[error("frame {index} could not be had in {attempts} attempts; the last: {source}")]
    RetriesExhausted {
        /// Index of the frame.
        index: usize,
        /// Times that it was tried.
        attempts: usize,
        /// Why the last attempt failed.
        source: Box<CaptureError>,
    },
    /// The stage did not come back.
    #[error("the stage did not come back within {wait_s:.0} s: {source}")]
    StageReconnectTimeout {
        /// How long was waited.
        wait_s: f64,
        /// Why the last attempt failed.
        source: StageError,
    },
    /// The stage answers, and does not find home.
    #[error("the stage did not find home in {attempts} attempts; the last: {source}")]
    CannotHome {
        /// Times that it was tried.
        attempts: usize,
        /// Why the last attempt failed.
        source: StageError,
    },
    /// The light is not what it was.
    #[error(
        "frame {index} has a mean of {mean_dn:.1} DN, the frame before {before_dn:.1} DN: frames of neighbouring stops are alike; has \
         a lamp gone out, or does something stand in the light?"
    )]
    LightChanged {
        /// Index of the frame.
        index: usize,
        /// Mean of its samples, in DN.
        mean_dn: f64,
        /// Mean of the frame before, in DN.
        before_dn: f64,
    },
    /// A person wants it to end.
    #[error("paused")]
    Paused,
    /// The sequence was not made by a scan, or not by one of this plan.
    #[error("{} cannot be gone on with: {reason}", path.display())]
    NotThisScan {
        /// The folder.
        path: PathBuf,
        /// What does not fit.
        reason: String,
    },
    /// The position was lost in the scan, and nobody noticed until the stage was homed again.
    #[error(
        "the rig did not stay as it was in the scan: {how}; the frames do not show what their positions say: look for what moves \
         or blocks, and take the scan again"
    )]
    NotClosed {
        /// What differs from the beginning.
        how: String,
    },
    /// A person did not arrange what was asked for.
    #[error(
        "nobody has put {what}; have somebody at the terminal, or go without: `--set plan.dark=0 --set plan.flat=0 --set plan.board=0`"
    )]
    NotArranged {
        /// What was to be in front of the camera.
        what: String,
    },
    /// A scan with a replayed camera stopped, because of what it replays.
    #[error(
        "{source}; {done} of {planned} frames are in {}, and there will be no more until what is replayed is mended", folder.display()
    )]
    ReplayEnded {
        /// The sequence.
        folder: PathBuf,
        /// Frames that are there.
        done: usize,
        /// Frames planned.
        planned: usize,
        /// Why.
        source: Box<CaptureError>,
    },
    /// A sequence that is complete by its end, but not by `verify`.
    #[error("{}: the scan has ended as complete, but {file}: {problem}{}", folder.display(), if *others > 0 { format!(" (and {others} more, which `epirig verify` lists)") } else { String::new() })]
    NotAsRecorded {
        /// The sequence.
        folder: PathBuf,
        /// The file or frame that it concerns.
        file: String,
        /// What is wrong and what to do.
        problem: String,
        /// Further findings.
        others: usize,
    },
    /// It stopped before the end, and can be resumed.
    #[error("{source}; {done} of {planned} frames are in {}: `epirig resume {}` goes on", folder.display(), folder.display())]
    Interrupted {
        /// The sequence.
        folder: PathBuf,
        /// Frames that are there.
        done: usize,
        /// Frames planned.
        planned: usize,
        /// Why.
        source: Box<CaptureError>,
    },
}

impl CaptureError {
    /// The reason behind [`Interrupted`](Self::Interrupted) or [`ReplayEnded`](Self::ReplayEnded), or itself.
    pub fn cause(&self) -> &Self {
        match self {
            Self::Interrupted { source, .. } | Self::ReplayEnded { source, .. } => source.cause(),
            other => other,
        }
    }

    /// Whether a person wanted it.
    pub fn is_wanted(&self) -> bool {
        matches!(
            self.cause(),
            Self::Paused
                | Self::Stage(StageError::Stopped { .. })
                | Self::Camera(CameraError::Interrupted { .. })
        )
    }
}

/// Errors of a stage that is not heard, or has not been until now.
pub(super) fn is_unheard(error: &StageError) -> bool {
    matches!(error, StageError::Link(_) | StageError::NoAnswer { .. } | StageError::Restarted { .. })
}
