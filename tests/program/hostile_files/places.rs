//! Where results and sequences are put: nothing of another kind, and nothing of a person, is replaced.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use super::{folder, imported, make_pipe, within_a_minute};
use crate::support::{epirig, fails, images, names, succeeds};

/// A sequence with results of `match` and `surface`.
fn measured(folder: &Path) {
    imported(folder);
    succeeds(folder, &["match", "seq"]);
    succeeds(folder, &["surface", "seq", "--trend", "constant"]);
}

#[test]
fn a_verb_replaces_its_own_results_only() {
    let folder = folder();
    let path = folder.path();
    measured(path);
    let before = |name: &str| fs::read(path.join("seq/results").join(name)).unwrap();
    let (matched, surface) = (before("match.json"), before("surface/surface.json"));
    let over = ["surface", "seq", "--out", "seq/results", "--overwrite"];
    fails(path, &over, 2, &["seq/results", "epirig match", "match.json"]);
    let over = ["match", "seq", "--out", "seq/results/surface", "--overwrite"];
    fails(path, &over, 2, &["seq/results/surface", "epirig surface", "surface.json"]);
    assert_eq!((before("match.json"), before("surface/surface.json")), (matched, surface));
    // Files with such names but without a summary are not ours.
    fs::create_dir(path.join("mine")).unwrap();
    fs::write(path.join("mine/height.png"), "a picture").unwrap();
    for verb in ["match", "surface"] {
        fails(path, &[verb, "seq", "--out", "mine", "--overwrite"], 2, &["mine", &format!("{verb}.json")]);
    }
    // What is in folders of the results is looked at, too.
    for name in ["figures/thesis.txt", "surface/thesis.txt", "surface/match.json"] {
        fs::write(path.join("seq/results").join(name), "years of work").unwrap();
        fails(path, &["match", "seq", "--overwrite"], 2, &[name, "not replaced"]);
        fs::remove_file(path.join("seq/results").join(name)).unwrap();
    }
    succeeds(path, &["surface", "seq", "--trend", "constant", "--overwrite"]);
    // The surface of former results goes with them, and that is said.
    let output = epirig(path, &["match", "seq", "--overwrite"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("epirig surface seq"), "{said}");
    assert!(!path.join("seq/results/surface").exists());
}

#[test]
fn an_exported_lens_replaces_nothing() {
    let folder = folder();
    let path = folder.path();
    imported(path);
    fs::write(path.join("lens.yml"), "the only copy").unwrap();
    symlink("lens.yml", path.join("link.yml")).unwrap();
    symlink("nowhere", path.join("dangling.yml")).unwrap();
    make_pipe(&path.join("pipe.yml"));
    for name in ["lens.yml", "link.yml", "dangling.yml", "pipe.yml"] {
        let export = ["calibrate", "seq", "--positions", "texture", "--export-lens", name];
        fails(path, &export, 2, &[name, "exists already"]);
    }
    assert_eq!(fs::read_to_string(path.join("lens.yml")).unwrap(), "the only copy");
    assert!(!path.join("seq/calibration.json").exists());
}

#[test]
fn a_profile_of_any_length_ends() {
    let folder = folder();
    measured(folder.path());
    for ends in ["0,0,1e308,1", "0,0,1000000000,1", "0,0,64,1", "nan,0,9,1", "-1,0,9,1"] {
        let ends = format!("--profile={ends}");
        let arguments = ["surface", "seq", "--trend", "constant", "--overwrite", &ends];
        let (code, said) = within_a_minute(folder.path(), &arguments);
        assert_eq!(code, Some(2), "{ends}: {said}");
        assert!(said.contains("outside the picture of 64 x 24") && said.len() < 300, "{ends}: {said}");
    }
}

#[test]
fn links_are_followed_or_refused_but_not_taken_for_files() {
    let folder = folder();
    let path = folder.path();
    images(&path.join("photos"), 4);
    fs::rename(path.join("photos/frame_2.png"), path.join("elsewhere.png")).unwrap();
    symlink("../elsewhere.png", path.join("photos/frame_2.png")).unwrap();
    succeeds(path, &["import", "photos", "--out", "seq", "--link"]);
    assert!(fs::symlink_metadata(path.join("seq/frames/0002.png")).unwrap().is_file());
    succeeds(path, &["verify", "seq"]);
    // A link does not lead into the source unnoticed, and names that only pass through it do.
    symlink("photos", path.join("other")).unwrap();
    fails(path, &["import", "photos", "--out", "other/seq"], 2, &["other/seq", "must stay as they are"]);
    assert_eq!(names(&path.join("photos")).len(), 4);
    succeeds(path, &["import", "photos", "--out", "photos/../second"]);
    // Nor can it be made a folder.
    fs::create_dir(path.join("empty")).unwrap();
    symlink("empty", path.join("to-empty")).unwrap();
    symlink("nowhere", path.join("dangling")).unwrap();
    for name in ["to-empty", "dangling"] {
        fails(path, &["import", "photos", "--out", name], 2, &[name, "is a link"]);
        fails(path, &["match", "seq", "--out", name], 2, &[name, "is a link"]);
        fails(path, &["capture", "--rig", "sim", "--out", name], 2, &[name, "is a link"]);
    }
}

#[test]
fn what_a_person_names_is_a_file() {
    let folder = folder();
    let path = folder.path();
    images(&path.join("photos"), 4);
    make_pipe(&path.join("pipe.yml"));
    make_pipe(&path.join("pipe.pfm"));
    succeeds(path, &["import", "photos", "--out", "seq"]);
    succeeds(path, &["match", "seq"]);
    for arguments in [
        &["import", "photos", "--out", "other", "--positions", "pipe.yml"][..],
        &["evaluate", "seq", "--truth", "pipe.pfm"],
        &["calibrate", "seq", "--lens", "pipe.yml"],
        &["decode", "pipe.yml"],
    ] {
        let (code, said) = within_a_minute(path, arguments);
        assert_eq!(code, Some(5), "{arguments:?}: {said}");
        assert!(said.contains("is a pipe"), "{arguments:?}: {said}");
    }
    // Without a profile there is no rig.
    fails(path, &["import", "photos", "--out", "other", "--rig", "pipe.yml"], 2, &["is a pipe"]);
    // What a shell gives is read.
    let script = format!(
        "{} import photos --out piped --positions <(printf '0\\n1\\n2\\n4\\n')",
        env!("CARGO_BIN_EXE_epirig")
    );
    let output = std::process::Command::new("bash").args(["-c", &script]).current_dir(path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_hole_in_numbered_images_is_named() {
    let folder = folder();
    let path = folder.path();
    images(&path.join("photos"), 5);
    fs::rename(path.join("photos/frame_3.png"), path.join("photos/frame_3.part")).unwrap();
    let import = ["import", "photos", "--out", "seq", "--step-mm", "1.5"];
    let output = epirig(path, &import);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("frame_3") && said.contains("--positions"), "{said}");
    fs::remove_dir_all(path.join("seq")).unwrap();
    fs::rename(path.join("photos/frame_3.part"), path.join("photos/frame_3.WEBP")).unwrap();
    fails(path, &import, 5, &["frame_3.WEBP", "not read"]);
    // Also at the end; but what is there in a format that is read is.
    fs::rename(path.join("photos/frame_3.WEBP"), path.join("photos/frame_5.dng")).unwrap();
    fails(path, &import, 5, &["frame_5.dng", "not read"]);
    fs::rename(path.join("photos/frame_5.dng"), path.join("photos/frame_4.dng")).unwrap();
    assert!(!path.join("seq").exists());
    succeeds(path, &import);
}

#[test]
fn exit_codes_tell_what_is_at_fault() {
    let folder = folder();
    let path = folder.path();
    imported(path);
    fs::write(path.join("lens.yml"), b"caf\xe9").unwrap();
    fails(path, &["calibrate", "seq", "--lens", "lens.yml"], 5, &["lens.yml", "UTF-8"]);
    succeeds(path, &["match", "seq"]);
    let unknown = epirig_core::grid::Grid::filled(24, 64, f32::NAN);
    fs::write(path.join("truth.npy"), epirig_data::formats::MapFormat::Npy.encode(&unknown).unwrap())
        .unwrap();
    fails(path, &["evaluate", "seq", "--truth", "truth.npy"], 5, &["truth.npy", "no pixel"]);
    let known = epirig_core::grid::Grid::filled(24, 64, 8.0_f32);
    fs::write(path.join("truth.npy"), epirig_data::formats::MapFormat::Npy.encode(&known).unwrap()).unwrap();
    super::edit(path, "stop.json", "\"complete\"", "\"not-closed\"");
    let output = epirig(path, &["evaluate", "seq", "--truth", "truth.npy"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("not closed"), "{said}");
    fs::remove_file(path.join("seq/journal.jsonl")).unwrap();
    fails(path, &["match", "seq"], 5, &["journal.jsonl", "missing"]);
}
