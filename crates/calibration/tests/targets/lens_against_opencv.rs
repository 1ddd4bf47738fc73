//! OpenCV's own calibration of its own photographs, beside ours of the same corners; and files that each
//! reads of the other.
//!
//! The photographs are not part of the repository; where they or Python are missing, the tests say so and do
//! nothing.

use std::path::{Path, PathBuf};
use std::process::Command;

use epirig_calibration::lens::views::{LensCalibration, PlanarPoint, Terms, View, calibrate, choose_terms};
use epirig_calibration::lens::{Lens, opencv_yaml};
use epirig_calibration::target::{ChessBoard, find_boards};
use epirig_core::frame::{Frame, Samples};

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
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/chessboards")
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

/// Our own corners of a photograph.
fn our_view(path: &Path) -> View {
    let grey = image::open(path).unwrap().into_luma8();
    let frame = Frame::new(ROWS, COLUMNS, 8, Samples::U8(grey.into_raw())).unwrap();
    let found = find_boards(&frame, &ChessBoard { columns: 9, rows: 6, square_mm: 25.0 }, 1);
    assert!(found.first().is_some_and(|found| found.complete), "{}", path.display());
    let corners: Vec<f64> =
        found[0].corners.iter().flat_map(|seen| [seen.corner.x_px, seen.corner.y_px]).collect();
    view(&corners)
}

/// Holds our calibration of `views`, from whatever corners, to what OpenCV has said of its own corners.
fn agrees_with_opencv(views: &[View], said: &str) -> LensCalibration {
    let (lens, sigma) = (&numbers(said, "lens")[0], &numbers(said, "sigma")[0]);
    let found = calibrate(views, ROWS, COLUMNS, Terms::All5).unwrap();
    let ours = found.estimate.lens.to_array();
    for (index, name) in Lens::NAMES.into_iter().enumerate() {
        let error = (ours[index] - lens[index]) / sigma[index];
        assert!(error.abs() < 3.0, "{name}: {} {} differ by {error} sigma", ours[index], lens[index]);
        // Since 4.7 OpenCV scales the inverse of the normal matrix by the sum of squares over the degrees of
        // freedom, as we do.
        let ratio = found.estimate.sigma()[index] / sigma[index];
        assert!((0.8..1.25).contains(&ratio), "the standard deviation of {name} is {ratio} times OpenCV's");
    }
    for index in 0..2 {
        assert!((ours[index] / lens[index] - 1.0).abs() < 0.002, "{} {}", ours[index], lens[index]);
    }
    found
}

#[test]
fn the_same_corners_give_the_lens_that_opencv_finds() {
    const TEST: &str = "the_same_corners_give_the_lens_that_opencv_finds";
    if !(photographs_are_there(TEST) && python_is_there(TEST)) {
        return;
    }
    let said = python(CORNERS, &photographs());
    let views: Vec<View> = numbers(&said, "corners").iter().map(|corners| view(corners)).collect();
    let found = agrees_with_opencv(&views, &said);
    let (rms, lens, sigma) =
        (numbers(&said, "rms")[0][0], &numbers(&said, "lens")[0], &numbers(&said, "sigma")[0]);
    assert!(found.rms_px <= rms + 1e-9, "{} {rms}", found.rms_px);
    // Nothing is rejected, so both minimise the same sum, and end where a step changes nothing that is known.
    assert!(found.rejected.is_empty(), "{:?}", found.rejected);
    for (index, ours) in found.estimate.lens.to_array().into_iter().enumerate() {
        assert!(
            (ours - lens[index]).abs() < 1e-3 * sigma[index],
            "{}: {ours} {}",
            Lens::NAMES[index],
            lens[index]
        );
    }
    let chosen = choose_terms(&views, ROWS, COLUMNS).unwrap();
    println!("{:#?}", chosen.cross_validation);
    assert!(chosen.terms >= Terms::K1K2, "a lens of 60 deg bends lines: {:?}", chosen.cross_validation);
}

