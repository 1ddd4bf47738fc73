//! Interrupted scans: they always end with the frames of an undisturbed scan.

use std::path::Path;
use std::time::Duration;

use epirig_data::sequence::{Event, ExitStatus, FrameRecord, ResumedRecord, Sequence, encode_png};

use super::guest::{
    FRAMES, Rig, START_MM, Workplace, assert_exact, here, passed, program, retakes, succeeds, system,
};
use super::uvc::{EXPOSURE, Faults, Format};
use super::uvc_bench::{Kind, UvcRig};
use super::vivid_bench::{Playing, plug_serial_port};

/// So many frames are on disk when a scan is disturbed.
const BEFORE: usize = 4;

/// The frames that the journal of a disturbed scan names, each of which must be there as it says.
fn named(sequence: &str) -> (String, Vec<FrameRecord>) {
    let sequence = Sequence::open(Path::new(sequence)).unwrap();
    for record in sequence.frames() {
        sequence.read(record).unwrap();
    }
    (sequence.record().uid.clone(), sequence.frames().to_vec())
}

/// Resumes what was disturbed: the sequence is the same, whole, and still has the very frames that it had.
fn resumed(sequence: &str, rig: &mut dyn Rig) -> Sequence {
    let (uid, before) = named(sequence);
    assert!((1..FRAMES).contains(&before.len()), "{} frames before", before.len());
    succeeds(&["resume", sequence]);
    let whole = assert_exact(sequence, rig);
    assert_eq!(whole.record().uid, uid);
    assert_eq!(whole.frames()[..before.len()], before);
    assert_compared(&whole, before.len() - 1);
    whole
}

/// The scan went on, the last time after the frame `good` had been seen again where it was.
fn assert_compared(sequence: &Sequence, good: usize) {
    let resumed = |event: &Event| match event {
        Event::Resumed(resumed) => Some(resumed.clone()),
        _ => None,
    };
    let resumed: Vec<ResumedRecord> = sequence.events().iter().filter_map(resumed).collect();
    let comparison = resumed.last().unwrap().comparison.as_ref().unwrap();
    println!("frame {good} was seen again {:.6} px, {:.6} px off", comparison.x_px, comparison.y_px);
    assert_eq!(comparison.frame, good);
    // As its plan allows. The simulator is free of noise and the stage where it was, so it is far less.
    assert!(comparison.x_px.hypot(comparison.y_px) < 0.1, "{comparison:?}");
}

/// As by a power cut.
fn kill_and_resume(rig: &mut dyn Rig) {
    let workplace = Workplace::new(rig);
    let sequence = workplace.path("seq");
    let mut scanning = workplace.capture(&sequence);
    scanning.until(BEFORE);
    scanning.kill();
    assert!(!Path::new(&sequence).join("stop.json").exists());
    resumed(&sequence, rig);
}

#[test]
fn a_scan_killed_in_its_middle_is_resumed_and_whole() {
    const NAME: &str = "interruptions::a_scan_killed_in_its_middle_is_resumed_and_whole";
    if !here(NAME) {
        return;
    }
    kill_and_resume(&mut Playing::start());
    passed(NAME);
}

#[test]
fn a_scan_with_a_uvc_camera_killed_in_its_middle_is_resumed_and_whole() {
    const NAME: &str = "interruptions::a_scan_with_a_uvc_camera_killed_in_its_middle_is_resumed_and_whole";
    if !here(NAME) {
        return;
    }
    kill_and_resume(&mut UvcRig::start(Kind::isochronous(Format::Y16)));
    passed(NAME);
}

/// By a person.
fn interrupt_and_resume(rig: &mut dyn Rig) {
    let workplace = Workplace::new(rig);
    let sequence = workplace.path("seq");
    let mut scanning = workplace.capture(&sequence);
    scanning.until(BEFORE);
    scanning.interrupt();
    let (code, talk) = scanning.end();
    assert_eq!(code, 7, "{talk}");
    assert!(talk.contains("stopping after this frame"), "{talk}");
    assert!(talk.contains(&format!("`epirig resume {sequence}` continues")), "{talk}");
    let stopped = Sequence::open(Path::new(&sequence)).unwrap();
    assert_eq!(stopped.stop().unwrap().exit_status, ExitStatus::Aborted);
    assert!(retakes(&stopped).is_empty());
    resumed(&sequence, rig);
}

