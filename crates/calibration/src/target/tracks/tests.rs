//! Labels against those that the simulated board truly has: a tilted camera over a board that slides by.

use proptest::prelude::*;

use super::{Tracks, track};
use crate::target::{BoardCorner, ChessBoard, Corner, FoundBoard, Target, TargetError};

const WIDTH_PX: f64 = 1000.0;
const SQUARE_MM: f64 = 7.5;

/// A pinhole camera over the plane, rolled and tilted, with a lens that bends lines.
#[derive(Debug, Clone, Copy)]
struct Camera {
    roll_rad: f64,
    tilt_rad: f64,
    pixels_per_square: f64,
    bend: f64,
}

impl Camera {
    /// Of a point of the plane, in squares from the centre of the view.
    fn image(&self, x: f64, y: f64) -> (f64, f64) {
        let (sin, cos) = self.roll_rad.sin_cos();
        let (x, y) = (cos * x - sin * y, sin * x + cos * y);
        let distance = 60.0;
        let (sin, cos) = self.tilt_rad.sin_cos();
        let (a, b) = (cos * x / (distance + sin * x), y / (distance + sin * x));
        let stretch = distance * self.pixels_per_square * (1.0 + self.bend * (a * a + b * b));
        (0.5 * WIDTH_PX + a * stretch, 0.5 * WIDTH_PX + b * stretch)
    }
}

#[derive(Debug, Clone)]
struct Scene {
    target: Target,
    camera: Camera,
    /// Of the board's first corner, in squares, at position 0.
    start: (f64, f64),
    positions_mm: Vec<f64>,
    /// Frames without any board.
    missing: Vec<usize>,
    /// One corner in this many is false; 0 for none.
    every_false: usize,
}

/// Boards as they are found, and the true labels of their corners: band, column, row, by place.
type Truth = Vec<Vec<(f64, f64, (usize, i32, i32))>>;

fn jitter(seed: usize) -> f64 {
    ((seed as f64 * 12.9898).sin() * 43758.5453).fract() * 0.04
}

fn scene(scene: &Scene) -> (Vec<Vec<FoundBoard>>, Truth) {
    let board = scene.target.board;
    let (mut found, mut truth) = (Vec::new(), Vec::new());
    for (frame, &position_mm) in scene.positions_mm.iter().enumerate() {
        let (mut boards, mut labels) = (Vec::new(), Vec::new());
        for band in 0..scene.target.bands {
            let mut corners = Vec::new();
            for row in 0..board.rows as i32 {
                for column in 0..board.columns as i32 {
                    let x = scene.start.0 + f64::from(column) + position_mm / SQUARE_MM;
                    let below = band as f64 * scene.target.band_distance_mm / SQUARE_MM;
                    let (x, y) = scene.camera.image(x, scene.start.1 + f64::from(row) + below);
                    let seed = frame * 1000 + band * 500 + row as usize * 31 + column as usize;
                    let (x_px, y_px) = (x + jitter(seed), y + jitter(seed + 7));
                    if (12.0..WIDTH_PX - 12.0).contains(&x_px) && (12.0..WIDTH_PX - 12.0).contains(&y_px) {
                        corners.push((column, row, x_px, y_px));
                    }
                }
            }
            if corners.len() < 6 || scene.missing.contains(&frame) {
                continue;
            }
            let complete = corners.len() == board.corners();
            let (first, top) = corners.iter().fold((99, 99), |(a, b), c| (a.min(c.0), b.min(c.1)));
            // Relative labels, with the colours right, as the finder gives them.
            let shift = if complete { 0 } else { (first + top).rem_euclid(2) };
            let corners = corners.iter().enumerate().map(|(index, &(column, row, x_px, y_px))| {
                let is_false = scene.every_false > 0 && (index + frame * 5) % scene.every_false == 3;
                if !is_false {
                    labels.push((x_px, y_px, (band, column, row)));
                }
                let off = if is_false { 0.4 * scene.camera.pixels_per_square } else { 0.0 };
                let corner =
                    Corner { x_px: x_px + off, y_px, sigma_px: 0.02, contrast_dn: 80.0, blur_px: 0.8 };
                BoardCorner { column: column - first + shift, row: row - top, corner }
            });
            let corners = corners.collect();
            boards.push(FoundBoard {
                corners,
                complete,
                even_dark: true,
                more: (0, 0),
                blur_px: 0.8,
                contrast_dn: 80.0,
            });
        }
        boards.reverse();
        found.push(boards);
        truth.push(labels);
    }
    (found, truth)
}

