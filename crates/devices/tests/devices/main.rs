//! Drivers against simulators, recorded sessions, firmware and lines that lie.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[cfg(unix)]
mod avr;
mod camera_faults;
mod faults;
#[cfg(unix)]
mod firmware;
mod grbl_dialects;
mod grbl_recording;
mod grbl_stage;
mod grbl_trust;
mod leftovers;
mod looking;
mod native_stage;
mod onlooking;
#[cfg(unix)]
mod real_grbl;
mod replayed;
#[cfg(unix)]
mod serial_port;
mod sim_bench;
mod transcripts;
mod zaber_stage;
