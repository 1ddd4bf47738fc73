//! Tests that take minutes: many rigs, many interruptions. `.ci/run` runs them in a short form,
//! `.ci/run full` in full size.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod calibration_statistics;
mod characterised_rigs;
mod error_analysis;
#[cfg(target_os = "linux")]
mod interrupted_writers;
#[path = "../support/known_rig.rs"]
mod known_rig;
#[path = "../support/size.rs"]
mod size;
#[path = "../support/program.rs"]
mod support;
