//! A match needs little more memory than the frames themselves, whichever way it goes.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "support/scans.rs"]
mod scans;

use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use epirig::capture::{CapturePlan, PauseSwitch};
use epirig::pipeline::{View, measure};
use epirig::results::{Region, ResultsFolder, ResultsKind};
use epirig_core::progress::Silent;
use epirig_data::sequence::Sequence;
use epirig_data::storage::RealDisk;
use epirig_matcher::{MatchOptions, Method, OrderingConstraint};
use epirig_simulator::{Simulator, SimulatorConfig};

const TEST: &str = "matching_a_hundred_frames_takes_at_most_three_times_their_bytes";
/// A process that finds these matches the scan in this way and tells its peak; another one's memory would count.
const SCAN: &str = "EPIRIG_TEST_SCAN";
const WAY: &str = "EPIRIG_TEST_WAY";
const PEAK: &str = "peak of this process in bytes: ";

/// The ways that a match can go, which differ in what they hold.
fn ways() -> [(&'static str, MatchOptions); 6] {
    let default = MatchOptions::default;
    [
        ("whole", default()),
        ("a first look", default().quick()),
        ("normalised frames", MatchOptions::for_method(Method::Normalised)),
        ("normalised frames, a first look", MatchOptions::for_method(Method::Normalised).quick()),
        ("semi-global", MatchOptions { semi_global: true, ..default() }),
        ("occluding objects", MatchOptions { ordering_constraint: OrderingConstraint::Off, ..default() }),
    ]
}

/// Peak of this process's resident memory in bytes, as the kernel counts it.
fn peak_bytes() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<usize>().ok()? * 1024)
}

fn match_and_tell_peak(scan: &Path, way: &str) {
    let (_, options) = ways().into_iter().find(|(name, _)| *name == way).unwrap();
    let sequence = Sequence::open(scan).unwrap();
    let results = ResultsFolder::create(&scan.join(way), ResultsKind::Match, false).unwrap();
    measure(&sequence, None, (&options, &Region::default()), View::default(), &results, &Silent).unwrap();
    results.commit().unwrap();
    println!("{PEAK}{}", peak_bytes().unwrap());
}

#[test]
fn matching_a_hundred_frames_takes_at_most_three_times_their_bytes() {
    if let Some(scan) = std::env::var_os(SCAN) {
        return match_and_tell_peak(scan.as_ref(), &std::env::var(WAY).unwrap());
    }
    if peak_bytes().is_none() {
        eprintln!("SKIPPED {TEST}: this system does not tell a process its peak memory");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let scan = folder.path().join("tile");
    let simulator = Arc::new(Simulator::new(SimulatorConfig::tile(1024, 100)).unwrap());
    let plan = CapturePlan::at(simulator.config().scan.positions_mm());
    scans::scan(&simulator, &plan, &scan, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    for (way, _) in ways() {
        let mut measured = Command::new(std::env::current_exe().unwrap());
        measured.args(["--exact", TEST, "--nocapture"]).env(SCAN, &scan).env(WAY, way);
        let output = measured.output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        let peak = said.lines().find_map(|line| line.split_once(PEAK)).map(|(_, bytes)| bytes);
        let Some(Ok(peak)) = peak.map(str::parse::<f64>) else {
            panic!("{way}: {said}{}", String::from_utf8_lossy(&output.stderr));
        };
        let ratio = peak / (1024.0 * 1024.0 * 100.0);
        println!("{way}: peak memory is {ratio:.2} times the frames' bytes");
        assert!(ratio <= 3.0, "{way}: {ratio}");
    }
}
