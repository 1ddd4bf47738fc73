//! Calibration: measures the properties of a rig from the frames of a sequence and its calibration frames.
//!
//! Each step uses the frames that exist, and reports its result or what it lacks:
//! [`photometry`](epirig_calibration::photometry) from dark and flat frames,
//! [`lens`](epirig_calibration::lens) from board frames or prior knowledge,
//! [`stage_axis`](epirig_calibration::stage_axis) and the position of every frame from the target on the
//! object (or positions from its texture). The [`Mapping`](epirig_calibration::rectification::Mapping)
//! combines them for rectification. [`Calibration`] is the record; [`load_calibrated`] applies it.

mod apply;
mod boards;
mod contradiction;
mod error;
mod find;
mod folder;
mod frames;
mod held;
mod inputs;
mod lens;
mod matched;
mod plan;
mod positions;
mod record;
mod rectified_frames;
mod remarks;
mod stage_axis;
mod texture;
mod told_twice;

pub use apply::rectifier;
pub use error::CalibrateError;
pub use find::{Calibrated, calibrate};
pub use folder::{
    CALIBRATION, CalibrationFolder, calibration_pictures, has_calibration, read_calibration,
    read_calibration_file, read_calibration_picture,
};
pub use frames::frames_in_order;
pub use inputs::InputHashes;
pub use matched::{MatchedFrames, load_calibrated, matched_shape};
pub use plan::{CalibrationPlan, LensKnowledge, PositionSource};
pub use record::{
    Calibration, CameraMotionRecord, FORMAT_VERSION, LensRecord, LensSource, MapHashes, PositionsRecord,
    StageAxisRecord,
};
pub(crate) use remarks::some_of;
