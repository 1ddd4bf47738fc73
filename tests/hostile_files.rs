//! Files that were damaged, exchanged or made to do harm: nothing hangs, nothing outside is read, and nothing is believed that another record or the
//! files themselves contradict.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod support;

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

use epirig::frame::{Frame, Samples};
use support::{epirig, fails, images, names, succeeds, twin, write_png};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// A sequence of images that other software took, with positions and a lens.
fn imported(folder: &Path) {
    images(&folder.join("photos"), 9);
    let arguments = ["import", "photos", "--out", "seq", "--step-mm", "1.5", "--focal-length-px", "100"];
    succeeds(folder, &arguments);
}

/// A scan of eight frames with their certificates.
fn captured(folder: &Path) {
    let plan = ["--size", "64x48", "--set", "plan.frames=8", "--set", "sim.scene=plane"];
    succeeds(folder, &[&["capture", "--out", "seq", "--rig", "sim"][..], &plan].concat());
}

/// Replaces a text that is there once in a file of the sequence.
fn edit(folder: &Path, file: &str, from: &str, to: &str) {
    let path = folder.join("seq").join(file);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from} is not in {file}:\n{text}");
    fs::write(&path, text.replacen(from, to, 1)).unwrap();
}

/// The line of the journal about a frame, as JSON.
fn line(folder: &Path, index: usize) -> serde_json::Value {
    let journal = fs::read_to_string(folder.join("seq/journal.jsonl")).unwrap();
    serde_json::from_str(journal.lines().nth(index).unwrap()).unwrap()
}

/// Changes lines of the journal.
fn change_lines(folder: &Path, change: impl Fn(&mut Vec<serde_json::Value>)) {
    let path = folder.join("seq/journal.jsonl");
    let journal = fs::read_to_string(&path).unwrap();
    let mut lines = journal.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    change(&mut lines);
    let lines: Vec<String> = lines.iter().map(|line| format!("{line}\n")).collect();
    fs::write(&path, lines.concat()).unwrap();
}

/// `verify` finds these words, and nothing is calibrated or matched.
fn is_refused(folder: &Path, words: &[&str]) {
    let output = epirig(folder, &["verify", "seq"]);
    let said =
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(5), "{said}");
    for word in words {
        assert!(said.contains(word), "verify does not say \"{word}\": {said}");
    }
    fails(folder, &["match", "seq", "--range", "0..9"], 5, &[]);
    fails(folder, &["calibrate", "seq", "--positions", "texture"], 5, &[]);
    assert!(!folder.join("seq/results").exists() && !folder.join("seq/calibration.json").exists());
}

fn make_pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// The program's exit code and what it said, if it ends by itself within a minute: what waits for a pipe would not.
fn within_a_minute(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
    command.current_dir(folder).env("XDG_CONFIG_HOME", folder).args(arguments);
    let output = command.timeout(std::time::Duration::from_secs(60)).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn names_of_images_without_a_file_behind_them_are_named_and_refused() {
    let folder = folder();
    let photos = folder.path().join("photos");
    images(&photos, 9);
    let import = ["import", "photos", "--out", "seq", "--step-mm", "1.5"];
    let refused = |words: &[&str]| {
        let (code, said) = within_a_minute(folder.path(), &import);
        assert_eq!(code, Some(5), "{said}");
        assert!(words.iter().all(|word| said.contains(word)), "{words:?} {said}");
        assert!(!folder.path().join("seq").exists());
    };
    symlink("nowhere.png", photos.join("frame_3b.png")).unwrap();
    refused(&["frame_3b.png"]);
    fs::create_dir(photos.join("frame_4b.png")).unwrap();
    make_pipe(&photos.join("frame_5b.tif"));
    refused(&["frame_3b.png", "frame_4b.png is a folder", "frame_5b.tif is a pipe"]);
    fs::remove_file(photos.join("frame_3b.png")).unwrap();
    fs::remove_dir(photos.join("frame_4b.png")).unwrap();
    fs::remove_file(photos.join("frame_5b.tif")).unwrap();
    // Nor are those of calibration images.
    fs::create_dir(folder.path().join("dark")).unwrap();
    write_png(&folder.path().join("dark/0.png"), &twin(9).expose(0.0, 0));
    symlink("loop.png", folder.path().join("dark/loop.png")).unwrap();
    fails(folder.path(), &[&import[..], &["--dark", "dark"]].concat(), 5, &["dark", "loop.png"]);
    // A link to a file is one, and what a system hides beside an image is none.
    fs::rename(photos.join("frame_3.png"), folder.path().join("elsewhere.png")).unwrap();
    symlink("../elsewhere.png", photos.join("frame_3.png")).unwrap();
    fs::write(photos.join("._frame_3.png"), "notes of a Macintosh").unwrap();
    let output = epirig(folder.path(), &import);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("._frame_3.png"), "{said}");
    assert_eq!(names(&folder.path().join("seq/frames")).len(), 9);
}

