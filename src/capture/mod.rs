//! A scan: move, settle, look, certify, write, next; and going on after whatever interrupted it.
//!
//! One thread has stage and camera, another one compresses and writes. A frame counts with a certificate only; one that fails is
//! taken again, and after a loss of the position (a restart, a pulled cable) the stage is homed, the last good frame taken again
//! and compared. What the journal names stays; [`resume`] goes on from there after any interruption.

mod archive;
mod calibration_frames;
mod closure;
mod error;
mod estimate;
mod motion_watch;
mod pause;
mod plan;
mod records;
mod resume;
mod rig;
mod scan;
mod step;

use std::path::Path;

use epirig_data::sequence::{
    ClosureRecord, FORMAT_VERSION, Origin, Sequence, SequenceRecord, SequenceWriter, new_uid, now,
    refuse_existing,
};
use epirig_data::storage::Disk;
use epirig_devices::camera::{CameraError, Configuration};

pub use error::CaptureError;
pub use estimate::Estimate;
pub use pause::PauseSwitch;
pub use plan::{CaptureLimits, CapturePlan};
pub use resume::resume;
pub use rig::{Arrangement, Assistant, Rig, Unattended};

use calibration_frames::Present;
use records::camera_record;
use scan::Scan;

/// Sets the camera up, homes the stage, takes a frame at each position, homes again, and writes the sequence `out`.
/// Returns what re-homing showed, if that is known.
///
/// # Errors
/// [`CaptureError`]. If a sequence has been begun it is [`CaptureError::Interrupted`] and can be [resumed](resume), or
/// [`CaptureError::NotClosed`] for a scan whose positions turned out to be wrong at its end.
pub fn capture(
    rig: &mut Rig<'_>,
    plan: &CapturePlan,
    out: &Path,
    disk: Box<dyn Disk>,
) -> Result<Option<ClosureRecord>, CaptureError> {
    // Nothing moves for a folder that cannot be used.
    refuse_existing(out)?;
    if !rig.assistant.is_there() {
        calibration_frames::refuse_unattended(plan)?;
    }
    let mut scan = Scan::begin(rig, plan, None)?;
    let record = start_record(&mut scan);
    let writer = SequenceWriter::create_on(disk, out, &record)?;
    let indices: Vec<usize> = (0..record.frames).collect();
    let finished =
        scan.finish(writer, &indices, |scan, archive| scan.calibration_frames(archive, &Present::default()));
    finished.map_err(|error| interrupted(error, out, record.frames))
}

/// How far it came, for whoever resumes; or that a replay will not come further by resuming.
fn interrupted(error: CaptureError, folder: &Path, planned: usize) -> CaptureError {
    if matches!(error, CaptureError::NotClosed { .. }) {
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
    SequenceRecord {
        format: FORMAT_VERSION,
        uid: new_uid(),
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        created: now(),
        origin: Origin::Captured {
            stage: scan.stage.as_ref().map_or_else(String::new, |stage| stage.identity().to_string()),
            camera: scan.camera().identity().to_string(),
            configuration: Some(camera_record(&configuration, plan.averaged)),
            rig: plan.rig.clone(),
            simulator: plan.simulator.clone(),
        },
        rows,
        columns,
        bit_depth: if plan.averaged > 1 { 16 } else { bit_depth },
        frames: plan.positions_mm.len(),
        positions_mm: Some(plan.positions_mm.clone()),
        intrinsics: plan.lens.map(|lens| lens.intrinsics(columns, rows)),
    }
}