/// The one shift between labels and truth in a band, which must be (0, 0) where labels are anchored.
fn check(tracks: &Tracks, truth: &Truth, bands: usize) {
    for band in 0..bands {
        let mut shifts = Vec::new();
        for observation in &tracks.observations {
            let corner = tracks.corners[observation.corner];
            let true_label = truth[observation.frame]
                .iter()
                .find(|(x, y, _)| (observation.x_px, observation.y_px) == (*x, *y))
                .map(|&(_, _, label)| label);
            let (true_band, column, row) = true_label.expect("a false corner is in a track");
            assert_eq!(true_band, corner.band);
            if true_band == band {
                shifts.push((corner.column - column, corner.row - row));
            }
        }
        assert!(shifts.windows(2).all(|pair| pair[0] == pair[1]), "{shifts:?}");
        if tracks.anchored[band] {
            assert!(shifts.iter().all(|&shift| shift == (0, 0)));
        }
    }
    let all: usize = truth.iter().map(Vec::len).sum();
    assert!(tracks.observations.len() as f64 > 0.97 * all as f64, "{} of {all}", tracks.observations.len());
}

fn bands() -> Target {
    let board = ChessBoard { columns: 18, rows: 2, square_mm: SQUARE_MM };
    Target { board, bands: 2, band_distance_mm: 112.5 }
}

fn camera(roll_rad: f64, tilt_rad: f64) -> Camera {
    Camera { roll_rad, tilt_rad, pixels_per_square: 42.0, bend: 0.03 }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn labels_are_right_through_a_scan(
        roll_rad in -0.06..0.06_f64,
        tilt_rad in -0.35..0.35_f64,
        step_mm in prop_oneof![0.5..4.0_f64, 5.0..25.0_f64],
        first_mm in -60.0..0.0_f64,
        frames in 8..40_usize,
        missing in prop::collection::vec(0..40_usize, 0..6),
        every_false in prop_oneof![Just(0_usize), 15..40_usize],
        known in any::<bool>(),
    ) {
        let frames = frames.min((240.0 / step_mm) as usize).max(3);
        let positions_mm: Vec<f64> = (0..frames).map(|k| first_mm + step_mm * k as f64).collect();
        // The board passes from the left over the centre: somewhere all of it may be in view.
        let scene_of = Scene {
            target: bands(),
            camera: camera(roll_rad, tilt_rad),
            start: (-14.0, -8.0),
            positions_mm: positions_mm.clone(),
            missing,
            every_false,
        };
        let (found, truth) = scene(&scene_of);
        match track(&found, &scene_of.target, known.then_some(&positions_mm)) {
            Ok(tracks) => check(&tracks, &truth, 2),
            // Steps of a square and more, seen in part, may be ambiguous without positions; then nothing is
            // claimed. So may small ones through few frames: two squares more a frame leave a board of 18
            // after nine.
            Err(TargetError::Ambiguous { .. }) => {
                let seen: Vec<usize> = (0..frames).filter(|&frame| !found[frame].is_empty()).collect();
                let complete = found.iter().flatten().any(|board| board.complete);
                let few = !complete && seen[seen.len() - 1] - seen[0] < 9;
                prop_assert!(!known && (step_mm > 5.0 || few));
            }
            Err(TargetError::NoBoard { .. } | TargetError::Bands { .. }) => {
                prop_assert!(found.iter().filter(|boards| boards.len() == 2).count() == 0);
            }
            Err(error) => prop_assert!(false, "{error}"),
        }
    }

    #[test]
    fn uneven_positions_tell_labels_that_even_steps_do_not(
        steps in prop::collection::vec(9.0..40.0_f64, 4..9),
        roll_rad in -0.05..0.05_f64,
    ) {
        let mut positions_mm = vec![-60.0];
        for step in steps {
            positions_mm.push(positions_mm[positions_mm.len() - 1] + step);
        }
        match board_that_is_never_complete(&positions_mm, roll_rad) {
            Ok(()) => {}
            // Steps may happen to be as whole numbers are to each other.
            Err(TargetError::Ambiguous { .. }) => {
                positions_mm.remove(1);
                let scatter = least_scatter_of_other_labels(&positions_mm);
                prop_assert!(scatter < 0.003, "other labels scatter by {scatter} squares");
            }
            Err(error) => prop_assert!(false, "{error}"),
        }
    }
}