#[test]
fn ctrl_c_ends_a_scan_after_the_frame_in_hand_and_it_is_resumed() {
    const NAME: &str = "interruptions::ctrl_c_ends_a_scan_after_the_frame_in_hand_and_it_is_resumed";
    if !here(NAME) {
        return;
    }
    interrupt_and_resume(&mut Playing::start());
    passed(NAME);
}

#[test]
fn ctrl_c_ends_a_scan_with_a_uvc_camera_and_it_is_resumed() {
    const NAME: &str = "interruptions::ctrl_c_ends_a_scan_with_a_uvc_camera_and_it_is_resumed";
    if !here(NAME) {
        return;
    }
    interrupt_and_resume(&mut UvcRig::start(Kind::bulk(Format::Mjpg)));
    passed(NAME);
}

/// By other programs that write.
fn fill_the_disk_and_resume(rig: &mut dyn Rig) {
    const PAGE: usize = 4096;
    let workplace = Workplace::new(rig);
    let disk = workplace.path("disk");
    std::fs::create_dir(&disk).unwrap();
    system(&["mount", "-t", "tmpfs", "-o", "size=16m", "tmpfs", &disk]);
    let sequence = format!("{disk}/seq");
    let mut scanning = workplace.capture(&sequence);
    // A scan begins only where there is room for all of it. Now there is room for some frames and their records.
    scanning.until(1);
    let frame_bytes = encode_png(&rig.truth(START_MM)).unwrap().len();
    let room = (BEFORE + 2) * frame_bytes.next_multiple_of(PAGE);
    system(&["mount", "-o", &format!("remount,size={room}"), &disk]);
    let (code, talk) = scanning.end();
    assert_eq!(code, 7, "{talk}");
    assert!(talk.contains("No space left on device"), "{talk}");
    println!("{}", talk.lines().last().unwrap_or_default());
    // Full still: to be resumed it needs room, and it loses nothing by being tried.
    let (_, before) = named(&sequence);
    let again = program(&["resume", &sequence]);
    assert_eq!(again.status.code(), Some(7), "{}", String::from_utf8_lossy(&again.stderr));
    assert_eq!(named(&sequence).1[..before.len()], before);
    system(&["mount", "-o", "remount,size=16m", &disk]);
    resumed(&sequence, rig);
    system(&["umount", &disk]);
}

#[test]
fn a_disk_that_fills_stops_a_scan_and_loses_nothing() {
    const NAME: &str = "interruptions::a_disk_that_fills_stops_a_scan_and_loses_nothing";
    if !here(NAME) {
        return;
    }
    fill_the_disk_and_resume(&mut Playing::start());
    passed(NAME);
}

#[test]
fn a_disk_that_fills_stops_a_scan_with_a_uvc_camera_and_loses_nothing() {
    const NAME: &str = "interruptions::a_disk_that_fills_stops_a_scan_with_a_uvc_camera_and_loses_nothing";
    if !here(NAME) {
        return;
    }
    fill_the_disk_and_resume(&mut UvcRig::start(Kind::isochronous(Format::Yuyv)));
    passed(NAME);
}

/// The stage's cable.
fn lose_the_stage(rig: &mut dyn Rig) {
    let workplace = Workplace::new(rig);
    let sequence = workplace.path("seq");
    let mut scanning = workplace.capture(&sequence);
    scanning.until(BEFORE);
    plug_serial_port(false);
    // No person is faster.
    std::thread::sleep(Duration::from_secs(2));
    plug_serial_port(true);
    let (code, talk) = scanning.end();
    println!("{talk}");
    assert_eq!(code, 0, "{talk}");
    let whole = assert_exact(&sequence, rig);
    assert_went_on(&whole);
}

#[test]
fn a_scan_whose_serial_port_is_pulled_out_and_put_back_goes_on_by_itself() {
    const NAME: &str = "interruptions::a_scan_whose_serial_port_is_pulled_out_and_put_back_goes_on_by_itself";
    if !here(NAME) {
        return;
    }
    lose_the_stage(&mut Playing::start());
    passed(NAME);
}

