//! Errors of a scan.

use std::path::PathBuf;

use thiserror::Error;

use super::settings::{ChangedSetting, listed};
use epirig_core::fault::{Blame, Fault};
use epirig_core::shell::quoted;
use epirig_data::sequence::SequenceError;
use epirig_devices::camera::CameraError;
use epirig_devices::stage::StageError;

/// Error that stopped a scan or prevented it.
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
    #[error("a plan of {0} position(s) is too short; give at least 2")]
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
    /// Too many samples of a frame are saturated.
    #[error(
        "frame {index}: {:.2} % of the samples are at full scale, {:.2} % are allowed (limits.saturated); dim the lamp, or \
         begin a new scan with a shorter exposure", 100.0 * share, 100.0 * limit
    )]
    Saturated {
        /// Index of the frame.
        index: usize,
        /// Saturated share of the samples, 0 to 1.
        share: f64,
        /// The limit, 0 to 1.
        limit: f64,
    },
    /// The picture does not move although the stage reports a move.
    #[error(
        "frame {index} shows what the frame before shows, although the stage reports a move of {step_mm} mm; check whether the \
         motor stalls, or slips on its shaft"
    )]
    NoMotion {
        /// Index of the frame.
        index: usize,
        /// Distance from the frame before, in mm.
        step_mm: f64,
    },
    /// After homing, the last good frame does not match when taken again.
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
    /// The stage has other settings than when the scan began.
    #[error(
        "{}, so the same position would be another place; set the stage back, as with `epirig stage console`, and \
         resume, or begin a new scan",
        listed(.0)
    )]
    SettingsChanged(Vec<ChangedSetting>),
    /// A frame failed in all attempts.
    #[error("frame {index} failed after {attempts} attempts; last error: {source}")]
    RetriesExhausted {
        /// Index of the frame.
        index: usize,
        /// Number of attempts.
        attempts: usize,
        /// Why the last attempt failed.
        source: Box<CaptureError>,
    },
    /// The stage did not reconnect in time.
    #[error("the stage did not reconnect within {wait_s:.0} s: {source}")]
    StageReconnectTimeout {
        /// The wait, in s.
        wait_s: f64,
        /// Why the last attempt failed.
        source: StageError,
    },
    /// The stage answers, but homing fails.
    #[error("homing failed after {attempts} attempts; last error: {source}")]
    CannotHome {
        /// Number of attempts.
        attempts: usize,
        /// Why the last attempt failed.
        source: StageError,
    },
    /// The brightness has changed abruptly.
    #[error(
        "frame {index} has a mean of {mean_dn:.1} DN, the frame before {before_dn:.1} DN: frames of neighbouring stops are similar; check whether \
         a lamp is off, or something blocks the light"
    )]
    LightChanged {
        /// Index of the frame.
        index: usize,
        /// Mean of the frame, in DN.
        mean_dn: f64,
        /// Mean of the frame before, in DN.
        before_dn: f64,
    },
    /// The operator has paused the scan.
    #[error("paused")]
    Paused,
    /// The operator has stopped a new scan before its first frame.
    #[error("stopped before the first frame; nothing was written, and there is nothing to resume")]
    NotBegun,
    /// The sequence is not a scan, or not a scan with this plan.
    #[error("{} cannot be resumed: {reason}", path.display())]
    NotThisScan {
        /// The folder.
        path: PathBuf,
        /// What does not fit.
        reason: String,
    },
    /// The position was lost during the scan, which was noticed only when the stage was homed again.
    #[error(
        "the rig changed during the scan: {0}; the positions of the frames are wrong: look for what slips \
         or blocks, and take the scan again"
    )]
    NotClosed(String),
    /// The operator did not confirm an arrangement.
    #[error(
        "not confirmed: {0}; run epirig in a terminal with an operator, or plan no such frames: `--set plan.dark=0 --set plan.flat=0 --set plan.board=0`"
    )]
    NotArranged(String),
    /// A scan with a replayed camera stopped because of the replayed sequence.
    #[error(
        "{source}; {done} of {planned} frames are in {}, and it cannot continue until the replayed sequence is repaired", folder.display()
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
    /// The end record says complete, but `verify` finds faults.
    #[error("{}: the scan is recorded as complete, but {file}: {problem}{}", folder.display(), if *others > 0 { format!(" (and {others} more, which `epirig verify` lists)") } else { String::new() })]
    NotAsRecorded {
        /// The sequence.
        folder: PathBuf,
        /// The faulty file or frame.
        file: String,
        /// What is wrong and what to do.
        problem: String,
        /// Number of further findings.
        others: usize,
    },
    /// The scan stopped early and can be resumed.
    #[error("{source}; {done} of {planned} frames are in {}: `epirig resume {}` continues", folder.display(), quoted(folder))]
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

impl Fault for CaptureError {
    fn blame(&self) -> Blame {
        match self {
            Self::Interrupted { .. } => Blame::Resumable,
            Self::Stage(error)
            | Self::StageReconnectTimeout { source: error, .. }
            | Self::CannotHome { source: error, .. } => error.blame(),
            Self::Camera(error) => error.blame(),
            Self::Sequence(error) => error.blame(),
            Self::ReplayEnded { source, .. } => source.blame(),
            Self::NotAsRecorded { .. } => Blame::Data,
            Self::Paused | Self::NotBegun => Blame::Interruption,
            Self::NotArranged { .. }
            | Self::EmptyPlan(_)
            | Self::BeyondTravel { .. }
            | Self::NotThisScan { .. } => Blame::Request,
            Self::Saturated { .. }
            | Self::NoMotion { .. }
            | Self::Moved { .. }
            | Self::SettingsChanged { .. }
            | Self::RetriesExhausted { .. }
            | Self::LightChanged { .. }
            | Self::NotClosed { .. } => Blame::Device,
        }
    }
}

impl CaptureError {
    /// The cause of [`Interrupted`](Self::Interrupted) or [`ReplayEnded`](Self::ReplayEnded); else the error
    /// itself.
    pub fn cause(&self) -> &Self {
        match self {
            Self::Interrupted { source, .. } | Self::ReplayEnded { source, .. } => source.cause(),
            other => other,
        }
    }

    /// Whether the operator asked for it.
    pub fn is_wanted(&self) -> bool {
        match self.cause() {
            Self::Paused | Self::NotBegun | Self::Camera(CameraError::Interrupted { .. }) => true,
            Self::Stage(error) => error.blame() == Blame::Interruption,
            _ => false,
        }
    }
}
