//! A scan that is killed, or runs out of disk, at any moment ends, once it is resumed, with the frames of an undisturbed one; and
//! what the journal has named is never lost.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "support/scans.rs"]
mod scans;

use std::path::Path;

use epirig::capture::{CaptureError, CapturePlan, PauseSwitch};
use epirig::sequence::{DiskFault, Event, FaultyDisk, RealDisk, Sequence};
use scans::{FRAMES, assert_whole, plan, scan, twin};

/// What the journal names now, with the bytes behind it.
fn named(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let Ok(sequence) = Sequence::open(folder) else { return Vec::new() };
    let named = |event: &Event| match event {
        Event::Frame(frame) | Event::Dark(frame) | Event::Flat(frame) => {
            Some((frame.blake3.clone(), std::fs::read(sequence.path(frame)).unwrap()))
        }
        _ => None,
    };
    sequence.events().iter().filter_map(named).collect()
}

/// Lets a scan fail in every step of everything that it does to the disk, resumes it, and returns the number of steps.
fn fail_at_every_step(fault: DiskFault) -> usize {
    let twin = twin();
    let plan = plan(&twin);
    for steps in 0.. {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("seq");
        let disk = Box::new(FaultyDisk::new(fault, steps));
        let first = scan(&twin, &plan, &out, disk, &PauseSwitch::default());
        let kept = named(&out);
        for (hash, bytes) in &kept {
            assert_eq!(blake3::hash(bytes).to_hex().as_str(), hash, "{fault:?} at step {steps}");
        }
        if first.is_ok() {
            assert_whole(&twin, &out);
            return steps;
        }
        if let Err(CaptureError::Interrupted { done, planned, .. }) = &first {
            assert_eq!((*done, *planned), (Sequence::open(&out).unwrap().frames().len(), FRAMES));
        }
        scan(&twin, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
        assert_whole(&twin, &out);
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
    assert!(steps >= 6 * (FRAMES + 2) + 4, "{steps}");
}

#[test]
fn a_disk_that_is_full_from_any_step_on_stops_it_and_loses_nothing() {
    assert!(fail_at_every_step(DiskFault::Full) > FRAMES);
}

#[test]
fn a_scan_that_is_being_resumed_can_be_killed_in_every_step_too() {
    let twin = twin();
    let plan = plan(&twin);
    for steps in 0.. {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("seq");
        // In the middle of a journal line: the folder has all kinds of leftovers.
        let first = scan(
            &twin,
            &plan,
            &out,
            Box::new(FaultyDisk::new(DiskFault::Killed, 33)),
            &PauseSwitch::default(),
        );
        assert!(first.is_err());
        let second = scan(
            &twin,
            &plan,
            &out,
            Box::new(FaultyDisk::new(DiskFault::Killed, steps)),
            &PauseSwitch::default(),
        );
        if second.is_ok() {
            assert_whole(&twin, &out);
            assert!(steps > 20);
            return;
        }
        scan(&twin, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
        assert_whole(&twin, &out);
    }
}

#[test]
fn a_damaged_frame_is_taken_again() {
    let twin = twin();
    let plan = plan(&twin);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    scan(&twin, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    std::fs::write(out.join("frames/0002.png"), b"no image").unwrap();
    std::fs::remove_file(out.join("frames/0004.png")).unwrap();
    scan(&twin, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    assert_whole(&twin, &out);
    let superseded = Sequence::open(&out).unwrap().frames().iter().filter(|frame| frame.supersedes).count();
    assert_eq!(superseded, 2);
}

#[test]
fn a_pause_ends_after_the_frame_in_hand() {
    let twin = twin();
    let plan = plan(&twin);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    let pause = PauseSwitch::default();
    pause.press();
    let error =
        scan(&twin, &CapturePlan { dark: 0, flat: 0, ..plan.clone() }, &out, Box::new(RealDisk), &pause)
            .unwrap_err();
    assert!(error.is_wanted(), "{error}");
    assert_eq!(Sequence::open(&out).unwrap().frames().len(), 1);
    scan(&twin, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    assert_whole(&twin, &out);
}

#[test]
fn dark_and_flat_frames_come_before_the_scan_once() {
    let twin = twin();
    let plan = plan(&twin);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    // Killed while the flat frame is written: the dark one is there, and not taken again.
    let killed = FaultyDisk::new(DiskFault::Killed, 17);
    assert!(scan(&twin, &plan, &out, Box::new(killed), &PauseSwitch::default()).is_err());
    scan(&twin, &plan, &out, Box::new(RealDisk), &PauseSwitch::default()).unwrap();
    let sequence = Sequence::open(&out).unwrap();
    let (mut dark, mut flat) = (Vec::new(), Vec::new());
    for event in sequence.events() {
        match event {
            Event::Dark(frame) => dark.push(sequence.read(frame).unwrap()),
            Event::Flat(frame) => flat.push(sequence.read(frame).unwrap()),
            _ => {}
        }
    }
    assert_eq!((dark.len(), flat.len()), (1, 1));
    assert_eq!(dark[0].samples().maximum(), 0, "this twin has no noise");
    // White is 0.9 of full scale: 229.5.
    assert!((flat[0].samples().mean() - 229.5).abs() <= 0.5, "{}", flat[0].samples().mean());
    assert_eq!(epirig::sequence::verify(&sequence, &epirig::progress::Silent).unwrap().findings, []);
}
