//! Limits of rows whose contrast, gradient and noise are known.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::candidates::Candidates;
use crate::candidates::DisparityRange;
use crate::lines::{EpiLines, SeenRule};
use crate::options::Occlusion;
use epirig_core::tau::Tau;

const COLUMNS: usize = 400;
const ROWS: usize = 4;
const LEAST: f32 = 1.0 / 12.0;

/// Frames whose samples are `shade` of column and tau, in DN, counted in 1/128 DN.
fn volume(tau: Tau, mut shade: impl FnMut(f64, f64) -> f64) -> Volume {
    let mut volume = Volume::fine(ROWS, COLUMNS, 8, tau.clone());
    for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
        let (x, tau) = ((index % COLUMNS) as f64, tau.values()[index / COLUMNS % tau.frames()]);
        *count = (128.0 * shade(x, tau)).round() as u16;
    }
    volume
}

fn plan_of(
    volume: &Volume,
    reference: usize,
    (minimum_px, maximum_px): (f64, f64),
    disparity_step_px: f64,
) -> Plan {
    let lines = EpiLines::new(volume.tau(), reference, COLUMNS);
    let rule = SeenRule::new(volume.frames(), 0.5, Occlusion::OneSide);
    Plan::new(
        &lines,
        Candidates::covering(DisparityRange { minimum_px, maximum_px }, disparity_step_px),
        rule,
    )
}

#[test]
fn a_ramp_may_miss_by_its_gradient_times_half_the_step() {
    let gradient = 0.5;
    // Two candidates, both summed up under the gradient that lies between them; a ramp is interpolated
    // without error.
    let scene = volume(Tau::equidistant(61).unwrap(), |x, tau| 20.0 + gradient * (x - 2.25 * tau));
    for (reference, farthest) in [(0, 1.0), (30, 0.5), (45, 0.75), (60, 1.0)] {
        let plan = plan_of(&scene, reference, (2.0, 2.5), 0.5);
        let rows = limits(&scene, &plan, 1..3, LEAST, 0.2, NOISE_OF_FRAMES);
        assert_eq!(rows.len(), 2);
        for row in &rows {
            assert_eq!(row.len(), COLUMNS + CHUNK);
            // Nine values that grow by the gradient have the variance 60/8 of its square. At the borders both
            // are others.
            let expected =
                0.2 * gradient * gradient * 7.5 + (0.25 * farthest * gradient).powi(2) + f64::from(LEAST);
            for (x, limit) in row.iter().enumerate().take(COLUMNS - 4).skip(4) {
                // Counts of 1/128 DN are 0.0023 DN off, which the contrast of 7.5 and a gradient of 0.5 make
                // 0.002 of, at most.
                assert!((f64::from(*limit) / expected - 1.0).abs() < 0.02, "{reference}, {x}: {limit}");
            }
            assert!(row[COLUMNS..].iter().all(|&limit| limit == LEAST));
        }
    }
}

/// Median of a chi-squared variable over its degrees of freedom, from tables.
const CHI_SQUARED_MEDIANS: [(f64, f64); 4] = [(1.0, 0.4549), (4.0, 0.8392), (7.0, 0.9065), (9.0, 0.9270)];

#[test]
fn noise_is_the_median_variance_of_the_frames_next_to_the_reference() {
    let sigma = 3.0;
    // 12 groups of 2, 5, 8 and 10 frames beside the first.
    for (frames, (freedom, median)) in [25, 61, 97, 121].into_iter().zip(CHI_SQUARED_MEDIANS) {
        let mut random = ChaCha8Rng::seed_from_u64(frames as u64);
        let scene = volume(Tau::equidistant(frames).unwrap(), |x, _| {
            let noise: f64 = StandardNormal.sample(&mut random);
            128.0 + 40.0 * (0.7 * x).sin() + sigma * noise
        });
        let plan = plan_of(&scene, 0, (0.0, 0.0), 0.5);
        assert_eq!(plan.groups.groups[0].frames.len() as f64, freedom + 1.0);
        let found = f64::from(noise_variance(&scene, &plan, 2).unwrap());
        // The median of n values is normal about its own with 1 / (2 f sqrt(n)), f the density there. By the
        // normal distribution of the same variance, 2 / freedom, f = sqrt(freedom / 4 pi); skew only makes it
        // larger.
        let deviation = (std::f64::consts::PI / (freedom * COLUMNS as f64)).sqrt();
        let expected = sigma * sigma * median;
        assert!((found - expected).abs() < 4.0 * deviation * sigma * sigma, "{frames}: {found} {expected}");
    }
}

#[test]
fn a_gradient_that_suits_the_scene_is_among_those_tried() {
    let sigma = 2.0;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    // 2 px from frame to frame, so that nothing is interpolated; a wrong gradient sees the texture as noise.
    let scene = volume(Tau::equidistant(61).unwrap(), |x, tau| {
        let noise: f64 = StandardNormal.sample(&mut random);
        128.0 + 60.0 * (0.7 * (x - 120.0 * tau)).sin() + sigma * noise
    });
    let found = |range| f64::from(noise_variance(&scene, &plan_of(&scene, 0, range, 0.5), 1).unwrap());
    let exact = found((120.0, 120.0));
    let among = found((60.0, 140.0));
    let beside = found((60.0, 70.0));
    // Less texture than noise is left within a block: of half a gradient's distance, 0.2 px over the group,
    // times a gradient of 42 DN/px at most.
    assert!(among > 0.5 * exact && among < exact + 42.0_f64.powi(2) * 0.2 * 0.2, "{among} {exact}");
    assert!(beside > 50.0 * exact, "{beside} {exact}");
}

#[test]
fn where_frames_stand_alone_all_of_the_contrast_is_allowed_for() {
    let scene = volume(Tau::equidistant(9).unwrap(), |x, _| if x % 2.0 == 0.0 { 10.0 } else { 16.0 });
    let plan = plan_of(&scene, 4, (0.0, 0.0), 0.5);
    assert!(noise_variance(&scene, &plan, 0).is_none());
    let rows = limits(&scene, &plan, 0..1, LEAST, 0.1, NOISE_OF_GROUPS);
    // Five of one and four of the other.
    assert!((rows[0][20] - (10.0 + LEAST)).abs() < 1e-4, "{}", rows[0][20]);
}
