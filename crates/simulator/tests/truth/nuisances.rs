//! Each fault of the simulator does what its number says, against projection matrices, plain fits and amounts
//! computed by hand.

use epirig_core::grid::Grid;
use epirig_simulator::{Distortion, Optics, Pinhole, Scene, Simulator, SimulatorConfig, StepError};
use nalgebra::{Matrix6, Rotation3, Vector3, Vector6};

/// Where the camera's image has a point of the rectified frame: rotation and camera matrix by nalgebra, the
/// lens by OpenCV's formula.
fn image_of(optics: &Optics, point: Vector3<f64>) -> (f64, f64) {
    let roll = Rotation3::from_axis_angle(&Vector3::z_axis(), optics.roll_rad);
    let pan = Rotation3::from_axis_angle(&Vector3::y_axis(), optics.pan_rad);
    let seen = (pan * roll).inverse() * point;
    let (a, b) = (seen.x / seen.z, seen.y / seen.z);
    let Distortion { k1, k2, p1, p2, k3 } = optics.distortion;
    let r2 = a * a + b * b;
    let radial = 1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3);
    let distorted_a = a * radial + 2.0 * p1 * a * b + p2 * (r2 + 2.0 * a * a);
    let distorted_b = b * radial + p1 * (r2 + 2.0 * b * b) + 2.0 * p2 * a * b;
    let f = optics.focal_length_px;
    (f * distorted_a + optics.principal_point_x_px, f * distorted_b + optics.principal_point_y_px)
}

/// The saddle of a picture near (x, y): a quadratic surface fitted under a Gaussian window, which moves to
/// the fit's saddle until it stays there. About a corner the picture is even, and so is the window, so that
/// the fit is not drawn to either side.
fn saddle(picture: &Grid<f32>, (mut x, mut y): (f64, f64)) -> (f64, f64) {
    for _ in 0..50 {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for row in (y.round() as usize - 6)..=(y.round() as usize + 6) {
            for column in (x.round() as usize - 6)..=(x.round() as usize + 6) {
                let (u, v) = (column as f64 - x, row as f64 - y);
                let weight = (-(u * u + v * v) / (2.0 * 1.2 * 1.2)).exp();
                let terms = Vector6::new(1.0, u, v, u * u, u * v, v * v);
                normal += weight * terms * terms.transpose();
                right += weight * f64::from(picture.at(column, row)) * terms;
            }
        }
        let fit = normal.cholesky().unwrap().solve(&right);
        let area = 4.0 * fit[3] * fit[5] - fit[4] * fit[4];
        assert!(area < 0.0, "a saddle at ({x}, {y})");
        let (u, v) = (
            (fit[4] * fit[2] - 2.0 * fit[5] * fit[1]) / area,
            (fit[4] * fit[1] - 2.0 * fit[3] * fit[2]) / area,
        );
        (x, y) = (x + u, y + v);
        if u.hypot(v) < 1e-7 {
            break;
        }
    }
    (x, y)
}

/// The tile of a real rig with light alike everywhere, and a blur that pixels resolve, so that saddles are
/// where corners are.
fn evenly_lit() -> SimulatorConfig {
    let mut config = SimulatorConfig::real_tile(512, 11);
    config.optics.vignetting = 0.0;
    config.optics.point_spread_sigma_px = 1.0;
    config.optics.distortion = Distortion { k1: -0.02, k2: 0.3, p1: 0.001, p2: -0.002, k3: 0.1 };
    config
}

#[test]
fn corners_of_the_tile_are_where_projection_puts_them() {
    let config = evenly_lit();
    let simulator = Simulator::new(config.clone()).unwrap();
    let position_mm = 100.0;
    let offset_mm = simulator.true_position_mm(position_mm) - 85.0;
    let corners = simulator.target_corners(position_mm);
    assert_eq!(corners.len(), 2 * 18 * 2);
    for corner in corners {
        // 19 squares of 7.5 mm: the first inner corner lies 8.5 squares left of the middle; the bands' edges
        // at 75 mm.
        let u = (corner.column as f64 - 8.5) * 7.5;
        let row_mm = (corner.row as f64 + 1.0) * 7.5;
        let v = if corner.band == 0 { -75.0 + row_mm } else { 52.5 + row_mm };
        let depth_mm = 900.0 + 0.3 * (u * u + v * v) / (75.0 * 75.0);
        let (x, y) = image_of(&config.optics, Vector3::new(u + offset_mm, v, depth_mm));
        assert!((corner.x_px - x).hypot(corner.y_px - y) < 1e-9, "{corner:?} ({x}, {y})");
    }
}

