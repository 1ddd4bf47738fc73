//! Scans under faults: what is captured is right, or the scan says what went wrong.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod bench;
mod disturbed_scans;
mod faulty_rig;
mod interrupted_scans;
mod panel;
/// The driver of the guide, which no table of the library knows.
#[path = "../../examples/plain_stage/plain.rs"]
mod plain;
mod scan_fault_list;
mod scan_faults;
mod scan_outcome;
#[path = "../support/scans.rs"]
mod scans;
mod stage_settings;
