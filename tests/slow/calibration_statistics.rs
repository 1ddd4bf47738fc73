//! What calibration states of itself holds: over 200 rigs in full size, each with its own texture, noise, stage errors and knowledge of the lens, errors over
//! stated standard deviations scatter by 1.
//!
//! The rig is small so that 200 are quick: 256 x 168 px, 15 frames, hollows 8 mm wide. Each runs from rendered frames through detection, tracks,
//! adjustment, rectification, matching and the surface. Lamp and pixels are alike here: flat frames would only add to the noise.

use crate::known_rig::{Place, places, target};
use crate::size::repetitions;
use epirig_calibration::lens::{Distortion, Lens, LensEstimate};
use epirig_calibration::photometry::Correction;
use epirig_calibration::rectification::{Mapping, Rectifier};
use epirig_calibration::stage_axis::{find, positioning_error};
use epirig_calibration::target::{find_boards, track};
use epirig_core::grid::Grid;
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_matcher::evaluate::match_halves;
use epirig_matcher::{EQUAL_DISCS_PX, GROWN_DISCS_PX, MatchOptions, ReferenceFrame, match_volume};
use epirig_simulator::{Bands, Optics, Scene, SimulatedScan, Simulator, SimulatorConfig, StepError, Texture};
use epirig_surface::conformity::{DecisionRule, Limits, Rule, Value, Verdict};
use epirig_surface::{Geometry, ScaleSigma, Steps, StepsOptions, TrendKind, find_steps, heights};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;

const RIGS: usize = 200;
const DEPTH_MM: f64 = 1.0;
/// Of the lens as it is known beforehand: fx, fy, cx, cy, k1.
const LENS_SIGMA: [f64; 5] = [2.0, 2.0, 1.0, 1.0, 0.01];

fn config(seed: u64) -> SimulatorConfig {
    let distance_mm = 400.0;
    let optics = Optics {
        rows: 168,
        principal_point_y_px: 83.5,
        roll_rad: 0.7_f64.to_radians(),
        pan_rad: 0.4_f64.to_radians(),
        ..Optics::square(256, 1000.0)
    };
    let mut config = SimulatorConfig {
        scene: Scene::Tile {
            distance_mm,
            side_mm: 56.0,
            hollow_depth_mm: DEPTH_MM,
            hollow_width_mm: 8.0,
            pitch_mm: 16.0,
            wall_mm: 0.4,
            bow_mm: 0.05,
            bands: Some(Bands { square_mm: 4.8, columns: 11, rows: 3 }),
        },
        // Two pixels.
        texture: Texture { grain_mm: 0.8, coarse_share: 0.35, seed },
        optics,
        scan: SimulatedScan { start_mm: 10.0, step_mm: 36.0 / 14.0, frames: 15 },
        step_error: StepError { sigma_um: 5.0, seed },
        ..SimulatorConfig::tile(256, 15)
    };
    config.optics.distortion.k1 = -0.02;
    // 45 dB below full scale.
    config.sensor.read_noise_dn = 1.434;
    config.sensor.seed = seed;
    config
}

/// Errors over stated standard deviations of one rig.
struct Normalised {
    roll: f64,
    pan: f64,
    tau: Vec<f64>,
    baseline: f64,
    /// Over what a t distribution of the stated degrees of freedom scatters by, which is more than 1.
    depth: f64,
    /// Whether the 95 % interval, with all contributions of the budget, holds the true depth.
    interval_holds: bool,
    /// The depth with its uncertainty, as a verdict is reached from it.
    value: Value,
}

/// How often a rule of risk `risk` decides wrongly: the shares of rigs whose depth passes although it does not conform, and
/// fails although it does. The true depth lies at the limit itself, where that happens most.
fn wrong_verdicts(rigs: &[Normalised], risk: f64) -> [f64; 2] {
    /// Too little to count, and enough to lie on one side.
    const HARDLY_MM: f64 = 1e-9;
    let rule = Rule { decision: DecisionRule::GuardedRisk, risk };
    let share = |lower_mm: f64, verdict: Verdict| {
        let limits = Limits::new(Some(lower_mm), None).unwrap();
        let counted = rigs.iter().filter(|rig| rule.decide(rig.value, limits).0 == verdict).count();
        counted as f64 / rigs.len() as f64
    };
    [share(DEPTH_MM + HARDLY_MM, Verdict::Pass), share(DEPTH_MM - HARDLY_MM, Verdict::Fail)]
}