#[test]
fn rendered_corners_lie_where_they_are_said_to() {
    let simulator = Simulator::new(evenly_lit()).unwrap();
    let tile = simulator.irradiance(60.0);
    for corner in simulator.target_corners(60.0) {
        // A fraction of a pixel beside it.
        let (x, y) = saddle(&tile, (corner.x_px + 0.3, corner.y_px - 0.2));
        let off = (x - corner.x_px).hypot(y - corner.y_px);
        assert!(off < 0.003, "{corner:?}: off by {off} px");
    }
    for pose in [0, 1, 7, 12] {
        let picture = simulator.board_irradiance(pose);
        let corners = simulator.board_corners(pose);
        assert_eq!(corners.len(), 9 * 6);
        for corner in corners {
            let (x, y) = saddle(&picture, (corner.x_px - 0.2, corner.y_px + 0.3));
            let off = (x - corner.x_px).hypot(y - corner.y_px);
            assert!(off < 0.003, "pose {pose}, {corner:?}: off by {off} px");
        }
    }
}

#[test]
fn board_corners_are_where_projection_puts_the_pose() {
    let config = evenly_lit();
    let simulator = Simulator::new(config.clone()).unwrap();
    // The pose is told in the camera's own frame, which nothing turns.
    let own = Optics { roll_rad: 0.0, pan_rad: 0.0, ..config.optics };
    for number in 0..12 {
        let pose = simulator.board_pose(number).unwrap();
        let [centre, axis_u, axis_v] = [pose.centre_mm, pose.axis_u, pose.axis_v].map(Vector3::from);
        for corner in simulator.board_corners(number) {
            let (u, v) = ((corner.column as f64 - 4.0) * 16.0, (corner.row as f64 - 2.5) * 16.0);
            let (x, y) = image_of(&own, centre + u * axis_u + v * axis_v);
            assert!((corner.x_px - x).hypot(corner.y_px - y) < 1e-9, "{corner:?} ({x}, {y})");
        }
    }
}

#[test]
fn roll_pan_and_distortion_move_the_picture_by_amounts_computed_by_hand() {
    let plain = Optics::square(1001, 2000.0);
    // 400 px to the right at a roll of 0.7 degrees: 400 (cos - 1) = -0.0299 and -400 sin = -4.8868 px.
    let (x, y) = Optics { roll_rad: 0.7_f64.to_radians(), ..plain.clone() }.pixel((0.2, 0.0));
    assert!((x - 899.9701).abs() < 1e-4 && (y - 495.1132).abs() < 1e-4, "({x}, {y})");
    // A pan of 0.4 degrees: -2000 tan = -13.9629 px on the axis.
    let (x, y) = Optics { pan_rad: 0.4_f64.to_radians(), ..plain.clone() }.pixel((0.0, 0.0));
    assert!((x - 486.0371).abs() < 1e-4 && y == 500.0, "({x}, {y})");
    // k1 = -0.02 at a = 0.2: 400 * -0.02 * 0.04 = -0.32 px.
    let distortion = Distortion { k1: -0.02, ..Distortion::default() };
    let (x, y) = Optics { distortion, ..plain }.pixel((0.2, 0.0));
    assert!((x - 899.68).abs() < 1e-9 && y == 500.0, "({x}, {y})");
}

