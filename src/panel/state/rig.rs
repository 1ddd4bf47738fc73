//! What the page is told of the rig: all of it, whenever something changes.

use jiff::tz::TimeZone;
use serde::Serialize;

use super::scan::ScanState;
use crate::doctor::{Check, Report};
use epirig_data::sequence::time;

/// All that is known of the rig.
#[derive(Debug, Clone, Default, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct RigState {
    /// What a person calls the rig: its file, or "the simulated rig".
    pub(in crate::panel) rig: String,
    /// What it is doing.
    pub(in crate::panel) task: Option<Task>,
    /// A stop was asked for, and the stage is not yet known to stand.
    pub(in crate::panel) stopping: bool,
    /// The camera.
    pub(in crate::panel) camera: CameraState,
    /// Light and sharpness of the latest picture.
    pub(in crate::panel) light: Option<LightState>,
    /// The chess-board in the latest picture, if one is looked for.
    pub(in crate::panel) target: Option<TargetState>,
    /// The stage.
    pub(in crate::panel) stage: StageState,
    /// The latest examination.
    pub(in crate::panel) doctor: Option<DoctorState>,
    /// The latest scan.
    pub(in crate::panel) scan: Option<ScanState>,
    /// The latest lines of the log, the newest last.
    pub(in crate::panel) log: Vec<LogLine>,
    /// The page that has control.
    pub(in crate::panel) controller: Option<String>,
    /// Free space on the disk of the sequences, in bytes.
    pub(in crate::panel) free_bytes: Option<u64>,
}

/// The kind of a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(in crate::panel) enum TaskKind {
    /// Stage and camera are being opened.
    Connecting,
    /// The stage is being homed.
    Homing,
    /// The stage moves to a position.
    Moving,
    /// The stage moves while a button is held.
    Jogging,
    /// The rig is examined.
    Doctor,
    /// A scan.
    Scan,
    /// A sequence is calibrated, matched and analysed.
    Measuring,
}

/// What the rig is doing.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct Task {
    /// Its kind.
    pub(in crate::panel) kind: TaskKind,
    /// In words.
    pub(in crate::panel) words: String,
    /// The step in hand.
    pub(in crate::panel) step: Option<String>,
    /// Parts of the step that are done, and all of them.
    pub(in crate::panel) done: Option<u64>,
    /// All parts of the step.
    pub(in crate::panel) of: Option<u64>,
    /// Time left, in s.
    pub(in crate::panel) seconds_left: Option<f64>,
    /// A measurement ends at its next step: STOP was pressed.
    pub(in crate::panel) stops: bool,
}

impl Task {
    /// A task that begins now.
    pub(in crate::panel) fn begun(kind: TaskKind, words: String) -> Self {
        Self { kind, words, step: None, done: None, of: None, seconds_left: None, stops: false }
    }
}

/// Whether a part of the rig is there.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(in crate::panel) enum Presence {
    /// It is being opened.
    #[default]
    Connecting,
    /// A camera that shows pictures.
    Live,
    /// A stage that takes orders.
    Ready,
    /// A camera that a scan or the doctor uses.
    Busy,
    /// It is not there.
    Lost,
}

/// The camera.
#[derive(Debug, Clone, Default, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct CameraState {
    /// Whether it is there.
    pub(in crate::panel) state: Presence,
    /// Model and place.
    pub(in crate::panel) name: String,
    /// Why it is not there.
    pub(in crate::panel) error: Option<String>,
    /// Whether it is simulated.
    pub(in crate::panel) simulated: bool,
    /// Rows of a frame.
    pub(in crate::panel) rows: usize,
    /// Columns of a frame.
    pub(in crate::panel) columns: usize,
    /// Bits of a sample.
    pub(in crate::panel) bit_depth: u8,
    /// Exposure, in us.
    pub(in crate::panel) exposure_us: Option<f64>,
    /// Frames per second of the camera.
    pub(in crate::panel) rate_hz: Option<f64>,
    /// Pictures that came in the last second.
    pub(in crate::panel) picture_hz: Option<f64>,
}

/// Light and sharpness of a picture.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct LightState {
    /// Mean, in DN.
    pub(in crate::panel) mean_dn: f64,
    /// The darkest sample, in DN.
    pub(in crate::panel) minimum_dn: u16,
    /// The brightest sample, in DN.
    pub(in crate::panel) maximum_dn: u16,
    /// Full scale, in DN.
    pub(in crate::panel) full_scale_dn: u16,
    /// Pixels.
    pub(in crate::panel) pixels: usize,
    /// Pixels at full scale.
    pub(in crate::panel) saturated: usize,
    /// Pixels at 0.
    pub(in crate::panel) black: usize,
    /// Sharpness; see [`Assessment`](epirig_devices::camera::Assessment).
    pub(in crate::panel) focus: f64,
    /// Its largest value since it was reset.
    pub(in crate::panel) focus_peak: f64,
    /// Mean light of the four corners over that of the centre.
    pub(in crate::panel) corners: Option<f64>,
    /// Levels per bin.
    pub(in crate::panel) bin_width_dn: u32,
    /// Samples in each bin.
    pub(in crate::panel) histogram: Vec<u64>,
}

