//! Scenes whose frames deviate from each other by known amounts.

use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::candidates::Candidates;
use crate::candidates::DisparityRange;
use crate::lines::{EpiLines, SeenRule};
use crate::maps::OrderingUsed;
use crate::options::{MatchOptions, Occlusion};
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

const FRAMES: usize = 61;
const ROWS: usize = 12;
const COLUMNS: usize = 180;
/// Any nine neighbours of a wave of period 9 px have the same variance, 9/16 of its squared amplitude.
const PERIOD_PX: f64 = 9.0;
const AMPLITUDE: f64 = 60.0;
const MEAN: f64 = 128.0;
const CONTRAST: f64 = 9.0 / 16.0 * AMPLITUDE * AMPLITUDE;
/// The square of half the step of the search, 0.1 px.
const STEP: f64 = 0.05 * 0.05;
const QUANTISATION: f64 = 1.0 / 12.0;

fn wave(x: f64) -> f64 {
    AMPLITUDE * (std::f64::consts::TAU * x / PERIOD_PX + 0.4).sin()
}

/// What [`measured_tolerance`] finds where the wave stands still and each sample deviates from it by
/// `deviation` of column and frame, in DN.
fn measured(mut deviation: impl FnMut(usize, usize) -> f64) -> Tolerance {
    let mut volume = Volume::fine(ROWS, COLUMNS, 8, Tau::equidistant(FRAMES).unwrap());
    for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
        let (x, t) = (index % COLUMNS, index / COLUMNS % FRAMES);
        *count = (128.0 * (MEAN + wave(x as f64) + deviation(x, t))).round() as u16;
    }
    let lines = EpiLines::new(volume.tau(), 0, COLUMNS);
    let rule = SeenRule::new(FRAMES, 0.5, Occlusion::OneSide);
    let range = DisparityRange { minimum_px: -3.0, maximum_px: 3.0 };
    // All candidates share the sums under the gradient of the middle one, on which samples are whole pixels
    // apart: nothing is interpolated.
    let plan = Plan::new(&lines, Candidates::covering(range, 0.1), rule);
    assert_eq!(plan.blocks.len(), 1);
    let options = MatchOptions::default();
    let task = Task {
        volume: &volume,
        lines: &lines,
        range,
        ordering: OrderingUsed::Off,
        rule,
        options: &options,
        progress: &Silent,
    };
    measured_tolerance(task, &plan, Window { rows: 1, columns: 1 })
}

fn alternating(t: usize) -> f64 {
    if t.is_multiple_of(2) { 1.0 } else { -1.0 }
}

