//! The program killed at random moments (SIGKILL: it is told nothing), and stopped by hand: once it is resumed, the sequence has the
//! frames of an undisturbed scan.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::size::repetitions;
use crate::support::epirig;
use epirig_data::sequence::{ExitStatus, Sequence};
use epirig_simulator::{SimulatedScan, Simulator, SimulatorConfig};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const FRAMES: usize = 24;
const PLAN: [&str; 6] = ["--size", "64x48", "--set", "plan.frames=24", "--set", "sim.scene=plane"];
const KILLS: usize = 300;

/// What the simulated camera sees.
fn simulator() -> Simulator {
    let mut config = SimulatorConfig::textured_plane(64, 48, FRAMES);
    // Of the embedded profile: 25 mm over 9 mm, 900 mm away.
    config.optics.focal_length_px = 25.0 / 9.0 * 64.0;
    config.scene = epirig_simulator::Scene::Plane { distance_mm: 900.0, slope_x: 0.0, slope_y: 0.0 };
    config.scan = SimulatedScan { start_mm: 10.0, step_mm: 1.5, frames: FRAMES };
    Simulator::new(config).unwrap()
}

/// Begins the scan, or resumes it.
fn spawn(folder: &Path, more: &[&str]) -> Child {
    let begun = folder.join("seq/sequence.json").exists();
    let new = [&["capture", "--out", "seq", "--rig", "sim"][..], &PLAN, more].concat();
    let arguments = if begun { vec!["resume", "seq"] } else { new };
    Command::new(env!("CARGO_BIN_EXE_epirig"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Hashes that the journal names, whose files must be as they were written.
fn named(folder: &Path) -> Vec<String> {
    let Ok(sequence) = Sequence::open(&folder.join("seq")) else { return Vec::new() };
    sequence.frames().iter().for_each(|frame| drop(sequence.read(frame).unwrap()));
    sequence.frames().iter().map(|frame| frame.blake3.clone()).collect()
}

#[test]
fn kills_at_random_moments_lose_nothing() {
    let seed = 20_261_121;
    println!("seed {seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let simulator = simulator();
    // How long a scan takes undisturbed, on this machine.
    let folder = tempfile::tempdir().unwrap();
    let began = Instant::now();
    assert!(spawn(folder.path(), &[]).wait().unwrap().success());
    let whole = began.elapsed();
    crate::scans::assert_whole(&simulator, &folder.path().join("seq"));

    let (mut kills, mut ended_before, mut counts) = (0, 0, [0; FRAMES + 1]);
    while kills < repetitions(KILLS) {
        let folder = tempfile::tempdir().unwrap();
        let mut kept: Vec<String> = Vec::new();
        loop {
            let mut child = spawn(folder.path(), &[]);
            // Some later than the end, so that every moment is met.
            std::thread::sleep(whole.mul_f64(random.random_range(0.0..1.1)));
            child.kill().unwrap();
            let status = child.wait().unwrap();
            let now = named(folder.path());
            assert!(kept.iter().all(|hash| now.contains(hash)), "a frame that the journal named was lost");
            kept = now;
            if status.success() {
                ended_before += 1;
                break;
            }
            assert_eq!(status.code(), None, "it was not killed, it failed");
            kills += 1;
            counts[kept.len()] += 1;
        }
        crate::scans::assert_whole(&simulator, &folder.path().join("seq"));
    }
    println!(
        "{kills} kills in {ended_before} scans of {} ms; frames there when killed: {counts:?}",
        whole.as_millis()
    );
}

/// Waits until the journal has this number of frames.
fn wait_for_frames(folder: &Path, frames: usize) {
    let until = Instant::now() + Duration::from_secs(60);
    while Sequence::open(&folder.join("seq")).map_or(0, |sequence| sequence.frames().len()) < frames {
        assert!(Instant::now() < until, "the scan does not get on");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn interrupt(child: &Child) {
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
}

#[test]
fn the_first_interruption_ends_after_the_frame_and_the_second_at_once() {
    for interruptions in [1, 2] {
        let folder = tempfile::tempdir().unwrap();
        let mut child = spawn(folder.path(), &["--set", "sim.real_time=true"]);
        wait_for_frames(folder.path(), 2);
        (0..interruptions).for_each(|_| {
            interrupt(&child);
            std::thread::sleep(Duration::from_millis(50));
        });
        assert_eq!(child.wait().unwrap().code(), Some(7));
        let sequence = Sequence::open(&folder.path().join("seq")).unwrap();
        assert_eq!(sequence.stop().map(|stop| stop.exit_status), Some(ExitStatus::Aborted));
        assert!((2..FRAMES).contains(&sequence.frames().len()));
        // A sequence that is not complete says so, and what to do.
        let verified = epirig(folder.path(), &["verify", "seq"]);
        assert_eq!(verified.status.code(), Some(5));
        assert!(String::from_utf8_lossy(&verified.stdout).contains("epirig resume"), "{verified:?}");
    }
}

#[test]
fn only_one_program_writes_a_sequence() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = spawn(folder.path(), &["--set", "sim.real_time=true"]);
    wait_for_frames(folder.path(), 1);
    crate::support::fails(folder.path(), &["resume", "seq"], 1, &["being written by another epirig"]);
    interrupt(&child);
    child.wait().unwrap();
}

#[test]
#[cfg(target_os = "linux")]
fn a_scan_that_nobody_listens_to_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let capture = [&["capture", "--out", "seq", "--rig", "sim"][..], &PLAN].concat();
    let status = Command::new(env!("CARGO_BIN_EXE_epirig"))
        .args(capture)
        .current_dir(folder.path())
        .env("XDG_CONFIG_HOME", folder.path())
        .stdout(Stdio::null())
        .stderr(full)
        .status();
    assert!(status.unwrap().success());
    crate::scans::assert_whole(&simulator(), &folder.path().join("seq"));
}
