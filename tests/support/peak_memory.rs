//! The peak of a process's memory while it matches a hundred frames.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

#[path = "scans.rs"]
mod scans;

use std::sync::Arc;

use epirig::capture::{CapturePlan, PauseSwitch};
use epirig::epi::MatchOptions;
use epirig::measure::{View, measure};
use epirig::progress::Silent;
use epirig::results::ResultsFolder;
use epirig::sequence::{RealDisk, Sequence};
use epirig::twin::{Twin, TwinConfig};

/// Peak of this process's resident memory in bytes, as the kernel counts it.
fn peak_bytes() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<usize>().ok()? * 1024)
}

/// Matches the tile's frames of 1024 x 1024 px and checks that this takes at most three times their bytes. To be the only test of its program: another one's memory would count.
pub fn assert_three_times_the_frames(test: &str, options: &MatchOptions) {
    if peak_bytes().is_none() {
        eprintln!("SKIPPED {test}: this system does not tell a process its peak memory");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let twin = Arc::new(Twin::new(TwinConfig::tile(1024, 100)).unwrap());
    let plan = CapturePlan::at(twin.config().scan.positions_mm());
    let path = folder.path().join("tile");
    scans::scan(&twin, &plan, &path, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    let sequence = Sequence::open(&path).unwrap();
    let results = ResultsFolder::create(&path.join("results"), false).unwrap();
    measure(&sequence, None, options, View::default(), &results, &Silent).unwrap();
    results.commit().unwrap();
    let ratio = peak_bytes().unwrap() as f64 / (1024.0 * 1024.0 * 100.0);
    println!("peak memory is {ratio:.2} times the frames' bytes");
    assert!(ratio <= 3.0, "{ratio}");
}
