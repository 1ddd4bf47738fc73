//! Frames with poses of their own, and turns of any angle.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::*;
use crate::rectification::FramePose;

/// Waves of 8.6 px and more, and how fast they rise at most, in DN per px.
const WAVES: [(f64, f64, f64); 4] = [(0.7, 0.2, 0.3), (-0.3, 0.65, 1.1), (0.5, -0.5, 2.0), (0.21, 0.13, 0.7)];
const STEEPEST: f64 = 12_000.0;

fn scene(t: usize, x: f64, y: f64) -> f64 {
    let phase = 1.0 + 0.37 * t as f64;
    32_000.0 + 5000.0 * WAVES.iter().map(|(a, b, c)| (a * x + b * y + c * phase).sin()).sum::<f64>()
}

fn sized(rows: usize, columns: usize, value: impl Fn(f64, f64) -> f64) -> Frame {
    let places = (0..rows * columns).map(|index| ((index % columns) as f64, (index / columns) as f64));
    let values = places.map(|(x, y)| value(x, y).round() as u16).collect();
    Frame::new(rows, columns, 16, Samples::U16(values)).unwrap()
}

fn lens(focal_length_px: f64, k1: f64) -> Lens {
    let distortion = Distortion { k1, ..Distortion::default() };
    Lens { distortion, ..Lens::pinhole(focal_length_px, 103.0, 77.0) }
}

/// A pose for each of some frames, all different.
fn wobble(frames: usize, size: f64) -> Vec<FramePose> {
    let pose = |t: usize| {
        let angle = |axis: usize| size * (1.7 * t as f64 + 2.1 * axis as f64).sin();
        FramePose { rotation_rad: [0, 1, 2].map(angle), offset: [3, 4, 5].map(angle) }
    };
    (0..frames).map(pose).collect()
}

/// Place in the raw frame, from the formulas.
fn truth(mapping: &Mapping, pose: &FramePose, x: f64, y: f64) -> Option<(f64, f64)> {
    let (camera, lens) = (mapping.camera, mapping.lens);
    let ideal = Matrix3::new(
        camera.focal_length_px,
        0.0,
        camera.principal_point_x_px,
        0.0,
        camera.focal_length_px,
        camera.principal_point_y_px,
        0.0,
        0.0,
        1.0,
    );
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), mapping.pan_rad)
        * Rotation3::from_axis_angle(&Vector3::z_axis(), mapping.roll_rad);
    let common = turn.inverse() * (ideal.try_inverse().unwrap() * Vector3::new(x, y, 1.0));
    let moved = common / common.z - Vector3::from(pose.offset);
    let seen = Rotation3::new(Vector3::from(pose.rotation_rad)) * moved;
    let (a, b) = (seen.x / seen.z, seen.y / seen.z);
    let radial = 1.0 + lens.distortion.k1 * (a * a + b * b);
    let place = (
        lens.focal_length_x_px * a * radial + lens.principal_point_x_px,
        lens.focal_length_y_px * b * radial + lens.principal_point_y_px,
    );
    (common.z > 0.0 && seen.z > 0.0).then_some(place)
}

/// Compares all pixels that lie in a frame with the scene; returns how many those are.
fn check_scene(mapping: &Mapping, poses: &[FramePose], volume: &Volume) -> usize {
    let mut compared = 0;
    for (t, pose) in poses.iter().enumerate() {
        let found = plane(volume, t);
        for y in 0..found.rows() {
            for x in 0..found.columns() {
                let (raw_x, raw_y) = truth(mapping, pose, x as f64, y as f64).unwrap();
                let inside = [(raw_x, mapping.raw_columns), (raw_y, mapping.raw_rows)]
                    .map(|(place, size)| place >= BORDER_PX && place <= size as f64 - 1.0 - BORDER_PX);
                if inside == [true; 2] {
                    let error = f64::from(found.at(x, y)) - scene(t, raw_x, raw_y);
                    // 0.0002 px at the border (see `spline`) and 0.0001 px of these waves; half a count of
                    // 2 DN, and rounding of the raw frame, which the spline makes four times larger at most.
                    assert!(error.abs() < 0.0003 * STEEPEST + 1.0 + 2.0, "{t} ({x}, {y}): {error}");
                    compared += 1;
                }
            }
        }
    }
    compared
}

fn with_poses(mapping: Mapping, poses: &[FramePose], frames: &[Frame]) -> Volume {
    let rectifier = Rectifier::with_poses(mapping, Correction::default(), poses.to_vec()).unwrap();
    let mut volume = rectifier.volume(frames[0].bit_depth(), Tau::equidistant(frames.len().max(2)).unwrap());
    rectifier.insert(&mut volume, 0, frames).unwrap();
    volume
}