#[test]
fn positions_that_contradict_each_other_are_refused() {
    let folder = folder();
    captured(folder.path());
    let reported = line(folder.path(), 3)["reported_mm"].as_f64().unwrap();
    change_lines(folder.path(), |lines| lines[3]["reported_mm"] = (reported + 0.9).into());
    is_refused(folder.path(), &["frame 3", "after the exposure", "are allowed"]);
    // Also if whoever changed it changed the reading with it.
    change_lines(folder.path(), |lines| lines[3]["certificate"]["readings_mm"][1] = (reported + 0.9).into());
    is_refused(folder.path(), &["frame 3", "are allowed"]);
    // Or said where it was sent.
    change_lines(folder.path(), |lines| lines[3]["commanded_mm"] = (reported + 0.9).into());
    is_refused(folder.path(), &["frame 3", "not the planned one"]);
    fails(folder.path(), &["resume", "seq"], 5, &["frame 3"]);
}

#[test]
fn whatever_is_told_twice_has_to_agree() {
    type Change = fn(&mut Vec<serde_json::Value>);
    let changes: [(Change, &[&str]); 9] = [
        (|lines| lines[2]["bytes"] = 7.into(), &["0002.png", "7 bytes"]),
        (|lines| lines[2]["mean_dn"] = 12.5.into(), &["0002.png", "12.5"]),
        (|lines| lines[2]["saturated"] = 1.into(), &["at full scale"]),
        (|lines| lines[2]["file"] = "frames/0003.png".into(), &["frame 2", "frames/0003.png instead of"]),
        (
            |lines| {
                for key in ["file", "blake3", "bytes", "mean_dn", "saturated"] {
                    let one = lines[2][key].take();
                    let other = lines[5][key].take();
                    (lines[2][key], lines[5][key]) = (other, one);
                }
            },
            &["frame 2", "frame 5", "instead of"],
        ),
        (|lines| lines[2]["certificate"]["saturated_share"] = 0.005.into(), &["frame 2", "full scale"]),
        (|lines| lines[2]["exposure"]["exposure_start_ns"] = 0.into(), &["frame 2", "at rest"]),
        (|lines| lines[2]["index"] = 3.into(), &["frame 3", "twice"]),
        (
            |lines| {
                lines.push(
                    serde_json::json!({"event": "retake", "index": 99, "attempt": 1, "reason": "", "at": ""}),
                )
            },
            &["frame 99"],
        ),
    ];
    for (change, words) in changes {
        let folder = folder();
        captured(folder.path());
        change_lines(folder.path(), change);
        let output = epirig(folder.path(), &["verify", "seq"]);
        let said = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(5), "{words:?}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
    }
    let records: [(&str, &str, &[&str]); 4] = [
        ("\n    \"focal_length_px\": ", "\n    \"focal_length_px\": 1", &["focal length"]),
        ("\"step_mm\": ", "\"step_mm\": 1", &["planned positions"]),
        ("\"focal_length_px\": ", "\"focal_length_px\": 1", &["simulated rig"]),
        ("\"averaged\": 1", "\"averaged\": 2", &["averaged"]),
    ];
    for (from, to, words) in records {
        let folder = folder();
        captured(folder.path());
        succeeds(folder.path(), &["verify", "seq"]);
        edit(folder.path(), "sequence.json", from, to);
        let output = epirig(folder.path(), &["verify", "seq"]);
        let said = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(5), "{from}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
    }
}

