//! OpenCV's own calibration of its own photographs, beside ours of the same corners; and files that each reads of the other.
//!
//! The photographs are not part of the repository; where they or Python are missing, the tests say so and do nothing.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

use std::path::{Path, PathBuf};
use std::process::Command;

use epirig::lens::views::{LensCalibration, PlanarPoint, Terms, View, calibrate, choose_terms};
use epirig::lens::{Lens, opencv_yaml, ros_camera_info};

const ROWS: usize = 480;
const COLUMNS: usize = 640;

/// Prints the corners of each photograph, and what OpenCV makes of them.
const CORNERS: &str = r#"
import sys, numpy, cv2
board = numpy.zeros((54, 3), numpy.float32)
board[:, :2] = numpy.mgrid[0:9, 0:6].T.reshape(-1, 2) * 25
seen = []
for name in sys.argv[1:]:
    image = cv2.imread(name, cv2.IMREAD_GRAYSCALE)
    found, corners = cv2.findChessboardCorners(image, (9, 6))
    assert found, name
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
    corners = cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), stop)
    seen.append(corners)
    print("corners", *[repr(float(number)) for number in corners.ravel()])
size = image.shape[::-1]
result = cv2.calibrateCameraExtended([board] * len(seen), seen, size, None, None)
rms, matrix, terms, sigma = result[0], result[1], result[2], result[5]
numbers = lambda values: [repr(float(number)) for number in values]
print("rms", repr(float(rms)))
print("lens", *numbers([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *terms.ravel()[:5]]))
print("sigma", *numbers(sigma.ravel()[:9]))
"#;

fn chessboards() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/chessboards")
}

/// Whether `test` can run; says so if not.
fn python_is_there(test: &str) -> bool {
    let python = Command::new("python3").args(["-c", "import numpy, cv2"]).output();
    let there = python.is_ok_and(|output| output.status.success());
    assert!(
        there || std::env::var_os("EPIRIG_REQUIRE_PYTHON").is_none(),
        "python3 with numpy and cv2 is required"
    );
    if !there {
        eprintln!("SKIPPED {test}: python3 with numpy and cv2 is not there");
    }
    there
}

fn photographs_are_there(test: &str) -> bool {
    let there = chessboards().exists();
    if !there {
        eprintln!("SKIPPED {test}: {} is not there", chessboards().display());
    }
    there
}

fn python(script: &str, arguments: &[PathBuf]) -> String {
    let output = Command::new("python3").args(["-c", script]).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Numbers of the lines that begin with `word`.
fn numbers(text: &str, word: &str) -> Vec<Vec<f64>> {
    let lines = text.lines().filter_map(|line| line.strip_prefix(word));
    lines.map(|line| line.split_whitespace().map(|number| number.parse().unwrap()).collect()).collect()
}

/// The thirteen photographs of the left camera.
fn photographs() -> Vec<PathBuf> {
    (1..=14)
        .filter(|index| *index != 10)
        .map(|index| chessboards().join(format!("left{index:02}.jpg")))
        .collect()
}

/// Corners of 9 x 6 that are 25 mm apart, row by row, as x, y, x, y ...
fn view(corners: &[f64]) -> View {
    let place = |index: usize| ((index % 9) as f64 * 25.0, (index / 9) as f64 * 25.0);
    let point = |(index, corner): (usize, &[f64])| {
        let (x_mm, y_mm) = place(index);
        PlanarPoint { x_mm, y_mm, x_px: corner[0], y_px: corner[1], sigma_px: 0.1 }
    };
    corners.chunks_exact(2).enumerate().map(point).collect()
}

/// Our calibration without the views in which it finds fault.
fn calibrated(views: &[View]) -> LensCalibration {
    calibrate(views, ROWS, COLUMNS, Terms::All5).unwrap()
}

#[test]
fn the_same_corners_give_the_lens_that_opencv_finds() {
    const TEST: &str = "the_same_corners_give_the_lens_that_opencv_finds";
    if !(photographs_are_there(TEST) && python_is_there(TEST)) {
        return;
    }
    let said = python(CORNERS, &photographs());
    let views: Vec<View> = numbers(&said, "corners").iter().map(|corners| view(corners)).collect();
    let (rms, lens, sigma) =
        (numbers(&said, "rms")[0][0], &numbers(&said, "lens")[0], &numbers(&said, "sigma")[0]);
    let found = calibrated(&views);
    println!("opencv {rms} {lens:?} {sigma:?}");
    println!("epirig {} {:?} {:?}", found.rms_px, found.estimate.lens.to_array(), found.estimate.sigma());
    println!("{:?} {:?} {:?} {:?}", found.rejected, found.warnings, found.coverage, found.views);
    // OpenCV knows no wrong points, so that its residuals are at least as large.
    assert!(found.rms_px <= rms + 1e-9, "{} {rms}", found.rms_px);
    let ours = found.estimate.lens.to_array();
    for index in 0..2 {
        assert!(
            (ours[index] / lens[index] - 1.0).abs() < 0.002,
            "{}: {} {}",
            Lens::NAMES[index],
            ours[index],
            lens[index]
        );
    }
    for index in 0..Lens::PARAMETERS {
        assert!(
            (ours[index] - lens[index]).abs() < 3.0 * sigma[index],
            "{}: {} {}",
            Lens::NAMES[index],
            ours[index],
            lens[index]
        );
    }
}