/// Corners of a chess-board in the picture.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct TargetState {
    /// `board` for the one held by hand, `target` for those on the object.
    #[cfg_attr(test, ts(type = "'board' | 'target'"))]
    pub(in crate::panel) name: &'static str,
    /// Corners of all boards.
    pub(in crate::panel) wanted: usize,
    /// x and y of the corners that were found, in px.
    pub(in crate::panel) corners: Vec<[f64; 2]>,
    /// Whether all were found.
    pub(in crate::panel) complete: bool,
    /// Blur of the edges, in px.
    pub(in crate::panel) blur_px: Option<f64>,
    /// Parts of the picture, each way.
    pub(in crate::panel) coverage_columns: usize,
    /// Parts of the picture, each way.
    pub(in crate::panel) coverage_rows: usize,
    /// Whether corners were seen in each part, row by row.
    pub(in crate::panel) coverage: Vec<bool>,
}

/// The stage.
#[derive(Debug, Clone, Default, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct StageState {
    /// Whether it is there.
    pub(in crate::panel) state: Presence,
    /// Model and port.
    pub(in crate::panel) name: String,
    /// Why it is not there.
    pub(in crate::panel) error: Option<String>,
    /// Whether it is simulated.
    pub(in crate::panel) simulated: bool,
    /// Position, in mm from home; `None` if unknown.
    pub(in crate::panel) position_mm: Option<f64>,
    /// Whether the position is known.
    pub(in crate::panel) homed: bool,
    /// Whether it moves.
    pub(in crate::panel) moving: bool,
    /// Whether a limit switch is closed.
    pub(in crate::panel) at_limit: bool,
    /// Length of the travel, in mm.
    pub(in crate::panel) travel_mm: f64,
    /// First and last position of the plan, in mm.
    pub(in crate::panel) plan_mm: Option<[f64; 2]>,
    /// Sizes of steps for buttons, in mm.
    pub(in crate::panel) steps_mm: Vec<f64>,
    /// How far a slow and a fast jog run on if this program dies, in mm.
    pub(in crate::panel) runs_on_mm: [f64; 2],
}

/// The latest examination.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct DoctorState {
    /// Local time, `hh:mm:ss`.
    pub(in crate::panel) at: String,
    /// Whether checks that need many moves were left out.
    pub(in crate::panel) short: bool,
    /// The checks.
    pub(in crate::panel) checks: Vec<Check>,
    /// Predicted standard uncertainty of the height of a pixel, in mm.
    pub(in crate::panel) predicted_mm: Option<f64>,
}

impl DoctorState {
    pub(in crate::panel) fn of(report: Report, short: bool) -> Self {
        let predicted_mm = report.predicted.map(|predicted| predicted.sigma_height_mm);
        Self { at: clock(), short, checks: report.checks, predicted_mm }
    }
}

/// The kind of a line of the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(in crate::panel) enum LogKind {
    /// Something that happened.
    Note,
    /// Something that a person should know.
    Warning,
    /// Something that failed.
    Error,
}

/// A line of the log.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct LogLine {
    /// Number of the line.
    pub(in crate::panel) number: u64,
    /// Local time, `hh:mm:ss`.
    pub(in crate::panel) at: String,
    /// Its kind.
    pub(in crate::panel) kind: LogKind,
    /// The line.
    pub(in crate::panel) words: String,
}

/// Lines of the log that are kept.
const LINES: usize = 60;

impl RigState {
    /// A part of the rig that is lost, and why.
    pub(in crate::panel) fn lost(&self) -> Option<(&'static str, String)> {
        let why = |error: &Option<String>| error.clone().unwrap_or_default();
        if self.camera.state == Presence::Lost {
            return Some(("camera", why(&self.camera.error)));
        }
        (self.stage.state == Presence::Lost).then(|| ("stage", why(&self.stage.error)))
    }

    /// Adds a line to the log.
    pub(in crate::panel) fn log(&mut self, kind: LogKind, words: impl Into<String>) {
        let number = self.log.last().map_or(0, |last| last.number + 1);
        self.log.push(LogLine { number, at: clock(), kind, words: words.into() });
        let surplus = self.log.len().saturating_sub(LINES);
        self.log.drain(..surplus);
    }
}

/// Local time, `hh:mm:ss`.
fn clock() -> String {
    time().to_zoned(TimeZone::system()).strftime("%H:%M:%S").to_string()
}