#[test]
fn a_scan_with_a_uvc_camera_whose_serial_port_is_pulled_out_goes_on_by_itself() {
    const NAME: &str =
        "interruptions::a_scan_with_a_uvc_camera_whose_serial_port_is_pulled_out_goes_on_by_itself";
    if !here(NAME) {
        return;
    }
    lose_the_stage(&mut UvcRig::start(Kind::isochronous(Format::Grey)));
    passed(NAME);
}

/// The camera's cable.
fn lose_the_camera(rig: &mut dyn Rig) {
    let workplace = Workplace::new(rig);
    let sequence = workplace.path("seq");
    let mut scanning = workplace.capture(&sequence);
    scanning.until(BEFORE);
    rig.pull_camera_out();
    rig.put_camera_back();
    let (code, talk) = scanning.end();
    println!("{talk}");
    assert_eq!(code, 0, "{talk}");
    let whole = assert_exact(&sequence, rig);
    assert_went_on(&whole);
}

#[test]
fn a_scan_whose_camera_is_disconnected_goes_on_by_itself() {
    const NAME: &str = "interruptions::a_scan_whose_camera_is_disconnected_goes_on_by_itself";
    if !here(NAME) {
        return;
    }
    lose_the_camera(&mut Playing::start());
    passed(NAME);
}

#[test]
fn a_scan_whose_uvc_camera_is_pulled_out_and_put_back_goes_on_by_itself() {
    const NAME: &str = "interruptions::a_scan_whose_uvc_camera_is_pulled_out_and_put_back_goes_on_by_itself";
    if !here(NAME) {
        return;
    }
    lose_the_camera(&mut UvcRig::start(Kind::bulk(Format::Yuyv)));
    passed(NAME);
}

#[test]
fn a_scan_whose_uvc_camera_is_put_into_another_socket_goes_on_by_itself() {
    const NAME: &str = "interruptions::a_scan_whose_uvc_camera_is_put_into_another_socket_goes_on_by_itself";
    if !here(NAME) {
        return;
    }
    let mut rig = UvcRig::start(Kind::isochronous(Format::Mjpg));
    rig.back_in = 1;
    lose_the_camera(&mut rig);
    passed(NAME);
}

#[test]
fn a_scan_whose_uvc_camera_fails_in_many_ways_goes_on_or_stops_and_is_whole() {
    const NAME: &str =
        "interruptions::a_scan_whose_uvc_camera_fails_in_many_ways_goes_on_or_stops_and_is_whole";
    if !here(NAME) {
        return;
    }
    let mut rig = UvcRig::start(Kind::bulk(Format::Mjpg));
    let workplace = Workplace::new(&rig);
    let sequence = workplace.path("seq");
    let mut scanning = workplace.capture(&sequence);
    let faults: [fn(&mut Faults); 4] = [
        |faults| (faults.error_bit, faults.split_fid) = (1, 1),
        |faults| faults.short = 3,
        // After five of them the driver is silent.
        |faults| faults.halt = 5,
        |faults| faults.same_fid = 2,
    ];
    for (index, fault) in (2..).step_by(2).zip(faults) {
        scanning.until(index);
        rig.camera.inject(fault);
    }
    scanning.until(FRAMES - BEFORE);
    assert!(rig.camera.faults().are_spent(), "{:?}", rig.camera.faults());
    // From now on the camera does not answer for its exposure: no frame can be trusted.
    rig.camera.inject(|faults| faults.stall = Some((EXPOSURE, 1)));
    let (code, talk) = scanning.end();
    println!("{talk}");
    assert_eq!(code, 7, "{talk}");
    assert!(talk.contains("exposure_time_absolute cannot be"), "{talk}");
    rig.camera.inject(|faults| faults.stall = None);
    resumed(&sequence, &mut rig);
    passed(NAME);
}

/// One frame was tried again, after the one before it had been seen again where it was.
fn assert_went_on(sequence: &Sequence) {
    let retakes = retakes(sequence);
    assert_eq!(retakes.len(), 1, "{retakes:?}");
    assert!((BEFORE..FRAMES).contains(&retakes[0].index), "{retakes:?}");
    assert_compared(sequence, retakes[0].index - 1);
}
