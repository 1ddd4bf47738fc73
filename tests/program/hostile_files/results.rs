//! Results that belong to another sequence or another calibration, or whose files were exchanged: every verb refuses them, and says which file is
//! wrong and what to do.

use std::fs;
use std::path::Path;

use super::{change_lines, edit, folder, within_a_minute};
use crate::support::{epirig, fails, images, names, succeeds, write_png};
use epirig_core::frame::{Frame, Samples};

/// A sequence with a calibration, results and a surface.
fn measured(folder: &Path) {
    images(&folder.join("photos"), 9);
    fs::create_dir(folder.join("white")).unwrap();
    for index in 0..4_usize {
        let samples = (0..24 * 64_usize).map(|pixel| 200 + ((pixel * 7 + index * 5) % 3) as u8);
        let frame = Frame::new(24, 64, 8, Samples::U8(samples.collect())).unwrap();
        write_png(&folder.join(format!("white/{index}.png")), &frame);
    }
    let import = ["import", "photos", "--out", "seq", "--step-mm", "1.5", "--focal-length-px", "100"];
    succeeds(folder, &[&import[..], &["--flat", "white"]].concat());
    succeeds(folder, &["calibrate", "seq", "--flat-field", "order:1"]);
    succeeds(folder, &["match", "seq", "--reference", "middle"]);
    succeeds(folder, &["surface", "seq", "--trend", "constant", "--s-filter-mm", "8"]);
}

/// Every ending that `export` knows, with a map that it can hold.
const EXPORTS: [(&str, &str); 14] = [
    ("disparity", "pfm"),
    ("sigma", "tiff"),
    ("cost", "npy"),
    ("confidence", "csv"),
    ("mask", "npy"),
    ("mask", "png"),
    ("height", "gsf"),
    ("height", "x3p"),
    ("height", "ply"),
    ("height-sigma", "png"),
    ("height-used", "ply"),
    ("height-without-form", "gsf"),
    ("height-without-form", "png"),
    ("height-filtered", "x3p"),
];

fn export<'a>(map: &'a str, out: &'a str) -> [&'a str; 6] {
    ["export", "seq", "--map", map, "--out", out]
}

/// No verb that reads results takes these, all with one reason; and nothing is written.
fn none_takes_them(folder: &Path, code: i32, words: &[&str]) {
    let before = names(folder);
    for (map, ending) in EXPORTS {
        fails(folder, &export(map, &format!("out.{ending}")), code, words);
    }
    fs::write(folder.join("truth.npy"), map_of(8.0)).unwrap();
    fails(folder, &["surface", "seq", "--overwrite"], code, words);
    fails(folder, &["compare", "seq", "seq", "--out", "change"], code, words);
    fails(folder, &["evaluate", "seq", "--truth", "truth.npy"], code, words);
    let (viewed, said) = within_a_minute(folder, &["view", "seq", "--results", "seq/results"]);
    assert!(viewed == Some(code) && words.iter().all(|word| said.contains(word)), "{viewed:?} {said}");
    fs::remove_file(folder.join("truth.npy")).unwrap();
    assert_eq!(names(folder), before);
}

fn map_of(value: f32) -> Vec<u8> {
    let map = epirig_core::grid::Grid::filled(24, 64, value);
    epirig_data::formats::MapFormat::Npy.encode(&map).unwrap()
}

#[test]
fn all_formats_are_exported_of_results_that_belong_to_their_sequence() {
    let folder = folder();
    measured(folder.path());
    for (map, ending) in EXPORTS {
        succeeds(folder.path(), &export(map, &format!("{map}.{ending}")));
    }
    succeeds(folder.path(), &["verify", "seq"]);
    // Heights are lengths: their pixels have a width in m.
    let gsf = fs::read(folder.path().join("height.gsf")).unwrap();
    let head = String::from_utf8_lossy(&gsf[..300]);
    assert!(head.contains("XYUnits = m") && head.contains("ZUnits = m"), "{head}");
}

#[test]
fn results_of_another_calibration_are_refused_by_every_verb() {
    let folder = folder();
    measured(folder.path());
    succeeds(folder.path(), &["calibrate", "seq", "--flat-field", "none", "--overwrite"]);
    none_takes_them(folder.path(), 5, &["calibrated again", "epirig match seq --overwrite"]);
}

#[test]
fn results_of_another_sequence_are_refused_by_every_verb() {
    let folder = folder();
    let path = folder.path();
    measured(path);
    fs::rename(path.join("seq"), path.join("former")).unwrap();
    succeeds(path, &["import", "photos", "--out", "seq", "--step-mm", "1.5", "--focal-length-px", "100"]);
    fs::rename(path.join("former/results"), path.join("seq/results")).unwrap();
    none_takes_them(path, 5, &["results of another sequence"]);
}