#[test]
fn the_bow_makes_the_edges_deeper() {
    let mut config = SimulatorConfig::tile(256, 3);
    if let Scene::Tile { bow_mm, hollow_depth_mm, .. } = &mut config.scene {
        (*bow_mm, *hollow_depth_mm) = (0.3, 0.0);
    }
    let simulator = Simulator::new(config).unwrap();
    // One pixel of this camera, far away and in the middle, looks at v = 60 mm, where the bow is 0.3 * 0.64 =
    // 0.192 mm deep.
    let camera = Pinhole {
        rows: 1,
        columns: 1,
        focal_length_px: 1000.0,
        principal_point_x_px: 0.0,
        principal_point_y_px: -1000.0 * 60.0 / 900.192,
    };
    let truth = simulator.truth_seen_by(&camera, 1).unwrap();
    assert!((truth.height_mm.at(0, 0) + 0.192).abs() < 1e-6, "{}", truth.height_mm.at(0, 0));
    let expected = 1000.0 * 150.0 / 900.192;
    assert!((f64::from(truth.disparity.at(0, 0)) - expected).abs() < 1e-5 * expected);
}

#[test]
fn the_carriage_stands_beside_its_position_and_truth_knows() {
    let mut config = SimulatorConfig::tile(64, 11);
    config.step_error = StepError { sigma_um: 5.0, seed: 9 };
    let simulator = Simulator::new(config.clone()).unwrap();
    let positions = config.scan.positions_mm();
    let errors: Vec<f64> =
        positions.iter().map(|&position| simulator.true_position_mm(position) - position).collect();
    // None of eleven is six standard deviations large, and together they are more than one.
    assert!(errors.iter().all(|error| error.abs() < 0.03));
    assert!(errors.iter().map(|error| error * error).sum::<f64>().sqrt() > 0.005, "{errors:?}");
    let baseline_mm = 150.0 + errors[10] - errors[0];
    let tau = simulator.true_tau();
    assert!((tau.values()[4] - (60.0 + errors[4] - errors[0]) / baseline_mm).abs() < 1e-12);
    // The picture is the one that a stage without error gives at the true place.
    let exact = Simulator::new(SimulatorConfig { step_error: StepError::default(), ..config }).unwrap();
    assert_eq!(
        simulator.irradiance(positions[4]),
        exact.irradiance(simulator.true_position_mm(positions[4]))
    );
    assert_ne!(simulator.irradiance(positions[4]), exact.irradiance(positions[4]));
}

#[test]
fn flicker_changes_the_light_of_a_whole_frame() {
    let mut config = SimulatorConfig::textured_plane(64, 48, 3);
    config.sensor.bit_depth = 16;
    config.flicker = 0.003;
    let simulator = Simulator::new(config).unwrap();
    let light = simulator.uniform_irradiance(0.5);
    // 0.5 * 0.9 * 65535 without flicker.
    let ratios: Vec<f64> = (0..1000)
        .map(|exposure| {
            let frame = simulator.digitise(&light, exposure);
            assert_eq!(frame.samples().count_at_least(frame.samples().maximum()), 64 * 48);
            frame.samples().mean() / 29_490.75 - 1.0
        })
        .collect();
    let variance = ratios.iter().map(|ratio| ratio * ratio).sum::<f64>() / 1e3;
    // Four standard deviations of a variance of 1000 values: 4 sqrt(2 / 1000) = 18 %.
    assert!((variance / 9e-6 - 1.0).abs() < 0.18, "{variance}");
}

#[test]
fn records_from_before_there_were_faults_still_read() {
    let config = SimulatorConfig::tile(64, 5);
    let mut record = serde_json::to_value(&config).unwrap();
    let forget = |part: &mut serde_json::Value, keys: &[&str]| {
        keys.iter().for_each(|&key| assert!(part.as_object_mut().unwrap().remove(key).is_some(), "{key}"));
    };
    forget(&mut record, &["board", "flicker", "step_error"]);
    forget(&mut record["optics"], &["roll_rad", "pan_rad", "distortion"]);
    forget(&mut record["sensor"], &["black_level_dn", "pixel_gain_sigma", "hot_pixels"]);
    forget(&mut record["scene"], &["bow_mm", "bands"]);
    assert_eq!(serde_json::from_value::<SimulatorConfig>(record).unwrap(), config);
    let faulty = SimulatorConfig::real_tile(256, 5);
    let text = serde_json::to_string(&faulty).unwrap();
    assert_eq!(serde_json::from_str::<SimulatorConfig>(&text).unwrap(), faulty);
}
