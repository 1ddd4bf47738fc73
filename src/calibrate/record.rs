//! `calibration.json`.

use serde::{Deserialize, Serialize};

use super::{InputHashes, PositionSource};
use epirig_calibration::lens::LensEstimate;
use epirig_calibration::lens::views::LensCalibration;
use epirig_calibration::photometry::{FrameGains, Linearity, Outcome, Photometry};
use epirig_calibration::rectification::{FramePose, Mapping};
use epirig_calibration::stage_axis::{Direction, Outline, PositioningError, TargetScale};
use epirig_calibration::texture_motion::MotionModel;
use epirig_core::statistics::root_mean_square;

/// Version of `calibration.json`.
pub const FORMAT_VERSION: u32 = 4;

/// A calibration: how raw frames become the volume, with uncertainties.
///
/// `mapping` is exact in both directions. A pixel (x, y) of the rectified image is the ray (a, b, 1) = ((x -
/// cx') / f', (y - cy') / f', 1) of its `camera`. The ray is turned back by R = Ry(`pan_rad`) Rz(`roll_rad`):
/// r = R^T (a, b, 1). It is divided by its third coordinate, distorted, and projected by `lens` as in OpenCV,
/// which gives the place in the raw frame. The inverse undoes the distortion (Newton's method) and turns by
/// R. Rz(roll) = [[c, -s, 0], [s, c, 0], [0, 0, 1]], Ry(pan) = [[c, 0, s], [0, 1, 0], [-s, 0, c]]; pixel
/// centres are at integers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// [`FORMAT_VERSION`].
    pub format: u32,
    /// [`hash`](Self::hash) of the rest of the record, to detect changes.
    pub blake3: String,
    /// Version of the program.
    pub program: String,
    /// Uid of the sequence.
    pub sequence_uid: String,
    /// How the scan ended: `complete`, `aborted`, `failed`, `not-closed` (its positions are wrong), or
    /// `unfinished`.
    pub scan_ended: String,
    /// Hashes of the inputs.
    pub inputs: InputHashes,
    /// Dark level, flat field, defective pixels.
    pub photometry: Photometry,
    /// Hashes of the maps of `photometry`.
    pub maps: MapHashes,
    /// Linearity of the sensor's response, if frames at several exposures were given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linearity: Option<Linearity>,
    /// Brightness of every frame.
    pub frame_gains: Outcome<FrameGains>,
    /// The lens.
    pub lens: LensRecord,
    /// Stage axis, if a target was found.
    pub stage_axis: Option<StageAxisRecord>,
    /// The camera's motion by the texture of the frames, if it was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_motion: Option<CameraMotionRecord>,
    /// Position of every frame.
    pub positions: PositionsRecord,
    /// Mapping from raw to rectified pixels and back.
    pub mapping: Mapping,
    /// Notes for the user, a sentence each.
    pub notes: Vec<String>,
    /// Suggested improvements, a sentence each.
    pub needs: Vec<String>,
}

impl Calibration {
    /// Whether the frames are rectified by the motion that their texture tells. Then the rectified frames may have pixels
    /// that not every frame shows.
    pub fn has_motion(&self) -> bool {
        self.camera_motion.as_ref().is_some_and(|motion| motion.is_applied)
    }

    /// Rotation and offset of every frame, in the order of the positions; empty if frames have none.
    pub fn poses(&self) -> Vec<FramePose> {
        self.camera_motion.as_ref().map_or_else(Vec::new, |motion| self.in_order(&motion.poses))
    }

    /// Brightness of every frame relative to a typical one, in the order of the positions, if it is corrected.
    pub fn gains(&self) -> Option<Vec<f64>> {
        self.frame_gains.applied().map(|gains| self.in_order(&gains.gain))
    }

    /// Values of the frames as they were taken, in the order of their positions.
    fn in_order<T: Copy>(&self, values: &[T]) -> Vec<T> {
        match self.positions.order.is_empty() {
            true => values.to_vec(),
            false => self.positions.order.iter().filter_map(|&frame| values.get(frame).copied()).collect(),
        }
    }

    /// The hash of the record, by which results refer to their calibration: BLAKE3 of the record as JSON
    /// without spaces, with `blake3` empty.
    pub fn hash(&self) -> String {
        let unsigned = Self { blake3: String::new(), ..self.clone() };
        // Numbers and text always serialise as JSON.
        let text = serde_json::to_vec(&unsigned).unwrap_or_default();
        epirig_data::storage::hash(&text)
    }
}

/// BLAKE3 of the map files, so that no other map is used by mistake.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapHashes {
    /// Hash of `dark.tiff`, if there is one.
    pub dark: Option<String>,
    /// Hash of `flat-field.tiff`, if there is one.
    pub flat_field: Option<String>,
}

/// Source of a lens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LensSource {
    /// From board frames.
    BoardFrames,
    /// From a file.
    File,
    /// From a data sheet.
    DataSheet,
    /// From the texture of frames that turned by themselves, and from what was known before.
    Texture,
    /// Unknown: rows can be rectified, but there are no heights.
    Unknown,
}

