//! Chess-boards are found in real photographs, where OpenCV finds them; a printed target is found again, at its true scale.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use epirig::frame::{Frame, Samples};
use epirig::target::print::{Page, Sheet};
use epirig::target::{ChessBoard, FoundBoard, Target, find_boards};

const BOARD: ChessBoard = ChessBoard { columns: 9, rows: 6, square_mm: 25.0 };

/// Prints x and y of each corner of each photograph that OpenCV finds complete, refined in windows that end before the next edges.
const FIND: &str = r#"
import sys, cv2, numpy
for path in sys.argv[1:]:
    image = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
    found, corners = cv2.findChessboardCorners(image, (9, 6))
    if not found:
        continue
    grid = corners.reshape(6, 9, 2)
    steps = [numpy.linalg.norm(numpy.diff(grid, axis=axis), axis=2).min() for axis in (0, 1)]
    half = int(max(2, min(5, 0.4 * min(steps))))
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
    corners = cv2.cornerSubPix(image, corners, (half, half), (-1, -1), stop).reshape(-1, 2)
    print(path, *(f"{value:.4f}" for value in corners.ravel()))
"#;

/// Calibrates the left and the right camera on the corners in each file, and prints the residuals' root mean squares, in px.
const CALIBRATE: &str = r#"
import sys, cv2, numpy
board = numpy.array([[column, row, 0] for row in range(6) for column in range(9)], numpy.float32)
for path in sys.argv[1:]:
    lines = [line.split() for line in open(path)]
    for camera in ("left", "right"):
        views = [numpy.array(line[1:], numpy.float32).reshape(-1, 1, 2) for line in lines if camera in line[0].split("/")[-1]]
        print(cv2.calibrateCamera([board] * len(views), views, (640, 480), None, None)[0])
"#;

/// Renders the first page of a PDF at 200 dpi as a grey PNG, and finds both bands by OpenCV.
const RENDER: &str = r#"
import sys, cv2, numpy, pypdfium2
page = pypdfium2.PdfDocument(sys.argv[1])[0]
# The renderer moves squares to whole pixels: to quarters of those that are left.
image = page.render(scale=800 / 72).to_pil().convert("L").reduce(4)
image.save(sys.argv[2])
print(*page.get_size())
image = numpy.asarray(image)
half = image.shape[0] * 100 // 297
found, corners = cv2.findChessboardCorners(image[:half], (9, 3))
assert found
step = numpy.linalg.norm(numpy.diff(corners.reshape(3, 9, 2), axis=1), axis=2).mean()
print(step)
"#;

fn photographs() -> Option<Vec<PathBuf>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/chessboards");
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .ok()?
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "jpg"))
        .collect();
    files.sort();
    Some(files)
}

fn frame(path: &Path) -> Frame {
    let grey = image::open(path).unwrap().into_luma8();
    let (columns, rows) = (grey.width() as usize, grey.height() as usize);
    Frame::new(rows, columns, 8, Samples::U8(grey.into_raw())).unwrap()
}

/// Whether Python has what `name` needs; if not, says so.
fn has_python(name: &str) -> bool {
    let python = Command::new("python3").args(["-c", "import numpy, cv2, PIL, pypdfium2"]).output();
    let there = python.is_ok_and(|output| output.status.success());
    assert!(
        there || std::env::var_os("EPIRIG_REQUIRE_PYTHON").is_none(),
        "python3 with numpy, cv2, PIL and pypdfium2 is required"
    );
    if !there {
        println!("SKIPPED {name}: python3 with numpy, cv2, PIL and pypdfium2 is not there");
    }
    there
}

fn places(board: &FoundBoard) -> Vec<(f64, f64)> {
    board.corners.iter().map(|corner| (corner.corner.x_px, corner.corner.y_px)).collect()
}

#[test]
fn the_board_is_found_in_real_photographs() {
    let Some(files) = photographs() else {
        println!("SKIPPED the_board_is_found_in_real_photographs: ../shared/data/chessboards is not there");
        return;
    };
    let mut complete = 0;
    for file in &files {
        let found = find_boards(&frame(file), &BOARD, 1);
        let Some(found) = found.first().filter(|found| found.complete) else { continue };
        complete += 1;
        let labels: Vec<(i32, i32)> =
            found.corners.iter().map(|corner| (corner.row, corner.column)).collect();
        let expected: Vec<(i32, i32)> =
            (0..6).flat_map(|row| (0..9).map(move |column| (row, column))).collect();
        assert_eq!(labels, expected, "{}", file.display());
    }
    assert!(complete + 1 >= files.len(), "{complete} of {}", files.len());
}

