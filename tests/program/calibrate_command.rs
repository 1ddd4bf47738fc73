//! `epirig calibrate` and `epirig rectify` as a person meets them: what they find, what they refuse and how they say it.

use std::fs;
use std::path::Path;

use crate::small_rig::{
    BOARD, blurred, changed, images, import, import_all, load, number, parallel_board, record, said, samples,
    scan, with_samples,
};
use crate::support::{epirig, fails, names, succeeds, write_png};
use epirig_core::grid::Grid;
use epirig_data::formats::MapFormat;
use epirig_data::sequence::{FrameKind, Origin, Sequence};

#[test]
fn images_of_other_software_are_calibrated_as_the_rig_is() {
    let folder = tempfile::tempdir().unwrap();
    import_all(folder.path(), "seq");
    let stderr = said(folder.path(), &["calibrate", "seq"]);
    // Nothing is missing, and no message uses view numbers, which users do not know.
    assert!(!stderr.contains("needs:") && !stderr.contains("view"), "{stderr}");
    let found = record(&folder.path().join("seq"));
    // As real.toml makes the rig, within four standard deviations of what is stated.
    let stage_axis = &found["stage_axis"];
    for (name, truth) in [("roll", 0.7), ("pan", 0.4)] {
        let sigma = number(&stage_axis[format!("{name}_sigma_deg")]);
        let off = number(&stage_axis[format!("{name}_deg")]) - truth;
        assert!(off.abs() < 4.0 * sigma && sigma < 0.05, "{name}: {off} +- {sigma}");
    }
    let estimate = &found["lens"]["estimate"];
    let sigma_px = number(&estimate["covariance"][0][0]).sqrt();
    let off_px = number(&estimate["lens"]["focal_length_x_px"]) - 256.0 * 25.0 / 9.0;
    assert!(off_px.abs() < 4.0 * sigma_px, "{off_px} +- {sigma_px}");
    assert_eq!(found["lens"]["board_files"][5], "board/0005.png");
    assert_eq!(found["positions"]["source"], "target");
    let text = succeeds(folder.path(), &["calibrate", "seq", "--overwrite"]);
    assert!(text.contains("next: `epirig match seq`") && !text.contains("0.000 %"), "{text}");
    let again = succeeds(folder.path(), &["-q", "calibrate", "seq", "--overwrite", "--json"]);
    assert_eq!(serde_json::from_str::<serde_json::Value>(&again).unwrap(), found);
}

#[test]
fn a_part_alone_is_calibrated_and_the_rest_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    import(folder.path(), "flat", &["--flat", images(FrameKind::Flat).to_str().unwrap()]);
    let stderr = said(folder.path(), &["calibrate", "flat"]);
    for word in ["dark level not corrected", "focal length"] {
        assert!(stderr.contains(word), "{word}: {stderr}");
    }
    // A board without a lens beside it is described as anything else is.
    import(
        folder.path(),
        "board",
        &[&["--board", images(FrameKind::Board).to_str().unwrap()][..], &BOARD].concat(),
    );
    assert!(said(folder.path(), &["calibrate", "board"]).contains("vignetting not corrected"));
    let target = ["target.square=15 mm", "target.columns=9", "target.rows=2", "target.bands=2"];
    let target: Vec<&str> = target.iter().flat_map(|text| ["--set", text]).collect();
    import(folder.path(), "target", &[&target[..], &["--set", "target.band_distance=105 mm"]].concat());
    succeeds(folder.path(), &["-q", "calibrate", "target"]);
    assert_eq!(record(&folder.path().join("target"))["lens"]["source"], "unknown");
}

