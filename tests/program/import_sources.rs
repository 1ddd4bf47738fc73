//! What `import` takes: folders, files, patterns, videos; and what turns, sorts and leaves out.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, UNIX_EPOCH};

use crate::support::{epirig, fails, images, names, simulator, succeeds, write_png};
use epirig_core::frame::{Frame, Samples};
use epirig_data::sequence::{Sequence, decode_grey};

/// The files that the frames of a sequence were made of.
fn sources(folder: &Path) -> Vec<String> {
    let sequence = Sequence::open(folder).unwrap();
    sequence.frames().iter().map(|frame| frame.source.clone().unwrap()).collect()
}

fn frame(sequence: &Path, index: usize) -> Frame {
    decode_grey(&fs::read(sequence.join(format!("frames/{index:04}.png"))).unwrap()).unwrap().frame
}

#[test]
fn files_and_patterns_are_taken_as_folders_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    images(&path.join("photos"), 12);
    succeeds(
        path,
        &["import", "photos/frame_10.png", "photos/frame_9.png", "photos/frame_1.png", "--out", "few"],
    );
    assert_eq!(sources(&path.join("few")), ["frame_1.png", "frame_9.png", "frame_10.png"]);
    let given = ["import", "photos/frame_10.png", "photos/frame_9.png", "--out", "given", "--sort", "given"];
    succeeds(path, &given);
    assert_eq!(sources(&path.join("given")), ["frame_10.png", "frame_9.png"]);
    // Without a shell, the pattern comes as it is. The sequence may lie beside single images.
    succeeds(path, &["import", "photos/frame_1*.png", "--out", "photos/seq"]);
    assert_eq!(sources(&path.join("photos/seq")), ["frame_1.png", "frame_10.png", "frame_11.png"]);
    fails(path, &["import", "photos/*.jpg", "--out", "none"], 2, &["photos/*.jpg", "no file fits"]);
    fails(path, &["import", "photos/frame_77.png", "--out", "none"], 1, &["frame_77.png", "check the path"]);
    fs::write(path.join("notes.txt"), "no image").unwrap();
    fails(
        path,
        &["import", "notes.txt", "photos", "--out", "none", "--sort", "given"],
        5,
        &["notes.txt", "no image"],
    );
    assert!(!path.join("none").exists());
}

#[test]
fn images_are_left_out_sorted_by_time_and_turned() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    images(&path.join("photos"), 6);
    let import = ["import", "photos", "--out"];
    let with = |out: &str, options: &[&str]| succeeds(path, &[&import[..], &[out], options].concat());
    with("part", &["--exclude", "0,2..3", "--step-mm", "1.5"]);
    assert_eq!(sources(&path.join("part")), ["frame_1.png", "frame_4.png", "frame_5.png"]);
    // The stage was at the places of those that were left out, too.
    let positions = Sequence::open(&path.join("part")).unwrap().record().positions_mm.clone().unwrap();
    assert_eq!(positions, [0.0, 4.5, 6.0]);
    let without_step = epirig(path, &[&import[..], &["gap", "--exclude", "2"]].concat());
    assert!(String::from_utf8_lossy(&without_step.stderr).contains("one step apart"));
    fails(path, &[&import[..], &["none", "--exclude", "6"]].concat(), 2, &["--exclude", "0 to 5"]);
    fails(path, &[&import[..], &["none", "--exclude", "0..4"]].concat(), 5, &["1 frame", "at least 2"]);

    for index in 0..6_u64 {
        let file =
            fs::File::options().append(true).open(path.join(format!("photos/frame_{index}.png"))).unwrap();
        file.set_modified(UNIX_EPOCH + Duration::from_secs(1000 - index)).unwrap();
    }
    with("timed", &["--sort", "time"]);
    assert_eq!(sources(&path.join("timed"))[0], "frame_5.png");

    with("turned", &["--rotate", "90"]);
    let (upright, turned) = (frame(&path.join("timed"), 5), frame(&path.join("turned"), 0));
    assert_eq!((turned.rows(), turned.columns()), (upright.columns(), upright.rows()));
    let sample = |frame: &Frame, row: usize, column: usize| match frame.samples() {
        Samples::U8(values) => values[row * frame.columns() + column],
        Samples::U16(_) => panic!("8 bit went in"),
    };
    // The first column, read upwards, is the first row.
    let first_row = (0..turned.columns()).map(|column| sample(&turned, 0, column));
    assert!(first_row.eq((0..upright.rows()).rev().map(|row| sample(&upright, row, 0))));
    succeeds(path, &["verify", "turned"]);
}