#[test]
fn a_texture_is_found_where_each_pose_puts_it() {
    let poses = wobble(11, 1e-3);
    let frames: Vec<Frame> = (0..11).map(|t| sized(ROWS, COLUMNS, |x, y| scene(t, x, y))).collect();
    for roll in [0.02, 0.8, FRAC_PI_2, -FRAC_PI_2, PI] {
        let mapping = Mapping::covering(lens(555.0, -0.05), roll, 0.05, ROWS, COLUMNS, &poses).unwrap();
        let compared = check_scene(&mapping, &poses, &with_poses(mapping, &poses, &frames));
        // All of the raw frames but their borders: the focal lengths are equal, the pan is small.
        let inner = 11 * (ROWS - 16) * (COLUMNS - 16);
        assert!((compared as f64 / inner as f64 - 1.0).abs() < 0.03, "{compared} of {inner}");
    }
}

#[test]
fn a_quarter_turn_without_poses_is_sampled_as_whole_frames() {
    let (rows, columns) = (40, 600);
    let lens = Lens { principal_point_x_px: 310.0, principal_point_y_px: 22.0, ..lens(900.0, -0.05) };
    let mapping = Mapping::fitting(lens, FRAC_PI_2, 0.01, rows, columns).unwrap();
    let rectifier = Rectifier::new(mapping, Correction::default()).unwrap();
    assert!(rectifier.whole.is_some());
    let frames: Vec<Frame> = (0..3).map(|t| sized(rows, columns, |x, y| scene(t, x, y))).collect();
    let volume = rectified(mapping, Correction::default(), &frames);
    let compared = check_scene(&mapping, &[FramePose::default(); 3], &volume);
    assert_eq!(compared, 3 * mapping.camera.rows * mapping.camera.columns);
}

#[test]
fn poses_of_the_mean_camera_change_nothing() {
    let frames: Vec<Frame> = (0..11).map(noise).collect();
    let values = |value: &dyn Fn(usize) -> f32| {
        Grid::from_values(ROWS, COLUMNS, (0..ROWS * COLUMNS).map(value).collect())
    };
    let correction = Correction {
        subtract: values(&|index| (index % 7) as f32),
        multiply: values(&|index| 1.0 + 0.01 * (index % 11) as f32),
        defective: vec![(50, 60), (51, 60), (199, 0), (120, 64)],
    };
    let shared = rectified(rig(), correction.clone(), &frames);
    let mean = vec![FramePose::default(); 11];
    let rectifier = Rectifier::with_poses(rig(), correction.clone(), mean).unwrap();
    let mut own = rectifier.volume(12, shared.tau().clone());
    rectifier.insert(&mut own, 0, &frames).unwrap();
    for t in 0..11 {
        // A count is 1/8 DN.
        let (one, other) = (plane(&shared, t), plane(&own, t));
        let difference = one.values().iter().zip(other.values()).map(|(a, b)| (a - b).abs());
        assert!(difference.fold(0.0, f32::max) <= 0.125);
    }
    let none = Rectifier::with_poses(rig(), correction, Vec::new()).unwrap();
    let mut volume = none.volume(12, shared.tau().clone());
    none.insert(&mut volume, 0, &frames).unwrap();
    assert_eq!(volume, shared);
}

#[test]
fn threads_and_calls_change_nothing() {
    let frames: Vec<Frame> = (0..11).map(noise).collect();
    let poses = wobble(11, 3e-3);
    let mapping = Mapping::covering(lens(555.0, -0.05), 0.3, 0.05, ROWS, COLUMNS, &poses).unwrap();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| with_poses(mapping, &poses, &frames))
    };
    let together = with(1);
    assert_eq!(together, with(3));
    let rectifier = Rectifier::with_poses(mapping, Correction::default(), poses.clone()).unwrap();
    let mut in_parts = rectifier.volume(12, together.tau().clone());
    rectifier.insert(&mut in_parts, 4, &frames[4..]).unwrap();
    rectifier.insert(&mut in_parts, 0, &frames[..4]).unwrap();
    assert_eq!(together, in_parts);
}