fn one_rig(seed: u64) -> Normalised {
    let simulator = Simulator::new(config(seed)).unwrap();
    let config = simulator.config();
    let positions_mm = config.scan.positions_mm();
    let frames: Vec<_> = positions_mm
        .iter()
        .enumerate()
        .map(|(index, &position_mm)| simulator.expose(position_mm, index as u32))
        .collect();
    let target = target(config);
    let found: Vec<_> = frames.iter().map(|frame| find_boards(frame, &target.board, 2)).collect();
    let tracks = track(&found, &target, Some(&positions_mm)).unwrap();
    let stage_axis = find(&tracks, &positions_mm, &known_lens(&config.optics, seed)).unwrap();

    let direction = stage_axis.direction;
    let truth = simulator.true_tau();
    // The first and the last frame are the scale and have no error.
    let tau = (1..positions_mm.len() - 1)
        .map(|frame| {
            let found = stage_axis.tau[frame].unwrap();
            (found.tau - truth.values()[frame]) / found.sigma
        })
        .collect();
    let positioning = positioning_error(&stage_axis.tau, &positions_mm).unwrap();
    let last = positions_mm[positions_mm.len() - 1];
    let true_baseline_mm = simulator.true_position_mm(last) - simulator.true_position_mm(positions_mm[0]);

    let Optics { rows, columns, .. } = config.optics;
    let lens = &stage_axis.lens;
    let mapping = Mapping::fitting(lens.lens, direction.roll_rad, direction.pan_rad, rows, columns).unwrap();
    let measured: Vec<f64> = positioning.frames.iter().map(|frame| frame.measured_mm).collect();
    let rectifier = Rectifier::new(mapping, Correction::default()).unwrap();
    let mut volume = rectifier.volume(8, Tau::from_positions(&measured).unwrap());
    rectifier.insert(&mut volume, 0, &frames).unwrap();
    let options = MatchOptions { reference: ReferenceFrame::Middle, ..MatchOptions::default() };
    let maps = match_volume(&volume, &options, &Silent).unwrap();
    let halves = match_halves(&volume, maps.reference, &options, &Silent).unwrap();

    // The field between the bands, as a person would cut it out.
    let camera = mapping.camera;
    let seen = places(&simulator, maps.reference, (camera.rows, camera.columns), |x, y| camera.ray(x, y));
    let inside = |x: usize, y: usize| {
        seen.at(x, y).is_some_and(|Place { u_mm, v_mm, .. }| u_mm.abs() < 26.0 && v_mm.abs() < 11.5)
    };
    let columns = (0..camera.columns).filter(|&x| (0..camera.rows).any(|y| inside(x, y)));
    let rows = (0..camera.rows).filter(|&y| (0..camera.columns).any(|x| inside(x, y)));
    let (columns, rows): (Vec<usize>, Vec<usize>) = (columns.collect(), rows.collect());
    let (left, top) = (columns[0], rows[0]);
    let cut = |map: &Grid<f32>| map.cropped(left..left + columns.len(), top..top + rows.len());
    let point = (camera.principal_point_x_px - left as f64, camera.principal_point_y_px - top as f64);
    let geometry =
        Geometry::exact(camera.focal_length_px, positioning.baseline_mm, point).with_scale(ScaleSigma {
            focal_length: Some(lens.sigma()[0] / lens.lens.focal_length_x_px),
            baseline: Some(positioning.baseline_sigma_mm / positioning.baseline_mm),
        });
    let heights = heights(geometry, &cut(&maps.disparity), &cut(&maps.sigma)).unwrap();
    // As `surface` takes them.
    let steps =
        StepsOptions::for_window(TrendKind::Quadric, EQUAL_DISCS_PX).with_grown_window(GROWN_DISCS_PX);
    let halves = halves.map(|half| heights.of_half(&half.map(cut)));
    let Steps { depth, budget, .. } = find_steps(&heights, Some(&halves), &steps).unwrap();
    let freedom = depth.degrees_of_freedom.unwrap();
    let wider = (freedom / (freedom - 2.0)).sqrt();
    let depth_sigma_mm = depth.scale_sigma_mm.hypot(wider * depth.sigma_mm.unwrap());
    let combined = budget.combined.unwrap();
    Normalised {
        roll: (direction.roll_rad - config.optics.roll_rad) / stage_axis.roll_sigma_rad,
        pan: (direction.pan_rad - config.optics.pan_rad) / stage_axis.pan_sigma_rad,
        tau,
        baseline: (positioning.baseline_mm - true_baseline_mm) / positioning.baseline_sigma_mm,
        depth: (depth.depth_mm - DEPTH_MM) / depth_sigma_mm,
        interval_holds: (depth.depth_mm - DEPTH_MM).abs() <= combined.half_width_95_mm,
        value: Value {
            value_mm: depth.depth_mm,
            sigma_mm: Some(combined.sigma_mm),
            degrees_of_freedom: combined.degrees_of_freedom,
        },
    }
}

