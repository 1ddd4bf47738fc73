//! Finds a chessboard in a simulated frame and prints its corners:
//! `cargo run --release -p epirig-calibration --example find_board`.

use epirig_calibration::target::{ChessBoard, find_boards};
use epirig_core::frame::{Frame, Samples};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Squares of 20 px, 7 x 5 of them, on a light ground.
    let (rows, columns) = (160, 200);
    let dark = |x: usize, y: usize| {
        let inside = (30..170).contains(&x) && (30..130).contains(&y);
        inside && ((x - 30) / 20 + (y - 30) / 20).is_multiple_of(2)
    };
    let levels = (0..rows * columns).map(|at| if dark(at % columns, at / columns) { 30 } else { 220 });
    let frame = Frame::new(rows, columns, 8, Samples::U8(levels.collect()))?;
    let board = ChessBoard { columns: 6, rows: 4, square_mm: 5.0 };
    for found in find_boards(&frame, &board, 1) {
        println!("{} of {} corners", found.corners.len(), board.columns * board.rows);
        for corner in &found.corners {
            println!("{corner:?}");
        }
    }
    Ok(())
}
