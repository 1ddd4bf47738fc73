//! `epirig pack`: a volume on disk gives the results of the images, and other programs read it.

use std::fs;
use std::path::Path;

use crate::small_rig::{import_all, said};
use crate::support::{fails, images, names, simulator, succeeds};
use epirig_core::frame::Samples;

/// All maps of two folders of results are the same bytes.
pub(crate) fn same_maps(one: &Path, other: &Path) {
    let maps: Vec<String> = names(one).into_iter().filter(|name| name.ends_with(".tiff")).collect();
    assert!(maps.len() >= 4, "{maps:?}");
    for name in maps {
        assert_eq!(fs::read(one.join(&name)).unwrap(), fs::read(other.join(&name)).unwrap(), "{name}");
    }
}

#[test]
fn a_packed_volume_gives_the_results_of_the_images_until_it_is_of_something_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    import_all(path, "seq");
    // As captured.
    succeeds(path, &["match", "seq", "--out", "raw"]);
    let told = succeeds(path, &["pack", "seq"]);
    assert!(told.contains("seq/volume.zarr: 9 frames") && told.contains("8 bit, as captured"), "{told}");
    succeeds(path, &["match", "seq", "--out", "raw-packed"]);
    same_maps(&path.join("raw"), &path.join("raw-packed"));
    // Rectified: what was packed is of no use any more, which is said.
    succeeds(path, &["-q", "calibrate", "seq"]);
    let note = said(path, &["match", "seq", "--out", "calibrated"]);
    assert!(note.contains("volume.zarr is not used: it is of another calibration"), "{note}");
    let told = succeeds(path, &["--json", "pack", "seq"]);
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(
        (&told["frames"], &told["bit_depth"], &told["packed_before"]),
        (&9.into(), &16.into(), &0.into())
    );
    assert!(said(path, &["pack", "seq"]).contains("9 of 9 frames were packed before"));
    let note = said(path, &["match", "seq", "--out", "packed"]);
    assert!(!note.contains("not used"), "{note}");
    same_maps(&path.join("calibrated"), &path.join("packed"));
    // It is the volume that was read: without the images `match` does not miss them.
    let frames = path.join("seq/frames");
    fs::rename(&frames, path.join("away")).unwrap();
    fs::create_dir(&frames).unwrap();
    succeeds(path, &["match", "seq", "--out", "without-images"]);
    same_maps(&path.join("calibrated"), &path.join("without-images"));
    fs::remove_dir(&frames).unwrap();
    fs::rename(path.join("away"), &frames).unwrap();
    let note = said(path, &["match", "seq", "--as-captured", "--out", "raw-again"]);
    assert!(note.contains("volume.zarr is not used: it holds rectified frames"), "{note}");
    same_maps(&path.join("raw"), &path.join("raw-again"));
    // What is damaged is told, and what to do.
    let shard = path.join("seq/volume.zarr/0/c/4/0/0");
    let bytes = fs::read(&shard).unwrap();
    fs::write(&shard, &bytes[..bytes.len() / 2]).unwrap();
    let words = ["frame 4 of", "missing or damaged", "remove the volume, and run `epirig pack` again"];
    fails(path, &["match", "seq", "--out", "damaged"], 5, &words);
    fs::remove_dir_all(path.join("seq/volume.zarr")).unwrap();
    // Something of another kind is not touched.
    fs::create_dir_all(path.join("seq/volume.zarr/mine")).unwrap();
    fails(path, &["pack", "seq"], 2, &["volume.zarr is there already", "give another name"]);
    assert!(path.join("seq/volume.zarr/mine").exists());
    succeeds(path, &["pack", "seq", "--out", "elsewhere/v.zarr"]);
    assert!(path.join("elsewhere/v.zarr/zarr.json").exists());
}

#[test]
fn memory_decides_where_frames_are_and_not_what_comes_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    import_all(path, "seq");
    let blocks = ["--as-captured", "--block-rows", "40"];
    let matched =
        |out: &str, more: &[&str]| said(path, &[&["match", "seq", "--out", out], &blocks[..], more].concat());
    let note = matched("held", &["--memory", "4GiB"]);
    assert!(!note.contains("packed") && !path.join("seq/volume.zarr").exists(), "{note}");
    succeeds(path, &["pack", "seq", "--as-captured"]);
    let note = matched("read", &[]);
    assert!(!note.contains("not used"), "{note}");
    same_maps(&path.join("held"), &path.join("read"));
    fails(
        path,
        &["match", "seq", "--out", "none", "--memory", "1MB"],
        2,
        &["--memory allows 1 MB", "give it more"],
    );
    fails(path, &["match", "seq", "--out", "none", "--memory", "1"], 2, &["not a size of memory", "2GiB"]);
    fails(
        path,
        &["match", "seq", "--out", "none", "--block-rows", "0"],
        2,
        &["the number of rows of a block is 0"],
    );
    assert!(!path.join("none").exists());
    let words = ["calibrating needs up to", "--memory allows 1 MB"];
    fails(path, &["calibrate", "seq", "--memory", "1MB"], 2, &words);
    assert!(!path.join("seq/calibration.json").exists());
}

