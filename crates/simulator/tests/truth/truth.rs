//! The simulator's truth agrees with a derivation by projection matrices, which shares nothing with its
//! closed forms.

use epirig_simulator::{Carried, Pinhole, Scene, Simulator, SimulatorConfig, SimulatorError, Truth};
use nalgebra::{Matrix3x4, Matrix4, Vector3};

/// Projection of scene points into the frame that an ideal pinhole takes when the stage says that it is at
/// `position_mm`.
fn projection(simulator: &Simulator, camera: &Pinhole, position_mm: f64) -> Matrix3x4<f64> {
    let f = camera.focal_length_px;
    let (cx, cy) = (camera.principal_point_x_px, camera.principal_point_y_px);
    let config = simulator.config();
    let sign = if config.carried == Carried::Scene { 1.0 } else { -1.0 };
    let shift = sign * (simulator.true_position_mm(position_mm) - config.scan.middle_mm());
    Matrix3x4::new(f, 0.0, cx, f * shift, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0)
}

/// The scene point seen at `first` in one frame and at `last` in another (direct linear transformation).
fn triangulate(frames: [(Matrix3x4<f64>, (f64, f64)); 2]) -> Vector3<f64> {
    let mut rows = Matrix4::zeros();
    for (index, (projection, (x, y))) in frames.iter().enumerate() {
        rows.set_row(2 * index, &(projection.row(2) * *x - projection.row(0)));
        rows.set_row(2 * index + 1, &(projection.row(2) * *y - projection.row(1)));
    }
    let point = rows.svd(false, true).v_t.unwrap().row(3).transpose();
    Vector3::new(point[0] / point[3], point[1] / point[3], point[2] / point[3])
}

/// How far a point lies behind the surface that the scene is defined as, in mm.
fn behind(scene: &Scene, point: &Vector3<f64>) -> f64 {
    let depth = match *scene {
        Scene::Plane { distance_mm, slope_x, slope_y } => distance_mm + slope_x * point.x + slope_y * point.y,
        Scene::CubeEdge { distance_mm, slope } => distance_mm + slope * point.x.abs(),
        Scene::Tile {
            distance_mm,
            side_mm,
            hollow_depth_mm,
            hollow_width_mm,
            pitch_mm,
            wall_mm,
            bow_mm,
            bands,
        } => {
            let from_middle = (point.x - (point.x / pitch_mm).round() * pitch_mm).abs();
            let share = (0.5 * (hollow_width_mm + wall_mm) - from_middle) / wall_mm;
            let free = bands.map_or(1.0, |bands| {
                (0.5 * side_mm - bands.rows as f64 * bands.square_mm - point.y.abs()) / wall_mm
            });
            let bow = bow_mm * (point.x.powi(2) + point.y.powi(2)) / (0.5 * side_mm).powi(2);
            distance_mm + bow + hollow_depth_mm * share.min(free).clamp(0.0, 1.0)
        }
    };
    point.z - depth
}

fn check(config: SimulatorConfig, reference: usize) {
    let camera = config.optics.pinhole();
    let simulator = Simulator::new(config).unwrap();
    check_truth(&simulator, &camera, reference, &simulator.truth(reference).unwrap());
}

fn check_truth(simulator: &Simulator, camera: &Pinhole, reference: usize, truth: &Truth) {
    let config = simulator.config();
    let positions = config.scan.positions_mm();
    let last = positions.len() - 1;
    let (start, end) =
        (projection(simulator, camera, positions[0]), projection(simulator, camera, positions[last]));
    let share = simulator.true_tau().values()[reference];
    let (mut seen, mut unseen) = (0, 0);
    for y in (0..camera.rows).step_by(7) {
        for x in (0..camera.columns).step_by(3) {
            let disparity = f64::from(truth.disparity.at(x, y));
            if disparity.is_nan() {
                unseen += 1;
                assert_eq!(truth.visible_frames.at(x, y), 0);
                continue;
            }
            seen += 1;
            let first_x = x as f64 - disparity * share;
            let point = triangulate([(start, (first_x, y as f64)), (end, (first_x + disparity, y as f64))]);
            // The disparity is stored as f32: 6e-8 of it, times Z / d.
            let resolution = 1.2e-7 * point.z + 1e-6;
            assert!(behind(&config.scene, &point).abs() < resolution, "({x}, {y}): {point:?}");
            let height = config.scene.distance_mm() - point.z;
            assert!((f64::from(truth.height_mm.at(x, y)) - height).abs() < resolution);
            let inside = |position: &&f64| {
                let image = projection(simulator, camera, **position) * point.push(1.0);
                let column = image[0] / image[2];
                (-1e-4..=camera.columns as f64 - 1.0 + 1e-4).contains(&column)
            };
            let disagree = |(t, position): (usize, &f64)| inside(&position) != truth.sees(x, y, t);
            let differing = positions.iter().enumerate().filter(|&pair| disagree(pair)).count();
            assert!(differing <= 1, "({x}, {y}): {differing} frames see it otherwise");
            let count = positions.iter().filter(inside).count();
            assert!(count.abs_diff(truth.visible_frames.at(x, y).into()) <= 1, "({x}, {y}): {count}");
        }
    }
    assert!(seen > 500, "{seen} pixels with a truth, {unseen} without");
}

#[test]
fn triangulated_points_lie_on_the_surface() {
    check(SimulatorConfig::tile(256, 11), 0);
    check(SimulatorConfig::cube_edge(192, 9), 4);
    let mut slanted = SimulatorConfig::textured_plane(160, 120, 7);
    slanted.scene = Scene::Plane { distance_mm: 500.0, slope_x: 0.5, slope_y: -0.2 };
    slanted.carried = Carried::Camera;
    check(slanted, 6);
}

#[test]
fn a_rectified_view_of_a_faulty_rig_has_a_truth_that_triangulates() {
    let simulator = Simulator::new(SimulatorConfig::real_tile(256, 11)).unwrap();
    assert_eq!(simulator.truth(3), Err(SimulatorError::NotRectified));
    let camera = Pinhole {
        rows: 200,
        columns: 280,
        focal_length_px: 650.0,
        principal_point_x_px: 131.0,
        principal_point_y_px: 97.5,
    };
    check_truth(&simulator, &camera, 3, &simulator.truth_seen_by(&camera, 3).unwrap());
}
