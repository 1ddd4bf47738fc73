//! The program as a person meets it.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod bad_input;
#[cfg(unix)]
mod bands;
mod calibrate_command;
mod camera_commands;
mod characterise;
mod command_line;
mod compare;
mod dark_frames;
#[cfg(unix)]
mod first_hour;
#[path = "../../fuzz/fuzz_targets/folder.rs"]
mod folder;
mod fuzz_seeds;
#[cfg(unix)]
mod hostile_files;
mod import_focal_length;
mod import_motion;
mod import_sources;
mod import_times;
mod independent_readers;
mod independent_roughness;
#[cfg(unix)]
mod killed_scans;
mod logging;
mod manual;
mod masked_match;
mod measure_photographs;
mod packed;
#[path = "../../crates/matcher/tests/promises/painted/mod.rs"]
mod painted;
mod panel;
mod panel_sequences;
mod pixel_locking;
#[path = "../../crates/matcher/tests/promises/promises.rs"]
mod promises;
mod real_frames;
mod report;
mod rig_profiles;
mod scale;
#[path = "../support/scans.rs"]
mod scans;
mod screens;
mod scripted_faults;
#[path = "../support/size.rs"]
mod size;
mod small_rig;
mod split_half;
#[cfg(unix)]
mod stage_commands;
#[path = "../support/program.rs"]
mod support;
mod surface;
#[cfg(target_os = "linux")]
mod system_limits;
mod trend;
mod verdicts;
mod view;
