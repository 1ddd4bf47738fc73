//! Chess-boards are found in real photographs, and where OpenCV finds them.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

use std::fs;
use std::path::{Path, PathBuf};

use epirig::frame::{Frame, Samples};
use epirig::target::{ChessBoard, FoundBoard, find_boards};

const BOARD: ChessBoard = ChessBoard { columns: 9, rows: 6, square_mm: 25.0 };

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

#[test]
fn the_board_is_found_in_real_photographs() {
    let Some(files) = photographs() else {
        println!("SKIPPED the_board_is_found_in_real_photographs: ../shared/data/chessboards is not there");
        return;
    };
    let mut complete = 0;
    for file in &files {
        let start = std::time::Instant::now();
        let found = find_boards(&frame(file), &BOARD, 1);
        let time = start.elapsed();
        let c = found.first().map(|b| (b.corners.len(), b.complete, b.even_dark, b.blur_px, b.contrast_dn));
        let sig = found.first().map(|b| {
            let mut v: Vec<f64> = b.corners.iter().map(|c| c.corner.sigma_px).collect();
            v.sort_by(f64::total_cmp);
            (v[v.len() / 2], v[v.len() - 1])
        });
        println!("{} {:?} {:?} {:?}", file.file_name().unwrap().to_string_lossy(), time, c, sig);
        complete += usize::from(found.first().is_some_and(|b: &FoundBoard| b.complete));
    }
    assert!(complete >= 25, "{complete} of {}", files.len());
}