#[test]
fn what_will_not_do_is_refused_with_a_reason_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    changed(path, "white", FrameKind::Flat, |_, frame| with_samples(&frame, |_, _| 255.0));
    changed(path, "tiles", FrameKind::Flat, |_, frame| {
        with_samples(&frame, |x, y| {
            f64::from(samples(&frame)[256 * y + x]) * if (x / 40 + y / 40) % 2 == 0 { 0.85 } else { 1.0 }
        })
    });
    changed(path, "unsharp", FrameKind::Board, |_, frame| blurred(&frame));
    changed(path, "still", FrameKind::Scan, |_, _| load(&images(FrameKind::Scan).join("0000.png")));
    changed(path, "empty", FrameKind::Scan, |_, frame| with_samples(&frame, |x, _| 100.0 + (x % 7) as f64));
    fs::create_dir(path.join("two")).unwrap();
    fs::create_dir(path.join("parallel")).unwrap();
    for index in 0..2 {
        let file = format!("000{index}.png");
        fs::copy(images(FrameKind::Board).join(&file), path.join("two").join(&file)).unwrap();
    }
    for index in 0..5 {
        let side = 14.0 + 2.0 * f64::from(index);
        let place = (20.3 + 4.0 * f64::from(index), 30.7 - 3.0 * f64::from(index));
        write_png(&path.join(format!("parallel/{index}.png")), &parallel_board(side, place.0, place.1));
    }
    let [dark, flat, board] = FrameKind::CALIBRATION.map(images);
    let [dark, flat, board] = [&dark, &flat, &board].map(|path| path.to_str().unwrap());
    let rig = scan().join("rig.toml");
    let rig = rig.to_str().unwrap();
    let photos = images(FrameKind::Scan);
    let photos = photos.to_str().unwrap();
    /// Photographs, options of import, options of calibrate, exit code, words.
    type Case<'a> = (&'a str, &'a [&'a str], &'a [&'a str], i32, &'a [&'a str]);
    let cases: [Case<'_>; 14] = [
        (photos, &[], &["--positions", "stage"], 6, &["nothing to calibrate with", "--lens"]),
        (photos, &["--board", board], &[], 2, &["6 board frames", "[board]", "--set board.columns"]),
        (photos, &["--board", "two"], &BOARD, 6, &["in 2 of 2", "at least 3"]),
        (photos, &["--board", "unsharp"], &BOARD, 6, &["in 0 of 6", "at least 3"]),
        (photos, &["--board", "parallel"], &BOARD, 6, &["focal length", "tilt the board"]),
        (photos, &["--flat", "white"], &[], 6, &["full scale", "less light"]),
        (photos, &["--flat", "tiles"], &[], 6, &["not uniform"]),
        (photos, &["--flat", dark, "--dark", flat], &[], 6, &["exchanged"]),
        ("empty", &["--rig", rig], &[], 6, &["no frame shows a chess-board of 9 x 2"]),
        ("still", &["--rig", rig], &[], 6, &["moves by 0.", "did not move"]),
        (
            photos,
            &["--rig", rig, "--step-mm", "10"],
            &["--set", "target.square=16.5 mm"],
            6,
            &["88.", "+10.0 %", "ruler"],
        ),
        (photos, &["--flat", flat], &["--positions", "target"], 2, &["[target]"]),
        (photos, &["--rig", rig], &["--set", "target.square=15"], 2, &["unit", "15 mm"]),
        (photos, &["--flat", flat], &["--export-lens", "nowhere/lens.yml"], 2, &["nowhere", "create it"]),
    ];
    for (index, (photos, given, options, code, words)) in cases.into_iter().enumerate() {
        let name = format!("seq-{index}");
        succeeds(path, &[&["-q", "import", photos, "--out", &name][..], given].concat());
        fails(path, &[&["calibrate", &name][..], options].concat(), code, words);
        let left = names(&path.join(&name));
        assert!(!left.iter().any(|name| name.contains("calibration")), "{index}: {left:?}");
    }
    // Who describes one band of two need not take back the distance that was recorded.
    succeeds(path, &["-q", "import", photos, "--out", "one-band", "--rig", rig]);
    succeeds(path, &["-q", "calibrate", "one-band", "--set", "target.bands=1"]);
}

