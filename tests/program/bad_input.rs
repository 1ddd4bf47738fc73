//! Bad input gets an error that names the file and the next step, an exit code by kind, and leaves nothing half-written.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{epirig, fails, images, names, simulator, succeeds, write_png};
use epirig_core::frame::{Frame, Samples};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn sequence(folder: &Path) {
    images(&folder.join("photos"), 9);
    succeeds(folder, &["import", "photos", "--out", "seq"]);
}

#[test]
fn an_empty_folder() {
    let folder = folder();
    fs::create_dir(folder.path().join("photos")).unwrap();
    fails(
        folder.path(),
        &["import", "photos", "--out", "seq"],
        2,
        &["photos", "no images that are read", "PNG"],
    );
    fails(folder.path(), &["import", "nowhere", "--out", "seq"], 1, &["nowhere", "check the path"]);
    assert_eq!(names(folder.path()), ["photos"]);
}

#[test]
fn one_frame() {
    let folder = folder();
    images(&folder.path().join("photos"), 3);
    fs::remove_file(folder.path().join("photos/frame_1.png")).unwrap();
    fs::remove_file(folder.path().join("photos/frame_2.png")).unwrap();
    fails(folder.path(), &["import", "photos", "--out", "seq"], 5, &["photos", "1 frame", "at least 2"]);
    fails(
        folder.path(),
        &["import", "photos", "--out", "seq", "--frames", "0..4"],
        2,
        &["photos", "--frames"],
    );
    assert_eq!(names(folder.path()), ["photos"]);
}

#[test]
fn frames_of_different_sizes() {
    let folder = folder();
    images(&folder.path().join("photos"), 4);
    let odd = Frame::new(24, 60, 8, Samples::U8(vec![7; 24 * 60])).unwrap();
    write_png(&folder.path().join("photos/frame_2.png"), &odd);
    let words = ["frame_2.png", "60 x 24", "64 x 24", "--exclude 2`", "--frames"];
    fails(folder.path(), &["import", "photos", "--out", "seq"], 5, &words);
    assert_eq!(names(folder.path()), ["photos"]);
}

#[test]
fn a_truncated_png() {
    let folder = folder();
    images(&folder.path().join("photos"), 4);
    let path = folder.path().join("photos/frame_3.png");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    fails(
        folder.path(),
        &["import", "photos", "--out", "seq"],
        5,
        &["frame_3.png", "damaged", "copy it again"],
    );
    assert_eq!(names(folder.path()), ["photos"]);
}

#[test]
fn a_frame_that_was_damaged_after_the_import() {
    let folder = folder();
    sequence(folder.path());
    let path = folder.path().join("seq/frames/0004.png");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    fails(folder.path(), &["match", "seq"], 5, &["0004.png", "copy"]);
    assert!(!folder.path().join("seq/results").exists());
    let output = epirig(folder.path(), &["verify", "seq"]);
    assert_eq!(output.status.code(), Some(5));
    assert!(String::from_utf8_lossy(&output.stdout).contains("0004.png"));
    // A picture that is sound but another one.
    write_png(&path, &simulator(9).expose(0.0, 77));
    fails(folder.path(), &["match", "seq"], 5, &["0004.png", "hash"]);
    fs::remove_file(&path).unwrap();
    fails(folder.path(), &["match", "seq"], 5, &["0004.png", "missing"]);
    assert_eq!(epirig(folder.path(), &["verify", "seq"]).status.code(), Some(5));
}

#[test]
fn bit_depths_that_contradict_each_other() {
    let folder = folder();
    images(&folder.path().join("photos"), 4);
    let wide = Frame::new(24, 64, 16, Samples::U16(vec![700; 24 * 64])).unwrap();
    write_png(&folder.path().join("photos/frame_2.png"), &wide);
    fails(folder.path(), &["import", "photos", "--out", "seq"], 5, &["frame_2.png", "16 bit", "8 bit"]);
    // All 16 bit, but said to be 8.
    for index in 0..4 {
        write_png(&folder.path().join(format!("photos/frame_{index}.png")), &wide);
    }
    let arguments = ["import", "photos", "--out", "seq", "--bit-depth", "8"];
    fails(folder.path(), &arguments, 5, &["frame_0.png", "8 bit", "true bit depth"]);
    // A file whose name says JPEG is read for what it is.
    fs::rename(folder.path().join("photos/frame_3.png"), folder.path().join("photos/frame_3.jpg")).unwrap();
    succeeds(folder.path(), &["import", "photos", "--out", "seq", "--bit-depth", "12"]);
    // A record that says 8 bit of 16-bit files.
    let path = folder.path().join("seq/sequence.json");
    let record = fs::read_to_string(&path).unwrap();
    fs::write(&path, record.replace("\"bit_depth\": 12", "\"bit_depth\": 8")).unwrap();
    fails(folder.path(), &["match", "seq"], 5, &["0000.png", "16 bit", "8 bit"]);
}