#[test]
fn checks_and_surfaces_are_the_same_from_blocks_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    import_all(path, "seq");
    succeeds(path, &["-q", "calibrate", "seq"]);
    succeeds(path, &["match", "seq", "--block-rows", "40"]);
    let told = || -> Vec<String> {
        [&["--split-half"][..], &["--both-ways"], &["--leave-out", "3"]]
            .into_iter()
            .map(|check| [&["evaluate", "seq", "--json", "--block-rows", "40"], check].concat())
            .chain([vec!["surface", "seq", "--json", "--overwrite"]])
            .map(|arguments| {
                let mut told: serde_json::Value = serde_json::from_str(&succeeds(path, &arguments)).unwrap();
                // The report tells when it was made.
                told.as_object_mut().unwrap().remove("files");
                told.to_string()
            })
            .collect()
    };
    let held = told();
    succeeds(path, &["pack", "seq"]);
    let away = path.join("away");
    // It is the array that is read.
    fs::rename(path.join("seq/frames"), &away).unwrap();
    fs::create_dir(path.join("seq/frames")).unwrap();
    fs::copy(away.join("0000.png"), path.join("seq/frames/0000.png")).unwrap();
    assert_eq!(told(), held);
    let words = ["evaluating needs up to", "--memory allows 1 MB"];
    fails(path, &["evaluate", "seq", "--both-ways", "--memory", "1MB"], 2, &words);
    fails(path, &["evaluate", "seq", "--truth", "x.pfm", "--memory", "1GB"], 2, &["cannot be used with"]);
}

#[test]
fn frames_of_an_array_are_imported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    images(&path.join("photos"), 7);
    succeeds(path, &["import", "photos", "--out", "seq"]);
    succeeds(path, &["pack", "seq", "--out", "array.zarr"]);
    succeeds(path, &["import", "array.zarr", "--out", "again"]);
    let simulator = simulator(7);
    let positions = simulator.config().scan.positions_mm();
    let check = |sequence: &str, expected: &[usize]| {
        let sequence = epirig_data::sequence::Sequence::open(&path.join(sequence)).unwrap();
        assert_eq!(sequence.frames().len(), expected.len());
        for (record, &t) in sequence.frames().iter().zip(expected) {
            let truth = simulator.expose(positions[t], t as u32);
            let Samples::U8(_) = truth.samples() else { panic!() };
            assert_eq!(sequence.read(record).unwrap(), truth);
        }
    };
    check("again", &[0, 1, 2, 3, 4, 5, 6]);
    succeeds(path, &["import", "array.zarr", "--every", "2", "--out", "half"]);
    check("half", &[0, 2, 4, 6]);
    succeeds(path, &["import", "array.zarr", "--frames", "1..4", "--exclude", "2", "--out", "some"]);
    check("some", &[1, 3, 4]);
    fails(path, &["import", "array.zarr", "photos", "--out", "x"], 2, &["is an array", "import it alone"]);
    fs::remove_dir_all(path.join("array.zarr/0")).unwrap();
    fails(path, &["import", "array.zarr", "--out", "x"], 5, &["there is no array in it"]);
    assert!(!path.join("x").exists());
}

/// Unpacks a zip archive.
fn unpack(archive: &Path, into: &Path) {
    let mut archive = zip::ZipArchive::new(fs::File::open(archive).unwrap()).unwrap();
    archive.extract(into).unwrap();
}

#[test]
fn who_unpacks_a_bundle_has_the_measurement() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    import_all(path, "seq");
    succeeds(path, &["-q", "calibrate", "seq"]);
    succeeds(path, &["match", "seq"]);
    succeeds(path, &["pack", "seq"]);
    let told = succeeds(path, &["pack", "seq", "--bundle", "raw.zip"]);
    assert!(told.contains("raw.zip: ") && told.contains("`epirig verify seq`"), "{told}");
    fails(path, &["pack", "seq", "--bundle", "raw.zip"], 2, &["raw.zip exists already"]);
    let text = succeeds(path, &["--json", "pack", "seq", "--bundle", "whole.zip", "--with-results"]);
    let told: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (archive, derived) in [("raw", false), ("whole", true)] {
        let there = path.join(archive);
        unpack(&path.join(format!("{archive}.zip")), &there);
        succeeds(&there, &["verify", "seq"]);
        assert_eq!(there.join("seq/results/match.json").exists(), derived);
        assert_eq!(there.join("seq/calibration.json").exists(), derived);
        assert!(!there.join("seq/volume.zarr").exists());
        if !derived {
            succeeds(&there, &["-q", "calibrate", "seq"]);
            succeeds(&there, &["match", "seq"]);
        }
        same_maps(&path.join("seq/results"), &there.join("seq/results"));
    }
    // The list has the hash of every file of the archive.
    let list = fs::read(path.join("whole/seq/bundle.json")).unwrap();
    let list: serde_json::Value = serde_json::from_slice(&list).unwrap();
    assert_eq!(list, told);
    let files = list["files"].as_object().unwrap();
    assert!(files.len() > 9 + 12, "{list}");
    for (name, hash) in files {
        let bytes = fs::read(path.join("whole/seq").join(name)).unwrap();
        assert_eq!(blake3::hash(&bytes).to_hex().as_str(), hash, "{name}");
    }
    // A frame that has changed is not passed on.
    let frame = path.join("seq/frames/0003.png");
    let mut bytes = fs::read(&frame).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&frame, bytes).unwrap();
    fails(path, &["pack", "seq", "--bundle", "damaged.zip"], 5, &["0003.png"]);
    assert!(
        !names(path).iter().any(|name| name == "damaged.zip" || name.starts_with('.')),
        "{:?}",
        names(path)
    );
}
