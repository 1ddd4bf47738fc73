//! A scan: move, look, write, next.

use std::path::Path;

use thiserror::Error;

use crate::camera::{Camera, CameraError};
use crate::progress::Progress;
use crate::sequence::{
    ExitStatus, FORMAT_VERSION, FrameFacts, Intrinsics, Origin, SequenceError, SequenceRecord,
    SequenceWriter, new_uid, now, refuse_existing,
};
use crate::stage::{Stage, StageError};

/// Why a scan stopped.
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
}

/// What a scan is to do and what is known of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct CapturePlan {
    /// Where to take frames, in mm from home.
    pub positions_mm: Vec<f64>,
    /// Lens and pixels, if known.
    pub intrinsics: Option<Intrinsics>,
    /// How the simulated rig was made, if it is one.
    pub twin: Option<serde_json::Value>,
}

/// Homes the stage, takes a frame at each position and writes the sequence `out`.
///
/// # Errors
/// [`CaptureError`]; the frames taken until then stay, with a final record that says so.
pub fn capture(
    stage: &mut dyn Stage,
    camera: &mut dyn Camera,
    plan: &CapturePlan,
    out: &Path,
    progress: &dyn Progress,
) -> Result<(), CaptureError> {
    let Some(&first_mm) = plan.positions_mm.first().filter(|_| plan.positions_mm.len() > 1) else {
        return Err(CaptureError::EmptyPlan(plan.positions_mm.len()));
    };
    // Nothing moves for a folder that cannot be used.
    refuse_existing(out)?;
    stage.home()?;
    stage.move_to(first_mm)?;
    // A look before the scan tells the format of the frames.
    let frame = camera.grab()?.frame;
    let record = SequenceRecord {
        format: FORMAT_VERSION,
        uid: new_uid(),
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        created: now(),
        origin: Origin::Captured {
            stage: stage.identity().to_string(),
            camera: camera.identity(),
            twin: plan.twin.clone(),
        },
        rows: frame.rows(),
        columns: frame.columns(),
        bit_depth: frame.bit_depth(),
        frames: plan.positions_mm.len(),
        positions_mm: Some(plan.positions_mm.clone()),
        intrinsics: plan.intrinsics,
    };
    let mut writer = SequenceWriter::create(out, &record)?;
    progress.begin("capturing", plan.positions_mm.len() as u64);
    let taken: Result<(), CaptureError> = plan.positions_mm.iter().try_for_each(|&position_mm| {
        take(stage, camera, &mut writer, position_mm)?;
        progress.advance(1);
        Ok(())
    });
    progress.end();
    let status = if taken.is_ok() { ExitStatus::Complete } else { ExitStatus::Failed };
    let finished = writer.finish(status);
    taken?;
    Ok(finished?)
}

fn take(
    stage: &mut dyn Stage,
    camera: &mut dyn Camera,
    writer: &mut SequenceWriter,
    position_mm: f64,
) -> Result<(), CaptureError> {
    stage.move_to(position_mm)?;
    let reported_mm = stage.position_mm()?;
    let taken = camera.grab()?;
    let facts = FrameFacts {
        commanded_mm: Some(position_mm),
        reported_mm: Some(reported_mm),
        camera_sequence: Some(taken.sequence),
        source: None,
    };
    Ok(writer.add(&taken.frame, facts)?)
}