#[test]
fn positions_of_a_wrong_count_or_not_increasing() {
    let folder = folder();
    images(&folder.path().join("photos"), 4);
    let positions = folder.path().join("positions.csv");
    let arguments = ["import", "photos", "--out", "seq", "--positions", "positions.csv"];
    for (table, words) in [
        ("0\n1.5\n3\n", vec!["positions.csv", "3 position(s) for 4 frame(s)"]),
        ("0\n1.5\n1.5\n3\n", vec!["positions.csv", "increase strictly", "position 2"]),
        ("0\n1.5\nthree\n4\n", vec!["positions.csv", "line 3", "three"]),
        ("0\n1.5\nnan\n4\n", vec!["positions.csv", "position 2", "finite"]),
        ("a,b\n0,1\n", vec!["positions.csv", "position_mm"]),
        ("0\n1,5\n3,0\n4,5\n", vec!["positions.csv", "line 2"]),
    ] {
        fs::write(&positions, table).unwrap();
        fails(folder.path(), &arguments, 5, &words);
    }
    assert_eq!(names(folder.path()), ["photos", "positions.csv"]);
    fs::write(&positions, "# from the log\nframe,position_mm\n0,0\n1,1.5\n2,3.5\n3,4\n").unwrap();
    succeeds(folder.path(), &arguments);
    let record = fs::read_to_string(folder.path().join("seq/sequence.json")).unwrap();
    assert!(record.contains("3.5"), "{record}");
}

#[test]
fn ranges_and_options_that_make_no_sense() {
    let folder = folder();
    sequence(folder.path());
    for (arguments, words) in [
        (vec!["--range", "0..64"], vec!["0..64", "64 px wide"]),
        (vec!["--range", "0..1000"], vec!["1000"]),
        (vec!["--range", "150..170"], vec!["150..170"]),
        (vec!["--range", "9..3"], vec!["9..3", "smaller number first"]),
        (vec!["--range", "nan..3"], vec!["NaN..3"]),
        (vec!["--range", "wide"], vec!["wide", "420..434"]),
        (vec!["--reference", "9"], vec!["frame 9", "0 to 8"]),
        (vec!["--window", "4"], vec!["window", "4", "odd"]),
        (vec!["--window", "61"], vec!["window", "61"]),
        (
            vec!["--reference", "middle", "--range", "-20..20", "--disparity-step", "0.001"],
            vec!["disparity step", "0.001"],
        ),
        (vec!["--disparity-step", "0"], vec!["disparity step", "0.01"]),
        (vec!["--min-visible", "2"], vec!["share", "2"]),
        (vec!["--figure-row", "24"], vec!["row 24", "23"]),
    ] {
        let all: Vec<&str> = ["match", "seq"].into_iter().chain(arguments).collect();
        fails(folder.path(), &all, 2, &words);
    }
    assert!(!folder.path().join("seq/results").exists());
    fails(folder.path(), &["match", "photos"], 2, &["photos", "epirig import"]);
    fails(folder.path(), &["evaluate", "seq", "--leave-out", "1"], 2, &["from 2"]);
}

#[test]
fn frames_without_texture() {
    let folder = folder();
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    for index in 0..5 {
        let flat = Frame::new(24, 64, 8, Samples::U8(vec![100; 24 * 64])).unwrap();
        write_png(&photos.join(format!("{index}.png")), &flat);
    }
    succeeds(folder.path(), &["import", "photos", "--out", "seq"]);
    fails(folder.path(), &["match", "seq"], 8, &["no range", "too little texture"]);
    let output = epirig(folder.path(), &["match", "seq", "--range", "0..5", "--json"]);
    assert_eq!(output.status.code(), Some(8));
    // One object: the result, which is there although no pixel has an answer.
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["answered"], 0.0);
}

