//! Maps in the pixels of the photograph that they belong to.

use std::fs;
use std::path::Path;

use epirig::calibrate::read_calibration;
use epirig::pipeline::open_results;
use epirig::results::{ResultMap, read_map};
use epirig_calibration::rectification::FramePose;
use epirig_core::grid::Grid;
use epirig_data::sequence::Sequence;
use nalgebra::Vector3;

use super::program::{fails, succeeds};
use epirig_photographs::{Photographs, Series};

const SIZE: (usize, usize) = (300, 450);
/// Pixels from one that is looked at to the next, along rows and columns.
const EVERY: usize = 7;

/// Photographs of a relief that are measured, as `seq`.
fn measured(folder: &Path, taken: Photographs) -> Series {
    let series = taken.take();
    series.write_photographs(&folder.join("photos"));
    let focal_length_px = series.camera.focal_length_px.to_string();
    let measure = ["-q", "measure", "photos", "--out", "seq", "--focal-length-px", &focal_length_px];
    succeeds(folder, &measure);
    series
}

/// The map in the pixels of the photograph.
fn exported(folder: &Path, map: &str) -> Grid<f32> {
    let out = format!("{map}.npy");
    succeeds(folder, &["export", "seq", "--map", map, "--original", "--out", &out]);
    read_map(&folder.join(out)).unwrap()
}

/// How well two series of values agree: 1 if they differ by scale and offset alone.
fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let mean = |value: fn(&(f64, f64)) -> f64| pairs.iter().map(value).sum::<f64>() / pairs.len() as f64;
    let (a, b) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let sum = |product: fn(f64, f64) -> f64| -> f64 {
        pairs.iter().map(|pair| product(pair.0 - a, pair.1 - b)).sum()
    };
    sum(|a, b| a * b) / (sum(|a, _| a * a) * sum(|_, b| b * b)).sqrt()
}

#[test]
fn a_map_lies_on_its_photograph() {
    let (rows, columns) = SIZE;
    let plain = Photographs::sized(rows, columns, 20);
    let vertical = Photographs { roll_deg: 90.0, ..plain.clone() };
    // The reference frame has a pose of its own, and another place in the order of positions than it was taken at.
    let slanted = Photographs { roll_deg: 7.0, wobble_deg: 0.03, step_back: Some(11), ..plain };
    for taken in [vertical, slanted] {
        let roll_deg = taken.roll_deg;
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let series = measured(folder, taken);
        let [disparity, sigma, mask] = ["disparity", "sigma", "mask"].map(|map| exported(folder, map));
        for map in [&disparity, &sigma, &mask] {
            assert_eq!((map.rows(), map.columns()), SIZE);
        }

        // Each value is that of a pixel of the results near the place that the calibration tells.
        let sequence = Sequence::open(&folder.join("seq")).unwrap();
        let results = open_results(&sequence, &folder.join("seq/results")).unwrap();
        let (calibration, _) = read_calibration(&sequence).unwrap().unwrap();
        let reference = results.matched.reference;
        let pose = calibration.poses().get(reference).copied().unwrap_or_else(FramePose::default);
        let rectified_mask = results.map(ResultMap::Mask, None).unwrap().unwrap();
        let mut compared = 0;
        for y in (1..results.sigma.rows() - 1).step_by(EVERY) {
            for x in (1..results.sigma.columns() - 1).step_by(EVERY) {
                let (raw_x, raw_y) = calibration.mapping.raw_of(&pose, x as f64, y as f64);
                if !series.has_pixel((raw_x, raw_y)) {
                    continue;
                }
                let (raw_x, raw_y) = (raw_x.round() as usize, raw_y.round() as usize);
                for (raw, rectified) in
                    [(&disparity, &results.disparity), (&sigma, &results.sigma), (&mask, &rectified_mask)]
                {
                    let value = raw.at(raw_x, raw_y).to_bits();
                    let around = rectified.cropped(x - 1..x + 2, y - 1..y + 2);
                    let found = around.values().iter().any(|near| near.to_bits() == value);
                    assert!(found, "roll {roll_deg}: ({x}, {y}) at ({raw_x}, {raw_y})");
                }
                compared += usize::from(results.sigma.at(x, y).is_finite());
            }
        }
        assert!(compared * EVERY * EVERY * 2 > rows * columns, "roll {roll_deg}: {compared}");

        // The photograph shows there what the value tells of.
        let file = &results.reference_record(&sequence).unwrap().file;
        let frame = sequence.frames().iter().position(|frame| frame.file == *file).unwrap();
        let axis = Vector3::from(calibration.mapping.rotation()[2]);
        let mut pairs = Vec::new();
        for y in (0..rows).step_by(EVERY) {
            for x in (0..columns).step_by(EVERY) {
                let found = f64::from(disparity.at(x, y));
                assert_eq!(found.is_finite(), mask.at(x, y) == 255.0, "roll {roll_deg}: ({x}, {y})");
                let point = series.seen(frame, x as f64, y as f64);
                if found.is_finite() && series.is_in_all(&point) {
                    pairs.push((found, series.disparity_px(&point, &axis, series.camera.focal_length_px)));
                }
            }
        }
        assert!(pairs.len() * EVERY * EVERY * 2 > rows * columns, "roll {roll_deg}: {}", pairs.len());
        let correlation = correlation(&pairs).abs();
        // Noise leaves 0.9998, and a map that lies 3 px beside the photograph has 0.9990.
        assert!(correlation > 0.9995, "roll {roll_deg}: {correlation}");

        let picture = ["export", "seq", "--original", "--out", "picture.png"];
        let said = succeeds(folder, &picture);
        assert!(
            said.contains(&format!("picture.png: {columns} x {rows}, the pixels of seq/{file}")),
            "{said}"
        );
    }
}

#[test]
fn what_cannot_lie_on_a_photograph_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let refused = |map: &str, out: &str, words: &[&str]| {
        fails(folder, &["export", "seq", "--map", map, "--original", "--out", out], 2, words);
        assert!(!folder.join(out).exists());
    };
    refused("height", "height.x3p", &["height.x3p", "leave out --original"]);
    refused("height", "height.ply", &["height.ply", "choose another format"]);
    refused("difference", "difference.npy", &["--map difference", "one sequence"]);
}

#[test]
fn photographs_that_were_matched_as_they_are_have_their_maps_already() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    Photographs::sized(120, 180, 8).take().write_photographs(&folder.join("photos"));
    succeeds(folder, &["-q", "import", "photos", "--out", "seq"]);
    succeeds(folder, &["-q", "match", "seq"]);
    let original = exported(folder, "confidence");
    succeeds(folder, &["export", "seq", "--map", "confidence", "--out", "plain.npy"]);
    assert_eq!((original.rows(), original.columns()), (120, 180));
    assert_eq!(fs::read(folder.join("plain.npy")).unwrap(), fs::read(folder.join("confidence.npy")).unwrap());
}
