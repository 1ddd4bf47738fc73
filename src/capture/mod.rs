//! The scan: move, settle, take a frame, certify, write; and resuming after an interruption.
//!
//! One thread controls stage and camera, another compresses and writes. Only a frame with a certificate
//! counts; a frame that fails is taken again. After a loss of the position (a restart, a disconnected cable)
//! the stage is homed, and the last good frame is taken again and compared. Frames in the journal are kept:
//! [`resume`] continues from them after any interruption.

mod archive;
mod calibration_frames;
mod closure;
mod error;
mod estimate;
mod homing;
mod motion_watch;
mod pause;
mod plan;
mod records;
mod recovery;
mod resume;
mod rig;
mod scan;
mod settings;
mod step;
mod trust;
mod watch;

use std::path::Path;

use epirig_data::sequence::{
    ClosureRecord, LimitsRecord, Origin, Sequence, SequenceError, SequenceRecord, SequenceWriter,
    refuse_existing,
};
use epirig_data::storage::Disk;
use epirig_devices::camera::{CameraError, Configuration};

pub use error::CaptureError;
pub use estimate::Estimate;
pub use pause::PauseSwitch;
pub use plan::CapturePlan;
pub use resume::resume;
pub use rig::{Arrangement, Assistant, Rig, Unattended};
pub use settings::ChangedSetting;
pub use watch::{Awaited, ScanWatcher, Unwatched};

use calibration_frames::Present;
use records::camera_record;
use scan::Scan;

/// Sets up the camera, homes the stage, takes a frame at each position, homes again, and writes the sequence
/// `out`. Returns the result of homing again, if it is known.
///
/// # Errors
/// [`CaptureError`]. Once the sequence has been started the error is [`CaptureError::Interrupted`], and it
/// can be [resumed](resume); or [`CaptureError::NotClosed`] if the positions turn out to be wrong at the end.
pub fn capture(
    rig: &mut Rig<'_>,
    plan: &CapturePlan,
    out: &Path,
    disk: Box<dyn Disk>,
) -> Result<Option<ClosureRecord>, CaptureError> {
    // The folder is checked before anything moves.
    refuse_existing(out)?;
    if !rig.assistant.is_there() {
        calibration_frames::refuse_unattended(plan)?;
    }
    let mut scan = Scan::begin(rig, plan, None)?;
    let record = start_record(&mut scan);
    let writer = SequenceWriter::create_on(disk, out, &record)?;
    let folder = writer.folder();
    let indices: Vec<usize> = (0..record.frames).collect();
    let finished =
        scan.finish(writer, &indices, |scan, archive| scan.calibration_frames(archive, &Present::default()));
    finished.map_err(|error| interrupted(error, &folder.whereabouts_or_name(), record.frames))
}

/// Adds the number of frames to the error, and how to resume; or that a replay cannot be resumed.
fn interrupted(error: CaptureError, folder: &Path, planned: usize) -> CaptureError {
    // These say themselves what there is and what to do.
    if matches!(
        error,
        CaptureError::NotClosed { .. }
            | CaptureError::Sequence(SequenceError::Disturbed { .. } | SequenceError::Renamed { .. })
    ) {
        return error;
    }
    let done = Sequence::open(folder).map_or(0, |sequence| sequence.frames().len());
    let (folder, source) = (folder.to_owned(), Box::new(error));
    match source.cause() {
        CaptureError::Camera(CameraError::Sequence(_) | CameraError::Exhausted { .. }) => {
            CaptureError::ReplayEnded { folder, done, planned, source }
        }
        _ => CaptureError::Interrupted { folder, done, planned, source },
    }
}

fn start_record(scan: &mut Scan<'_, '_>) -> SequenceRecord {
    let (plan, configuration) = (scan.plan, scan.configuration.clone());
    let Configuration { rows, columns, bit_depth, .. } = configuration;
    let origin = Origin::Captured {
        stage: scan.stage.as_ref().map_or_else(String::new, |stage| stage.identity().to_string()),
        stage_settings: scan.settings.clone(),
        camera: scan.camera().identity().to_string(),
        configuration: Some(camera_record(&configuration, plan.section.average)),
        limits: Some(LimitsRecord { position_mm: plan.limits.position_mm, shift_px: plan.limits.shift_px }),
        rig: plan.rig.clone(),
        simulator: plan.simulator.clone(),
    };
    let bit_depth = if plan.section.average > 1 { 16 } else { bit_depth };
    SequenceRecord {
        positions_mm: Some(plan.positions_mm.clone()),
        intrinsics: plan.lens.map(|lens| lens.intrinsics(columns, rows)),
        ..SequenceRecord::new(origin, (rows, columns), bit_depth, plan.positions_mm.len())
    }
}
