//! The records of a sequence.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::clock::{new_uid, now};
use epirig_core::choice::Choice as _;

/// Version of the records that this program writes and reads.
pub const FORMAT_VERSION: u32 = 4;

/// Where the frames come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Origin {
    /// Taken by this program with a stage and a camera.
    Captured {
        /// The stage's identity, as it says.
        stage: String,
        /// Settings of the stage that decide where its positions are, by their names in its dialect; empty if
        /// it has none.
        stage_settings: BTreeMap<String, f64>,
        /// The camera's identity, as it says.
        camera: String,
        /// The camera's settings, read back.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        configuration: Option<CameraRecord>,
        /// The limits that the scan was begun with.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        limits: Option<LimitsRecord>,
        /// The rig's profile and plan, as far as the program knows how to connect to it again.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rig: Option<serde_json::Value>,
        /// How the simulated rig was made, if it was simulated.
        #[serde(skip_serializing_if = "Option::is_none")]
        simulator: Option<serde_json::Value>,
    },
    /// Taken by other software.
    Imported {
        /// The folder or the video that held the images, or the first that was named.
        folder: String,
        /// Conversions of the images, one sentence each.
        conversions: Vec<String>,
        /// What looked wrong in the frames, one sentence each.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        findings: Vec<String>,
        /// The folders that held calibration images, by the sequence's own folder for them.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        calibration_folders: BTreeMap<String, String>,
        /// Lens and targets as the person stated them, as a profile; its stage, camera and plan have no
        /// meaning.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rig: Option<serde_json::Value>,
    },
    /// Corrected and rectified frames of another sequence. A sample of 32768 is one level above full scale of
    /// the original.
    Rectified {
        /// The folder of that sequence.
        folder: String,
        /// Its uid.
        sequence_uid: String,
        /// BLAKE3 of the calibration that was applied.
        calibration: String,
        /// Size of a sample of 1 in the original frames, in DN.
        dn_per_sample: f64,
        /// Bits of the original frames, in whose DN these are matched.
        original_bit_depth: u8,
        /// Relative standard uncertainty of the focal length, if it is known.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        focal_length_sigma: Option<f64>,
        /// Relative standard uncertainty of the length of the baseline, if it is known.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        baseline_sigma: Option<f64>,
    },
}

impl Origin {
    /// The profile that was recorded with the frames, if one was.
    pub fn rig(&self) -> Option<&serde_json::Value> {
        match self {
            Self::Captured { rig, .. } | Self::Imported { rig, .. } => rig.as_ref(),
            // The rig's lens is not that of rectified frames.
            Self::Rectified { .. } => None,
        }
    }

    /// Bits of the frames before they were rectified, if they were.
    pub fn original_bit_depth(&self) -> Option<u8> {
        if let Self::Rectified { original_bit_depth, .. } = self { Some(*original_bit_depth) } else { None }
    }

    /// The limits that a scan was begun with, if they were recorded.
    pub fn limits(&self) -> Option<LimitsRecord> {
        if let Self::Captured { limits, .. } = self { *limits } else { None }
    }
}

/// The limits of a scan, by which its records are judged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LimitsRecord {
    /// How far readings of the stage may be from where it was sent, in mm.
    pub position_mm: f64,
    /// How far the picture may have moved where a stop is taken again, in px.
    pub shift_px: f64,
}

/// The settings of a camera, as its driver reports them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraRecord {
    /// Code of the pixel format.
    pub format: String,
    /// Columns of its images; twice those of a frame for a colour mosaic.
    pub columns: usize,
    /// Rows of its images.
    pub rows: usize,
    /// Frames per second, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Exposure time, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_us: Option<f64>,
    /// Watched controls and their values.
    pub controls: BTreeMap<String, i64>,
    /// Frames that are averaged to one.
    pub averaged: usize,
}

/// How a frame was taken. Times are in ns of the camera's clock, `CLOCK_MONOTONIC` for real cameras.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExposureRecord {
    /// The stage was at rest from here on: the exposure had to begin later.
    pub requested_ns: u64,
    /// When it began, at the earliest.
    pub exposure_start_ns: u64,
    /// The source of that time: `start-of-exposure`, `end-of-frame` or `counted`.
    pub timing: String,
    /// The driver's time stamp.
    pub stamp_ns: u64,
    /// When the frame was taken from the driver's queue.
    pub received_ns: u64,
    /// The driver's flags.
    pub flags: u32,
    /// Frames that were passed over because they differed from the one before.
    pub stale: usize,
    /// Frames that were passed over because they were damaged.
    pub damaged: usize,
    /// Frames that the driver lost meanwhile.
    pub missed: u32,
    /// Frames that were passed over because they did not show what the one before showed.
    pub unsteady: usize,
    /// Number of times the camera was set up anew.
    pub restarts: usize,
    /// Typical difference from the frame before, in DN.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub difference_dn: Option<f64>,
}

