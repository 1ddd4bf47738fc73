//! What a sequence's records hold.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Version of the records that this program writes and reads.
pub const FORMAT_VERSION: u32 = 1;

/// Where the frames come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Origin {
    /// Taken by this program with a stage and a camera.
    Captured {
        /// What the stage said it is.
        stage: String,
        /// What the camera said it is.
        camera: String,
        /// What the camera was set to, read back.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        configuration: Option<CameraRecord>,
        /// How the simulated rig was made, if it was simulated.
        #[serde(skip_serializing_if = "Option::is_none")]
        twin: Option<serde_json::Value>,
    },
    /// Taken by other software.
    Imported {
        /// The folder that held the images.
        folder: String,
        /// What was done to the images to make frames of them, one sentence each.
        conversions: Vec<String>,
    },
}

/// What a camera was set to, as its driver told it.
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
    /// How that is known: `start-of-exposure`, `end-of-frame` or `counted`.
    pub timing: String,
    /// The driver's time stamp.
    pub stamp_ns: u64,
    /// When the frame was taken from the driver's queue.
    pub received_ns: u64,
    /// The driver's flags.
    pub flags: u32,
    /// Frames that were passed over because they were begun too early.
    pub stale: usize,
    /// Frames that were passed over because they were damaged.
    pub damaged: usize,
    /// Frames that the driver lost meanwhile.
    pub missed: u32,
    /// Frames that were passed over because they did not show what the one before showed.
    pub unsteady: usize,
    /// How often the camera had to be set up anew.
    pub restarts: usize,
    /// Typical difference from the frame before, in DN.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub difference_dn: Option<f64>,
}

/// What is known of the lens and the pixels.
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
}

/// `sequence.json`: what was known before the first frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SequenceRecord {
    /// [`FORMAT_VERSION`].
    pub format: u32,
    /// A name that never comes twice.
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
    /// Position of each planned frame, in mm; `None` where only their order is known and they count as equidistant.
    pub positions_mm: Option<Vec<f64>>,
    /// Lens and pixels, if known.
    pub intrinsics: Option<Intrinsics>,
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
    /// When the frame was written, as in RFC 3339.
    pub written: String,
    /// Mean intensity, in DN.
    pub mean_dn: f64,
    /// Samples at full scale.
    pub saturated: usize,
    /// File that the frame was made of, if it was imported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

/// A line of `journal.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "event")]
pub enum Event {
    /// A frame was written.
    Frame(FrameRecord),
}

/// How a sequence ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExitStatus {
    /// All planned frames are there.
    Complete,
    /// A person stopped it.
    Aborted,
    /// Something went wrong.
    Failed,
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
    /// When, as in RFC 3339.
    pub stopped: String,
}
