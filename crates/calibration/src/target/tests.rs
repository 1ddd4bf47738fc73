//! Whole frames with boards in them, rendered by supersampling a homography, among texture, with noise and
//! uneven light.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use super::{ChessBoard, FoundBoard, find_boards};
use epirig_core::frame::{Frame, Samples};

/// A board in space before a pinhole camera.
#[derive(Debug, Clone, Copy)]
struct Pose {
    /// Place of the middle of the board, in px.
    middle: (f64, f64),
    square_px: f64,
    roll_rad: f64,
    /// About the axis that runs down the image, after the roll.
    tilt_rad: f64,
}

impl Pose {
    const DISTANCE: f64 = 40.0;

    fn image(&self, x: f64, y: f64) -> (f64, f64) {
        let (sin, cos) = self.roll_rad.sin_cos();
        let (x, y) = (cos * x - sin * y, sin * x + cos * y);
        let w = 1.0 + x * self.tilt_rad.sin() / Self::DISTANCE;
        (self.middle.0 + self.square_px * x * self.tilt_rad.cos() / w, self.middle.1 + self.square_px * y / w)
    }

    /// Place on the board, in squares from its middle.
    fn board(&self, x: f64, y: f64) -> (f64, f64) {
        let (a, b) = ((x - self.middle.0) / self.square_px, (y - self.middle.1) / self.square_px);
        let x = a / (self.tilt_rad.cos() - a * self.tilt_rad.sin() / Self::DISTANCE);
        let y = b * (1.0 + x * self.tilt_rad.sin() / Self::DISTANCE);
        let (sin, cos) = self.roll_rad.sin_cos();
        (cos * x + sin * y, cos * y - sin * x)
    }
}

/// A frame of `size` x `size` with boards on white sheets, on a ground of dots and blots.
fn frame(
    board: &ChessBoard,
    poses: &[Pose],
    size: usize,
    bit_depth: u8,
    noise: f64,
    dark_first: bool,
) -> Frame {
    let mut random = ChaCha8Rng::seed_from_u64(size as u64);
    let normal = Normal::new(0.0, noise).unwrap();
    let (columns, rows) = (board.columns as f64 + 1.0, board.rows as f64 + 1.0);
    let reflectance = |x: f64, y: f64| {
        for pose in poses {
            let (u, v) = pose.board(x, y);
            let (u, v) = (u + 0.5 * columns, v + 0.5 * rows);
            if (0.0..columns).contains(&u) && (0.0..rows).contains(&v) {
                let even = (u.floor() + v.floor()).rem_euclid(2.0) < 0.5;
                return if even == dark_first { 0.15 } else { 0.85 };
            }
            if (-0.7..columns + 0.7).contains(&u) && (-0.7..rows + 0.7).contains(&v) {
                return 0.85;
            }
        }
        let wave = (0.31 * x + 1.7 * (0.05 * y).sin()).sin() * (0.27 * y + 2.1 * (0.043 * x).cos()).cos();
        0.5 + 0.3 * wave + 0.1 * (0.9 * x).sin() * (1.1 * y).sin()
    };
    const FINE: usize = 4;
    let full = f64::from(epirig_core::frame::full_scale(bit_depth));
    let mut levels = Vec::with_capacity(size * size);
    for y in 0..size {
        for x in 0..size {
            let mut sum = 0.0;
            // Over 1.5 px: pixel and lens.
            for k in 0..FINE * FINE {
                let at = |k: usize| 1.5 * ((k as f64 + 0.5) / FINE as f64 - 0.5);
                sum += reflectance(x as f64 + at(k % FINE), y as f64 + at(k / FINE));
            }
            let light = 1.0 - 0.6 * x as f64 / size as f64 - 0.2 * (y as f64 / size as f64).powi(2);
            let level = light * sum / (FINE * FINE) as f64 + normal.sample(&mut random);
            levels.push((level * full).round().clamp(0.0, full));
        }
    }
    let samples = if bit_depth <= 8 {
        Samples::U8(levels.iter().map(|&level| level as u8).collect())
    } else {
        Samples::U16(levels.iter().map(|&level| level as u16).collect())
    };
    Frame::new(size, size, bit_depth, samples).unwrap()
}

/// Checks places and labels against the pose, up to one shift, which is returned; `turn` maps labels to those
/// of the drawing.
fn check(
    found: &FoundBoard,
    board: &ChessBoard,
    pose: &Pose,
    turn: fn(i32, i32) -> (i32, i32),
) -> (i32, i32) {
    let mut shifts = Vec::new();
    for corner in &found.corners {
        let (u, v) = pose.board(corner.corner.x_px, corner.corner.y_px);
        let (u, v) = (u + 0.5 * (board.columns as f64 - 1.0), v + 0.5 * (board.rows as f64 - 1.0));
        let (x, y) = pose.image(
            u.round() - 0.5 * (board.columns as f64 - 1.0),
            v.round() - 0.5 * (board.rows as f64 - 1.0),
        );
        let error = (x - corner.corner.x_px).hypot(y - corner.corner.y_px);
        assert!(error < 0.1, "{error} px at {u}, {v}");
        assert!((0..board.columns as i32).contains(&(u.round() as i32)), "{u}");
        assert!((0..board.rows as i32).contains(&(v.round() as i32)), "{v}");
        let (column, row) = turn(corner.column, corner.row);
        shifts.push((u.round() as i32 - column, v.round() as i32 - row));
    }
    assert!(shifts.windows(2).all(|pair| pair[0] == pair[1]), "{shifts:?}");
    shifts[0]
}