#[test]
fn numbers_that_cannot_be_are_refused() {
    for (from, to, words) in [
        ("\"focal_length_px\": 100.0", "\"focal_length_px\": 0.0", "focal length"),
        ("\"focal_length_px\": 100.0", "\"focal_length_px\": -1.0", "focal length"),
        ("\"focal_length_px\": 100.0", "\"focal_length_px\": 1e308", "focal length"),
        ("\"principal_point_x_px\": 31.5", "\"principal_point_x_px\": 1e300", "principal point"),
        ("\"frames\": 9", "\"frames\": 9223372036854775808", "9223372036854775808 frames"),
        ("\"frames\": 9", "\"frames\": 0", "0 frames"),
        ("\"rows\": 24", "\"rows\": 4611686018427387904", "cannot be"),
        ("\"columns\": 64", "\"columns\": 0", "cannot be"),
        ("\"bit_depth\": 8", "\"bit_depth\": 200", "cannot be"),
        ("\"bit_depth\": 8", "\"bit_depth\": 300", "bit_depth"),
    ] {
        let folder = folder();
        imported(folder.path());
        edit(folder.path(), "sequence.json", from, to);
        is_refused(folder.path(), &["sequence.json", words]);
    }
    let folder = folder();
    imported(folder.path());
    // Their span is larger than the largest number.
    change_lines(folder.path(), |lines| {
        lines[0]["commanded_mm"] = (-1.5e308).into();
        lines[8]["commanded_mm"] = 1.5e308.into();
    });
    is_refused(folder.path(), &["no stage goes farther"]);
    fails(
        folder.path(),
        &["import", "photos", "--out", "far", "--step-mm", "1e308"],
        5,
        &["photos", "finite"],
    );
    fails(folder.path(), &["import", "photos", "--out", "far", "--step-mm", "1e300"], 5, &["no stage goes"]);
    fs::write(folder.path().join("far.csv"), "-1.5e308\n0\n1\n2\n3\n4\n5\n6\n1.5e308\n").unwrap();
    fails(folder.path(), &["import", "photos", "--out", "far", "--positions", "far.csv"], 5, &["far.csv"]);
}

#[test]
fn a_recorded_plan_that_no_rig_has_is_refused() {
    for (from, to) in [
        ("\"frames\": 8,\n        \"settle_s\"", "\"frames\": 1000000000000000,\n        \"settle_s\""),
        ("\"average\": 1", "\"average\": 1000000000000000"),
        ("\"dark\": 0", "\"dark\": 1000000000000000"),
        ("\"retakes\": 3", "\"retakes\": 1000000000000000"),
        ("\"start_mm\": 10.0", "\"start_mm\": 1e300"),
    ] {
        let folder = folder();
        captured(folder.path());
        edit(folder.path(), "sequence.json", from, to);
        for verb in ["resume", "calibrate"] {
            fails(folder.path(), &[verb, "seq"], 5, &["sequence.json", "rig."]);
        }
        let output = epirig(folder.path(), &["verify", "seq"]);
        assert_eq!(output.status.code(), Some(5), "{to}");
    }
}

