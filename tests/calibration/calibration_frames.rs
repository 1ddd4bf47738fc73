//! Calibration frames from the rig or from other software: what is taken, what is recorded with it, and what is refused.

use std::fs;
use std::path::Path;

use crate::support::{epirig, fails, images, names, simulator, succeeds, write_png};
use epirig::profile::Profile;
use epirig_calibration::target::ChessBoard;
use epirig_core::frame::{Frame, Samples};
use epirig_data::sequence::{ExitStatus, FrameKind, Origin, Sequence};
use epirig_simulator::Simulator;

/// The rig with all faults, small and short.
const REAL: [&str; 8] =
    ["--rig", "real", "--size", "96x96", "--set", "plan.frames=5", "--set", "plan.dark=2"];
const FEWER: [&str; 4] = ["--set", "plan.flat=3", "--set", "plan.board=2"];

fn open(folder: &Path) -> Sequence {
    Sequence::open(folder).unwrap()
}

fn read_all(sequence: &Sequence, kind: FrameKind) -> Vec<Frame> {
    sequence.calibration_frames(kind).iter().map(|frame| sequence.read(frame).unwrap()).collect()
}

#[test]
fn the_real_rig_is_captured_with_its_targets_and_its_truth() {
    let folder = tempfile::tempdir().unwrap();
    let quiet = ["--set", "sim.noise=0 DN", "--set", "sim.flicker=0 %"];
    succeeds(folder.path(), &[&["capture", "--out", "seq"][..], &REAL, &FEWER, &quiet].concat());
    succeeds(folder.path(), &["verify", "seq"]);
    let sequence = open(&folder.path().join("seq"));
    let stop = sequence.stop().unwrap();
    assert_eq!(stop.exit_status, ExitStatus::Complete);
    assert!(stop.closure.as_ref().unwrap().comparison.is_some());
    let Origin::Captured { simulator: Some(config), .. } = &sequence.record().origin else { panic!() };
    let simulator = Simulator::new(serde_json::from_value(config.clone()).unwrap()).unwrap();
    // Without noise every exposure of a view is the same.
    let boards = read_all(&sequence, FrameKind::Board);
    assert_eq!(boards.len(), 2);
    for (pose, board) in boards.iter().enumerate() {
        assert!(*board == simulator.digitise(&simulator.board_irradiance(pose), 0), "pose {pose}");
    }
    let darks = read_all(&sequence, FrameKind::Dark);
    assert_eq!((darks.len(), read_all(&sequence, FrameKind::Flat).len()), (2, 3));
    // The black level of 3 DN, and five pixels of 0.97 x 255 = 247 DN.
    let Samples::U8(dark) = darks[0].samples() else { panic!() };
    assert_eq!(dark.iter().filter(|&&level| level == 247).count(), 5);
    assert!(dark.iter().all(|&level| level == 3 || level == 247));
    for frame in sequence.frames() {
        // The stage reports what it was asked for, and the carriage stands beside it.
        let position_mm = frame.reported_mm.unwrap();
        assert_eq!(frame.commanded_mm, Some(position_mm));
        assert_ne!(simulator.true_position_mm(position_mm), position_mm);
        assert!(sequence.read(frame).unwrap() == simulator.expose(position_mm, 0), "frame {}", frame.index);
    }
    let profile = Profile::of_sequence(&sequence).unwrap().unwrap();
    assert_eq!(profile.board.chess_board(), Some(ChessBoard { square_mm: 16.0, columns: 9, rows: 6 }));
    assert_eq!(profile.target.print().unwrap().board.columns, 18);
    assert_eq!((profile.plan.frames, profile.plan.board), (Some(5), 2));
}

#[test]
fn calibration_frames_can_be_added_later() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &[&["capture", "--out", "seq"][..], &REAL, &FEWER].concat());
    let path = folder.path().join("seq/board/0001.png");
    let before = fs::read(&path).unwrap();
    succeeds(folder.path(), &["resume", "seq", "--set", "plan.board=4"]);
    succeeds(folder.path(), &["verify", "seq"]);
    assert_eq!(fs::read(&path).unwrap(), before);
    assert_eq!(names(&folder.path().join("seq/board")), ["0000.png", "0001.png", "0002.png", "0003.png"]);
    fs::write(&path, b"damaged").unwrap();
    let verified = epirig(folder.path(), &["verify", "seq"]);
    assert_eq!(verified.status.code(), Some(5));
    assert!(String::from_utf8_lossy(&verified.stdout).contains("board/0001.png"), "{verified:?}");
}

#[test]
fn the_real_rig_can_be_planned_and_examined() {
    let folder = tempfile::tempdir().unwrap();
    let plan: serde_json::Value =
        serde_json::from_str(&succeeds(folder.path(), &["plan", "--rig", "real", "--json"])).unwrap();
    // 101 frames, and 8 + 16 + 20 for calibration.
    assert_eq!(plan["bytes"], (101 + 44) * 1024 * 1024);
    let examined = ["--rig", "real", "--size", "320x320", "--set", "target.relief=2 mm"];
    succeeds(folder.path(), &[&["doctor"][..], &examined].concat());
    let unknown = ["--rig", "sim", "--set", "plan.board=3"];
    fails(
        folder.path(),
        &[&["capture", "--out", "seq"][..], &unknown].concat(),
        2,
        &["plan.board", "[board]"],
    );
}

/// A frame of small images with a level of its own.
fn even(rows: usize, columns: usize, level: u8) -> Frame {
    Frame::new(rows, columns, 8, Samples::U8(vec![level; rows * columns])).unwrap()
}

