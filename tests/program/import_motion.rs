//! What `import` and `match` say of the motion in frames: of sound ones nothing.

use std::fs;
use std::path::Path;

use crate::support::{epirig, fails, succeeds, write_png};
use epirig_core::frame::{Frame, Samples};
use epirig_data::sequence::{Origin, Sequence};
use epirig_simulator::{Simulator, SimulatorConfig};

const FRAMES: usize = 12;

fn simulator() -> Simulator {
    Simulator::new(SimulatorConfig::textured_plane(256, 192, FRAMES)).unwrap()
}

/// Writes frames of the simulator, which stands at these places of its plan, as 0.png, 1.png ...
fn photographs(folder: &Path, places: &[usize]) {
    fs::create_dir_all(folder).unwrap();
    let simulator = simulator();
    let positions = simulator.config().scan.positions_mm();
    for (index, &place) in places.iter().enumerate() {
        write_png(&folder.join(format!("{index}.png")), &simulator.expose(positions[place], index as u32));
    }
}

/// Imports and gives the notes.
fn notes(folder: &Path, arguments: &[&str]) -> String {
    let _ = fs::remove_dir_all(folder.join("seq"));
    let output = epirig(folder, &[&["import", "photos", "--out", "seq"], arguments].concat());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    said
}

fn findings(folder: &Path) -> Vec<String> {
    match &Sequence::open(&folder.join("seq")).unwrap().record().origin {
        Origin::Imported { findings, .. } => findings.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn of_sound_frames_nothing_is_said() {
    let folder = tempfile::tempdir().unwrap();
    photographs(&folder.path().join("photos"), &(0..FRAMES).collect::<Vec<_>>());
    assert_eq!(notes(folder.path(), &[]), "");
    assert!(findings(folder.path()).is_empty());
}

#[test]
fn motion_along_the_columns_is_told_and_cured() {
    let folder = tempfile::tempdir().unwrap();
    photographs(&folder.path().join("photos"), &(0..FRAMES).collect::<Vec<_>>());
    let said = notes(folder.path(), &["--rotate", "90"]);
    assert!(said.contains("along the columns") && said.contains("`epirig measure seq` turns"), "{said}");
    assert!(findings(folder.path())[0].contains("along the columns"));
    let measured = succeeds(folder.path(), &["-q", "measure", "seq"]);
    assert!(measured.contains("turned by 90.0") || measured.contains("turned by 89.9"), "{measured}");
    fs::remove_dir_all(folder.path().join("photos")).unwrap();
    fs::rename(folder.path().join("seq/frames"), folder.path().join("photos")).unwrap();
    assert!(!notes(folder.path(), &["--rotate", "90"]).contains("columns"));
}

#[test]
fn names_in_disorder_are_told_and_sorting_by_motion_helps() {
    let folder = tempfile::tempdir().unwrap();
    let places = [7, 2, 10, 0, 5, 11, 3, 8, 1, 6, 9, 4];
    photographs(&folder.path().join("photos"), &places);
    let said = notes(folder.path(), &[]);
    assert!(said.contains("not in the order of the motion") && said.contains("--sort motion"), "{said}");
    assert_eq!(notes(folder.path(), &["--sort", "motion"]), "");
    let sequence = Sequence::open(&folder.path().join("seq")).unwrap();
    let sources = sequence.frames().iter().map(|frame| frame.source.clone().unwrap());
    let found: Vec<usize> =
        sources.map(|name| places[name.trim_end_matches(".png").parse::<usize>().unwrap()]).collect();
    assert!(found.is_sorted() || found.iter().rev().is_sorted(), "{found:?}");
}

#[test]
fn a_frame_of_another_scene_is_named_and_leaving_it_out_helps() {
    let folder = tempfile::tempdir().unwrap();
    photographs(&folder.path().join("photos"), &(0..FRAMES).collect::<Vec<_>>());
    let other: Vec<u8> =
        (0..256 * 192_u32).map(|pixel| (pixel.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    write_png(&folder.path().join("photos/4.png"), &Frame::new(192, 256, 8, Samples::U8(other)).unwrap());
    let said = notes(folder.path(), &[]);
    assert!(said.contains("4 (4.png)") && said.contains("`--exclude 4`"), "{said}");
    assert_eq!(notes(folder.path(), &["--exclude", "4", "--step-mm", "1.5"]), "");
}

#[test]
fn a_scene_that_stands_still_is_told() {
    let folder = tempfile::tempdir().unwrap();
    photographs(&folder.path().join("photos"), &[5; FRAMES]);
    let said = notes(folder.path(), &[]);
    assert!(said.contains("nothing moves"), "{said}");
}

#[test]
fn a_match_without_any_answer_has_an_exit_code_and_says_what_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("photos")).unwrap();
    for index in 0..6 {
        let grey = Frame::new(64, 96, 8, Samples::U8(vec![100; 64 * 96])).unwrap();
        write_png(&path.join(format!("photos/{index}.png")), &grey);
    }
    succeeds(path, &["import", "photos", "--out", "blank"]);
    fails(path, &["match", "blank", "--range", "0..4"], 8, &["no pixel has an answer", "too little texture"]);
    // The results are there, with the reasons.
    assert!(path.join("blank/results/mask.png").exists());
    fails(path, &["match", "blank", "--overwrite"], 8, &["no range", "could not be measured"]);

    fs::remove_dir_all(path.join("photos")).unwrap();
    photographs(&path.join("photos"), &(0..FRAMES).collect::<Vec<_>>());
    succeeds(path, &["import", "photos", "--out", "seq"]);
    // No disparity of this range is there, and no pixel is that sure.
    let hopeless = ["match", "seq", "--range", "60..64", "--max-sigma", "0.000001"];
    fails(path, &hopeless, 8, &["no pixel has an answer", "px along the rows"]);
}

/// Writes frames of a plane 500 mm away, seen by a camera that is turned by `roll_deg`, as 0.png, 1.png ...; `places`
/// are in steps of 3 px.
fn at(folder: &Path, places: &[f64], roll_deg: f64) {
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).unwrap();
    let mut config = SimulatorConfig::textured_plane(256, 192, 2);
    config.optics.roll_rad = roll_deg.to_radians();
    let step_mm = 3.0 * 500.0 / config.optics.focal_length_px;
    let simulator = Simulator::new(config).unwrap();
    for (index, place) in places.iter().enumerate() {
        let frame = simulator.expose(10.0 + step_mm * place, index as u32);
        write_png(&folder.join(format!("{index}.png")), &frame);
    }
}

#[test]
fn missing_frames_are_told_and_positions_from_the_texture_are_right() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // Three frames are missing after the sixth, and one at the end; the camera was moved by hand.
    let places = [0.0, 1.04, 1.98, 3.06, 3.95, 5.0, 9.02, 10.0, 11.05, 11.96, 13.0, 15.04];
    at(&path.join("photos"), &places, 0.0);
    let said = notes(path, &[]);
    // The usual step is the median, 1.04.
    assert!(said.contains("from image 5 (5.png) to image 6 (6.png) it goes 3.8"), "{said}");
    assert!(said.contains("from image 10 (10.png) to image 11 (11.png) it goes 1.9"), "{said}");
    assert!(said.contains("steps differ by") && said.contains("`epirig measure seq` measures"), "{said}");
    fs::remove_dir_all(path.join("seq")).unwrap();
    let output = epirig(path, &["import", "photos", "--out", "seq"]);
    let next = String::from_utf8(output.stdout).unwrap();
    assert!(next.contains("next: epirig measure seq\n"), "{next}");
    // With a target to be found, or frames to calibrate with, the next step is another one.
    fs::remove_dir_all(path.join("seq")).unwrap();
    let output = epirig(path, &["import", "photos", "--out", "seq", "--dark", "photos"]);
    let next = String::from_utf8(output.stdout).unwrap();
    assert!(next.contains("next: epirig calibrate seq --positions texture\n"), "{next}");
    fs::remove_dir_all(path.join("seq")).unwrap();
    succeeds(path, &["import", "photos", "--out", "seq"]);

    succeeds(path, &["calibrate", "seq", "--positions", "texture"]);
    let record: serde_json::Value =
        serde_json::from_slice(&fs::read(path.join("seq/calibration.json")).unwrap()).unwrap();
    let tau: Vec<f64> = serde_json::from_value(record["positions"]["tau"].clone()).unwrap();
    let sigma: Vec<f64> = serde_json::from_value(record["positions"]["tau_sigma"].clone()).unwrap();
    for (frame, place) in places.iter().enumerate() {
        let error = tau[frame] - place / places[11];
        // Four standard uncertainties: one of 16,000 normal numbers is farther off. And 0.02 px of 45 px.
        assert!(error.abs() <= 4.0 * sigma[frame] && error.abs() < 0.02 / 45.0, "{frame}: {error} {sigma:?}");
    }
    // With the true positions nothing is said, nor with a table of them.
    let table: Vec<String> = places.iter().map(f64::to_string).collect();
    fs::write(path.join("positions.csv"), table.join("\n")).unwrap();
    assert_eq!(notes(path, &["--positions", "positions.csv"]), "");
    // Given positions that are wrong are contradicted.
    let said = notes(path, &["--step-mm", "2"]);
    assert!(said.contains("it goes 3.8"), "{said}");
    let output = epirig(path, &["calibrate", "seq", "--positions", "texture"]);
    let said = String::from_utf8(output.stdout).unwrap() + &String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.success() && said.contains("the texture contradicts the given positions"),
        "{said}"
    );
    let record: serde_json::Value =
        serde_json::from_slice(&fs::read(path.join("seq/calibration.json")).unwrap()).unwrap();
    let baseline_mm = record["positions"]["baseline_mm"].as_f64().unwrap();
    let sigma_mm = record["positions"]["baseline_sigma_mm"].as_f64().unwrap();
    // Twelve frames in steps of 2 mm would be 22 mm.
    let error_mm = baseline_mm - 2.0 * places[11];
    assert!(error_mm.abs() < 3.0 * sigma_mm && sigma_mm < 1.0, "{baseline_mm} +- {sigma_mm}");
}

