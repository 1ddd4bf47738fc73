//! What the page is told of the rig and a scan, as JSON.

mod rig;
mod scan;

pub(in crate::panel) use rig::{
    CameraState, DoctorState, LightState, LogKind, Presence, RigState, StageState, TargetState, Task,
    TaskKind,
};
pub(in crate::panel) use scan::{Asked, LiveMapState, Retake, ScanPhase, ScanState, Stop};
