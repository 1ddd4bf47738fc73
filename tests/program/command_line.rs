//! The verbs work together as the README says.

use std::fs;
use std::path::Path;

use crate::support::{epirig, fails, images, names, simulator, succeeds};
use image::{DynamicImage, ImageBuffer};

#[test]
fn the_demo_measures_what_it_simulates() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["demo", "--size", "192", "--frames", "41", "--out", "demo", "--json"];
    let output: serde_json::Value = serde_json::from_str(&succeeds(folder.path(), &arguments)).unwrap();
    let errors = &output["truth"]["in_both_end_frames"];
    assert_eq!(errors["answered"], errors["pixels"]);
    assert!(errors["pixels"].as_u64().unwrap() > 5000);
    // The relief is 0.02 px here; a hundredth of a pixel is the promise.
    assert!(errors["mean_px"].as_f64().unwrap() < 0.01, "{errors}");
    for file in [
        "measured-and-truth.png",
        "height-along-row.png",
        "disparity.png",
        "figures/6-disparity-along-row.csv",
    ] {
        assert!(folder.path().join("demo/results").join(file).exists(), "{file}");
    }
    succeeds(folder.path(), &["verify", "demo"]);
    let truth = "demo/truth/disparity.pfm";
    let again = succeeds(folder.path(), &["evaluate", "demo", "--truth", truth, "--json"]);
    let again: serde_json::Value = serde_json::from_str(&again).unwrap();
    assert_eq!(again["truth"]["all"]["answered"], output["truth"]["all"]["answered"]);
    // A second demo finds a folder of its own.
    fails(folder.path(), &arguments, 2, &["demo", "another folder"]);
}

#[test]
fn a_first_look_says_that_it_is_one() {
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 11);
    succeeds(folder.path(), &["import", "photos", "--out", "seq"]);
    let settings = |more: &[&str]| -> serde_json::Value {
        let arguments = [&["match", "seq", "--overwrite", "--json"], more].concat();
        let summary: serde_json::Value = serde_json::from_str(&succeeds(folder.path(), &arguments)).unwrap();
        assert!((summary["median_disparity_px"].as_f64().unwrap() - 8.0).abs() < 0.02, "{summary}");
        summary["settings"].clone()
    };
    let quick = settings(&["--quick"]);
    assert_eq!(quick["quick"], true);
    assert_eq!(settings(&[])["quick"], false);
    // It has discs of two sizes only, whatever sigma they reach.
    fails(
        folder.path(),
        &["match", "seq", "--quick", "--wanted-sigma", "0.01"],
        2,
        &["--quick", "--wanted-sigma"],
    );
}

#[test]
fn photographs_become_a_disparity_map() {
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 11);
    let before = names(&folder.path().join("photos"));
    let arguments = ["import", "photos", "--out", "seq", "--step-mm", "1.5", "--focal-length-px", "128"];
    succeeds(folder.path(), &arguments);
    assert_eq!(names(&folder.path().join("photos")), before);
    // Natural order: frame_10 is the last, not the third.
    let journal = fs::read_to_string(folder.path().join("seq/journal.jsonl")).unwrap();
    assert!(journal.lines().last().unwrap().contains("frame_10.png"));
    let verified: serde_json::Value =
        serde_json::from_str(&succeeds(folder.path(), &["verify", "seq", "--json"])).unwrap();
    assert_eq!(verified["good_frames"], 11);

    let summary: serde_json::Value =
        serde_json::from_str(&succeeds(folder.path(), &["match", "seq", "--json"])).unwrap();
    assert!((summary["median_disparity_px"].as_f64().unwrap() - 8.0).abs() < 0.01, "{summary}");
    // Z = f b / d = 128 px * 15 mm / 8 px.
    assert!((summary["distance_mm"].as_f64().unwrap() - 240.0).abs() < 0.5, "{summary}");
    let expected = [
        "answers.png",
        "confidence.tiff",
        "cost.tiff",
        "disparity-detail.png",
        "disparity.png",
        "disparity.tiff",
        "figures",
        "height.png",
        "height_mm.tiff",
        "height_sigma_mm.tiff",
        "mask.png",
        "match.json",
        "sigma.png",
        "sigma.tiff",
    ];
    assert_eq!(names(&folder.path().join("seq/results")), expected);
    assert_eq!(names(&folder.path().join("seq/results/figures")).len(), 8);

    let settings = |folder: &Path| -> serde_json::Value {
        serde_json::from_slice(&fs::read(folder.join("match.json")).unwrap()).unwrap()
    };
    succeeds(folder.path(), &["match", "seq", "--semi-global", "--out", "across"]);
    for (results, semi_global) in [("seq/results", false), ("across", true)] {
        assert_eq!(settings(&folder.path().join(results))["settings"]["semi_global"], semi_global);
    }

    let left_out: serde_json::Value =
        serde_json::from_str(&succeeds(folder.path(), &["evaluate", "seq", "--leave-out", "4", "--json"]))
            .unwrap();
    let [predicted, repeated] =
        ["prediction_error_dn", "repetition_error_dn"].map(|key| left_out[key].as_f64().unwrap());
    assert!(predicted < 0.25 * repeated, "{left_out}");
    for (check, share) in [("--split-half", "/answered/pixels"), ("--both-ways", "/compared")] {
        let report = succeeds(folder.path(), &["evaluate", "seq", check, "--json"]);
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        assert!(report.pointer(share).unwrap().as_f64().unwrap() > 0.5, "{check}: {report}");
    }
    fails(folder.path(), &["evaluate", "seq", "--both-ways", "--reference", "last"], 2, &["--reference"]);

    succeeds(folder.path(), &["export", "seq", "--map", "height", "--out", "height.csv"]);
    assert_eq!(fs::read_to_string(folder.path().join("height.csv")).unwrap().lines().count(), 24);
    fails(folder.path(), &["export", "seq", "--out", "height.csv"], 2, &["height.csv", "exists"]);
    fails(folder.path(), &["export", "seq", "--out", "map.xyz"], 2, &["map.xyz", ".npy", ".x3p", ".png"]);
    succeeds(folder.path(), &["export", "seq", "--map", "height", "--out", "a/new/folder/height.X3P"]);
    assert!(folder.path().join("a/new/folder/height.X3P").is_file());
    // What is no height is no surface, and leaves no folder behind.
    fails(folder.path(), &["export", "seq", "--out", "other/map.x3p"], 2, &["other/map.x3p", "heights"]);
    fails(folder.path(), &["export", "seq", "--out", "other/map.ply"], 2, &["--map height"]);
    let map = ["export", "seq", "--map", "height-without-form", "--out", "other/map.npy"];
    fails(folder.path(), &map, 2, &["epirig surface"]);
    assert!(!folder.path().join("other").exists());
    fails(folder.path(), &["surface", "seq", "--s-filter-mm", "1"], 2, &["S-filter", "three pixels"]);
    fails(folder.path(), &["surface", "seq", "--s-filter-mm", "9", "--l-filter-mm", "8"], 2, &["L-filter"]);
}

