//! Chess-boards are found in real photographs, where OpenCV finds them; a printed target is found again, at
//! its true scale.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use epirig_calibration::target::print::{Page, Sheet};
use epirig_calibration::target::{ChessBoard, FoundBoard, Target, find_boards};
use epirig_core::frame::{Frame, Samples};

const BOARD: ChessBoard = ChessBoard { columns: 9, rows: 6, square_mm: 25.0 };

/// Prints, for each photograph and each of OpenCV's ways that finds the board complete: name of the way,
/// path, x and y of each corner.
///
/// `sector` is the newer detector, which fits at a finer scale (OpenCV's most accurate); `wide` refines by
/// gradients in windows that end before the next edges, at most 9 px to either side; `five` in those of most
/// examples.
const FIND: &str = r#"
import sys, cv2, numpy
stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
for path in sys.argv[1:]:
    image = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
    ways = {}
    found, corners = cv2.findChessboardCornersSB(image, (9, 6), flags=cv2.CALIB_CB_ACCURACY)
    if found:
        ways["sector"] = corners
    found, corners = cv2.findChessboardCorners(image, (9, 6))
    if found:
        grid = corners.reshape(6, 9, 2)
        steps = [numpy.linalg.norm(numpy.diff(grid, axis=axis), axis=2).min() for axis in (0, 1)]
        wide = int(min(9, 0.4 * min(steps)))
        for way, half in (("wide", wide), ("five", min(5, wide))):
            ways[way] = cv2.cornerSubPix(image, corners.copy(), (half, half), (-1, -1), stop)
    for way, corners in ways.items():
        print(way, path, *(f"{value:.4f}" for value in corners.ravel()))
"#;

/// For the corners in each file: calibrates the left and the right camera on them, and prints the residuals'
/// root mean squares, in px; then the scatter of corners along rows, in px, by their fourth differences:
/// neither camera nor board bends that fast.
const JUDGE: &str = r#"
import sys, cv2, numpy
board = numpy.array([[column, row, 0] for row in range(6) for column in range(9)], numpy.float32)
for path in sys.argv[1:]:
    lines = [line.split() for line in open(path)]
    for camera in ("left", "right"):
        views = [numpy.array(line[1:], numpy.float32).reshape(-1, 1, 2) for line in lines if camera in line[0].split("/")[-1]]
        print(cv2.calibrateCamera([board] * len(views), views, (640, 480), None, None)[0])
    rows = numpy.array([line[1:] for line in lines], float).reshape(-1, 9, 2)
    print(numpy.sqrt(numpy.mean(numpy.diff(rows, n=4, axis=1) ** 2) / 70))
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
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/chessboards");
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

/// Corners of our and of one of OpenCV's ways, for the photographs in which both find all.
#[derive(Default)]
struct Compared {
    /// Distances of all corners, in px.
    apart_px: Vec<f64>,
    /// Median distance of each photograph, in px.
    medians_px: Vec<f64>,
    /// Path and numbers of each photograph.
    ours: String,
    theirs: String,
}

impl Compared {
    fn add(&mut self, path: &str, ours: &[(f64, f64)], theirs: &[(f64, f64)]) {
        let apart = |theirs: &[(f64, f64)]| {
            let pairs = ours.iter().zip(theirs);
            let mut apart: Vec<f64> = pairs.map(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1)).collect();
            apart.sort_by(f64::total_cmp);
            apart
        };
        // OpenCV begins at either end.
        let reversed: Vec<(f64, f64)> = theirs.iter().rev().copied().collect();
        let ways = [(apart(theirs), theirs), (apart(&reversed), &reversed[..])];
        let [one, other] = ways;
        let (apart, theirs) = if one.0[53] < other.0[53] { one } else { other };
        // The same corner has the same label: squares are 15 px and more.
        assert!(apart[53] < 2.0, "{path}: {} px", apart[53]);
        self.medians_px.push(median(&apart));
        self.apart_px.extend(apart);
        let line = |places: &[(f64, f64)]| {
            let numbers = places.iter().fold(String::new(), |text, (x, y)| format!("{text} {x} {y}"));
            format!("{path}{numbers}\n")
        };
        self.ours.push_str(&line(ours));
        self.theirs.push_str(&line(theirs));
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
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
    let ours: BTreeMap<String, Vec<(f64, f64)>> = files
        .iter()
        .filter_map(|file| {
            let found = find_boards(&frame(file), &BOARD, 1);
            found
                .first()
                .filter(|found| found.complete)
                .map(|found| (file.display().to_string(), places(found)))
        })
        .collect();
    let mut ways: BTreeMap<String, Compared> = BTreeMap::new();
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let (way, rest) = line.split_once(' ').unwrap();
        let (path, numbers) = rest.split_once(".jpg ").unwrap();
        let path = format!("{path}.jpg");
        let numbers: Vec<f64> = numbers.split(' ').map(|number| number.parse().unwrap()).collect();
        let theirs: Vec<(f64, f64)> = numbers.chunks(2).map(|pair| (pair[0], pair[1])).collect();
        if let Some(ours) = ours.get(&path) {
            ways.entry(way.to_owned()).or_default().add(&path, ours, &theirs);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    for (way, compared) in &ways {
        assert!(compared.medians_px.len() >= 20, "{way}: {} of {}", compared.medians_px.len(), files.len());
        let apart_px = median(&compared.apart_px);
        let [theirs, ours] = ["theirs", "ours"].map(|name| folder.path().join(name));
        fs::write(&theirs, &compared.theirs).unwrap();
        fs::write(&ours, &compared.ours).unwrap();
        let output = Command::new("python3").args(["-c", JUDGE]).args([&theirs, &ours]).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let figures: Vec<f64> = String::from_utf8(output.stdout)
            .unwrap()
            .split_whitespace()
            .map(|number| number.parse().unwrap())
            .collect();
        let (theirs, ours) = figures.split_at(3);
        println!("{way}: median {apart_px:.3} px apart, of photographs {:.3?}", compared.medians_px);
        println!("  left, right, scatter: theirs {theirs:.3?}, ours {ours:.3?}");
        // Against residuals of a calibrated camera, and without any: what is between them and us is their
        // scatter.
        assert!(ours.iter().zip(theirs).all(|(ours, theirs)| ours < theirs), "{way}: {ours:?} {theirs:?}");
        match way.as_str() {
            "sector" | "wide" => assert!(apart_px < 0.1, "{way}: {apart_px} px"),
            // Windows of 5 px leave them 0.1 px of scatter in x and in y: a median distance of 1.18 times
            // that.
            _ => assert!(apart_px < 1.18 * theirs[2].hypot(ours[2]) + 0.02, "{way}: {apart_px} px"),
        }
    }
    assert_eq!(ways.keys().collect::<Vec<_>>(), ["five", "sector", "wide"]);
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