/// The lens and its source.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensRecord {
    /// The source.
    pub source: LensSource,
    /// Name of the file, if the source is a file.
    pub file: Option<String>,
    /// The lens that is applied; refined by the target's tracks, if there are any.
    pub estimate: LensEstimate,
    /// The calibration from the board frames.
    pub board_frames: Option<LensCalibration>,
    /// Number of corners of the whole board; 0 without board frames and in older records.
    #[serde(default)]
    pub corners_of_board: usize,
    /// The frame of each of its views.
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
    /// Blur of the target's edges, the median over its frames, in px (standard deviation); `None` in older records.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blur_px: Option<f64>,
    /// Number of tracked corners.
    pub corners: usize,
    /// Number of corners of the whole target; 0 in older records.
    #[serde(default)]
    pub corners_of_target: usize,
    /// Number of observations used.
    pub observations: usize,
    /// Rejected observations, which contradict the others: frame and corner.
    pub rejected: Vec<(usize, usize)>,
    /// Number of frames that show the target.
    pub frames: usize,
    /// Median disparity of the corners in the rectified image, in px.
    pub disparity_px: f64,
    /// Where each band of the target lies in the rectified frames, which is no surface to be measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub target: Vec<Outline>,
}

/// The camera's motion by the texture of the frames.
///
/// A point with the bearing x = (u, v, 1) and the inverse depth rho is seen in a frame along R(w) (x - rho (s m + d)):
/// m is the direction of motion, s the position, w the frame's rotation and d its offset across m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraMotionRecord {
    /// What was adjusted besides direction and positions.
    pub model: MotionModel,
    /// Whether it could be tested if more is to be adjusted: half of the points must connect all frames.
    pub is_tested: bool,
    /// Rotation about the optical axis, from the raw to the rectified camera, in deg.
    pub roll_deg: f64,
    /// Its standard uncertainty, in deg.
    pub roll_sigma_deg: f64,
    /// Pan after that, in deg.
    pub pan_deg: f64,
    /// Its standard uncertainty, in deg.
    pub pan_sigma_deg: f64,
    /// What would be left of it with the focal length known, in deg.
    pub pan_own_sigma_deg: f64,
    /// Focal length, in px, as it was adjusted or held.
    pub focal_length_px: f64,
    /// Its standard uncertainty, in px; 0 if something else has measured it.
    pub focal_length_sigma_px: f64,
    /// How far a typical point moves over the whole path, in px.
    pub moved_px: f64,
    /// Standard uncertainty of the position of a frame, in px of a typical point. It is large where frames turn by
    /// themselves: a turn to the side moves all points like a step.
    pub position_sigma_px: f64,
    /// Standard uncertainty that the motion brings to all disparities together, in px: a steady turn to the side cannot be told
    /// from a change of all of them. It is not in the sigma of a pixel.
    pub disparity_sigma_px: f64,
    /// What is left of it beside an offset, a slope and a scale of the map, in px: it bends a plane.
    pub bend_sigma_px: f64,
    /// How far rows drift over the whole path in a corner, in px, if roll and pan are not corrected.
    pub drift_px: f64,
    /// Whether the mapping corrects them; a drift that is not significant is left.
    pub is_applied: bool,
    /// Standard uncertainty of the row of a point from frame to frame after rectification, in px.
    pub rows_sigma_px: f64,
    /// Number of points that were followed.
    pub points: usize,
    /// Share of their places that contradict the others.
    pub rejected: f64,
    /// Root mean square of the residuals of the others on either axis, in px.
    pub residual_px: f64,
    /// Rotation and offset of every frame; empty if they are not significant.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub poses: Vec<FramePose>,
}

impl CameraMotionRecord {
    /// Root mean square of the rotations of the frames about the axes of columns, rows and view, in deg.
    pub fn rotation_rms_deg(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| {
            let rotations: Vec<f64> =
                self.poses.iter().map(|pose| pose.rotation_rad[axis].to_degrees()).collect();
            root_mean_square(&rotations)
        })
    }
}

/// Position of every frame on the baseline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionsRecord {
    /// Source of the positions.
    pub source: PositionSource,
    /// Numbers of the frames in the order of their positions; empty if they were taken in this order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<usize>,
    /// tau of every frame in that order: 0 for the first, 1 for the last.
    pub tau: Vec<f64>,
    /// Standard uncertainty of each, relative to the first and the last frame; `None` for positions reported
    /// by the stage.
    pub tau_sigma: Vec<Option<f64>>,
    /// Length of the baseline, in mm, if stage or target give it.
    pub baseline_mm: Option<f64>,
    /// Its standard uncertainty, in mm, if known.
    pub baseline_sigma_mm: Option<f64>,
    /// Positioning error: reported minus measured positions.
    pub positioning_error: Option<PositioningError>,
    /// Scale of the stage compared with the size of the target's squares.
    pub target_scale: Option<TargetScale>,
}