/// The certificate of a frame: the checks besides those of [`ExposureRecord`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CertificateRecord {
    /// Which attempt this frame comes from, from 1.
    pub attempt: usize,
    /// Positions that the stage reported before and after the exposure, in mm.
    pub readings_mm: [f64; 2],
    /// Tolerance of the readings against the commanded position, in mm.
    pub position_tolerance_mm: f64,
    /// Time that the stage was given to come to rest (mechanical settling), in ms; the exposure began later.
    pub settle_ms: f64,
    /// Number of watched controls that still had their setting after the exposure.
    pub controls_as_set: usize,
    /// Share of the samples at full scale, 0 to 1, ...
    pub saturated_share: f64,
    /// ... and its limit.
    pub saturated_limit: f64,
}

/// The lens and the pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Intrinsics {
    /// Focal length, in px.
    pub focal_length_px: f64,
    /// Principal point, column.
    pub principal_point_x_px: f64,
    /// Principal point, row.
    pub principal_point_y_px: f64,
}

impl Intrinsics {
    /// With the principal point in the middle of an image of `columns` x `rows`.
    pub fn centred(focal_length_px: f64, columns: usize, rows: usize) -> Self {
        let middle = |size: usize| 0.5 * (size as f64 - 1.0);
        Self { focal_length_px, principal_point_x_px: middle(columns), principal_point_y_px: middle(rows) }
    }

    /// The first value that cannot be of a camera with images of `rows` x `columns`; `None` if all can. The
    /// view is narrower than 179.9 deg and wider than a second of arc, and the axis meets the image plane
    /// within a hundred images from the middle.
    pub fn impossible(&self, rows: usize, columns: usize) -> Option<String> {
        let size = rows.max(columns) as f64;
        let length_px = self.focal_length_px;
        if !(1e-3 * size..=1e6 * size).contains(&length_px) {
            return Some(format!("a focal length of {length_px} px cannot be"));
        }
        let point = [self.principal_point_x_px, self.principal_point_y_px];
        let far = point.iter().any(|place_px| !place_px.is_finite() || place_px.abs() > 100.0 * size);
        far.then(|| format!("a principal point of {}, {} px cannot be", point[0], point[1]))
    }
}

/// `sequence.json`: the start record, written before the first frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SequenceRecord {
    /// [`FORMAT_VERSION`].
    pub format: u32,
    /// A name that never comes twice: a UUID.
    pub uid: String,
    /// Version of the program.
    pub program: String,
    /// When the record was made, as in RFC 3339.
    pub created: String,
    /// Where the frames come from.
    pub origin: Origin,
    /// Rows of a frame.
    pub rows: usize,
    /// Columns of a frame.
    pub columns: usize,
    /// Bits of a sample.
    pub bit_depth: u8,
    /// Number of frames planned.
    pub frames: usize,
    /// Position of each planned frame, in mm; `None` where only their order is known and they count as
    /// equidistant.
    pub positions_mm: Option<Vec<f64>>,
    /// Lens and pixels, if known.
    pub intrinsics: Option<Intrinsics>,
}

impl SequenceRecord {
    /// The record of so many frames of `rows` x `columns`, made now; positions and lens are not known.
    pub fn new(origin: Origin, (rows, columns): (usize, usize), bit_depth: u8, frames: usize) -> Self {
        Self {
            format: FORMAT_VERSION,
            uid: new_uid(),
            program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
            created: now(),
            origin,
            rows,
            columns,
            bit_depth,
            frames,
            positions_mm: None,
            intrinsics: None,
        }
    }
}

/// One frame in the journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameRecord {
    /// Index of the frame, from 0.
    pub index: usize,
    /// File in the sequence's folder, with `/` between names.
    pub file: String,
    /// BLAKE3 of the file's bytes, in hexadecimal.
    pub blake3: String,
    /// Size of the file.
    pub bytes: u64,
    /// Position that was asked for, in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub commanded_mm: Option<f64>,
    /// Position that the stage reported, in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reported_mm: Option<f64>,
    /// The camera's own count of frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera_sequence: Option<u32>,
    /// How it was taken; of the last of averaged frames, with the counts of all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure: Option<ExposureRecord>,
    /// Why it is good.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certificate: Option<CertificateRecord>,
    /// Whether it takes the place of an earlier frame of this index, whose file was damaged later.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub supersedes: bool,
    /// When the frame was written, as in RFC 3339.
    pub written: String,
    /// Mean intensity, in DN.
    pub mean_dn: f64,
    /// Samples at full scale.
    pub saturated: usize,
    /// File that the frame was made of, if it was imported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// When the camera of an imported frame took it, by its own clock: ISO 8601 without a zone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taken: Option<String>,
}

epirig_core::choices! {
    /// The subject of a frame; its name is that of the folder of such frames in a sequence.
    pub enum FrameKind {
        /// The object, at a position of the plan.
        Scan = "frames",
        /// No light.
        Dark = "dark",
        /// A uniform target.
        Flat = "flat",
        /// A chess-board that is held before the camera, in another pose in each frame.
        Board = "board",
    }
}

