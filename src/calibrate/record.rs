//! `calibration.json`.

use serde::{Deserialize, Serialize};

use super::{InputHashes, PositionSource};
use epirig_calibration::lens::LensEstimate;
use epirig_calibration::lens::views::LensCalibration;
use epirig_calibration::photometry::{FrameGains, Linearity, Outcome, Photometry};
use epirig_calibration::rectification::Mapping;
use epirig_calibration::stage_axis::{Direction, PositioningError, TargetScale};

/// Version of `calibration.json`.
pub const FORMAT_VERSION: u32 = 4;

/// Everything that a calibration has found: how raw frames become the volume, and how well that is known.
///
/// `mapping` is exact in both directions. A pixel (x, y) of the rectified image is the ray (a, b, 1) = ((x - cx') / f', (y - cy') / f', 1) of its
/// `camera`; turned back by R = Ry(`pan_rad`) Rz(`roll_rad`), r = R^T (a, b, 1), and divided by its third coordinate it is distorted and seen by `lens` as in
/// OpenCV: that is the place in the raw frame. The way back undoes the distortion (Newton) and turns by R. Rz(roll) = [[c, -s, 0], [s, c, 0],
/// [0, 0, 1]], Ry(pan) = [[c, 0, s], [0, 1, 0], [-s, 0, c]]; pixel centres are at integers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// [`FORMAT_VERSION`].
    pub format: u32,
    /// [`hash`](Self::hash) of all the rest, by which a record that was changed is known.
    pub blake3: String,
    /// Version of the program.
    pub program: String,
    /// Uid of the sequence.
    pub sequence_uid: String,
    /// How the scan ended: `complete`, `aborted`, `failed`, `not-closed` (its positions are wrong), or `unfinished`.
    pub scan_ended: String,
    /// What it was made of.
    pub inputs: InputHashes,
    /// Dark level, flat field, bad pixels.
    pub photometry: Photometry,
    /// The maps that belong to that.
    pub maps: MapHashes,
    /// How straight the sensor's response is, if frames at several exposures were given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linearity: Option<Linearity>,
    /// Brightness of every frame.
    pub frame_gains: Outcome<FrameGains>,
    /// The lens.
    pub lens: LensRecord,
    /// Direction of travel, if the target tells it.
    pub stage_axis: Option<StageAxisRecord>,
    /// Where every frame stands.
    pub positions: PositionsRecord,
    /// From raw to rectified pixels and back.
    pub mapping: Mapping,
    /// What a person should know, a sentence each.
    pub notes: Vec<String>,
    /// What would make it better, a sentence each.
    pub needs: Vec<String>,
}

impl Calibration {
    /// The hash that the record carries, and by which results name the calibration that they were made with: BLAKE3 of the record as JSON without spaces,
    /// `blake3` empty.
    pub fn hash(&self) -> String {
        let unsigned = Self { blake3: String::new(), ..self.clone() };
        // Numbers and text always become JSON.
        let text = serde_json::to_vec(&unsigned).unwrap_or_default();
        blake3::hash(&text).to_hex().to_string()
    }
}

/// BLAKE3 of the files of maps, so that no other map is taken for them.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapHashes {
    /// Of `dark.tiff`, if there is one.
    pub dark: Option<String>,
    /// Of `flat-field.tiff`, if there is one.
    pub flat_field: Option<String>,
}

/// Where a lens is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LensSource {
    /// From board frames.
    BoardFrames,
    /// From a file.
    File,
    /// From a data sheet.
    DataSheet,
    /// From nowhere: rows can be made straight, heights cannot be told.
    Unknown,
}

/// The lens and where it is from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensRecord {
    /// Where it is from.
    pub source: LensSource,
    /// Name of the file, if it is from one.
    pub file: Option<String>,
    /// The lens that is applied; refined by the target's tracks, if there are any.
    pub estimate: LensEstimate,
    /// What the board frames have told.
    pub board_frames: Option<LensCalibration>,
    /// The frame that each of its views is from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub board_files: Vec<String>,
}

/// The stage axis and how well the tracks fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageAxisRecord {
    /// The two angles, in rad.
    pub direction: Direction,
    /// Rotation about the optical axis, in deg.
    pub roll_deg: f64,
    /// Its standard deviation, in deg.
    pub roll_sigma_deg: f64,
    /// Pan, in deg.
    pub pan_deg: f64,
    /// Its standard deviation, in deg.
    pub pan_sigma_deg: f64,
    /// Root mean square of the distance of all corners from their rows after rectification, in px.
    pub rows_rms_px: f64,
    /// Standard deviation of a coordinate of a typical corner, in px.
    pub corner_sigma_px: f64,
    /// Corners that were followed.
    pub corners: usize,
    /// Observations that count.
    pub observations: usize,
    /// Observations that contradict the others and do not count: frame and corner.
    pub rejected: Vec<(usize, usize)>,
    /// Frames that show the target.
    pub frames: usize,
    /// Median disparity of the corners in the rectified image, in px.
    pub disparity_px: f64,
}

/// Where every frame stands on the baseline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionsRecord {
    /// Where the positions are from.
    pub source: PositionSource,
    /// tau of every frame: 0 for the first, 1 for the last.
    pub tau: Vec<f64>,
    /// Standard deviation of each as measured, against the first and the last frame; `None` where it is the stage's own.
    pub tau_sigma: Vec<Option<f64>>,
    /// Length of the baseline, in mm, if stage or target tell it.
    pub baseline_mm: Option<f64>,
    /// Its standard deviation, in mm, as far as it is known.
    pub baseline_sigma_mm: Option<f64>,
    /// The stage's report against what was measured.
    pub positioning_error: Option<PositioningError>,
    /// The stage's scale against the size of the target's squares.
    pub target_scale: Option<TargetScale>,
}
