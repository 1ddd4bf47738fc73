//! A scan: move, look, write, next.

mod records;

use std::path::Path;
use std::time::Duration;

use thiserror::Error;

use crate::camera::{self, Camera, CameraError, CameraSettings, Configuration, TakenFrame, average};
use crate::frame::Frame;
use crate::progress::Progress;
use crate::sequence::{
    ExitStatus, FORMAT_VERSION, FrameFacts, Intrinsics, Origin, SequenceError, SequenceRecord,
    SequenceWriter, new_uid, now, refuse_existing,
};
use crate::stage::{Stage, StageError, StopSwitch};

use records::{camera_record, exposure_record};

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
    /// How long the stage swings after a move: exposures begin after that.
    pub settle: Duration,
    /// What the camera is to be.
    pub camera: CameraSettings,
    /// Frames averaged to one of 16 bit at each position; 1 for single frames as they are.
    pub averaged: usize,
    /// How long to wait for a camera that goes in the middle of the scan.
    pub reconnect: Duration,
    /// Lens and pixels, if known.
    pub intrinsics: Option<Intrinsics>,
    /// How the simulated rig was made, if it is one.
    pub twin: Option<serde_json::Value>,
}

impl CapturePlan {
    /// A plan that takes a frame as it is at each position, with a camera set up for measuring.
    pub fn at(positions_mm: Vec<f64>) -> Self {
        Self {
            positions_mm,
            settle: Duration::ZERO,
            camera: CameraSettings::default(),
            averaged: 1,
            reconnect: Duration::from_secs(30),
            intrinsics: None,
            twin: None,
        }
    }
}

/// Sets the camera up, homes the stage, takes a frame at each position and writes the sequence `out`.
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
    // Nothing moves for a folder, or a camera, that cannot be used.
    refuse_existing(out)?;
    let configuration = camera.configure(&plan.camera)?;
    stage.home()?;
    // The first move tells whether the positions can be approached at all; and the camera gets used to what it will see.
    stage.move_to(first_mm)?;
    camera.start()?;
    let record = start_record(stage, camera, plan, &configuration);
    let mut writer = SequenceWriter::create(out, &record)?;
    progress.begin("capturing", plan.positions_mm.len() as u64);
    let taken: Result<(), CaptureError> = plan.positions_mm.iter().try_for_each(|&position_mm| {
        take(stage, camera, plan, &mut writer, position_mm)?;
        progress.advance(1);
        Ok(())
    });
    progress.end();
    let status = match &taken {
        Ok(()) => ExitStatus::Complete,
        Err(CaptureError::Stage(StageError::Stopped { .. })) => ExitStatus::Aborted,
        Err(_) => ExitStatus::Failed,
    };
    let finished = writer.finish(status);
    taken?;
    finished?;
    Ok(camera.stop()?)
}

fn start_record(
    stage: &dyn Stage,
    camera: &dyn Camera,
    plan: &CapturePlan,
    configuration: &Configuration,
) -> SequenceRecord {
    SequenceRecord {
        format: FORMAT_VERSION,
        uid: new_uid(),
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        created: now(),
        origin: Origin::Captured {
            stage: stage.identity().to_string(),
            camera: camera.identity().to_string(),
            configuration: Some(camera_record(configuration, plan.averaged)),
            twin: plan.twin.clone(),
        },
        rows: configuration.rows,
        columns: configuration.columns,
        bit_depth: if plan.averaged > 1 { 16 } else { configuration.bit_depth },
        frames: plan.positions_mm.len(),
        positions_mm: Some(plan.positions_mm.clone()),
        intrinsics: plan.intrinsics,
    }
}

fn take(
    stage: &mut dyn Stage,
    camera: &mut dyn Camera,
    plan: &CapturePlan,
    writer: &mut SequenceWriter,
    position_mm: f64,
) -> Result<(), CaptureError> {
    stage.move_to(position_mm)?;
    let reported_mm = stage.position_mm()?;
    let stop = stage.stop_switch();
    let (frame, exposures) = match look(camera, plan, &stop) {
        Err(CameraError::Gone { .. }) => {
            wait_for(camera, plan.reconnect, &stop).and_then(|()| look(camera, plan, &stop))
        }
        looked => looked,
    }
    .map_err(|error| match error {
        CameraError::Interrupted { .. } => StageError::Stopped { position_mm: Some(reported_mm) }.into(),
        other => CaptureError::Camera(other),
    })?;
    let facts = FrameFacts {
        commanded_mm: Some(position_mm),
        reported_mm: Some(reported_mm),
        camera_sequence: exposures.last().map(|exposure| exposure.sequence),
        exposure: exposure_record(&exposures),
        source: None,
    };
    Ok(writer.add(&frame, facts)?)
}

/// Waits for a camera that has gone, as long as nobody stops it.
fn wait_for(camera: &mut dyn Camera, patience: Duration, stop: &StopSwitch) -> Result<(), CameraError> {
    /// How long a person who stops it waits, at most.
    const SLICE: Duration = Duration::from_secs(1);
    let until = camera.now().after(patience);
    loop {
        let left = until.since(camera.now());
        match camera.reconnect(SLICE.min(left)) {
            Err(CameraError::StaysAway { camera, .. }) if stop.pressed().is_some() => {
                return Err(CameraError::Interrupted { camera });
            }
            Err(CameraError::StaysAway { .. }) if left > SLICE => {}
            Err(CameraError::StaysAway { camera, why, .. }) => {
                return Err(CameraError::StaysAway { camera, patience, why });
            }
            done => return done,
        }
    }
}

/// A frame of what is there now, once the stage has come to rest.
fn look(
    camera: &mut dyn Camera,
    plan: &CapturePlan,
    stop: &StopSwitch,
) -> Result<(Frame, Vec<camera::FrameFacts>), CameraError> {
    let at_rest = camera.now().after(plan.settle);
    if plan.averaged > 1 {
        let averaged = average(camera, at_rest, plan.averaged, &|| stop.pressed().is_none())?;
        return Ok((averaged.frame, averaged.facts));
    }
    let TakenFrame { frame, facts } = camera.grab_after(at_rest)?;
    Ok((frame, vec![facts]))
}