#[test]
fn pixels_outside_take_the_value_of_the_border() {
    let ramp = |x: f64, y: f64| 2000.0 + 50.0 * x + 30.0 * y;
    let frame = sized(ROWS, COLUMNS, ramp);
    for poses in [Vec::new(), wobble(1, 5e-3)] {
        let mapping = Mapping::covering(lens(555.0, 0.0), 0.4, 0.05, ROWS, COLUMNS, &poses).unwrap();
        assert!(matches!(
            Rectifier::new(mapping, Correction::default()),
            Err(RectifyError::Outside { x: 0, y: 0 })
        ));
        let found = plane(&with_poses(mapping, &poses, std::slice::from_ref(&frame)), 0);
        let pose = poses.first().copied().unwrap_or_default();
        let mut outside = 0;
        for y in 0..found.rows() {
            for x in 0..found.columns() {
                let (raw_x, raw_y) = truth(&mapping, &pose, x as f64, y as f64).unwrap();
                let nearest = (raw_x.clamp(0.0, 199.0), raw_y.clamp(0.0, 159.0));
                // Mirroring makes a kink at the border. It matters between pixels, not on those of the
                // border.
                let clear = |place: f64, nearest: f64, last: f64| {
                    place != nearest || (BORDER_PX..=last - BORDER_PX).contains(&place)
                };
                if nearest == (raw_x, raw_y)
                    || !(clear(raw_x, nearest.0, 199.0) && clear(raw_y, nearest.1, 159.0))
                {
                    continue;
                }
                outside += 1;
                let error = f64::from(found.at(x, y)) - ramp(nearest.0, nearest.1);
                assert!(error.abs() < 0.0002 * 80.0 + 1.05, "({x}, {y}): {error}");
            }
        }
        assert!(outside > 10_000, "{outside}");
    }
}

#[test]
fn nothing_is_seen_twice_beyond_the_fold_of_a_lens_or_behind_it() {
    let dark_inside = |x: f64, y: f64| {
        let inside = (12.0..188.0).contains(&x) && (12.0..148.0).contains(&y);
        if inside { 1000.0 } else { 30_000.0 }
    };
    let frame = sized(ROWS, COLUMNS, dark_inside);
    let poses = wobble(1, 1e-3);
    let shown = |mapping: &Mapping, x: usize, y: usize| {
        let (raw_x, raw_y) = mapping.raw_of(&poses[0], x as f64, y as f64);
        let back = mapping.rectified_of(&poses[0], raw_x, raw_y);
        let inside = (-1.0..200.0).contains(&raw_x) && (-1.0..160.0).contains(&raw_y);
        inside && back.is_some_and(|(a, b)| (a - x as f64).abs() + (b - y as f64).abs() < 1e-3)
    };
    // The image folds at 0.577 focal lengths, 208 px.
    let folded = Mapping::covering(lens(360.0, -1.0), 0.8, 0.0, ROWS, COLUMNS, &poses).unwrap();
    // A part of the image looks behind the camera.
    let behind = Mapping::covering(lens(100.0, 0.0), 0.1, 0.5, ROWS, COLUMNS, &poses).unwrap();
    let wide = [folded, behind].map(|mut mapping| {
        mapping.camera.principal_point_x_px += 300.0;
        mapping.camera.columns += 600;
        mapping
    });
    for mapping in wide {
        let found = plane(&with_poses(mapping, &poses, std::slice::from_ref(&frame)), 0);
        let (mut beyond, mut within) = (0, 0);
        for y in 0..found.rows() {
            for x in 0..found.columns() {
                if shown(&mapping, x, y) {
                    within += usize::from(found.at(x, y) < 2000.0);
                } else {
                    assert!(found.at(x, y) > 28_000.0, "({x}, {y}): {}", found.at(x, y));
                    let (raw_x, raw_y) = mapping.raw_of(&poses[0], x as f64, y as f64);
                    let inside = (0.0..199.0).contains(&raw_x) && (0.0..159.0).contains(&raw_y);
                    beyond += usize::from(raw_x.is_nan() || inside);
                }
            }
        }
        assert!(beyond > 20 && within > 10_000, "{beyond} {within}");
    }
}

#[test]
fn each_frame_needs_a_pose() {
    let frames: Vec<Frame> = (0..3).map(noise).collect();
    let rectifier = Rectifier::with_poses(rig(), Correction::default(), wobble(2, 1e-3)).unwrap();
    let mut volume = rectifier.volume(12, Tau::equidistant(3).unwrap());
    let empty = volume.clone();
    assert_eq!(rectifier.insert(&mut volume, 0, &frames), Err(RectifyError::Poses { poses: 2, needed: 3 }));
    assert_eq!(
        rectifier.insert(&mut volume, 2, &frames[2..]),
        Err(RectifyError::Poses { poses: 2, needed: 3 })
    );
    assert_eq!(volume, empty);
}