#[test]
fn several_images_of_another_size_are_named_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    images(&path.join("photos"), 8);
    let small = Frame::new(12, 32, 8, Samples::U8(vec![7; 12 * 32])).unwrap();
    for index in [0, 5, 6] {
        write_png(&path.join(format!("photos/frame_{index}.png")), &small);
    }
    let import = ["import", "photos", "--out", "seq"];
    fails(path, &import, 5, &["frame_1.png", "32 x 12", "--exclude 0,5..6`"]);
    succeeds(path, &[&import[..], &["--exclude", "0,5..6"]].concat());
}

#[test]
fn a_video_without_ffmpeg_gets_the_command_to_run() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("my scan.mp4"), "no video").unwrap();
    let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
    command.current_dir(folder.path()).env("PATH", folder.path());
    let output = command.args(["import", "my scan.mp4", "--out", "seq"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("ffmpeg -i 'my scan.mp4' -fps_mode passthrough -pix_fmt gray"), "{said}");
    assert_eq!(names(folder.path()), ["my scan.mp4"]);
}

/// Frames of 8 bit in a video that loses nothing come back as they were.
#[test]
fn frames_of_a_video_are_those_that_went_in() {
    if !Command::new("ffmpeg").arg("-version").output().is_ok_and(|output| output.status.success()) {
        eprintln!("SKIPPED frames_of_a_video_are_those_that_went_in: there is no ffmpeg");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    images(&path.join("photos"), 5);
    let make =
        ["-loglevel", "error", "-i", "photos/frame_%d.png", "-c:v", "ffv1", "-pix_fmt", "gray", "100%d.mkv"];
    assert!(Command::new("ffmpeg").current_dir(path).args(make).status().unwrap().success());
    fs::write(path.join("damaged.mkv"), "no video").unwrap();
    fails(path, &["import", "damaged.mkv", "--out", "seq"], 5, &["damaged.mkv", "ffmpeg", "Invalid data"]);
    fails(path, &["import", "100%d.mkv", "photos", "--out", "seq"], 2, &["100%d.mkv", "alone"]);
    assert!(!path.join("seq").exists());
    succeeds(path, &["import", "100%d.mkv", "--out", "100%d"]);
    succeeds(path, &["import", "100%d.mkv", "--out", "part", "--frames", "1..3"]);
    let positions = simulator(5).config().scan.positions_mm();
    for (index, &position) in positions.iter().enumerate() {
        assert_eq!(frame(&path.join("100%d"), index), simulator(5).expose(position, index as u32));
    }
    assert_eq!(frame(&path.join("part"), 0), frame(&path.join("100%d"), 1));
    assert_eq!(Sequence::open(&path.join("part")).unwrap().frames().len(), 3);
    succeeds(path, &["import", "100%d.mkv", "--out", "every", "--every", "2"]);
    assert_eq!(Sequence::open(&path.join("every")).unwrap().frames().len(), 3);
    assert_eq!(frame(&path.join("every"), 2), frame(&path.join("100%d"), 4));
}

#[test]
fn every_is_for_videos() {
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 5);
    fails(
        folder.path(),
        &["import", "photos", "--out", "seq", "--every", "2"],
        2,
        &["--every is for", "video"],
    );
}

#[test]
fn files_of_formats_that_are_not_read_get_one_message_and_one_code() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("raw")).unwrap();
    for name in ["raw/IMG_1.CR2", "raw/IMG_2.CR2"] {
        fs::write(path.join(name), b"II*\0\x10\0\0\0CR\x02\0").unwrap();
    }
    fs::write(path.join("p.zip"), b"PK\x03\x04").unwrap();
    fs::create_dir(path.join("phone")).unwrap();
    for index in 0..3 {
        fs::write(path.join(format!("phone/{index}.jpg")), b"\0\0\0\x18ftypheic\0\0\0\0").unwrap();
    }
    for (arguments, words) in [
        (&["p.zip"][..], ["p.zip is a zip archive", "unzip"]),
        (&["raw"], ["IMG_1.CR2 is a camera's raw image", "dcraw"]),
        (&["raw/IMG_1.CR2"], ["IMG_1.CR2 is a camera's raw image", "dcraw"]),
        (&["raw/IMG_1.CR2", "raw/IMG_2.CR2"], ["IMG_1.CR2 is a camera's raw image", "dcraw"]),
        (&["phone"], ["0.jpg is a HEIC image", "heif-convert"]),
    ] {
        fails(path, &[&["import"], arguments, &["--out", "seq"]].concat(), 5, &words);
    }
}