#[test]
fn a_board_frame_that_contradicts_the_others_is_left_out_by_name() {
    let folder = tempfile::tempdir().unwrap();
    // Seen higher than wide by a quarter: pixels of another shape.
    changed(folder.path(), "boards", FrameKind::Board, |index, frame| {
        if index != 3 {
            return frame;
        }
        with_samples(&frame, |x, y| {
            let at = 128.0 + (y as f64 - 128.0) / 1.25;
            let (row, part) = (at.floor() as usize, at.fract());
            let sample = |row: usize| f64::from(samples(&frame)[256 * row.min(255) + x]);
            (1.0 - part) * sample(row) + part * sample(row + 1)
        })
    });
    import(folder.path(), "seq", &[&["--board", "boards"][..], &BOARD].concat());
    let stderr = said(folder.path(), &["calibrate", "seq"]);
    assert!(stderr.contains("board/0003.png") && !stderr.contains("view 3"), "{stderr}");
    let found = record(&folder.path().join("seq"));
    assert_eq!(found["lens"]["board_files"].as_array().unwrap().len(), 5);
    let focal_length_px = number(&found["lens"]["estimate"]["lens"]["focal_length_x_px"]);
    assert!((focal_length_px / (256.0 * 25.0 / 9.0) - 1.0).abs() < 0.01, "{focal_length_px}");
}

fn calibrate_anew<'a>(options: &[&'a str]) -> Vec<&'a str> {
    [&["-q", "calibrate", "seq", "--overwrite"][..], options].concat()
}

#[test]
fn lenses_come_from_other_programs_and_go_to_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    import_all(path, "seq");
    succeeds(path, &calibrate_anew(&["--export-lens", "lens.yml"]));
    fs::copy(path.join("seq/calibration.json"), path.join("other.json")).unwrap();
    let focal_length = || number(&record(&path.join("seq"))["lens"]["estimate"]["lens"]["focal_length_x_px"]);
    let original_px = focal_length();
    succeeds(path, &calibrate_anew(&["--export-lens", "lens.yaml", "--positions", "stage"]));
    for file in ["lens.yml", "lens.yaml", "other.json"] {
        succeeds(path, &calibrate_anew(&["--lens", file, "--flat-field", "order:2"]));
        let found = record(&path.join("seq"));
        assert_eq!((&found["lens"]["source"], &found["lens"]["file"]), (&"file".into(), &file.into()));
        // The tracks refine it by less than a file's lens is trusted: 0.2 %.
        assert!((focal_length() / original_px - 1.0).abs() < 0.002, "{file}: {}", focal_length());
    }
    let text = fs::read_to_string(path.join("lens.yml")).unwrap();
    fs::write(path.join("small.yml"), text.replace("width: 256", "width: 128")).unwrap();
    fs::write(path.join("nonsense.yml"), "nonsense: 1\n").unwrap();
    fs::write(path.join("nonsense.json"), "{").unwrap();
    let before = fs::read(path.join("seq/calibration.json")).unwrap();
    for (file, code, words) in [
        ("small.yml", 2, &["small.yml", "128 x 256", "256 x 256"][..]),
        ("nonsense.yml", 5, &["nonsense.yml", "matrix of the camera"]),
        ("nonsense.json", 5, &["nonsense.json"]),
        ("nowhere.yml", 2, &["nowhere.yml"]),
        ("nowhere.json", 2, &["nowhere.json"]),
        ("seq/frames/0000.png", 5, &["0000.png", "OpenCV"]),
    ] {
        fails(path, &calibrate_anew(&["--lens", file]), code, words);
    }
    fails(path, &["calibrate", "seq"], 2, &["calibration.json", "--overwrite"]);
    assert_eq!(fs::read(path.join("seq/calibration.json")).unwrap(), before);
}

