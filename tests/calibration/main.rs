//! What a calibration promises on the simulated rig.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod calibration;
mod calibration_frames;
#[path = "../support/known_rig.rs"]
mod known_rig;
#[path = "../support/program.rs"]
mod support;