fn median_of(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Typical cost if frames deviate by `size` of the column, alternately up and down, and may deviate by
/// `share` of the contrast: half is the column's own variance over its limit, half that of the best window of
/// three columns among those that contain it. Contrast is that of the reference frame, which shows the wave
/// `gain` times as large.
fn formula(size: impl Fn(f64) -> f64, gain: f64, share: f64) -> f64 {
    let columns: Vec<f64> = (20..20 + 9).map(f64::from).collect();
    // Among 61 frames one more deviates upwards; among the five of a group next to the reference it is the
    // same, unbiased 6/5.
    let variance = |x: f64| size(x).powi(2) * (1.0 - 1.0 / (FRAMES * FRAMES) as f64);
    let noise = 1.2 * median_of(columns.iter().map(|&x| size(x).powi(2)).collect());
    let gradient = |x: f64| 0.5 * ((wave(x + 1.0) - wave(x)).powi(2) + (wave(x - 1.0) - wave(x)).powi(2));
    let limit = |x: f64| gain * gain * (share * CONTRAST + STEP * gradient(x)) + 4.0 * noise + QUANTISATION;
    let three = |x: f64, of: &dyn Fn(f64) -> f64| (of(x - 1.0) + of(x) + of(x + 1.0)) / 3.0;
    let window = |x: f64| three(x, &variance) / three(x, &limit);
    let best = |x: f64| window(x - 1.0).min(window(x)).min(window(x + 1.0));
    median_of(columns.iter().map(|&x| 0.5 * (variance(x) / limit(x) + best(x))).collect())
}

/// Samples are rounded to 1/128 DN, and other candidates within a tenth of a pixel may fit a little better by
/// chance.
const NEARLY: f64 = 0.03;

fn check_deviations(size: impl Fn(f64) -> f64, gain: f64, nearly: f64) {
    let agrees = |found: f32, expected: f64| (f64::from(found) / expected - 1.0).abs() < nearly;
    let found = measured(|x, t| size(x as f64) * alternating(t));
    let share = 4.0 * formula(&size, gain, 1.0);
    assert!(share > 0.15 && share < 0.9, "the formula's share {share} lies within its bounds");
    assert!(agrees(found.share, share), "{} for {share}", found.share);
    let typical = formula(&size, gain, share);
    assert!(agrees(found.typical, typical), "{} for {typical}", found.typical);
}

#[test]
fn offsets_of_frames_are_what_is_typical() {
    check_deviations(|_| 10.0, 1.0, NEARLY);
    check_deviations(|_| 14.0, 1.0, NEARLY);
}

#[test]
fn gains_of_frames_are_what_is_typical() {
    // Frames deviate less where it is dark, so lines that lead there cost less, until the texture that they
    // cross tells: by d px on a gradient of A w, gain e^2 128 A w d of e^2 128^2, lost (A w d)^2 / 12, at
    // best 3 e^4 128^2, which is 3 e^2 of the whole.
    for gain in [0.1, 0.14] {
        check_deviations(|x| gain * (MEAN + wave(x)), 1.0 + gain, NEARLY + 3.0 * gain * gain);
    }
}

#[test]
fn noise_is_what_is_typical() {
    let sigma = 12.0;
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let found = measured(|_, _| {
        let noise: f64 = StandardNormal.sample(&mut random);
        sigma * noise
    });
    // The noise is the median of variances of five frames: 0.839 of the mean (chi-squared, four degrees of
    // freedom). The mean squared gradient stands for that of each pixel, of which the step makes little;
    // contrast contains the noise of the reference frame.
    let square = sigma * sigma;
    let gradient = AMPLITUDE.powi(2) * (1.0 - (std::f64::consts::TAU / PERIOD_PX).cos());
    let cost = |share: f64| {
        square / (share * (CONTRAST + square) + STEP * gradient + 4.0 * 0.839 * square + QUANTISATION)
    };
    // The candidate and the window are the best of a few: of nine means of nine variances of 60 degrees of
    // freedom, each 0.06 of it astray, the best lies some 1.2 standard deviations low, which counts by half;
    // a candidate takes one degree of freedom of 60. Noise in contrast: 0.05.
    let within = |found: f32, expected: f64| (0.85..1.05).contains(&(f64::from(found) / expected));
    assert!(within(found.share, 4.0 * cost(1.0)), "{} for {}", found.share, 4.0 * cost(1.0));
    let typical = cost(f64::from(found.share));
    assert!(within(found.typical, typical), "{} for {typical}", found.typical);
}

#[test]
fn the_share_stays_within_its_bounds() {
    let still = measured(|_, _| 0.0);
    assert_eq!(still.share, LEAST_SHARE);
    // Nothing is left but rounding.
    assert!(still.typical < 1e-4, "{}", still.typical);
    // Frames that have nothing to do with each other.
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let unlike = measured(|x, _| {
        let noise: f64 = StandardNormal.sample(&mut random);
        25.0 * noise - wave(x as f64)
    });
    assert!(unlike.share > 0.6 && unlike.share <= 1.0, "{}", unlike.share);
}

#[test]
fn the_dearest_right_candidate_is_lost_in_the_others() {
    let tolerance = Tolerance { share: 0.1, typical: 0.1 };
    // 0.4 of the frames agree at a tenth of the limit, 0.6 disagree at the limit.
    assert!((tolerance.largest_cost(0.4) - 0.64).abs() < 1e-6);
    // All frames see it: half of such candidates cost more than the median.
    assert_eq!(tolerance.largest_cost(1.0), 0.25);
    assert_eq!(Tolerance { typical: 0.2, ..tolerance }.largest_cost(1.0), 0.4);
    // Where frames have nothing to do with each other nothing is too costly.
    assert_eq!(Tolerance { typical: 0.7, ..tolerance }.largest_cost(1.0), 1.0);
}

proptest! {
    #[test]
    fn what_fewer_frames_need_to_see_may_cost_more(
        typical in 0.0_f32..=1.0, share in 0.1_f32..=1.0, visible in (0.01_f64..=1.0, 0.01_f64..=1.0),
    ) {
        let tolerance = Tolerance { share, typical };
        let (fewer, more) = (visible.0.min(visible.1), visible.0.max(visible.1));
        prop_assert!(tolerance.largest_cost(fewer) >= tolerance.largest_cost(more));
        prop_assert!(tolerance.largest_cost(more) >= typical);
        prop_assert!(tolerance.largest_cost(fewer) <= 1.0);
    }
}