#[test]
fn our_corners_fit_better_and_give_the_same_lens() {
    const TEST: &str = "our_corners_fit_better_and_give_the_same_lens";
    if !(photographs_are_there(TEST) && python_is_there(TEST)) {
        return;
    }
    let said = python(CORNERS, &photographs());
    let views: Vec<View> = photographs().iter().map(|path| our_view(path)).collect();
    let found = agrees_with_opencv(&views, &said);
    let rms = numbers(&said, "rms")[0][0];
    println!("residuals of our corners {} px, of OpenCV's {rms} px", found.rms_px);
    assert!(found.rejected.is_empty(), "{:?}", found.rejected);
    assert!(found.rms_px <= rms, "{} {rms}", found.rms_px);
}

#[test]
fn files_of_opencv_are_read() {
    const TEST: &str = "files_of_opencv_are_read";
    if !photographs_are_there(TEST) {
        return;
    }
    let read =
        |name: &str| opencv_yaml::read_lens(&std::fs::read_to_string(chessboards().join(name)).unwrap());
    let sample = read("left_intrinsics.yml").unwrap();
    assert_eq!((sample.rows, sample.columns), (Some(480), Some(640)));
    assert_eq!(sample.lens.focal_length_x_px, 5.359_157_339_616_32e2);
    assert_eq!(sample.lens.distortion.k3, 2.383_915_308_087_848_6e-1);
    let pair = read("intrinsics.yml").unwrap();
    assert_eq!((pair.rows, pair.columns), (None, None));
    assert_eq!(pair.lens.principal_point_y_px, 2.406_618_305_406_633_7e2);
    assert_eq!(pair.lens.distortion.k2, -1.035_466_204_304_267_5);
    let message = read("stereo_calib.xml").unwrap_err().to_string();
    assert!(message.contains("XML") && message.contains(".yml"), "{message}");
}

#[test]
fn opencv_reads_our_file_to_the_last_bit_and_we_its() {
    const TEST: &str = "opencv_reads_our_file_to_the_last_bit_and_we_its";
    if !python_is_there(TEST) {
        return;
    }
    let script = r#"
import sys, cv2
file = cv2.FileStorage(sys.argv[1], cv2.FILE_STORAGE_READ)
matrix, terms = (file.getNode(name).mat() for name in ["camera_matrix", "distortion_coefficients"])
print("size", int(file.getNode("image_height").real()), int(file.getNode("image_width").real()))
print("lens", *[repr(float(n)) for n in [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *terms.ravel()]])
again = cv2.FileStorage(sys.argv[2], cv2.FILE_STORAGE_WRITE)
again.write("cameraMatrix", matrix)
again.write("dist_coeffs", terms)
again.release()
"#;
    let folder = tempfile::tempdir().unwrap();
    let [ours, theirs] = ["ours.yml", "theirs.yml"].map(|name| folder.path().join(name));
    let third = 1.0 / 3.0;
    for parameters in [
        [
            2844.0 + third,
            2843.0 - third,
            511.5,
            517.0 * third,
            -0.1 * third,
            1e-7 * third,
            -3e-5,
            1e-300,
            -7e12,
        ],
        [1.0, 2.0, -3.0, 0.0, 0.0, 0.0, f64::MIN_POSITIVE, -0.0, 1e22],
    ] {
        let lens = Lens::from_array(parameters);
        std::fs::write(&ours, opencv_yaml::write(1024, 1280, &lens)).unwrap();
        let said = python(script, &[ours.clone(), theirs.clone()]);
        assert_eq!(numbers(&said, "size"), [[1024.0, 1280.0]]);
        assert_eq!(numbers(&said, "lens"), [parameters]);
        let back = opencv_yaml::read_lens(&std::fs::read_to_string(&theirs).unwrap()).unwrap();
        assert_eq!(back.lens.to_array(), parameters);
    }
}
