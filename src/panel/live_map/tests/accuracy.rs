//! Disparity and sigma of live maps against the truth.

use super::scans::{Comparison, Maps, compare, frames, plane, true_means};
use epirig_core::grid::Grid;
use epirig_simulator::{Simulator, SimulatorConfig};

const FRAMES: usize = 31;
/// Numbers of frames whose maps are compared; each is about one and a half times the one before.
const LOOKED_AT: [usize; 5] = [5, 8, 13, 20, 31];
/// So many frames know a plane to the wanted sigma in discs that are small against the map.
const MANY_FRAMES: usize = 13;

fn config(seed: u64) -> SimulatorConfig {
    plane(400, 300, FRAMES, seed)
}

/// Checks the sigma of a map of so many frames. A few frames know little, so discs grow to 115 px
/// of the map, which holds three of them: their pixels err together, each by two sigma once in
/// twenty.
fn check_sigma(found: &Comparison, frames: usize, what: &str) {
    // Wrong by a tenth, the scale would shift a disparity of 24 px by many sigmas.
    assert!(found.bias_sigmas.abs() < if frames < MANY_FRAMES { 2.0 } else { 0.5 }, "{what}");
    // A sigma that is right holds 68 % of Gaussian errors. It is to be larger rather than smaller:
    // it allows for rounding to the camera's levels and for pixel locking.
    assert!((if frames < MANY_FRAMES { 0.2 } else { 0.5 }..0.9).contains(&found.within), "{what}");
}

/// Checks the maps of a scan at `positions_mm`. The truth of the whole baseline is `truth` times `sign`.
fn check_course(config: SimulatorConfig, positions_mm: &[f64], truth: &Grid<f32>, sign: f64) {
    let simulator = Simulator::new(config).unwrap();
    let maps = Maps::new(positions_mm);
    let mut course: Vec<Comparison> = Vec::new();
    for (index, frame) in frames(&simulator, positions_mm).iter().enumerate() {
        maps.maker.add(index, frame);
        if !LOOKED_AT.contains(&(index + 1)) {
            continue;
        }
        let map = maps.of(index + 1);
        assert_eq!((map.planned, map.bin), (FRAMES, 2));
        assert_eq!((map.disparity.rows(), map.disparity.columns()), (150, 200));
        let now = compare(&map, &true_means(truth, &map, sign));
        let what = format!("{} frames: {now:?}", map.frames);
        assert!((map.median_sigma_px / now.sigma_px - 1.0).abs() < 1e-6, "{what}");
        assert!(now.answered > 0.9, "{what}");
        check_sigma(&now, index + 1, &what);
        if let Some(before) = course.last() {
            assert!(now.sigma_px < before.sigma_px && now.error_px < before.error_px, "{what}, {before:?}");
        }
        course.push(now);
    }
    // The sigma of a slope falls as its baseline and the root of the number of points rise: for equal steps
    // by 14 from 5 to 31 frames. Windows that shrink meanwhile take a part of it.
    let (early, late) = (course[0], course[course.len() - 1]);
    assert!(late.error_px < early.error_px / 5.0 && late.sigma_px < early.sigma_px / 5.0, "{course:?}");
}

fn check_usual(config: SimulatorConfig) {
    let truth = Simulator::new(config.clone()).unwrap().truth(0).unwrap();
    let positions_mm = config.scan.positions_mm();
    check_course(config, &positions_mm, &truth.disparity, 1.0);
}

#[test]
fn maps_sharpen_as_frames_come_and_sigma_tells_their_error() {
    for seed in [3, 8] {
        check_usual(config(seed));
    }
}

#[test]
fn frames_of_16_bit_keep_their_levels() {
    let mut config = config(4);
    config.sensor.bit_depth = 16;
    config.sensor.read_noise_dn *= 257.0;
    check_usual(config);
}

#[test]
fn steps_need_not_be_equal() {
    let config = config(5);
    let truth = Simulator::new(config.clone()).unwrap().truth(0).unwrap();
    let equal = config.scan.positions_mm();
    let (first, last) = (equal[0], equal[FRAMES - 1]);
    let place = |index: usize| (index as f64 / (FRAMES - 1) as f64).powf(1.3);
    let positions_mm: Vec<f64> = (0..FRAMES).map(|index| first + (last - first) * place(index)).collect();
    check_course(config, &positions_mm, &truth.disparity, 1.0);
}

#[test]
fn a_stage_may_go_downwards() {
    let config = config(6);
    // The first frame is where a scan upwards ends, and everything moves the other way.
    let truth = Simulator::new(config.clone()).unwrap().truth(FRAMES - 1).unwrap();
    let positions_mm: Vec<f64> = config.scan.positions_mm().into_iter().rev().collect();
    check_course(config, &positions_mm, &truth.disparity, -1.0);
}

#[test]
fn gaps_break_nothing() {
    let config = config(7);
    let simulator = Simulator::new(config.clone()).unwrap();
    let truth = simulator.truth(0).unwrap();
    let positions_mm = config.scan.positions_mm();
    let maps = Maps::new(&positions_mm);
    let there = [0, 1, 2, 3, 4, 9, 10, 13, 20];
    for index in there {
        maps.maker.add(index, &simulator.expose(positions_mm[index], index as u32));
    }
    let map = maps.of(there.len());
    let found = compare(&map, &true_means(&truth.disparity, &map, 1.0));
    check_sigma(&found, there.len(), &format!("{found:?}"));
}