#[test]
fn folders_that_hold_something_already() {
    let folder = folder();
    sequence(folder.path());
    fails(folder.path(), &["import", "photos", "--out", "seq"], 2, &["seq", "another folder"]);
    succeeds(folder.path(), &["match", "seq"]);
    let before = fs::read(folder.path().join("seq/results/disparity.tiff")).unwrap();
    fails(folder.path(), &["match", "seq"], 2, &["seq/results", "--overwrite"]);
    assert_eq!(before, fs::read(folder.path().join("seq/results/disparity.tiff")).unwrap());
    succeeds(folder.path(), &["match", "seq", "--overwrite"]);
    assert_eq!(before, fs::read(folder.path().join("seq/results/disparity.tiff")).unwrap());
    // Nor are results to which a person has added something, nor a file.
    fs::write(folder.path().join("seq/results/thesis.txt"), "years of work").unwrap();
    fails(folder.path(), &["match", "seq", "--overwrite"], 2, &["seq/results", "another folder"]);
    fs::write(folder.path().join("notes.txt"), "notes").unwrap();
    fails(folder.path(), &["match", "seq", "--out", "notes.txt"], 2, &["notes.txt", "another folder"]);
    assert_eq!(fs::read_to_string(folder.path().join("notes.txt")).unwrap(), "notes");
    // A folder of something else is never replaced.
    fails(
        folder.path(),
        &["match", "seq", "--overwrite", "--out", "photos"],
        2,
        &["photos", "another folder"],
    );
    assert_eq!(names(&folder.path().join("photos")).len(), 9);
}

#[test]
fn a_folder_that_cannot_be_written() {
    let folder = folder();
    sequence(folder.path());
    // A file where a folder should be: refused to everybody, even to an administrator.
    fs::write(folder.path().join("file"), "").unwrap();
    fails(folder.path(), &["match", "seq", "--out", "file/results"], 1, &["file", "--out"]);
    fails(folder.path(), &["import", "photos", "--out", "file/seq"], 1, &["file"]);
    assert_eq!(names(folder.path()), ["file", "photos", "seq"]);
}

/// Runs the program in a folder on a file system of 256 KiB that only it sees; `None` where that is not allowed.
fn on_a_small_disk(folder: &Path, setup: &str, arguments: &str) -> Option<std::process::Output> {
    let program = assert_cmd::cargo::cargo_bin!("epirig");
    let script = format!(
        "mount -t tmpfs -o size=256k tmpfs disk || exit 99; {setup}; {} {arguments}; code=$?; ls -A disk; exit $code",
        program.display()
    );
    let command = Command::new("unshare").args(["-rm", "sh", "-c", &script]).current_dir(folder).output();
    let output = command.ok()?;
    let refused =
        output.status.code() == Some(99) || String::from_utf8_lossy(&output.stderr).contains("unshare:");
    (!refused).then_some(output)
}

#[test]
fn a_full_disk() {
    let folder = folder();
    sequence(folder.path());
    fs::create_dir(folder.path().join("disk")).unwrap();
    for arguments in ["match seq --out disk/results", "import photos --out disk/seq"] {
        // What is left after the filler is less than either needs.
        let filler = "head -c 240000 /dev/zero > disk/filler";
        let Some(output) = on_a_small_disk(folder.path(), filler, arguments) else {
            eprintln!(
                "SKIPPED a_full_disk: this machine lets no test mount a small file system (unshare -rm)"
            );
            return;
        };
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments}: {stderr}");
        assert!(stderr.contains("disk/") && stderr.contains("make room"), "{stderr}");
        assert_eq!(
            String::from_utf8_lossy(&output.stdout).trim(),
            "filler",
            "{arguments} left something behind"
        );
    }
}

#[test]
fn records_that_cannot_be_understood() {
    let folder = folder();
    sequence(folder.path());
    let path = folder.path().join("seq/sequence.json");
    let record = fs::read_to_string(&path).unwrap();
    fs::write(&path, record.replace("\"format\": 4", "\"format\": 99")).unwrap();
    fails(folder.path(), &["match", "seq"], 5, &["sequence.json", "version 99"]);
    fs::write(&path, &record[..record.len() / 2]).unwrap();
    fails(folder.path(), &["match", "seq"], 5, &["sequence.json"]);
    fs::write(&path, &record).unwrap();
    let journal = folder.path().join("seq/journal.jsonl");
    let lines = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, lines.replacen("\"blake3\"", "\"black3\"", 1)).unwrap();
    fails(folder.path(), &["match", "seq"], 5, &["journal.jsonl", "line 1"]);
    // A last line that was cut short by a crash is no error; the frame it named is missing.
    fs::write(&journal, &lines[..lines.len() - 20]).unwrap();
    let output = epirig(folder.path(), &["verify", "seq"]);
    assert_eq!(output.status.code(), Some(5));
    assert!(String::from_utf8_lossy(&output.stdout).contains("frame 8"));
}