#[test]
fn other_formats_are_converted_and_said_so() {
    let folder = tempfile::tempdir().unwrap();
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    let simulator = simulator(5);
    for (index, &position) in simulator.config().scan.positions_mm().iter().enumerate() {
        let mut grey = vec![0.0; 64 * 24];
        simulator.expose(position, 0).samples().copy_to_f32(0, &mut grey);
        let level = |x: u32, y: u32| grey[(y * 64 + x) as usize] as u8;
        let colour = ImageBuffer::from_fn(64, 24, |x, y| image::Rgb([level(x, y); 3]));
        let path = photos.join(format!("{index}.{}", ["png", "tif", "jpg"][index % 3]));
        DynamicImage::ImageRgb8(colour).save(path).unwrap();
    }
    let output = epirig(folder.path(), &["import", "photos", "--out", "seq"]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert!(stderr.contains("4 image(s): colour converted to grey"), "{stderr}");
    assert!(stderr.contains("1 image(s): colour JPEG"), "{stderr}");
    assert!(fs::read_to_string(folder.path().join("seq/sequence.json")).unwrap().contains("Rec. 709"));
    succeeds(folder.path(), &["verify", "seq"]);
}

#[test]
fn grey_png_files_are_copied_byte_by_byte_or_linked() {
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 4);
    succeeds(folder.path(), &["import", "photos", "--out", "copied", "--frames", "1..3"]);
    succeeds(folder.path(), &["import", "photos", "--out", "linked", "--link"]);
    let source = fs::read(folder.path().join("photos/frame_1.png")).unwrap();
    assert_eq!(fs::read(folder.path().join("copied/frames/0000.png")).unwrap(), source);
    // A second name of the same file, and no link that leads out of the sequence.
    let linked = folder.path().join("linked/frames/0001.png").symlink_metadata().unwrap();
    assert!(linked.is_file());
    #[cfg(unix)]
    assert_eq!(std::os::unix::fs::MetadataExt::nlink(&linked), 2);
    succeeds(folder.path(), &["verify", "linked"]);
    assert_eq!(names(&folder.path().join("copied/frames")), ["0000.png", "0001.png", "0002.png"]);
}

#[test]
fn help_has_examples_and_completions_name_the_verbs() {
    let folder = tempfile::tempdir().unwrap();
    for verb in [
        "demo",
        "devices",
        "camera",
        "grab",
        "init",
        "plan",
        "capture",
        "resume",
        "run",
        "stage",
        "import",
        "measure",
        "verify",
        "match",
        "surface",
        "evaluate",
        "export",
        "decode",
        "simulate",
        "target",
        "licences",
        "completions",
        "manual",
    ] {
        let help = succeeds(folder.path(), &[verb, "--help"]);
        assert!(help.contains("Example") && help.contains(&format!("epirig {verb}")), "{help}");
        assert!(succeeds(folder.path(), &["completions", "bash"]).contains(verb));
    }
    assert!(succeeds(folder.path(), &["--help"]).contains("Exit codes"));
    assert_eq!(epirig(folder.path(), &["mesure"]).status.code(), Some(2));
    assert_eq!(epirig(folder.path(), &[]).status.code(), Some(2));
}
