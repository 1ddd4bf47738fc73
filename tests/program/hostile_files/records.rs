//! Records that contradict each other, the frames, or what can be.

use std::fs;

use epirig_core::frame::{Frame, Samples};

use super::{captured, change_lines, edit, folder, imported, is_refused, line};
use crate::support::{self, epirig, fails, succeeds, write_png};

#[test]
fn positions_that_contradict_each_other_are_refused() {
    let folder = folder();
    captured(folder.path());
    let reported = line(folder.path(), 3)["reported_mm"].as_f64().unwrap();
    change_lines(folder.path(), |lines| lines[3]["reported_mm"] = (reported + 0.9).into());
    is_refused(folder.path(), &["frame 3", "after the exposure", "are allowed"]);
    // Also if the reading was changed with it.
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
    let changes: [(Change, &[&str]); 24] = [
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
                // Within its own tolerance.
                lines[3]["certificate"]["position_tolerance_mm"] = 100.0.into();
                lines[3]["certificate"]["readings_mm"] = serde_json::json!([15.3, 15.3]);
                lines[3]["reported_mm"] = 15.3.into();
            },
            &["frame 3", "100 mm off", "the rig 0.02 mm"],
        ),
        (|lines| lines[3]["certificate"]["saturated_limit"] = 1.0.into(), &["frame 3", "other limits"]),
        (|lines| lines[3]["certificate"]["controls_as_set"] = 77.into(), &["frame 3", "other limits"]),
        (|lines| lines[3]["certificate"]["settle_ms"] = (-1e308).into(), &["frame 3", "limits", "cannot be"]),
        (|lines| lines[3]["certificate"]["attempt"] = 9.into(), &["frame 3", "attempt 9"]),
        (
            |lines| drop(lines[3].as_object_mut().unwrap().remove("reported_mm")),
            &["frame 3", "reported is missing"],
        ),
        (|lines| lines[3]["exposure"]["received_ns"] = 0.into(), &["frame 3", "received before"]),
        (
            |lines| {
                for line in lines.iter_mut() {
                    line["certificate"]["position_tolerance_mm"] = 1.0.into();
                }
                lines[3]["certificate"]["readings_mm"] = serde_json::json!([15.4, 15.4]);
                lines[3]["reported_mm"] = 15.4.into();
            },
            &["frame 3", "1 mm off", "the rig 0.02 mm"],
        ),
        (
            |lines| {
                for line in lines.iter_mut() {
                    drop(line.as_object_mut().unwrap().remove("certificate"));
                }
                lines[3]["reported_mm"] = 15.4.into();
            },
            &["frame 0: its certificate is missing", "frame 3", "stood at 15.4 mm"],
        ),
        (
            |lines| lines[3]["camera_sequence"] = lines[2]["camera_sequence"].clone(),
            &["frame 3", "the camera counted it"],
        ),
        (|lines| lines[3]["camera_sequence"] = 1.into(), &["frame 3", "the camera counted it"]),
        (|lines| lines[3]["exposure"]["stamp_ns"] = 0.into(), &["0003.png", "stamp of 0 ns"]),
        (
            |lines| lines[3]["exposure"] = lines[2]["exposure"].clone(),
            &["frame 3", "before frame 2 had been received"],
        ),
        (|lines| lines[3]["exposure"]["timing"] = "guessed".into(), &["0003.png", "guessed"]),
        (|lines| lines[3]["written"] = "yesterday".into(), &["0003.png", "yesterday"]),
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
    let records: [(&str, &str, &[&str]); 8] = [
        ("\"uid\": \"", "\"uid\": \"x", &["no UUID"]),
        ("\"created\": \"", "\"created\": \"x", &["created is no date"]),
        ("\n    \"focal_length_px\": ", "\n    \"focal_length_px\": 1", &["focal length"]),
        ("\"step\": \"", "\"step\": \"1", &["planned positions"]),
        ("\"shift_px\": ", "\"shift_px\": 1", &["the limits"]),
        ("\"saturated\": \"", "\"position_um\": 1,\n \"saturated\": \"", &["limits.position is given twice"]),
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
fn a_lens_that_is_not_the_rigs_is_not_measured_with() {
    let folder = folder();
    captured(folder.path());
    edit(folder.path(), "sequence.json", "\n    \"focal_length_px\": ", "\n    \"focal_length_px\": 1");
    is_refused(folder.path(), &["focal length"]);
    let folder = super::folder();
    captured(folder.path());
    change_lines(folder.path(), |lines| drop(lines[3].as_object_mut().unwrap().remove("certificate")));
    is_refused(folder.path(), &["frame 3", "certificate is missing"]);
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
        ("\"frames\": 8,\n        \"settle\"", "\"frames\": 1000000000000000,\n        \"settle\""),
        ("\"average\": 1", "\"average\": 1000000000000000"),
        ("\"dark\": 0", "\"dark\": 1000000000000000"),
        ("\"retakes\": 3", "\"retakes\": 1000000000000000"),
        ("\"start\": \"10 mm\"", "\"start\": \"1e300 mm\""),
    ] {
        let folder = folder();
        captured(folder.path());
        edit(folder.path(), "sequence.json", from, to);
        for verb in ["resume", "calibrate"] {
            fails(folder.path(), &[verb, "seq"], 5, &["sequence.json", "recorded rig"]);
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
fn a_wrong_journal_costs_no_good_frame() {
    let changes: [fn(&mut Vec<serde_json::Value>); 2] = [
        |lines| {
            let hash = lines[3]["blake3"].as_str().unwrap().replacen(['1', '2', '3', '4'], "0", 1);
            lines[3]["blake3"] = hash.into();
        },
        |lines| lines[3]["mean_dn"] = (lines[3]["mean_dn"].as_f64().unwrap() + 1.0).into(),
    ];
    for change in changes {
        let folder = folder();
        captured(folder.path());
        fs::remove_file(folder.path().join("seq/stop.json")).unwrap();
        change_lines(folder.path(), change);
        let frame = folder.path().join("seq/frames/0003.png");
        let before = fs::metadata(&frame).unwrap().modified().unwrap();
        fails(folder.path(), &["resume", "seq"], 5, &["journal.jsonl", "frames/0003.png", "restore"]);
        assert_eq!(fs::metadata(&frame).unwrap().modified().unwrap(), before);
    }
}

#[test]
fn a_scan_whose_end_contradicts_its_numbers_is_not_complete() {
    for (key, value, words) in [
        ("/closure/home_shift_mm", serde_json::json!(50.0), "home was found 50 mm"),
        ("/closure/comparison/x_px", serde_json::json!(1e308), "had moved by"),
        ("/closure/comparison/frame", serde_json::json!(1_u64 << 63), "had moved by"),
        ("/closure/comparison/sigma_px", serde_json::json!(-1.0), "had moved by"),
        ("/times/moving_s", serde_json::json!(-1.0), "below 0 s"),
    ] {
        let folder = folder();
        captured(folder.path());
        let stop = folder.path().join("seq/stop.json");
        let mut record: serde_json::Value = serde_json::from_slice(&fs::read(&stop).unwrap()).unwrap();
        *record.pointer_mut(key).unwrap() = value;
        fs::write(&stop, serde_json::to_vec_pretty(&record).unwrap()).unwrap();
        is_refused(folder.path(), &["stop.json", words]);
    }
}

#[test]
fn what_verify_refuses_resume_does_not_call_complete() {
    let folder = folder();
    captured(folder.path());
    succeeds(folder.path(), &["resume", "seq"]);
    change_lines(folder.path(), |lines| lines[2]["mean_dn"] = 12.5.into());
    fails(folder.path(), &["resume", "seq"], 5, &["0002.png", "12.5"]);
    // A simulated rig that differs from the profile is refused, and the scan is not resumed.
    for ended in [true, false] {
        let folder = super::folder();
        captured(folder.path());
        edit(folder.path(), "sequence.json", "\"focal_length_px\": ", "\"focal_length_px\": 1");
        if !ended {
            fs::remove_file(folder.path().join("seq/stop.json")).unwrap();
            fs::remove_file(folder.path().join("seq/frames/0007.png")).unwrap();
        }
        fails(folder.path(), &["resume", "seq"], 5, &["simulated rig"]);
        fails(folder.path(), &["match", "seq"], 5, &["simulated rig"]);
    }
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
    // Results from it are refused too.
    fails(images, &["rectify", "seq", "--out", "straight"], 5, &words);
    succeeds(images, &["rectify", "seq", "--out", "straight", "--anyway"]);
    fails(images, &["match", "straight"], 5, &words);
    assert_eq!(epirig(images, &["verify", "straight"]).status.code(), Some(5));
}
