//! A scan that is killed, or runs out of disk, at any moment ends, once it is resumed, with the frames of an undisturbed one; and
//! what the journal has named is never lost.

use std::path::Path;
use std::sync::Arc;

use crate::scans::{FRAMES, assert_whole, plan, scan, scan_on, simulator};
use epirig::capture::{CaptureError, CapturePlan, PauseSwitch};
use epirig_data::sequence::{Event, ExitStatus, FrameKind, FrameRecord, Sequence, SequenceError};
use epirig_data::storage::{DiskFault, FaultyDisk, RealDisk};
use epirig_devices::stage::SimStageConfig;
use epirig_simulator::Simulator;

/// What the journal names now, with the bytes behind it.
fn named(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let Ok(sequence) = Sequence::open(folder) else { return Vec::new() };
    let bytes = |frame: &FrameRecord| std::fs::read(sequence.path(frame)).unwrap();
    let frames = sequence.events().iter().filter_map(Event::frame);
    frames.map(|(_, frame)| (frame.blake3.clone(), bytes(frame))).collect()
}

/// Lets a scan fail in every step of everything that it does to the disk, resumes it, and returns the number of steps.
fn fail_at_every_step(fault: DiskFault) -> usize {
    let simulator = simulator();
    let plan = plan(&simulator);
    for steps in 0.. {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("seq");
        let disk = Box::new(FaultyDisk::new(fault, steps));
        let first = scan(&simulator, &plan, &out, disk, &PauseSwitch::default());
        let kept = named(&out);
        for (hash, bytes) in &kept {
            assert_eq!(blake3::hash(bytes).to_hex().as_str(), hash, "{fault:?} at step {steps}");
        }
        if first.is_ok() {
            assert_whole(&simulator, &out);
            return steps;
        }
        let error = first.unwrap_err();
        // No other program has done anything.
        let is_of_the_disk = matches!(error.cause(), CaptureError::Sequence(SequenceError::Io { .. }));
        assert!(is_of_the_disk, "{fault:?} at step {steps}: {error}");
        if let CaptureError::Interrupted { done, planned, .. } = &error {
            assert_eq!((*done, *planned), (Sequence::open(&out).unwrap().frames().len(), FRAMES));
        } else {
            assert!(kept.is_empty(), "{fault:?} at step {steps}: {error}");
        }
        scan(&simulator, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
        assert_whole(&simulator, &out);
        let after = named(&out);
        assert!(
            kept.iter().all(|frame| after.contains(frame)),
            "{fault:?} at step {steps}: a frame was lost"
        );
    }
    unreachable!()
}

#[test]
fn killed_in_every_write_and_rename_it_ends_as_if_undisturbed() {
    let steps = fail_at_every_step(DiskFault::Killed);
    // Four steps for each file, two for each line, and what makes and ends the folder.
    assert!(steps >= 6 * (FRAMES + 4) + 4, "{steps}");
}

#[test]
fn the_program_makes_stage_and_camera_wait_for_nothing() {
    let simulator = simulator();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    let plan = CapturePlan::at(simulator.config().scan.positions_mm());
    scan(&simulator, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    let times = Sequence::open(&out).unwrap().stop().unwrap().times.unwrap();
    // In simulated time, which the disk does not take part in.
    assert!(times.overhead().unwrap() <= 1.05, "{times:?}");
}

#[test]
fn a_disk_that_is_full_from_any_step_on_stops_it_and_loses_nothing() {
    assert!(fail_at_every_step(DiskFault::Full) > FRAMES);
}

/// The step in which a scan has to be killed to leave half a journal line behind a few whole ones.
fn step_that_tears_a_line(simulator: &Arc<Simulator>, plan: &CapturePlan) -> usize {
    let tears = |steps: &usize| {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("seq");
        let disk = Box::new(FaultyDisk::new(DiskFault::Killed, *steps));
        assert!(scan(simulator, plan, &out, disk, &PauseSwitch::default()).is_err());
        let journal = std::fs::read_to_string(out.join("journal.jsonl")).unwrap_or_default();
        journal.lines().count() > 3 && !journal.ends_with('\n')
    };
    (0..).find(tears).unwrap()
}

#[test]
fn a_scan_that_is_being_resumed_can_be_killed_in_every_step_too() {
    let simulator = simulator();
    let plan = plan(&simulator);
    let torn = step_that_tears_a_line(&simulator, &plan);
    for steps in 0.. {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("seq");
        let first = scan(
            &simulator,
            &plan,
            &out,
            Box::new(FaultyDisk::new(DiskFault::Killed, torn)),
            &PauseSwitch::default(),
        );
        assert!(first.is_err());
        let second = scan(
            &simulator,
            &plan,
            &out,
            Box::new(FaultyDisk::new(DiskFault::Killed, steps)),
            &PauseSwitch::default(),
        );
        if second.is_ok() {
            assert_whole(&simulator, &out);
            assert!(steps > 20);
            return;
        }
        scan(&simulator, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
        assert_whole(&simulator, &out);
    }
}

#[test]
fn a_damaged_frame_is_taken_again() {
    let simulator = simulator();
    let plan = plan(&simulator);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    scan(&simulator, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    std::fs::write(out.join("frames/0002.png"), b"no image").unwrap();
    std::fs::remove_file(out.join("frames/0004.png")).unwrap();
    scan(&simulator, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    assert_whole(&simulator, &out);
    let superseded = Sequence::open(&out).unwrap().frames().iter().filter(|frame| frame.supersedes).count();
    assert_eq!(superseded, 2);
}

#[test]
fn a_pause_before_anything_is_taken_leaves_nothing() {
    let simulator = simulator();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    let pause = PauseSwitch::default();
    pause.press();
    let error = scan(&simulator, &plan(&simulator), &out, Box::new(RealDisk), &pause).unwrap_err();
    assert!(matches!(error, CaptureError::NotBegun), "{error}");
    assert!(!out.exists());
}

#[test]
fn calibration_frames_come_before_the_scan_once() {
    let simulator = simulator();
    let plan = plan(&simulator);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    let calibration = |kind| {
        let sequence = Sequence::open(&out).unwrap();
        let records = sequence.calibration_frames(kind);
        records.iter().map(|frame| sequence.read(frame).unwrap()).collect::<Vec<_>>()
    };
    // Killed when the dark frame is there and the flat one is not.
    for steps in 0.. {
        let killed = Box::new(FaultyDisk::new(DiskFault::Killed, steps));
        assert!(scan(&simulator, &plan, &out, killed, &PauseSwitch::default()).is_err());
        let begun = out.join("sequence.json").exists();
        if begun && calibration(FrameKind::Dark).len() == 1 {
            assert!(calibration(FrameKind::Flat).is_empty());
            break;
        }
        if begun {
            std::fs::remove_dir_all(&out).unwrap();
        }
    }
    let taken = std::fs::metadata(out.join("dark/0000.png")).unwrap().modified().unwrap();
    scan(&simulator, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    assert_eq!(std::fs::metadata(out.join("dark/0000.png")).unwrap().modified().unwrap(), taken);
    let (dark, flat) = (calibration(FrameKind::Dark), calibration(FrameKind::Flat));
    assert_eq!((dark.len(), flat.len()), (1, 1));
    assert_eq!(dark[0].samples().maximum(), 0, "this simulator has no noise");
    // White is 0.9 of full scale: 229.5.
    assert!((flat[0].samples().mean() - 229.5).abs() <= 0.5, "{}", flat[0].samples().mean());
    let boards = calibration(FrameKind::Board);
    assert_eq!(boards.len(), 2);
    for (pose, board) in boards.iter().enumerate() {
        assert!(*board == simulator.digitise(&simulator.board_irradiance(pose), 0), "pose {pose}");
    }
    // One that is damaged later is taken again, a board in the same pose.
    std::fs::write(out.join("dark/0000.png"), b"no image").unwrap();
    std::fs::write(out.join("board/0001.png"), b"no image").unwrap();
    scan(&simulator, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    assert_whole(&simulator, &out);
    assert!(calibration(FrameKind::Board) == boards);
}

#[test]
fn a_scan_that_does_not_close_says_by_how_much() {
    let simulator = simulator();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    // Each of the moves upwards to the six stops loses 50 um, each way down gains as much.
    let slips = SimStageConfig { slip_probability: 1.0, slip_um: 50.0, ..SimStageConfig::ideal(200.0) };
    let plan = CapturePlan::at(simulator.config().scan.positions_mm());
    let ended = scan_on(slips, &simulator, &plan, &out, Box::new(RealDisk), &PauseSwitch::default());
    assert!(matches!(ended, Err(CaptureError::NotClosed { .. })), "{ended:?}");
    let sequence = Sequence::open(&out).unwrap();
    let stop = sequence.stop().unwrap();
    assert_eq!(stop.exit_status, ExitStatus::NotClosed);
    // Six up; down to below the first, up to it, and home.
    let shift_mm = stop.closure.as_ref().unwrap().home_shift_mm.unwrap();
    assert!((shift_mm.abs() - 0.05 * f64::from(6 - 1 + 1 - 1)).abs() < 1e-9, "{shift_mm}");
}
