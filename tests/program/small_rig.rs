//! A small rig with all faults, scanned once, and its images as other software would have them.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use epirig_core::frame::{Frame, Samples};
use epirig_data::sequence::{FrameKind, decode_grey};

use super::support::{epirig, names, succeeds, write_png};

/// The rig with all faults, small and short, with squares that are as large in the image as those of the large one.
const RIG: [&str; 21] = [
    "--rig",
    "real",
    "--size",
    "256x256",
    "--set",
    "plan.frames=9",
    "--set",
    "plan.step=10 mm",
    "--set",
    "plan.dark=2",
    "--set",
    "plan.flat=4",
    "--set",
    "plan.board=6",
    "--set",
    "target.square=15 mm",
    "--set",
    "target.columns=9",
    "--set",
    "target.band_distance=105 mm",
    // A black level that the noise does not cut off.
    "--set=sim.black_level=10 DN",
];
const PROFILE: &str = "[optics]\nfocal_length = \"25 mm\"\nsensor_width = \"9 mm\"\n[target]\nsquare = \"15 mm\"\ncolumns = 9\nrows = 2\nbands = 2\n\
    band_distance = \"105 mm\"\n[board]\nsquare = \"16 mm\"\ncolumns = 9\nrows = 6\n";
/// What import and calibrate are told of the board in the hand.
pub const BOARD: [&str; 6] =
    ["--set", "board.square=16 mm", "--set", "board.columns=9", "--set", "board.rows=6"];

/// A folder with the scan `seq` of the small rig, taken once for all tests, and rig.toml.
pub fn scan() -> &'static Path {
    static SCAN: OnceLock<PathBuf> = OnceLock::new();
    SCAN.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("calibrate-command");
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("rig.toml"), PROFILE).unwrap();
        succeeds(&folder, &[&["-q", "capture", "--out", "seq"][..], &RIG].concat());
        folder
    })
}

/// The folder of the frames of a kind.
pub fn images(kind: FrameKind) -> PathBuf {
    scan().join("seq").join(kind.folder())
}

/// The frame in a file.
pub fn load(path: &Path) -> Frame {
    decode_grey(&fs::read(path).unwrap()).unwrap().frame
}

/// Writes images of a kind, changed, into `folder/name`.
pub fn changed(folder: &Path, name: &str, kind: FrameKind, change: impl Fn(usize, Frame) -> Frame) {
    fs::create_dir(folder.join(name)).unwrap();
    for (index, file) in names(&images(kind)).iter().enumerate() {
        write_png(&folder.join(name).join(file), &change(index, load(&images(kind).join(file))));
    }
}

/// Its samples.
pub fn samples(frame: &Frame) -> &[u8] {
    match frame.samples() {
        Samples::U8(samples) => samples,
        Samples::U16(_) => panic!("the rig has 8 bit"),
    }
}

/// A frame of the same size with other samples, by column and row.
pub fn with_samples(frame: &Frame, sample: impl Fn(usize, usize) -> f64) -> Frame {
    let (rows, columns) = (frame.rows(), frame.columns());
    let samples = (0..rows * columns).map(|at| sample(at % columns, at / columns).round() as u8).collect();
    Frame::new(rows, columns, 8, Samples::U8(samples)).unwrap()
}

/// Blurred by a box of 11 x 11, twice: a standard deviation of sqrt(2 (121 - 1) / 12) = 4.5 px, of squares of 10 px.
pub fn blurred(frame: &Frame) -> Frame {
    let once = |frame: &Frame| {
        let (rows, columns) = (frame.rows(), frame.columns());
        let at = |x: i64, y: i64| {
            let (x, y) = (x.clamp(0, columns as i64 - 1), y.clamp(0, rows as i64 - 1));
            f64::from(samples(frame)[y as usize * columns + x as usize])
        };
        with_samples(frame, |x, y| {
            let (x, y) = (x as i64, y as i64);
            let sum: f64 = (-5..=5)
                .flat_map(|dy| (-5..=5).map(move |dx| (dx, dy)))
                .map(|(dx, dy)| at(x + dx, y + dy))
                .sum();
            sum / 121.0
        })
    };
    once(&once(frame))
}

/// A chess-board of 9 x 6 inner corners that is held parallel to the image, with squares of `side` px: exact by areas.
pub fn parallel_board(side: f64, left: f64, top: f64) -> Frame {
    let blank = Frame::new(256, 256, 8, Samples::U8(vec![0; 256 * 256])).unwrap();
    // How far a pixel is in a white square along one axis, -1 to 1, soft over a pixel.
    let sign = |at: f64, count: f64| {
        let squares = at / side;
        if !(0.0..count).contains(&squares) {
            return None;
        }
        let to_edge = (squares - squares.round()) * side;
        let soft = (to_edge / 0.7).clamp(-1.0, 1.0);
        let odd = if (squares.round() as i64) % 2 == 0 { 1.0 } else { -1.0 };
        Some(odd * soft)
    };
    with_samples(&blank, |x, y| {
        let signs = (sign(x as f64 - left, 10.0), sign(y as f64 - top, 7.0));
        match signs {
            (Some(across), Some(down)) => 120.0 - 90.0 * across * down,
            _ => 210.0,
        }
    })
}

/// Runs the program, which must succeed, and gives what it says beside the result.
pub fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = epirig(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stderr).unwrap()
}

/// Imports the frames of the scan as those of other software; further options say what else.
pub fn import(folder: &Path, out: &str, options: &[&str]) {
    let photos = images(FrameKind::Scan);
    succeeds(folder, &[&["-q", "import", photos.to_str().unwrap(), "--out", out][..], options].concat());
}

/// The same with everything that the scan has.
pub fn import_all(folder: &Path, out: &str) {
    let [dark, flat, board] = FrameKind::CALIBRATION.map(images);
    let rig = scan().join("rig.toml");
    let paths = [&dark, &flat, &board, &rig].map(|path| path.to_str().unwrap());
    let options = ["--dark", paths[0], "--flat", paths[1], "--board", paths[2], "--rig", paths[3]];
    import(folder, out, &[&options[..], &["--step-mm", "10"]].concat());
}

/// The calibration of a sequence.
pub fn record(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.join("calibration.json")).unwrap()).unwrap()
}

/// A number of it.
pub fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap()
}
