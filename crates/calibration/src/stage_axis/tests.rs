//! The stage axis against a rig whose truth is written down with rotation matrices.

use nalgebra::{Rotation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::*;
use crate::lens::{Distortion, Lens};
use crate::target::{ChessBoard, Observation, Target, TrackedCorner, Tracks};

const ROLL: f64 = 0.7 * std::f64::consts::PI / 180.0;
const PAN: f64 = 0.4 * std::f64::consts::PI / 180.0;
const LENS: Lens = Lens {
    focal_length_x_px: 1422.0,
    focal_length_y_px: 1422.0,
    principal_point_x_px: 259.0,
    principal_point_y_px: 250.0,
    distortion: Distortion { k1: -0.02, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 },
};
/// What is known of it beforehand: fx, fy, cx, cy to 0.2 % and 2 px, k1 to a quarter; the rest is held.
const SIGMA: [f64; Lens::PARAMETERS] = [3.0, 3.0, 2.0, 2.0, 0.005, 0.0, 0.0, 0.0, 0.0];
const STEP_SIGMA_MM: f64 = 0.005;
const NOISE_PX: f64 = 0.02;

struct Scan {
    tracks: Tracks,
    reported_mm: Vec<f64>,
    true_mm: Vec<f64>,
    lens: LensEstimate,
}

fn target() -> Target {
    Target { board: ChessBoard { columns: 9, rows: 2, square_mm: 15.0 }, bands: 2, band_distance_mm: 110.0 }
}

/// A bowed tile 900 mm away with two bands, moved over 150 mm; `noise` is a factor on all errors.
fn scan(seed: u64, frames: usize, noise: f64) -> Scan {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = move |sigma: f64| -> f64 {
        let unit: f64 = StandardNormal.sample(&mut random);
        noise * sigma * unit
    };
    let to_camera = (Rotation3::from_axis_angle(&Vector3::y_axis(), PAN)
        * Rotation3::from_axis_angle(&Vector3::z_axis(), ROLL))
    .inverse();
    let reported_mm: Vec<f64> = (0..frames).map(|t| 10.0 + 150.0 * t as f64 / (frames - 1) as f64).collect();
    let true_mm: Vec<f64> = reported_mm.iter().map(|position| position + normal(STEP_SIGMA_MM)).collect();
    let mut corners = Vec::new();
    for band in 0..2 {
        for row in 0..2 {
            corners.extend((0..9).map(|column| TrackedCorner { band, column, row }));
        }
    }
    let mut observations = Vec::new();
    for (frame, position) in true_mm.iter().enumerate() {
        for (corner, label) in corners.iter().enumerate() {
            let x = 15.0 * f64::from(label.column) - 60.0;
            let y = 15.0 * f64::from(label.row) - 62.5 + 110.0 * label.band as f64;
            let bow = 0.3 * (x * x + y * y) / 75.0_f64.powi(2);
            let seen = to_camera * Vector3::new(x + position - 85.0, y, 900.0 + bow);
            let (x_px, y_px) = LENS.pixel(seen.x / seen.z, seen.y / seen.z);
            let (x_px, y_px) = (x_px + normal(NOISE_PX), y_px + normal(NOISE_PX));
            // Half of the true noise is stated: its size is to be found from the tracks.
            observations.push(Observation { frame, corner, x_px, y_px, sigma_px: 0.5 * NOISE_PX });
        }
    }
    let tracks = Tracks { corners, observations, dropped: 0, anchored: vec![true; 2] };
    let mut known = LENS.to_array();
    known.iter_mut().zip(SIGMA).for_each(|(value, sigma)| *value += normal(sigma));
    let lens = LensEstimate::independent(512, 512, Lens::from_array(known), SIGMA);
    Scan { tracks, reported_mm, true_mm, lens }
}

impl Scan {
    fn true_tau(&self, frame: usize) -> f64 {
        let (first, last) = (self.true_mm[0], self.true_mm[self.true_mm.len() - 1]);
        (self.true_mm[frame] - first) / (last - first)
    }
}

#[test]
fn without_noise_everything_is_found_exactly() {
    let scan = scan(1, 12, 0.0);
    let found = find(&scan.tracks, &scan.reported_mm, &scan.lens).unwrap();
    assert!((found.direction.roll_rad - ROLL).abs() < 1e-8, "{:?}", found.direction);
    assert!((found.direction.pan_rad - PAN).abs() < 1e-8, "{:?}", found.direction);
    assert!(found.rows_rms_px() < 1e-6 && found.rejected.is_empty());
    let baseline_mm = baseline_by_target(&found.points, &scan.tracks, &target()).unwrap();
    // The bow makes the boards longer by some ppm.
    assert!((baseline_mm / 150.0 - 1.0).abs() < 1e-4, "{baseline_mm}");
}

#[test]
fn stated_standard_deviations_hold() {
    let runs = 200;
    let frames = 9;
    let mut normalised = vec![Vec::new(); 3];
    for seed in 0..runs {
        let scan = scan(seed, frames, 1.0);
        let found = find(&scan.tracks, &scan.reported_mm, &scan.lens).unwrap();
        normalised[0].push((found.direction.roll_rad - ROLL) / found.roll_sigma_rad);
        normalised[1].push((found.direction.pan_rad - PAN) / found.pan_sigma_rad);
        let middle = frames / 2;
        let tau = found.tau[middle].unwrap();
        normalised[2].push((tau.tau - scan.true_tau(middle)) / tau.sigma);
    }
    for (errors, name) in normalised.iter().zip(["roll", "pan", "tau"]) {
        let mean = errors.iter().sum::<f64>() / runs as f64;
        let spread =
            (errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / (runs - 1) as f64).sqrt();
        // The spread of 200 normal numbers is known to 5 %, their mean to 0.07.
        assert!((0.8..1.2).contains(&spread), "{name}: {spread}");
        assert!(mean.abs() < 0.3, "{name}: {mean}");
    }
}

#[test]
fn a_corner_that_was_mistaken_does_not_count() {
    let mut scan = scan(3, 12, 1.0);
    let expected = find(&scan.tracks, &scan.reported_mm, &scan.lens).unwrap();
    let wrong = [40, 41, 300];
    wrong.iter().for_each(|&index| scan.tracks.observations[index].x_px += 5.0);
    let found = find(&scan.tracks, &scan.reported_mm, &scan.lens).unwrap();
    for index in wrong {
        let seen = scan.tracks.observations[index];
        assert!(found.rejected.contains(&(seen.frame, seen.corner)), "{:?}", found.rejected);
    }
    let moved = (found.direction.pan_rad - expected.direction.pan_rad).abs();
    assert!(moved < 0.5 * expected.pan_sigma_rad, "{moved}");
}

#[test]
fn a_wrong_focal_length_leaves_the_rows_straight() {
    let mut scan = scan(4, 12, 0.0);
    let wrong = Lens {
        focal_length_x_px: 1000.0,
        focal_length_y_px: 1000.0,
        distortion: Distortion::default(),
        ..LENS
    };
    // k1 is in units of the focal length's square.
    let wrong = Lens {
        distortion: Distortion { k1: -0.02 * (1000.0_f64 / 1422.0).powi(2), ..wrong.distortion },
        ..wrong
    };
    scan.lens = LensEstimate::independent(512, 512, wrong, [0.0; Lens::PARAMETERS]);
    let found = find(&scan.tracks, &scan.reported_mm, &scan.lens).unwrap();
    // The pan scales with the focal length; rows do not suffer: K is needed only roughly (paper, section
    // 5.2).
    assert!(found.rows_rms_px() < 0.002, "{}", found.rows_rms_px());
    assert!((found.direction.roll_rad - ROLL).abs() < 1e-4);
    assert!((found.direction.pan_rad / PAN - 1000.0 / 1422.0).abs() < 0.02, "{:?}", found.direction);
}

#[test]
fn frames_that_no_corner_connects_are_held_together_by_the_stage() {
    let mut scan = scan(5, 12, 1.0);
    // The left half of the target is seen in the first frames only, the right half in the last.
    scan.tracks.observations.retain(|seen| (seen.frame < 6) == (scan.tracks.corners[seen.corner].column < 4));
    let found = find(&scan.tracks, &scan.reported_mm, &scan.lens).unwrap();
    // Half a step of the stage is what is known of their distance.
    let sigma = found.tau[6].unwrap().sigma;
    assert!(sigma > 0.005 && sigma < 0.05, "{sigma}");
}

#[test]
fn what_cannot_be_told_is_refused() {
    let mut one_row = scan(6, 12, 1.0);
    one_row.tracks.observations.retain(|seen| seen.corner < 9);
    assert_eq!(find(&one_row.tracks, &one_row.reported_mm, &one_row.lens), Err(StageAxisError::OneLine));
    let mut few = scan(7, 12, 1.0);
    few.tracks.observations.retain(|seen| seen.corner < 3);
    assert!(matches!(
        find(&few.tracks, &few.reported_mm, &few.lens),
        Err(StageAxisError::TooFewTracks { corners: 3, .. })
    ));
    let mut across = scan(8, 12, 1.0);
    for seen in &mut across.tracks.observations {
        (seen.x_px, seen.y_px) = (seen.y_px, seen.x_px);
    }
    assert_eq!(find(&across.tracks, &across.reported_mm, &across.lens), Err(StageAxisError::NotAlongRows));
}
