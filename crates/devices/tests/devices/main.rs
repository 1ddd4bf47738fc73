//! Drivers against simulators, recorded sessions, firmware and lines that lie.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[cfg(feature = "serial")]
mod avr;
mod camera_faults;
mod faults;
#[cfg(feature = "serial")]
mod firmware;
mod grbl_dialects;
mod grbl_recording;
mod grbl_stage;
mod grbl_trust;
mod leftovers;
mod looking;
mod native_stage;
mod onlooking;
#[cfg(feature = "serial")]
mod real_grbl;
mod replayed;
#[cfg(feature = "serial")]
mod serial_port;
mod sim_bench;
mod transcripts;
mod zaber_stage;