#[test]
fn results_of_other_frames_are_refused_by_every_verb() {
    let folder = folder();
    let path = folder.path();
    measured(path);
    succeeds(path, &["match", "seq", "--as-captured", "--overwrite"]);
    succeeds(path, &["surface", "seq", "--trend", "constant", "--s-filter-mm", "8"]);
    // A frame that was taken again, with its line in the journal.
    let frame = epirig_data::sequence::encode_png(&crate::support::simulator(9).expose(6.0, 77)).unwrap();
    fs::write(path.join("seq/frames/0004.png"), &frame).unwrap();
    let hash = blake3::hash(&frame).to_hex().to_string();
    change_lines(path, |lines| lines[4]["blake3"] = hash.clone().into());
    none_takes_them(path, 5, &["taken after it was matched", "epirig match seq --overwrite"]);
}

#[test]
fn results_of_damaged_records_are_refused_by_every_verb() {
    let folder = folder();
    measured(folder.path());
    edit(folder.path(), "sequence.json", "\n  \"rows\": 24", "\n  \"rows\": 0");
    let before = names(folder.path());
    for (map, ending) in EXPORTS {
        fails(folder.path(), &export(map, &format!("out.{ending}")), 5, &["sequence.json"]);
    }
    fails(folder.path(), &["surface", "seq", "--overwrite"], 5, &["sequence.json"]);
    assert_eq!(names(folder.path()), before);
}

/// Exchanges two files of the results.
fn exchange(folder: &Path, one: &str, other: &str) {
    let results = folder.join("seq/results");
    let (first, second) = (results.join(one), results.join(other));
    fs::rename(&first, folder.join("aside")).unwrap();
    fs::rename(&second, &first).unwrap();
    fs::rename(folder.join("aside"), &second).unwrap();
}

#[test]
fn exchanged_maps_are_noticed() {
    let folder = folder();
    let path = folder.path();
    measured(path);
    for (one, other) in [("sigma.tiff", "confidence.tiff"), ("disparity.tiff", "cost.tiff")] {
        exchange(path, one, other);
        none_takes_them(path, 5, &[one, "exchanged", "epirig match"]);
        fails(path, &["verify", "seq"], 5, &[]);
        exchange(path, one, other);
    }
    // Maps that are not needed for all are noticed by whoever reads them.
    exchange(path, "cost.tiff", "confidence.tiff");
    fails(path, &export("cost", "out.npy"), 5, &["cost.tiff", "exchanged"]);
    succeeds(path, &export("disparity", "disparity.npy"));
    exchange(path, "cost.tiff", "confidence.tiff");
    exchange(path, "surface/height_mm.tiff", "surface/filtered_mm.tiff");
    for map in ["height-without-form", "height-used", "height-filtered"] {
        fails(path, &export(map, "out.npy"), 5, &["_mm.tiff", "exchanged", "epirig surface"]);
    }
    exchange(path, "surface/height_mm.tiff", "surface/filtered_mm.tiff");
    succeeds(path, &["verify", "seq"]);
}

#[test]
fn verify_names_each_file_of_the_results_that_differs() {
    let folder = folder();
    let path = folder.path();
    measured(path);
    let results = path.join("seq/results");
    fs::remove_file(results.join("height_mm.tiff")).unwrap();
    fs::write(results.join("figures/6-disparity-along-row.csv"), "other numbers").unwrap();
    fs::write(results.join("surface/used.png"), "no picture").unwrap();
    let output = epirig(path, &["verify", "seq"]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(5), "{said}");
    for (file, word) in [
        ("results/height_mm.tiff", "is missing"),
        ("results/figures/6-disparity-along-row.csv", "changed"),
        ("results/surface/used.png", "changed"),
    ] {
        assert!(said.lines().any(|line| line.contains(file) && line.contains(word)), "{file}: {said}");
    }
    assert_eq!(said.lines().count(), 4, "{said}");
}

#[test]
fn the_surface_of_other_results_is_not_theirs() {
    let folder = folder();
    let path = folder.path();
    measured(path);
    succeeds(path, &["match", "seq", "--out", "seq/quick", "--quick", "--reference", "middle"]);
    fs::rename(path.join("seq/results/surface"), path.join("seq/quick/surface")).unwrap();
    let words = ["surface.json", "of other results", "epirig surface"];
    for map in ["height-without-form", "height-used", "height-filtered"] {
        let export = ["export", "seq", "--results", "seq/quick", "--map", map, "--out", "out.npy"];
        fails(path, &export, 5, &words);
    }
    fails(path, &["verify", "seq"], 5, &[]);
    // The match itself is good.
    succeeds(path, &["export", "seq", "--results", "seq/quick", "--out", "out.npy"]);
}

#[test]
fn maps_of_a_comparison_are_bound_to_their_record() {
    let folder = folder();
    let path = folder.path();
    measured(path);
    succeeds(path, &["match", "seq", "--out", "seq/quick", "--quick", "--reference", "middle"]);
    succeeds(path, &["compare", "seq", "seq/quick", "--out", "change"]);
    let export = |map: &'static str| ["export", "change", "--map", map, "--out", "out.npy"];
    fs::copy(path.join("change/difference_sigma_mm.tiff"), path.join("change/difference_mm.tiff")).unwrap();
    fails(path, &export("difference"), 5, &["difference_mm.tiff", "exchanged", "epirig compare"]);
    succeeds(path, &export("difference-sigma"));
}