#[test]
fn frames_that_do_not_go_on_are_named_and_put_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    at(&path.join("photos"), &[0.0, 1.0, 2.0, 3.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], 0.0);
    let said = notes(path, &[]);
    assert!(said.contains("the step to image 4 (4.png) cannot be told from none"), "{said}");
    assert!(
        said.contains("`epirig measure seq` takes them in the order") && !said.contains("the steps are not"),
        "{said}"
    );
    at(&path.join("photos"), &[0.0, 1.0, 2.0, 3.0, 3.0, 4.0, 5.0, 6.0, 5.3, 7.0, 8.0], 0.0);
    let said = notes(path, &[]);
    assert!(said.contains("--sort motion") || said.contains("image 8 (8.png) stands 0.7"), "{said}");
    let output = epirig(path, &["calibrate", "seq", "--positions", "texture"]);
    let said = String::from_utf8(output.stderr).unwrap();
    for words in [
        "frame 4 (4.png) stands where the one in front of it does",
        "(8.png) stands 0.7",
        "in the order of their positions",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let record: serde_json::Value =
        serde_json::from_slice(&fs::read(path.join("seq/calibration.json")).unwrap()).unwrap();
    let order: Vec<u64> = serde_json::from_value(record["positions"]["order"].clone()).unwrap();
    // Frames 3 and 4 stand at one place, so either may come first.
    let without: Vec<u64> = order.iter().copied().filter(|frame| ![3, 4].contains(frame)).collect();
    assert_eq!(without, [0, 1, 2, 5, 6, 8, 7, 9, 10]);
    // Positions that somebody has given are contradicted.
    notes(path, &["--step-mm", "1"]);
    fails(
        path,
        &["calibrate", "seq", "--positions", "texture"],
        6,
        &["frame 3 (3.png) to frame 4 (4.png) cannot be told from none", "(8.png) stands 0.7", "--exclude"],
    );
    assert!(!path.join("seq/calibration.json").exists());
}

#[test]
fn a_camera_that_is_turned_a_little_is_told_with_its_angle_and_is_the_cause_of_few_answers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let places: Vec<f64> = (0..14).map(f64::from).collect();
    // 39 px along the rows and 0.34 px across them.
    at(&path.join("photos"), &places, 0.5);
    let said = notes(path, &[]);
    assert!(said.contains("0.50 degrees to the rows, 0.3 px"), "{said}");
    assert!(!said.contains("steps"), "{said}");
    at(&path.join("photos"), &places, -30.0);
    // 39 px along the motion.
    let said = notes(path, &[]);
    assert!(said.contains("30.0 degrees to the rows, 19.5 px"), "{said}");
    let output = epirig(path, &["match", "seq"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("30.0 degrees to the rows"), "{said}");
    assert!(!said.contains("little texture"), "{said}");
}