#[test]
fn a_calibration_that_does_not_fit_the_frames_is_not_used() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    import(path, "seq", &["--flat", images(FrameKind::Flat).to_str().unwrap()]);
    succeeds(path, &["-q", "calibrate", "seq", "--flat-field", "pixels"]);
    let file = path.join("seq/calibration.json");
    let good = fs::read_to_string(&file).unwrap();
    let mut value: serde_json::Value = serde_json::from_str(&good).unwrap();
    value["positions"]["tau"].as_array_mut().unwrap().pop();
    // The change comes with a corrected hash.
    let signed = |value: &serde_json::Value| {
        let mut record: epirig::calibrate::Calibration = serde_json::from_value(value.clone()).unwrap();
        record.blake3 = record.hash();
        serde_json::to_string(&record).unwrap()
    };
    let short = signed(&value);
    value = serde_json::from_str(&good).unwrap();
    value["mapping"]["camera"]["columns"] = 1_000_000_000_u64.into();
    let huge = signed(&value);
    value = serde_json::from_str(&good).unwrap();
    value["mapping"]["roll_rad"] = 1.0.into();
    let turned = signed(&value);
    value = serde_json::from_str(&good).unwrap();
    value["sequence_uid"] = "x".into();
    let other = signed(&value);
    for (text, words) in [
        (&good[..good.len() / 2], &["calibration.json", "--overwrite"][..]),
        (&good.replace("\"format\": 4", "\"format\": 5"), &["version 5", "reads version 4"]),
        (&value.to_string(), &["calibration.json", "changed after it was made"]),
        (&other, &["stale", "another sequence", "--as-captured"]),
        (&short, &["8 positions for 9 frames"]),
        (&huge, &["1000000000 x"]),
        (&turned, &["calibration.json"]),
    ] {
        fs::write(&file, text).unwrap();
        fails(path, &["match", "seq"], 5, words);
        fails(path, &["rectify", "seq", "--out", "rectified"], 5, words);
        assert!(!path.join("seq/results").exists() && !path.join("rectified").exists());
    }
    fs::write(&file, &good).unwrap();
    let map = path.join("seq/calibration/flat-field.tiff");
    let bytes = fs::read(&map).unwrap();
    fs::remove_file(&map).unwrap();
    fails(path, &["match", "seq"], 5, &["flat-field.tiff", "missing", "--overwrite"]);
    fs::write(&map, &bytes[..bytes.len() / 2]).unwrap();
    fails(path, &["match", "seq"], 5, &["flat-field.tiff", "--overwrite"]);
    // A sound map of the right size, and not the one that belongs to the record.
    let mut other = epirig_data::formats::MapFormat::Tiff.decode(&bytes).unwrap();
    other.values_mut().iter_mut().for_each(|gain| *gain *= 1.01);
    fs::write(&map, epirig_data::formats::MapFormat::Tiff.encode(&other).unwrap()).unwrap();
    fails(path, &["match", "seq"], 5, &["flat-field.tiff", "not the map", "--overwrite"]);
    fs::write(&map, &bytes).unwrap();
    // A frame less, and frames that have changed.
    let journal = path.join("seq/journal.jsonl");
    let lines = fs::read_to_string(&journal).unwrap();
    let end = lines.trim_end().rfind('\n').unwrap();
    fs::write(&journal, &lines[..=end]).unwrap();
    fails(path, &["match", "seq"], 5, &["stale", "4 flat frames", "3"]);
    fs::write(&journal, &lines).unwrap();
    fs::copy(path.join("seq/flat/0000.png"), path.join("seq/flat/0001.png")).unwrap();
    fails(path, &["calibrate", "seq", "--overwrite"], 5, &["flat/0001.png"]);
    fs::remove_file(path.join("seq/flat/0001.png")).unwrap();
    fails(path, &["calibrate", "seq", "--overwrite"], 5, &["flat/0001.png", "missing"]);
    assert_eq!(fs::read_to_string(&file).unwrap(), good);
}

