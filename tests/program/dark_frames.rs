//! Frames that are black but for a few dots, and frames of one grey level: each verb ends, and what it writes has finite numbers.

use std::fs;
use std::path::Path;
use std::time::Duration;

use crate::support::write_png;
use epirig_core::frame::{Frame, Samples};

const ROWS: usize = 5;
const COLUMNS: usize = 16;
const FRAMES: usize = 7;
/// Disparity of all dots over the baseline, in px.
const DISPARITY_PX: f64 = 5.5;
/// How often a dot begins in a column.
const DENSITY: f64 = 0.08;

/// Scenes whose lines between the dots are darker than black in all frames, because interpolation rings there.
const SPECKLE_8: [u64; 4] = [34, 37, 63, 112];
const SPECKLE_16: [u64; 4] = [0, 8, 14, 16];

/// Dots on black that move along the rows, drawn with shares of two pixels each.
fn speckle(seed: u64, full: f64) -> Vec<Vec<f64>> {
    let mut state = seed;
    let mut number = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut frames = vec![vec![0.0_f64; ROWS * COLUMNS]; FRAMES];
    for y in 0..ROWS {
        for x in -10..COLUMNS as i32 + 10 {
            if number() >= DENSITY {
                continue;
            }
            let (place, light) = (f64::from(x) + number(), 0.3 + 0.7 * number());
            for (t, frame) in frames.iter_mut().enumerate() {
                let place = place + DISPARITY_PX * t as f64 / (FRAMES - 1) as f64;
                let (whole, share) = (place.floor(), place.fract().rem_euclid(1.0));
                for (column, share) in [(whole, 1.0 - share), (whole + 1.0, share)] {
                    if (0.0..COLUMNS as f64).contains(&column) {
                        frame[y * COLUMNS + column as usize] += light * share;
                    }
                }
            }
        }
    }
    let level = |value: f64| (full * value + 0.5).floor().min(full);
    frames.into_iter().map(|frame| frame.into_iter().map(level).collect()).collect()
}

fn write(folder: &Path, bit_depth: u8, frames: &[Vec<f64>]) {
    fs::create_dir(folder).unwrap();
    for (index, frame) in frames.iter().enumerate() {
        let samples = match bit_depth {
            8 => Samples::U8(frame.iter().map(|&level| level as u8).collect()),
            _ => Samples::U16(frame.iter().map(|&level| level as u16).collect()),
        };
        let frame = Frame::new(ROWS, COLUMNS, bit_depth, samples).unwrap();
        write_png(&folder.join(format!("{index}.png")), &frame);
    }
}

/// Runs a verb that must end within two minutes, with 0 or, where nothing can be measured, 8.
fn ends(folder: &Path, arguments: &[&str], codes: &[i32]) -> i32 {
    let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
    command.current_dir(folder).env("XDG_CONFIG_HOME", folder).args(arguments);
    let output = command.timeout(Duration::from_secs(120)).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    let code = output.status.code().unwrap_or_else(|| panic!("{arguments:?} does not end: {said}"));
    assert!(codes.contains(&code) && !said.contains("panicked"), "{arguments:?}: {code} {said}");
    code
}

/// Matches frames in all ways that draw other lines, and looks at the numbers.
fn measured(bit_depth: u8, frames: &[Vec<f64>]) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(&path.join("photos"), bit_depth, frames);
    let scale = ["--step-mm", "1", "--focal-length-px", "100"];
    ends(path, &[&["-q", "import", "photos", "--out", "seq"][..], &scale].concat(), &[0]);
    if ends(path, &["-q", "match", "seq", "--range", "0..8"], &[0, 8]) == 8 {
        return false;
    }
    let results = path.join("seq/results");
    let figures: Vec<_> = fs::read_dir(results.join("figures")).unwrap().map(Result::unwrap).collect();
    for figure in figures.iter().filter(|figure| figure.path().extension().unwrap() == "csv") {
        let text = fs::read_to_string(figure.path()).unwrap();
        assert!(!text.contains("inf"), "{}: {text}", figure.path().display());
    }
    // What is read back is as it was written: a number that JSON does not know would be missing.
    ends(path, &["-q", "verify", "seq"], &[0]);
    ends(path, &["-q", "export", "seq", "--out", "disparity.csv"], &[0]);
    true
}

#[test]
fn dots_before_black_are_matched() {
    for seed in SPECKLE_8 {
        assert!(measured(8, &speckle(seed, 255.0)), "{seed}");
    }
    for seed in SPECKLE_16 {
        assert!(measured(16, &speckle(seed, 65_535.0)), "{seed}");
    }
}

#[test]
fn frames_of_one_level_have_no_answer() {
    for (bit_depth, levels) in [(8, vec![0.0, 1.0, 255.0]), (16, vec![0.0, 65_535.0])] {
        for level in levels {
            assert!(
                !measured(bit_depth, &vec![vec![level; ROWS * COLUMNS]; FRAMES]),
                "{bit_depth} bit, {level}"
            );
        }
    }
}

#[test]
fn one_dot_and_one_step_are_matched_or_have_no_answer() {
    let dot = |t: usize| {
        (0..ROWS * COLUMNS).map(move |index| if index == 2 * COLUMNS + 4 + t { 255.0 } else { 0.0 })
    };
    let step =
        |t: usize| (0..ROWS * COLUMNS).map(move |index| if index % COLUMNS > 5 + t { 255.0 } else { 0.0 });
    measured(8, &(0..FRAMES).map(|t| dot(t).collect()).collect::<Vec<_>>());
    measured(8, &(0..FRAMES).map(|t| step(t).collect()).collect::<Vec<_>>());
}
