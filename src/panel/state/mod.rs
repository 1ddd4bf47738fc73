//! What the page is told, as JSON. `web/src/rig/api.ts` has the same as types.

mod rig;
mod scan;

pub(in crate::panel) use rig::{
    CameraState, DoctorState, LightState, LogKind, Presence, RigState, StageState, TargetState, Task,
    TaskKind,
};
pub(in crate::panel) use scan::{Asked, LiveMapState, Retake, ScanPhase, ScanState, Stop};