/// Photographs, and calibration images of the same size.
fn photographs(folder: &Path) {
    images(&folder.join("photos"), 4);
    for (kind, count) in [("cap", 2), ("white", 3), ("boards", 11)] {
        fs::create_dir(folder.join(kind)).unwrap();
        for index in 0..count {
            write_png(&folder.join(kind).join(format!("{kind}_{index}.png")), &even(24, 64, 10 + index));
        }
    }
}

const FOLDERS: [&str; 10] =
    ["import", "photos", "--out", "seq", "--dark", "cap", "--flat", "white", "--board", "boards"];

#[test]
fn calibration_images_are_imported_with_what_is_known_of_lens_and_targets() {
    let folder = tempfile::tempdir().unwrap();
    photographs(folder.path());
    let rig = "[stage]\ndriver = \"native\"\nport = \"/dev/ttyACM0\"\n[plan]\nstep = \"1.5 mm\"\nframes = 101\n\
               [optics]\nfocal_length = \"25 mm\"\nsensor_width = \"10 mm\"\nk1 = -0.02\n\
               [board]\nsquare = \"16 mm\"\ncolumns = 9\nrows = 6\n";
    fs::write(folder.path().join("bench.toml"), rig).unwrap();
    let output = epirig(folder.path(), &[&FOLDERS[..], &["--rig", "bench.toml"]].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert!(stderr.contains("--step-mm 1.5"), "{stderr}");
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(stdout.contains("4 frames of 64 x 24, 8 bit, 2 dark, 3 flat, 11 board"), "{stdout}");
    succeeds(folder.path(), &["verify", "seq"]);

    let sequence = open(&folder.path().join("seq"));
    let boards = sequence.calibration_frames(FrameKind::Board);
    // Natural order: 10 comes last.
    assert_eq!(boards[10].source.as_deref(), Some("boards_10.png"));
    assert_eq!(sequence.read(&boards[10]).unwrap(), even(24, 64, 20));
    assert_eq!(read_all(&sequence, FrameKind::Flat).len(), 3);
    let Origin::Imported { calibration_folders, .. } = &sequence.record().origin else { panic!() };
    assert_eq!(calibration_folders["dark"], "cap");
    // 25 mm before pixels of 10 mm / 64.
    assert_eq!(sequence.record().intrinsics.unwrap().focal_length_px, 160.0);
    let profile = Profile::of_sequence(&sequence).unwrap().unwrap();
    assert_eq!(profile.board.chess_board(), Some(ChessBoard { square_mm: 16.0, columns: 9, rows: 6 }));
    let lens = profile.optics.lens(64, 24).unwrap();
    assert_eq!((lens.focal_length_x_px, lens.distortion.k1), (160.0, -0.02));
    // The images were not taken with this stage and this plan.
    let nothing = Profile::of(&[]).unwrap();
    assert_eq!((&profile.stage, &profile.plan), (&nothing.stage, &nothing.plan));
}

#[test]
fn the_command_line_counts_before_the_profile_of_an_import() {
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 4);
    // One that merely lies here is of another rig.
    fs::write(folder.path().join("rig.toml"), "[optics]\nfocal_length_px = 77\n").unwrap();
    succeeds(folder.path(), &["import", "photos", "--out", "plain"]);
    let plain = open(&folder.path().join("plain"));
    assert_eq!(plain.record().intrinsics, None);
    assert_eq!(Profile::of_sequence(&plain).unwrap(), None);
    let options = ["--rig", "sim", "--focal-length-px", "128.5", "--principal-point-px", "30,12.5"];
    succeeds(folder.path(), &[&["import", "photos", "--out", "seq"][..], &options].concat());
    let sequence = open(&folder.path().join("seq"));
    let intrinsics = sequence.record().intrinsics.unwrap();
    assert_eq!((intrinsics.focal_length_px, intrinsics.principal_point_y_px), (128.5, 12.5));
    let profile = Profile::of_sequence(&sequence).unwrap().unwrap();
    assert_eq!(profile.optics.focal_length_px(64), Some(128.5));
    assert_eq!(profile.optics.distance_mm, Some(900.0), "the rest is the profile's");
    let alone = ["import", "photos", "--out", "other", "--principal-point-px", "30,12"];
    fails(folder.path(), &alone, 2, &["--principal-point-px", "--focal-length-px"]);
}

#[test]
fn calibration_images_unlike_the_frames_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    photographs(folder.path());
    write_png(&folder.path().join("boards/boards_5.png"), &even(48, 64, 9));
    fails(folder.path(), &FOLDERS, 5, &["boards_5.png", "64 x 48", "64 x 24", "same camera"]);
    let deep = Frame::new(24, 64, 16, Samples::U16(vec![1000; 24 * 64])).unwrap();
    write_png(&folder.path().join("boards/boards_5.png"), &even(24, 64, 9));
    write_png(&folder.path().join("white/white_1.png"), &deep);
    fails(folder.path(), &FOLDERS, 5, &["white_1.png", "16 bit", "8 bit"]);
    assert!(!folder.path().join("seq").exists());
    write_png(&folder.path().join("white/white_1.png"), &simulator(4).expose(10.0, 0));
    fs::create_dir(folder.path().join("empty")).unwrap();
    fails(
        folder.path(),
        &["import", "photos", "--out", "seq", "--dark", "empty"],
        2,
        &["empty", "no images"],
    );
    fails(
        folder.path(),
        &["import", "photos", "--out", "cap/seq", "--dark", "cap"],
        2,
        &["cap", "elsewhere"],
    );
    let linked = [&FOLDERS[..], &["--link"]].concat();
    succeeds(folder.path(), &linked);
    assert!(folder.path().join("seq/dark/0000.png").symlink_metadata().unwrap().is_file());
    succeeds(folder.path(), &["verify", "seq"]);
}
