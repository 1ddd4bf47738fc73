//! `epirig measure`: from photographs to results in one command.

use std::fs;
use std::path::Path;

use crate::support::{epirig, fails, names, succeeds, write_png};
use epirig_core::frame::{Frame, Samples};
use epirig_simulator::{Simulator, SimulatorConfig};

/// Steps of a hand: they differ by 6 %, and two frames are missing in one place.
const PLACES: [f64; 12] = [0.0, 1.06, 1.95, 3.05, 3.94, 5.0, 8.03, 9.0, 10.07, 10.95, 12.0, 13.02];

/// Writes frames of a plane 500 mm away as 0.png, 1.png ...; `places` are in steps of 3 px.
fn photographs(folder: &Path, places: &[f64]) -> f64 {
    fs::create_dir_all(folder).unwrap();
    let config = SimulatorConfig::textured_plane(256, 192, 2);
    let focal_length_px = config.optics.focal_length_px;
    let step_mm = 3.0 * 500.0 / focal_length_px;
    let simulator = Simulator::new(config).unwrap();
    for (index, place) in places.iter().enumerate() {
        let frame = simulator.expose(10.0 + step_mm * place, index as u32);
        write_png(&folder.join(format!("{index}.png")), &frame);
    }
    focal_length_px
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn photographs_with_uneven_steps_are_measured_in_one_command() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    photographs(&path.join("photos"), &PLACES);
    let output = epirig(path, &["measure", "photos", "--out", "first"]);
    let (said, found) =
        (String::from_utf8(output.stderr).unwrap(), String::from_utf8(output.stdout).unwrap());
    assert_eq!(output.status.code(), Some(0), "{said}");
    // What this verb does need not be advised.
    assert!(!said.contains("the steps are not as") && !said.contains("--positions texture"), "{said}");
    assert!(found.contains("first: 12 frames of 256 x 192"), "{found}");
    let sentence = found.lines().find(|line| line.starts_with("steps differ by")).unwrap();
    assert!(sentence.contains(" %, 1 gap; ") && sentence.contains("% of the object answered"), "{sentence}");
    assert!(sentence.contains("median sigma 0.0"), "{sentence}");
    assert!(found.contains("look at first/results/disparity.png"), "{found}");
    for file in ["calibration.json", "results/match.json", "results/disparity.png"] {
        assert!(path.join("first").join(file).exists(), "{file}");
    }
    // The map is as good as that of a match with the true positions.
    let record = json(&fs::read_to_string(path.join("first/results/match.json")).unwrap());
    assert!(
        record["object_answered"].as_f64().unwrap() > 0.97 && record["positions"] == "texture",
        "{record}"
    );
    let error_px = record["median_disparity_px"].as_f64().unwrap().abs() - 3.0 * PLACES[11];
    assert!(error_px.abs() < 0.02, "{error_px}");

    // The folder is taken now, and the sequence in it can be measured again.
    fails(path, &["measure", "photos", "--out", "first"], 2, &["first exists already"]);
    fails(path, &["measure", "first"], 2, &["first/results", "--overwrite"]);
    let output = epirig(path, &["measure", "first", "--overwrite", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let again = json(&String::from_utf8(output.stdout).unwrap());
    assert!(again["imported"].is_null() && again["surface"].is_null(), "{again}");
    assert_eq!(again["sentence"], sentence);
    assert_eq!(again["summary"]["median_sigma_px"], record["median_sigma_px"]);
}

#[test]
fn with_a_scale_the_surface_is_measured_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let focal_length_px = photographs(&path.join("photos"), &PLACES).to_string();
    let table: Vec<String> = PLACES.iter().map(|place| (5.0 * place).to_string()).collect();
    fs::write(path.join("positions.csv"), table.join("\n")).unwrap();
    let scale = ["--positions", "positions.csv", "--focal-length-px", &focal_length_px];
    let found = succeeds(path, &[&["measure", "photos", "--out", "first", "--json"][..], &scale].concat());
    let found = json(&found);
    assert_eq!(found["imported"]["frames"], 12);
    assert!(found["surface"].is_object(), "{found}");
    assert!(path.join("first/results/surface/report.html").exists());
}

#[test]
fn photographs_without_motion_are_refused_with_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    photographs(&path.join("photos"), &[2.0; 8]);
    let still = ["measure", "photos", "--out", "still"];
    fails(path, &still, 6, &["the motion cannot be measured", "take frames from places along a line"]);
    // The sequence stays as it was imported.
    assert!(path.join("still/sequence.json").exists() && !path.join("still/results").exists());
    assert!(!path.join("still/calibration.json").exists());

    fs::create_dir(path.join("grey")).unwrap();
    for index in 0..6 {
        let grey = Frame::new(64, 96, 8, Samples::U8(vec![100; 64 * 96])).unwrap();
        write_png(&path.join(format!("grey/{index}.png")), &grey);
    }
    fails(
        path,
        &["measure", "grey", "--out", "blank"],
        6,
        &["too little texture", "bring more light or contrast"],
    );

    photographs(&path.join("back"), &[0.0, 1.0, 2.0, 3.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    let words = ["frame 4 (4.png) cannot be told from none", "--exclude", "`epirig match returns`"];
    fails(path, &["measure", "back", "--out", "returns", "--step-mm", "1"], 6, &words);
    // Without positions that say otherwise, frames of one place are both used.
    succeeds(path, &["measure", "back", "--out", "repeated"]);
}

#[test]
fn options_that_do_not_fit_are_refused_before_there_is_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    photographs(&path.join("photos"), &[0.0, 1.0, 2.0, 3.0]);
    fails(path, &["measure", "photos"], 2, &["--out DIR"]);
    fails(path, &["measure", "photos", "--out", "first", "--window", "4"], 2, &["the window"]);
    fails(path, &["measure", "photos", "--out", "first", "--reference", "9"], 2, &["9"]);
    fails(path, &["measure", "photos", "--step-mm", "2"], 2, &["required arguments"]);
    assert_eq!(names(path), ["photos"]);
    succeeds(path, &["import", "photos", "--out", "seq"]);
    fails(
        path,
        &["measure", "seq", "--out", "first"],
        2,
        &["seq is a sequence already", "epirig measure seq"],
    );
    fails(path, &["measure", "seq", "--rotate", "90"], 2, &["required arguments"]);
    fails(path, &["measure", "photos", "--out", "first", "--overwrite"], 2, &["--overwrite"]);
    assert_eq!(names(path), ["photos", "seq"]);
}