#[test]
fn corners_are_where_opencv_has_them() {
    let name = "corners_are_where_opencv_has_them";
    let Some(files) = photographs() else {
        println!("SKIPPED {name}: ../shared/data/chessboards is not there");
        return;
    };
    if !has_python(name) {
        return;
    }
    let output = Command::new("python3").args(["-c", FIND]).args(&files).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (mut compared, mut ours) = (0, String::new());
    let theirs_text = String::from_utf8(output.stdout).unwrap();
    for line in theirs_text.lines() {
        let (path, numbers) = line.split_once(".jpg ").unwrap();
        let numbers: Vec<f64> = numbers.split(' ').map(|number| number.parse().unwrap()).collect();
        let theirs: Vec<(f64, f64)> = numbers.chunks(2).map(|pair| (pair[0], pair[1])).collect();
        let found = find_boards(&frame(Path::new(&format!("{path}.jpg"))), &BOARD, 1);
        let Some(found) = found.first().filter(|found| found.complete) else { continue };
        let apart = |theirs: &mut dyn Iterator<Item = &(f64, f64)>| {
            let mut apart: Vec<f64> =
                places(found).iter().zip(theirs).map(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1)).collect();
            apart.sort_by(f64::total_cmp);
            apart
        };
        // OpenCV begins at either end.
        let apart = [apart(&mut theirs.iter()), apart(&mut theirs.iter().rev())];
        let nearer = apart.iter().min_by(|a, b| a[53].total_cmp(&b[53])).unwrap();
        // Their own scatter: 0.2 px (root mean square) about OpenCV's calibration.
        assert!(nearer[27] < 0.2, "{path}: median {} px", nearer[27]);
        // The same corner has the same label: squares are 15 px and more.
        assert!(nearer[53] < 2.0, "{path}: {} px", nearer[53]);
        compared += 1;
        let numbers = places(found).iter().fold(String::new(), |text, (x, y)| format!("{text} {x} {y}"));
        ours.push_str(&format!("{path}.jpg{numbers}\n"));
    }
    assert!(compared >= 20, "{compared} of {}", files.len());
    // Left and right camera: ours fit a calibrated camera better than theirs.
    let folder = tempfile::tempdir().unwrap();
    let (theirs_file, ours_file) = (folder.path().join("theirs"), folder.path().join("ours"));
    fs::write(&theirs_file, &theirs_text).unwrap();
    fs::write(&ours_file, ours).unwrap();
    let output =
        Command::new("python3").args(["-c", CALIBRATE]).args([&theirs_file, &ours_file]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let residuals: Vec<f64> = String::from_utf8(output.stdout)
        .unwrap()
        .split_whitespace()
        .map(|number| number.parse().unwrap())
        .collect();
    assert!(residuals[2] < residuals[0] && residuals[3] < residuals[1], "{residuals:?}");
}

#[test]
fn a_printed_target_is_found_again_at_its_scale() {
    if !has_python("a_printed_target_is_found_again_at_its_scale") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let board = ChessBoard { columns: 9, rows: 3, square_mm: 14.0 };
    let target = Target { board, bands: 2, band_distance_mm: 120.0 };
    fs::write(folder.path().join("target.pdf"), Sheet::new(&target, Page::A4).unwrap().to_pdf()).unwrap();
    let output = Command::new("python3")
        .args(["-c", RENDER, "target.pdf", "target.png"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let numbers: Vec<f64> = String::from_utf8(output.stdout)
        .unwrap()
        .split_whitespace()
        .map(|number| number.parse().unwrap())
        .collect();
    // A4 in points; 14 mm at 200 dpi.
    assert!((numbers[0] - 595.276).abs() < 0.01 && (numbers[1] - 841.89).abs() < 0.01, "{numbers:?}");
    // OpenCV's corners are whole or half pixels here, before refinement.
    assert!((numbers[2] - 14.0 * 200.0 / 25.4).abs() < 0.3, "{numbers:?}");

    let frame = frame(&folder.path().join("target.png"));
    // The renderer rounds the page to whole pixels.
    let pixels_per_mm = (frame.columns() as f64 / 210.0, frame.rows() as f64 / 297.0);
    assert!((pixels_per_mm.0 * 25.4 - 200.0).abs() < 0.15 && (pixels_per_mm.1 * 25.4 - 200.0).abs() < 0.15);
    let mut found = find_boards(&frame, &board, 2);
    found.sort_by(|a, b| a.corners[0].corner.y_px.total_cmp(&b.corners[0].corner.y_px));
    assert_eq!(found.iter().map(|found| found.complete).collect::<Vec<_>>(), [true, true]);
    let mut off = Vec::new();
    for (band, found) in found.iter().enumerate() {
        for corner in &found.corners {
            let x_mm = 14.0 * f64::from(corner.column);
            let y_mm = 14.0 * f64::from(corner.row) + 120.0 * band as f64;
            off.push((
                corner.corner.x_px - pixels_per_mm.0 * x_mm,
                corner.corner.y_px - pixels_per_mm.1 * y_mm,
            ));
        }
    }
    let count = off.len() as f64;
    let mean = off.iter().fold((0.0, 0.0), |sum, off| (sum.0 + off.0 / count, sum.1 + off.1 / count));
    for (x, y) in off {
        // The renderer moves an edge by up to one of its pixels, a quarter of ours, in x and in y.
        assert!((x - mean.0).abs() < 0.25 && (y - mean.1).abs() < 0.25, "{x}, {y} beside {mean:?} px");
    }
}