/// How far, root mean square, labels lie from a line that are wrong by even numbers, but not all by the same:
/// the least of those that move by a square for each square's length, within a fifth, either way.
fn least_scatter_of_other_labels(positions_mm: &[f64]) -> f64 {
    let places: Vec<f64> = positions_mm.iter().map(|mm| (mm - positions_mm[0]) / SQUARE_MM).collect();
    let count = places.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let last = places[places.len() - 1];
    let most = (1.1 * last).ceil() as i32;
    let scatter = |turns: i32| {
        let speed = 2.0 * f64::from(turns) / last;
        let wrong: Vec<f64> = places.iter().map(|place| 2.0 * (0.5 * speed * place).round()).collect();
        let (middle, offset) = (mean(&places), mean(&wrong));
        let squares: f64 = places.iter().map(|place| (place - middle).powi(2)).sum();
        let product: f64 = places.iter().zip(&wrong).map(|(place, wrong)| (place - middle) * wrong).sum();
        let slope = product / squares;
        let off = |(place, wrong): (&f64, &f64)| (wrong - offset - slope * (place - middle)).powi(2);
        (slope, (places.iter().zip(&wrong).map(off).sum::<f64>() / count).sqrt())
    };
    let speeds = (-most..=most).filter(|&turns| turns != 0).map(scatter);
    let possible =
        speeds.filter(|(slope, _)| [1.0, -1.0].iter().any(|own| ((own + slope).abs() - 1.0).abs() < 0.2));
    possible.map(|(_, scatter)| scatter).fold(f64::MAX, f64::min)
}

fn board_that_is_never_complete(positions_mm: &[f64], roll_rad: f64) -> Result<(), TargetError> {
    let mut target = bands();
    target.board.columns = 40;
    let scene_of = Scene {
        target,
        camera: camera(roll_rad, 0.1),
        start: (-20.0, -8.0),
        positions_mm: positions_mm.to_vec(),
        missing: vec![1],
        every_false: 0,
    };
    let (found, truth) = scene(&scene_of);
    let tracks = track(&found, &scene_of.target, Some(positions_mm))?;
    check(&tracks, &truth, 2);
    Ok(())
}

/// Labels for a motion the other way, at nearly the same speed, lie within 0.02 squares of a line here; the
/// true ones within 0.0002.
#[test]
fn four_views_tell_labels_if_wrong_ones_scatter_a_hundred_times_more() {
    board_that_is_never_complete(&[-60.0, -25.3, -15.2, 14.9, 52.2], 0.0).unwrap();
}

#[test]
fn even_steps_of_a_board_that_never_ends_are_ambiguous() {
    let mut target = bands();
    target.board.columns = 60;
    let positions_mm: Vec<f64> = (0..4).map(|k| 10.0 * f64::from(k)).collect();
    let scene_of = Scene {
        target,
        camera: camera(0.0, 0.0),
        start: (-30.0, -8.0),
        positions_mm: positions_mm.clone(),
        missing: Vec::new(),
        every_false: 0,
    };
    let (found, truth) = scene(&scene_of);
    let error = track(&found, &target, None).unwrap_err();
    assert!(matches!(error, TargetError::Ambiguous { first: 0, second: 3, .. }), "{error}");
    // A square for each 7.5 mm decides; where the board begins stays unknown.
    let tracks = track(&found, &target, Some(&positions_mm)).unwrap();
    check(&tracks, &truth, 2);
    assert_eq!(tracks.anchored, [false, false]);
}

#[test]
fn what_is_no_sequence_of_a_target_is_refused() {
    let target = bands();
    assert!(matches!(track(&[], &target, None), Err(TargetError::NoBoard { columns: 18, rows: 2 })));
    assert!(matches!(
        track(&[Vec::new()], &target, Some(&[])),
        Err(TargetError::Positions { positions: 0, frames: 1 })
    ));
    let overlapping = Target { band_distance_mm: 10.0, ..target };
    assert!(matches!(track(&[], &overlapping, None), Err(TargetError::Description { .. })));
}