#[test]
fn maps_of_an_older_calibration_do_not_stay() {
    let folder = tempfile::tempdir().unwrap();
    import(folder.path(), "seq", &["--flat", images(FrameKind::Flat).to_str().unwrap()]);
    let map = folder.path().join("seq/calibration/flat-field.tiff");
    succeeds(folder.path(), &["-q", "calibrate", "seq", "--flat-field", "pixels"]);
    assert!(map.exists());
    succeeds(folder.path(), &["-q", "calibrate", "seq", "--flat-field", "paper", "--overwrite"]);
    assert!(!map.exists());
    // Where nothing can be written, that is said before the work, and what was there stays.
    let before = record(&folder.path().join("seq"));
    fs::remove_dir_all(map.parent().unwrap()).unwrap();
    fs::write(map.parent().unwrap(), "a file where the folder should be").unwrap();
    let pixels = ["calibrate", "seq", "--flat-field", "pixels", "--overwrite"];
    fails(folder.path(), &pixels, 1, &["calibration", "check the disk"]);
    assert_eq!(record(&folder.path().join("seq")), before);
}

#[test]
fn a_sensor_that_is_not_linear_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    import(path, "seq", &["--flat", images(FrameKind::Flat).to_str().unwrap()]);
    let blank = load(&images(FrameKind::Flat).join("0000.png"));
    let mut table = "# seconds\nexposure, file\n".to_owned();
    for exposure in 1..=5 {
        let light = f64::from(exposure) / 5.5;
        // The paper's vignetting; and a response with the gamma of a television.
        let dark = |x: usize, y: usize| {
            let (x, y) = (x as f64 / 127.5 - 1.0, y as f64 / 127.5 - 1.0);
            1.0 - 0.09 * (x * x + y * y)
        };
        let straight = with_samples(&blank, |x, y| 5.0 + 240.0 * light * dark(x, y));
        let bent = with_samples(&blank, |x, y| 255.0 * (light * dark(x, y)).powf(0.8));
        write_png(&path.join(format!("straight-{exposure}.png")), &straight);
        write_png(&path.join(format!("bent-{exposure}.png")), &bent);
        table.push_str(&format!("{exposure}, straight-{exposure}.png\n"));
    }
    fs::write(path.join("straight.csv"), &table).unwrap();
    fs::write(path.join("bent.csv"), table.replace("straight", "bent")).unwrap();
    fs::write(path.join("two.csv"), table.lines().take(4).collect::<Vec<_>>().join("\n")).unwrap();
    fs::write(path.join("missing.csv"), table.replace("straight-3", "nowhere")).unwrap();
    fs::write(path.join("columns.csv"), table.replace("exposure, file", "time, file")).unwrap();
    fs::write(path.join("number.csv"), table.replace("3, ", "three, ")).unwrap();
    let calibrate = |table| ["calibrate", "seq", "--overwrite", "--linearity", table];
    assert!(succeeds(path, &calibrate("straight.csv")).contains("linearity          good"));
    let found = &record(&path.join("seq"))["linearity"];
    // Levels are rounded to 1 DN, and their means over a cell's 625 pixels to much less.
    assert!(number(&found["largest_departure_percent"]) < 0.1, "{found}");
    assert!((number(&found["offset_dn"]) - 5.0).abs() < 0.1, "{found}");
    let output = epirig(path, &calibrate("bent.csv"));
    assert!(String::from_utf8_lossy(&output.stdout).contains("NOT LINEAR"), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("is not linear"), "{output:?}");
    // Too few exposures do not reject the rest of the calibration.
    assert!(said(path, &calibrate("two.csv")).contains("note: the linearity was not tested"));
    assert!(record(&path.join("seq"))["linearity"].is_null());
    fails(path, &calibrate("nowhere.csv"), 2, &["nowhere.csv"]);
    fails(path, &calibrate("missing.csv"), 5, &["missing.csv, line 5", "nowhere.png"]);
    fails(path, &calibrate("columns.csv"), 5, &["columns.csv", "the column exposure is missing"]);
    fails(path, &calibrate("number.csv"), 5, &["line 5", "\"three\""]);
}