#[test]
fn a_wrong_record_costs_no_good_frame() {
    for (from, to) in [
        ("\"rows\": 48,\n  \"columns\"", "\"rows\": 49,\n  \"columns\""),
        ("\n  \"bit_depth\": 8", "\n  \"bit_depth\": 12"),
        ("\n  \"bit_depth\": 8", "\n  \"bit_depth\": 3"),
    ] {
        let folder = folder();
        captured(folder.path());
        fs::remove_file(folder.path().join("seq/stop.json")).unwrap();
        edit(folder.path(), "sequence.json", from, to);
        let frame = folder.path().join("seq/frames/0002.png");
        let before = fs::read(&frame).unwrap();
        fails(folder.path(), &["resume", "seq"], 5, &["sequence.json", "restore"]);
        assert_eq!(fs::read(&frame).unwrap(), before);
        fails(folder.path(), &["match", "seq"], 5, &["sequence.json"]);
    }
    // A frame that is damaged is taken again all the same.
    let folder = folder();
    captured(folder.path());
    fs::write(folder.path().join("seq/frames/0002.png"), "damaged").unwrap();
    succeeds(folder.path(), &["resume", "seq"]);
    succeeds(folder.path(), &["verify", "seq"]);
}

#[test]
fn what_verify_refuses_resume_does_not_call_complete() {
    let folder = folder();
    captured(folder.path());
    succeeds(folder.path(), &["resume", "seq"]);
    change_lines(folder.path(), |lines| lines[2]["mean_dn"] = 12.5.into());
    fails(folder.path(), &["resume", "seq"], 5, &["0002.png", "12.5"]);
}

