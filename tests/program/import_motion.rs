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
fn motion_along_the_columns_is_told_and_turning_helps() {
    let folder = tempfile::tempdir().unwrap();
    photographs(&folder.path().join("photos"), &(0..FRAMES).collect::<Vec<_>>());
    let said = notes(folder.path(), &["--rotate", "90"]);
    assert!(said.contains("along the columns") && said.contains("--rotate 90"), "{said}");
    assert!(findings(folder.path())[0].contains("along the columns"));
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