fn map(path: &Path) -> Grid<f32> {
    MapFormat::Tiff.decode(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn rectified_frames_match_as_the_calibrated_original_does() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    import_all(path, "seq");
    fails(path, &["rectify", "seq", "--out", "rectified"], 2, &["seq", "epirig calibrate seq"]);
    let note = said(path, &["match", "seq", "--reference", "middle", "--out", "raw"]);
    assert!(note.contains("run `epirig calibrate seq` first"), "{note}");
    succeeds(path, &["-q", "calibrate", "seq"]);
    let note = said(path, &["match", "seq", "--reference", "middle", "--out", "calibrated"]);
    assert!(note.contains("rectified by seq/calibration.json"), "{note}");
    succeeds(path, &["rectify", "seq", "--out", "rectified"]);
    succeeds(path, &["verify", "rectified"]);
    fails(path, &["rectify", "seq", "--out", "rectified"], 2, &["rectified", "exists"]);
    let matched = ["match", "rectified", "--reference", "middle", "--as-captured", "--out", "again"];
    succeeds(path, &matched);

    let calibration = record(&path.join("seq"));
    let rectified = Sequence::open(&path.join("rectified")).unwrap();
    let Origin::Rectified { sequence_uid, dn_per_sample, focal_length_sigma, .. } =
        &rectified.record().origin
    else {
        panic!()
    };
    assert_eq!(sequence_uid, calibration["sequence_uid"].as_str().unwrap());
    // 256 DN are 32768.
    assert_eq!((*dn_per_sample, rectified.record().bit_depth), (1.0 / 128.0, 16));
    let tau = rectified.tau().unwrap();
    for (tau, measured) in tau.values().iter().zip(calibration["positions"]["tau"].as_array().unwrap()) {
        assert!((tau - number(measured)).abs() < 1e-12);
    }
    let intrinsics = rectified.record().intrinsics.unwrap();
    assert_eq!(intrinsics.focal_length_px, number(&calibration["mapping"]["camera"]["focal_length_px"]));
    // Its heights are known no better than those of the frames that it was made of.
    let lens = &calibration["lens"]["estimate"];
    let relative = number(&lens["covariance"][0][0]).sqrt() / number(&lens["lens"]["focal_length_x_px"]);
    assert!(
        focal_length_sigma.is_some_and(|sigma| (sigma / relative - 1.0).abs() < 1e-12),
        "{focal_length_sigma:?}"
    );

    let [first, second] = ["calibrated", "again"].map(|name| map(&path.join(name).join("disparity.tiff")));
    let sigma = map(&path.join("calibrated/sigma.tiff"));
    // Rounding to 1/128 DN has a standard deviation of 0.0023 DN, beside noise of 1.434 DN: on a
    // plane a disparity moves by 0.0016 of its sigma (RMS). At the tile's walls the edges of a disc
    // are weighed anew, so some move by more: measured 0.0067 sigma in the middle, and for nine of
    // ten pixels at most a few hundredths of sigma. A third of margin.
    let known = |value: f32| !value.is_nan();
    let mut off: Vec<(f32, f32)> = Vec::new();
    for ((first, second), sigma) in first.values().iter().zip(second.values()).zip(sigma.values()) {
        match (known(*first), known(*second)) {
            (true, true) => off.push(((first - second).abs(), (first - second).abs() / sigma)),
            (false, false) => {}
            _ => off.push((f32::INFINITY, f32::INFINITY)),
        }
    }
    // The tile covers a quarter of the picture, and nothing else has texture.
    assert!(off.len() > first.values().len() / 5, "{}", off.len());
    let (mut off_px, mut off_sigmas): (Vec<f32>, Vec<f32>) = off.into_iter().unzip();
    off_px.sort_unstable_by(f32::total_cmp);
    off_sigmas.sort_unstable_by(f32::total_cmp);
    let nine_tenths = off_px.len() * 9 / 10;
    assert!(off_sigmas[off_sigmas.len() / 2] < 0.009, "{}", off_sigmas[off_sigmas.len() / 2]);
    assert!(off_sigmas[nine_tenths] < 0.085, "{}", off_sigmas[nine_tenths]);
    assert!(off_px[nine_tenths] < 0.005, "{}", off_px[nine_tenths]);
    let heights = |name: &str| path.join(name).join("height_mm.tiff").exists();
    assert!(heights("calibrated") && heights("again") && heights("raw"));
}
