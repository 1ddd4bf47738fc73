//! Calibrations that were changed, or whose maps were.

use std::fs;
use std::path::Path;

use epirig_core::frame::{Frame, Samples};
use serde_json::Value;

use super::{change_lines, folder};
use crate::support::{epirig, fails, images, succeeds, write_png};

/// A sequence with flat frames, calibrated, whose positions are from its texture.
fn calibrated(folder: &Path) {
    images(&folder.join("photos"), 9);
    fs::create_dir(folder.join("white")).unwrap();
    for index in 0..3_usize {
        let samples = (0..24 * 64_usize).map(|pixel| 200 + ((pixel * 7 + index * 5) % 3) as u8);
        let frame = Frame::new(24, 64, 8, Samples::U8(samples.collect())).unwrap();
        write_png(&folder.join(format!("white/{index}.png")), &frame);
    }
    let import = ["import", "photos", "--out", "seq", "--step-mm", "1.5", "--focal-length-px", "100"];
    succeeds(folder, &[&import[..], &["--flat", "white"]].concat());
    succeeds(folder, &["calibrate", "seq", "--positions", "texture", "--flat-field", "pixels"]);
}

fn read(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("seq/calibration.json")).unwrap()).unwrap()
}

/// Neither `verify` nor `match` takes the calibration.
fn is_refused(folder: &Path, words: &[&str]) {
    let output = epirig(folder, &["verify", "seq"]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(5), "{words:?}: {said}");
    assert!(words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
    fails(folder, &["match", "seq", "--range", "0..9"], 5, words);
    assert!(!folder.join("seq/results").exists());
}

#[test]
fn a_calibration_that_was_changed_is_not_used() {
    let folder = folder();
    calibrated(folder.path());
    succeeds(folder.path(), &["verify", "seq"]);
    let sound = read(folder.path());
    let path = folder.path().join("seq/calibration.json");
    let changes: [(&str, Value, &str); 8] = [
        ("/positions/tau/0", (-1.0).into(), "from 0 to 1"),
        ("/positions/tau/3", 0.46.into(), "measured positions"),
        ("/positions/tau/3", 0.9.into(), "increase"),
        (
            "/positions/positioning_error/frames/3/reported_mm",
            4.6.into(),
            "its reported position of frame 3 differs",
        ),
        ("/positions/baseline_mm", 13.0.into(), "baseline"),
        ("/mapping/lens/distortion/k1", (-1.0).into(), "another lens"),
        ("/lens/estimate/lens/focal_length_x_px", 110.0.into(), "another lens"),
        ("/mapping/roll_rad", 0.1.into(), "another stage axis"),
    ];
    for (key, value, words) in changes {
        let mut changed = sound.clone();
        *changed.pointer_mut(key).unwrap_or_else(|| panic!("{key} is not in {sound}")) = value;
        fs::write(&path, changed.to_string()).unwrap();
        is_refused(folder.path(), &["calibration.json", "changed after it was made"]);
        fails(
            folder.path(),
            &["calibrate", "seq", "--overwrite", "--lens", "seq/calibration.json"],
            5,
            &["changed after it was made"],
        );
        // With a corrected hash, redundant values still contradict each other.
        let mut record: epirig::calibrate::Calibration = serde_json::from_value(changed).unwrap();
        record.blake3 = record.hash();
        fs::write(&path, serde_json::to_vec(&record).unwrap()).unwrap();
        is_refused(folder.path(), &["calibration.json", words]);
    }
    // What only looks otherwise is the same.
    fs::write(&path, sound.to_string()).unwrap();
    succeeds(folder.path(), &["verify", "seq"]);
    // Positions that have changed since.
    change_lines(folder.path(), |lines| lines[3]["commanded_mm"] = 4.6.into());
    let text = fs::read_to_string(folder.path().join("seq/sequence.json")).unwrap();
    fs::write(folder.path().join("seq/sequence.json"), text.replace("    4.5,", "    4.6,")).unwrap();
    is_refused(folder.path(), &["calibration.json", "stale"]);
}

#[test]
fn maps_of_a_calibration_that_are_missing_or_changed_are_found() {
    let folder = folder();
    calibrated(folder.path());
    let map = folder.path().join("seq/calibration/flat-field.tiff");
    let mut bytes = fs::read(&map).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&map, bytes).unwrap();
    is_refused(folder.path(), &["flat-field.tiff", "not the map"]);
    fs::remove_file(&map).unwrap();
    is_refused(folder.path(), &["flat-field.tiff", "missing"]);
}

#[test]
fn a_calibration_in_place_is_no_failure_when_its_folder_cannot_be_tidied_up() {
    let folder = folder();
    calibrated(folder.path());
    // By its name a map that an unfinished calibration has left; as a folder it cannot be removed as one.
    fs::create_dir(folder.path().join("seq/calibration/dark-0123456789abcdef.tiff")).unwrap();
    let again = ["calibrate", "seq", "--positions", "texture", "--overwrite"];
    let output = epirig(folder.path(), &again);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("calibration.json is in place and whole, but cannot tidy up"), "{said}");
    succeeds(folder.path(), &["verify", "seq"]);
}

#[test]
fn an_impossible_sigma_of_rectified_frames_is_refused() {
    let folder = folder();
    calibrated(folder.path());
    succeeds(folder.path(), &["rectify", "seq", "--out", "flat"]);
    let path = folder.path().join("flat/sequence.json");
    let sound: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    for key in ["focal_length_sigma", "baseline_sigma"] {
        let mut changed = sound.clone();
        changed["origin"][key] = (-0.01).into();
        fs::write(&path, changed.to_string()).unwrap();
        let words = ["sequence.json", "a relative standard uncertainty of -0.01 cannot be"];
        fails(folder.path(), &["match", "flat"], 5, &words);
    }
}