/// The true lens, astray as its stated standard deviations say.
fn known_lens(optics: &Optics, seed: u64) -> LensEstimate {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let f = optics.focal_length_px;
    let distortion = Distortion { k1: optics.distortion.k1, ..Distortion::default() };
    let lens =
        Lens { distortion, ..Lens::pinhole(f, optics.principal_point_x_px, optics.principal_point_y_px) };
    let mut sigma = [0.0; Lens::PARAMETERS];
    sigma[..LENS_SIGMA.len()].copy_from_slice(&LENS_SIGMA);
    let mut known = lens.to_array();
    for (value, sigma) in known.iter_mut().zip(sigma) {
        let unit: f64 = StandardNormal.sample(&mut random);
        *value += sigma * unit;
    }
    LensEstimate::independent(optics.rows, optics.columns, Lens::from_array(known), sigma)
}

#[test]
#[ignore = "takes minutes; `.ci/run` runs it"]
fn errors_scatter_as_stated() {
    let count = repetitions(RIGS);
    let rigs: Vec<Normalised> = (1..=count as u64).into_par_iter().map(one_rig).collect();
    let of = |value: &dyn Fn(&Normalised) -> f64| rigs.iter().map(value).collect::<Vec<f64>>();
    let tau: Vec<f64> = rigs.iter().flat_map(|rig| rig.tau.iter().copied()).collect();
    let all = [
        ("roll", of(&|rig| rig.roll)),
        ("pan", of(&|rig| rig.pan)),
        ("tau", tau),
        ("baseline", of(&|rig| rig.baseline)),
        ("depth", of(&|rig| rig.depth)),
    ];
    for (name, errors) in &all {
        let (mean, spread) = statistics(errors);
        println!("{name}: spread {spread:.3}, mean {mean:+.3}");
    }
    let held = rigs.iter().filter(|rig| rig.interval_holds).count() as f64 / rigs.len() as f64;
    println!("depth: {:.1} % of the 95 % intervals hold", 100.0 * held);
    // What is counted is known in proportion to the root of the number.
    let wider = (RIGS as f64 / count as f64).sqrt();
    for (name, errors) in &all {
        let (mean, spread) = statistics(errors);
        // The spread of 200 normal numbers is known to 5 %, their mean to 0.07.
        assert!((spread - 1.0).abs() < 0.2 * wider, "{name}: {spread}");
        assert!(mean.abs() < 0.3 * wider, "{name}: {mean}");
    }
    // The share of 200 intervals is known to 1.5 %.
    assert!((0.95 - 0.05 * wider..=0.95 + 0.04 * wider).contains(&held), "{held}");
    for risk in [0.05, 0.2] {
        let shares = wrong_verdicts(&rigs, risk);
        println!(
            "risk {risk}: {:.1} % pass wrongly, {:.1} % fail wrongly",
            100.0 * shares[0],
            100.0 * shares[1]
        );
        // Four standard deviations of a count of which each is wrong with this probability.
        let bound = risk + 4.0 * (risk * (1.0 - risk) / count as f64).sqrt();
        assert!(shares.iter().all(|&share| share <= bound), "risk {risk}: {shares:?}");
        // Nor are intervals so wide that nothing is decided: twice the risk is expected. Of the 50 rigs of the short form,
        // at a risk of 5 %, less than an eighth of that is none at all: 1 in 150 by chance.
        assert!(shares[0] + shares[1] >= risk / 4.0, "risk {risk}: {shares:?}");
    }
}

fn statistics(errors: &[f64]) -> (f64, f64) {
    let count = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / count;
    let variance = errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, variance.sqrt())
}