impl FrameKind {
    /// The calibration frames, in the order in which they are taken; a scan can do without them.
    pub const CALIBRATION: [Self; 3] = [Self::Dark, Self::Flat, Self::Board];

    /// The folder of such frames in a sequence.
    pub fn folder(self) -> &'static str {
        self.name()
    }

    /// The file of frame `index` in a sequence.
    pub fn file(self, index: usize) -> String {
        format!("{self}/{index:04}.png")
    }
}

/// An attempt at a frame that failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RetakeRecord {
    /// Index of the frame.
    pub index: usize,
    /// Which attempt it was, from 1.
    pub attempt: usize,
    /// Why it is not good.
    pub reason: String,
    /// When, as in RFC 3339.
    pub at: String,
}

/// Comparison of a frame's picture with that of an earlier frame of the same place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ComparisonRecord {
    /// Index of the earlier frame.
    pub frame: usize,
    /// How far the contents have moved towards higher columns, in px.
    pub x_px: f64,
    /// How far they have moved towards higher rows, in px.
    pub y_px: f64,
    /// Standard deviation of both, in px.
    pub sigma_px: f64,
    /// Ratio of the light: later over earlier.
    pub light: f64,
}

/// A scan that goes on after its position had been lost: by an interruption, or with stage or camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResumedRecord {
    /// The event before.
    pub after: String,
    /// Where homing found home, in mm by the count kept until then, if the stage can tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub home_shift_mm: Option<f64>,
    /// The last good frame, taken again: `None` if there was none, or it shows too little to be compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub comparison: Option<ComparisonRecord>,
    /// How far readings of the stage may be from where it was sent from here on, in mm; `None`: as before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_tolerance_mm: Option<f64>,
    /// When, as in RFC 3339.
    pub at: String,
}

/// A line of `journal.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "event")]
pub enum Event {
    /// A frame was written.
    Frame(FrameRecord),
    /// A dark frame was written.
    Dark(FrameRecord),
    /// A frame of a uniform target was written.
    Flat(FrameRecord),
    /// A frame of a chess-board in a hand was written.
    Board(FrameRecord),
    /// A frame was not good and is taken again.
    Retake(RetakeRecord),
    /// The scan goes on.
    Resumed(ResumedRecord),
}

impl Event {
    /// The frame that was written, if any, and its subject.
    pub fn frame(&self) -> Option<(FrameKind, &FrameRecord)> {
        match self {
            Self::Frame(frame) => Some((FrameKind::Scan, frame)),
            Self::Dark(frame) => Some((FrameKind::Dark, frame)),
            Self::Flat(frame) => Some((FrameKind::Flat, frame)),
            Self::Board(frame) => Some((FrameKind::Board, frame)),
            _ => None,
        }
    }
}

epirig_core::choices! {
    /// How a sequence ended.
    pub enum ExitStatus {
        /// All planned frames are there.
        Complete = "complete",
        /// A person stopped it.
        Aborted = "aborted",
        /// Something went wrong.
        Failed = "failed",
        /// The position was lost during the scan, unnoticed: frames may not stand where their positions say.
        NotClosed = "not-closed",
    }
}

/// The closure: whether the rig was the same at the end as at the beginning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClosureRecord {
    /// Position at which homing at the end found home, in mm by the count kept until then: steps lost or
    /// gained. `None` if the stage cannot tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub home_shift_mm: Option<f64>,
    /// The first frame, taken again before that. `None` if it shows too little to be compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub comparison: Option<ComparisonRecord>,
}

/// Where the time of a scan went, by the camera's clock, in s. Of a scan that was resumed: of its last part.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct TimesRecord {
    /// From the first homing to the last, when the scan is closed.
    pub total_s: f64,
    /// The stage's motions, until it reported to be there.
    pub moving_s: f64,
    /// Waiting for it to come to rest, as planned.
    pub settling_s: f64,
    /// From then until the camera had delivered a frame that counts.
    pub exposing_s: f64,
}

impl TimesRecord {
    /// The whole time over the time that stage and camera need: 1 for a program that never makes them wait.
    /// `None` if nothing was done.
    pub fn overhead(&self) -> Option<f64> {
        let needed_s = self.moving_s + self.settling_s + self.exposing_s;
        (needed_s > 0.0).then(|| self.total_s / needed_s)
    }
}

/// `stop.json`: how it ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StopRecord {
    /// [`FORMAT_VERSION`].
    pub format: u32,
    /// How it ended.
    pub exit_status: ExitStatus,
    /// Frames in the journal.
    pub frames: usize,
    /// Why it ended before it was complete.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Findings of re-homing and of the first frame, taken again, at the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closure: Option<ClosureRecord>,
    /// Where the time went.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<TimesRecord>,
    /// When, as in RFC 3339.
    pub stopped: String,
}