const BOARD: ChessBoard = ChessBoard { columns: 9, rows: 6, square_mm: 20.0 };

#[test]
fn tilted_boards_are_complete_whatever_the_depth_of_bits() {
    for (index, tilt_deg) in [-40.0_f64, -15.0, 0.0, 25.0, 40.0].into_iter().enumerate() {
        for roll_deg in [-30.0_f64, 4.0, 80.0] {
            let (tilt_rad, roll_rad) = (tilt_deg.to_radians(), roll_deg.to_radians());
            let pose = Pose { middle: (250.3, 248.8), square_px: 30.0, roll_rad, tilt_rad };
            let bit_depth = [8, 10, 12, 14, 16][index];
            let found = find_boards(&frame(&BOARD, &[pose], 500, bit_depth, 0.01, true), &BOARD, 1);
            assert_eq!(found.len(), 1, "{tilt_deg} {roll_deg}");
            assert!(found[0].complete, "{tilt_deg} {roll_deg}: {}", found[0].corners.len());
            assert_eq!(check(&found[0], &BOARD, &pose, |c, r| (c, r)), (0, 0), "{tilt_deg} {roll_deg}");
        }
    }
}

#[test]
fn colours_tell_which_way_up_an_odd_board_is() {
    let upright = Pose { middle: (250.0, 250.0), square_px: 32.0, roll_rad: 0.05, tilt_rad: 0.2 };
    for roll_rad in [0.05, 1.0, 2.0, 3.0, 4.0, 5.0] {
        let pose = Pose { roll_rad, ..upright };
        let found = find_boards(&frame(&BOARD, &[pose], 500, 8, 0.005, true), &BOARD, 1);
        assert_eq!(check(&found[0], &BOARD, &pose, |c, r| (c, r)), (0, 0), "{roll_rad}");
        assert!(found[0].complete && found[0].even_dark);
        // The negative is labelled from its other end, where the dark outermost square is.
        let found = find_boards(&frame(&BOARD, &[pose], 500, 8, 0.005, false), &BOARD, 1);
        assert_eq!(check(&found[0], &BOARD, &pose, |c, r| (8 - c, 5 - r)), (0, 0), "{roll_rad}");
    }
    // An even board goes by what is seen, and says its colours.
    let even = ChessBoard { columns: 8, rows: 6, square_mm: 20.0 };
    for dark_first in [true, false] {
        let found = find_boards(&frame(&even, &[upright], 500, 8, 0.005, dark_first), &even, 1);
        assert!(found[0].complete);
        assert_eq!(found[0].even_dark, dark_first);
        assert_eq!(check(&found[0], &even, &upright, |c, r| (c, r)), (0, 0));
    }
}

#[test]
fn two_bands_are_two_boards_and_parts_keep_their_colours() {
    let board = ChessBoard { columns: 12, rows: 2, square_mm: 7.5 };
    for shift_px in [0.0, 95.0, 190.0, 305.0] {
        let at =
            |y: f64| Pose { middle: (300.0 + shift_px, y), square_px: 31.0, roll_rad: 0.03, tilt_rad: 0.1 };
        let poses = [at(90.0), at(500.0)];
        let mut found = find_boards(&frame(&board, &poses, 600, 8, 0.01, true), &board, 2);
        assert_eq!(found.len(), 2, "{shift_px}");
        found.sort_by(|a, b| a.corners[0].corner.y_px.total_cmp(&b.corners[0].corner.y_px));
        for (found, pose) in found.iter().zip(&poses) {
            let shift = check(found, &board, pose, |c, r| (c, r));
            assert_eq!((shift.0 + shift.1) % 2, 0, "{shift_px}");
            // The last corner is at 470 px + shift.
            assert_eq!(found.complete, shift_px < 100.0, "{shift_px}");
            // All corners whose windows are in the image are found.
            let seen = (0..24).filter(|k| {
                let (x, y) = pose.image(f64::from(k % 12) - 5.5, f64::from(k / 12) - 0.5);
                (14.0..585.0).contains(&x) && (14.0..585.0).contains(&y)
            });
            assert!(found.corners.len() + 1 >= seen.count(), "{shift_px}");
        }
    }
}

#[test]
fn texture_without_a_board_has_none() {
    assert_eq!(find_boards(&frame(&BOARD, &[], 700, 8, 0.01, true), &BOARD, 2), []);
    let flat = Frame::new(20, 20, 8, Samples::U8(vec![7; 400])).unwrap();
    assert_eq!(find_boards(&flat, &BOARD, 1), []);
    let tiny = Frame::new(1, 2, 8, Samples::U8(vec![0, 9])).unwrap();
    assert_eq!(find_boards(&tiny, &BOARD, 1), []);
}