#[test]
fn a_scan_that_was_not_closed_is_measured_on_request_only_and_the_results_say_so() {
    let folder = folder();
    let images = folder.path();
    support::images(&images.join("photos"), 21);
    for kind in ["dark", "white"] {
        fs::create_dir(images.join(kind)).unwrap();
        for index in 0..3_u8 {
            let level = if kind == "dark" { 3 } else { 200 };
            let samples =
                (0..24 * 64_usize).map(|pixel| level + (pixel * 7 + usize::from(index) * 5) as u8 % 3);
            let frame = Frame::new(24, 64, 8, Samples::U8(samples.collect())).unwrap();
            write_png(&images.join(kind).join(format!("{index}.png")), &frame);
        }
    }
    let import = ["import", "photos", "--out", "seq", "--step-mm", "1.5", "--focal-length-px", "100"];
    succeeds(images, &[&import[..], &["--dark", "dark", "--flat", "white"]].concat());
    edit(images, "stop.json", "\"complete\"", "\"not-closed\"");
    let words = ["not closed", "positions", "--anyway"];
    fails(images, &["calibrate", "seq"], 5, &words);
    fails(images, &["match", "seq"], 5, &words);
    fails(images, &["evaluate", "seq", "--both-ways"], 5, &words);
    assert!(!images.join("seq/results").exists() && !images.join("seq/calibration.json").exists());
    succeeds(images, &["calibrate", "seq", "--anyway"]);
    assert!(fs::read_to_string(images.join("seq/calibration.json")).unwrap().contains("not closed"));
    let output = epirig(images, &["match", "seq", "--anyway", "--reference", "middle"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("not closed"), "{said}");
    assert!(fs::read_to_string(images.join("seq/results/match.json")).unwrap().contains("\"not-closed\""));
    fails(images, &["surface", "seq"], 5, &words);
    // What is made of it is no better.
    fails(images, &["rectify", "seq", "--out", "straight"], 5, &words);
    succeeds(images, &["rectify", "seq", "--out", "straight", "--anyway"]);
    fails(images, &["match", "straight"], 5, &words);
    assert_eq!(epirig(images, &["verify", "straight"]).status.code(), Some(5));
}

#[test]
fn frames_are_files_inside_the_sequence() {
    let folder = folder();
    imported(folder.path());
    let frame = folder.path().join("seq/frames/0004.png");
    let kept = fs::read(&frame).unwrap();
    fs::write(folder.path().join("outside.png"), &kept).unwrap();
    let refused = |words: &[&str]| {
        for verb in ["verify", "match"] {
            let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
            command.current_dir(folder.path()).env("XDG_CONFIG_HOME", folder.path()).args([verb, "seq"]);
            let output = command.timeout(std::time::Duration::from_secs(60)).output().unwrap();
            let said = format!(
                "{}{}",
                String::from_utf8_lossy(&output.stdout),
                String::from_utf8_lossy(&output.stderr)
            );
            assert_eq!(output.status.code(), Some(5), "{said}");
            assert!(words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
        }
    };
    fs::remove_file(&frame).unwrap();
    make_pipe(&frame);
    refused(&["0004.png", "a pipe"]);
    fs::remove_file(&frame).unwrap();
    symlink("../../outside.png", &frame).unwrap();
    refused(&["0004.png", "outside"]);
    fs::remove_file(&frame).unwrap();
    symlink("/dev/zero", &frame).unwrap();
    refused(&["0004.png", "outside"]);
    fs::remove_file(&frame).unwrap();
    fs::write(&frame, &kept).unwrap();
    succeeds(folder.path(), &["verify", "seq"]);
    for name in ["/dev/zero", "../outside.png", "frames/../../outside.png"] {
        let journal = folder.path().join("seq/journal.jsonl");
        let before = fs::read(&journal).unwrap();
        edit(folder.path(), "journal.jsonl", "frames/0004.png", name);
        refused(&[name]);
        fs::write(&journal, before).unwrap();
    }
    // A sparse file of a terabyte.
    fs::File::options().write(true).open(&frame).unwrap().set_len(1 << 40).unwrap();
    refused(&["0004.png", "larger than"]);
}

#[test]
fn records_that_are_pipes_do_not_hang() {
    for record in ["sequence.json", "journal.jsonl", "stop.json", "calibration.json"] {
        let folder = folder();
        imported(folder.path());
        let path = folder.path().join("seq").join(record);
        let _ = fs::remove_file(&path);
        make_pipe(&path);
        let (code, said) = within_a_minute(folder.path(), &["match", "seq"]);
        assert_eq!(code, Some(5), "{record}: {said}");
        assert!(said.contains(record) && said.contains("a pipe"), "{said}");
    }
}

/// A grey PNG whose head says that it has this size, and little more.
fn png_that_says(columns: u32, rows: u32) -> Vec<u8> {
    let frame = Frame::new(1, 1, 8, Samples::U8(vec![0])).unwrap();
    let mut bytes = epirig::sequence::encode_png(&frame).unwrap();
    // Signature, length, "IHDR", then the size; the checksum follows 17 bytes after its length.
    bytes[16..20].copy_from_slice(&columns.to_be_bytes());
    bytes[20..24].copy_from_slice(&rows.to_be_bytes());
    let mut checksum = u32::MAX;
    for &byte in &bytes[12..29] {
        checksum ^= u32::from(byte);
        for _ in 0..8 {
            checksum = (checksum >> 1) ^ (0xedb8_8320 & (checksum & 1).wrapping_neg());
        }
    }
    bytes[29..33].copy_from_slice(&(!checksum).to_be_bytes());
    bytes
}

#[test]
fn a_small_file_that_says_it_is_large_is_not_decoded() {
    let folder = folder();
    imported(folder.path());
    let bomb = png_that_says(60_000, 60_000);
    fs::write(folder.path().join("photos/frame_4.png"), &bomb).unwrap();
    let words = ["frame_4.png", "60000 x 60000"];
    fails(folder.path(), &["import", "photos", "--out", "other"], 5, &words);
    fs::remove_file(folder.path().join("photos/frame_0.png")).unwrap();
    fs::write(folder.path().join("photos/frame_0.png"), &bomb).unwrap();
    fails(folder.path(), &["import", "photos", "--out", "other"], 5, &["frame_0.png", "60000 x 60000"]);
    // Under the hash that the journal has: its head is compared with the record first.
    let bomb = png_that_says(16_000, 16_000);
    fs::write(folder.path().join("seq/frames/0004.png"), &bomb).unwrap();
    let hash = blake3::hash(&bomb).to_hex().to_string();
    change_lines(folder.path(), |lines| {
        lines[4]["blake3"] = hash.clone().into();
        lines[4]["bytes"] = bomb.len().into();
    });
    is_refused(folder.path(), &["0004.png", "16000 x 16000", "64 x 24"]);
}

#[test]
fn many_lines_and_many_keys_are_read_in_one_go() {
    let folder = folder();
    imported(folder.path());
    let sound = line(folder.path(), 0);
    change_lines(folder.path(), |lines| {
        for index in 0..100_000 {
            let mut line = sound.clone();
            line["index"] = index.into();
            lines.push(line);
        }
    });
    let (code, said) = within_a_minute(folder.path(), &["match", "seq"]);
    assert_eq!(code, Some(5), "{said}");
    let keys: String = (0..100_000).map(|index| format!("unknown{index} = 1\n")).collect();
    fs::write(folder.path().join("rig.toml"), format!("[plan]\n{keys}[camera.controls]\n{keys}")).unwrap();
    let (code, said) = within_a_minute(folder.path(), &["plan"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("line 2:") && said.contains("not looked at"), "{said}");
}

#[test]
fn files_that_nest_or_promise_too_much_end_with_an_error() {
    let folder = folder();
    imported(folder.path());
    for (name, text) in [
        ("list.yml", "- ".repeat(50_000)),
        ("map.yml", (0..5_000).map(|depth| format!("{}a:\n", " ".repeat(depth))).collect()),
        ("flow.yml", "[".repeat(50_000)),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        let (code, said) = within_a_minute(folder.path(), &["calibrate", "seq", "--lens", name]);
        assert_eq!(code, Some(5), "{name}: {said}");
        assert!(said.contains(name), "{said}");
    }
    succeeds(folder.path(), &["match", "seq"]);
    let npy = |header: &str, length: u32| {
        let mut bytes = b"\x93NUMPY\x02\0".to_vec();
        bytes.extend(length.to_le_bytes());
        bytes.extend(header.bytes());
        bytes
    };
    for (name, bytes) in [
        ("overflow.pfm", format!("Pf\n{} 0\n-1.0\n", 1_u64 << 62).into_bytes()),
        ("deep.npy", npy(&"(".repeat(60), 60)),
        ("long.npy", npy("{", u32::MAX)),
        (
            "huge.npy",
            npy("{'descr': '<f4', 'fortran_order': False, 'shape': (4611686018427387904, 4), }", 78),
        ),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
        let (code, said) = within_a_minute(folder.path(), &["evaluate", "seq", "--truth", name]);
        assert_eq!(code, Some(5), "{name}: {said}");
        assert!(said.contains(name), "{said}");
    }
}

#[test]
fn errors_say_what_is_wrong_and_where() {
    let folder = folder();
    imported(folder.path());
    let path = folder.path().join("seq/sequence.json");
    let record = fs::read_to_string(&path).unwrap();
    let said = |arguments: &[&str]| {
        let output = epirig(folder.path(), arguments);
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    // Not UTF-8: the disk is not at fault.
    let mut bytes = record.clone().into_bytes();
    bytes[40] = 0xe9;
    fs::write(&path, bytes).unwrap();
    let (code, error) = said(&["match", "seq"]);
    assert_eq!(code, Some(5), "{error}");
    assert!(
        error.contains("UTF-8") && error.contains("sequence.json") && !error.contains("check the disk"),
        "{error}"
    );
    // A value of another type: its key and line.
    fs::write(&path, record.replace("\"bit_depth\": 8", "\"bit_depth\": \"eight\"")).unwrap();
    let (code, error) = said(&["match", "seq"]);
    assert_eq!(code, Some(5), "{error}");
    let line = record.lines().position(|line| line.contains("bit_depth")).unwrap() + 1;
    assert!(error.contains(&format!("line {line}: bit_depth")), "{error}");
    fs::write(&path, &record).unwrap();
    let journal = folder.path().join("seq/journal.jsonl");
    let lines = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, lines.replacen("\"mean_dn\":", "\"mean_dn\":\"dark\",\"x\":", 1)).unwrap();
    fails(folder.path(), &["match", "seq"], 5, &["journal.jsonl, line 1: mean_dn"]);
    fs::write(&journal, &lines).unwrap();
    // A size that the frames do not have: the record is at fault, and no frame is to be removed.
    fs::write(
        &path,
        record.replace("\"columns\": 64", "\"columns\": 160").replace("\"rows\": 24", "\"rows\": 1"),
    )
    .unwrap();
    let (code, error) = said(&["match", "seq"]);
    assert_eq!(code, Some(5), "{error}");
    assert!(
        error.contains("160 x 1") && error.contains("64 x 24") && !error.contains("remove it"),
        "{error}"
    );
    fs::write(&path, &record).unwrap();
    // A replay of a damaged sequence cannot be gone on with.
    fs::write(folder.path().join("seq/frames/0004.png"), "damaged").unwrap();
    let replay = ["--driver", "sim", "--camera", "replay:seq", "--step-mm", "1.5", "--frames", "9"];
    let (code, error) = said(&[&["capture", "--out", "again"][..], &replay].concat());
    assert_eq!(code, Some(5), "{error}");
    assert!(error.contains("0004.png") && !error.contains("epirig resume"), "{error}");
}

#[test]
fn who_reads_no_further_is_told_nothing() {
    let folder = folder();
    for arguments in
        [&["completions", "bash"][..], &["plan", "--rig", "sim"], &["plan", "--rig", "sim", "--json"]]
    {
        let mut child = Command::new(env!("CARGO_BIN_EXE_epirig"))
            .args(arguments)
            .current_dir(folder.path())
            .env("XDG_CONFIG_HOME", folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !said.contains("error"), "{arguments:?}: {said}");
    }
}

#[test]
fn a_sound_image_of_a_kind_that_is_not_read_is_not_called_damaged() {
    let folder = folder();
    images(&folder.path().join("photos"), 3);
    let map = epirig::plane::Plane::filled(24, 64, 0.5_f32);
    let bytes = epirig::formats::MapFormat::Tiff.encode(&map).unwrap();
    fs::write(folder.path().join("photos/frame_1.tif"), bytes).unwrap();
    let output = epirig(folder.path(), &["import", "photos", "--out", "seq"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert!(
        said.contains("frame_1.tif") && said.contains("8 or 16 bit") && !said.contains("damaged"),
        "{said}"
    );
}

#[test]
#[cfg(target_os = "linux")]
fn what_does_not_fit_into_memory_is_refused_before_it_begins() {
    let folder = folder();
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    // Maps of 2.25 million pixels take some 400 MB.
    let samples: Vec<u8> =
        (0..1500 * 1500_u32).map(|pixel| (pixel.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    for index in 0..3 {
        let frame = Frame::new(1500, 1500, 8, Samples::U8(samples.clone())).unwrap();
        write_png(&photos.join(format!("{index}.png")), &frame);
    }
    succeeds(folder.path(), &["import", "photos", "--out", "seq"]);
    let limited = |kib: u32, arguments: &str| {
        let script = format!("ulimit -v {kib}; exec {} {arguments}", env!("CARGO_BIN_EXE_epirig"));
        let mut command = Command::new("sh");
        command.args(["-c", &script]).current_dir(folder.path()).env("XDG_CONFIG_HOME", folder.path());
        let output = command.output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for arguments in
        ["match seq --range 0..9", "calibrate seq --positions texture", "evaluate seq --both-ways"]
    {
        let (code, said) = limited(300_000, arguments);
        assert_eq!(code, Some(1), "{arguments}: {said}");
        assert!(said.contains("of memory") && said.contains("ulimit"), "{arguments}: {said}");
    }
    assert_eq!(names(&folder.path().join("seq")), ["frames", "journal.jsonl", "sequence.json", "stop.json"]);
}
