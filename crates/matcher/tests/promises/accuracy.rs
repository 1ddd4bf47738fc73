//! The disparity is as accurate as stated, whatever the order of frames, the stage axis and the bit depth.

use crate::of_first_frame;
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_matcher::evaluate::{TruthReport, compare_with_truth};
use epirig_matcher::{
    DisparityMaps, DisparityRange, Interpolation, MatchOptions, Method, OrderingConstraint, OrderingUsed,
    ReferenceFrame, Validity, match_volume,
};
use epirig_simulator::{Carried, Scene, Simulator, SimulatorConfig};

fn evaluate(simulator: &Simulator, volume: &Volume, options: &MatchOptions) -> (DisparityMaps, TruthReport) {
    let maps = match_volume(volume, options, &Silent).unwrap();
    let truth = simulator.truth(maps.reference).unwrap();
    let tau = volume.tau().values()[maps.reference];
    let report =
        compare_with_truth(&maps.disparity, Some(&maps.sigma), &truth.disparity, (tau, 1.0 - tau)).unwrap();
    (maps, report)
}

fn measure(config: SimulatorConfig, options: &MatchOptions) -> (DisparityMaps, TruthReport) {
    let simulator = Simulator::new(config).unwrap();
    let volume = simulator.render_volume(&Silent).unwrap();
    evaluate(&simulator, &volume, options)
}

/// The paper's section 5.1: 512 x 512 x 100, variance and dynamic programming, mean error 0.04 px, largest
/// 0.13 px.
#[test]
fn the_papers_synthetic_experiment_reaches_the_papers_figures() {
    let options = MatchOptions {
        method: Method::Variance,
        ordering_constraint: OrderingConstraint::On,
        reference: ReferenceFrame::First,
        ..MatchOptions::default()
    };
    let (maps, report) = measure(SimulatorConfig::cube_edge(512, 100), &options);
    let errors = report.in_both_end_frames;
    println!("{errors:?}");
    assert_eq!(maps.ordering, OrderingUsed::On);
    assert_eq!(errors.answered, errors.pixels, "every pixel that both end frames see has an answer");
    assert!(errors.mean_px <= 0.04 && errors.maximum_px <= 0.13, "{errors:?}");
}

#[test]
fn every_method_and_interpolation_measures_a_plane() {
    // Bounds: a disparity step of 0.25 px with a parabola leaves some hundredths; linear interpolation biases
    // by up to 0.044 px.
    for (method, interpolation, fit, bound) in [
        (Method::Variance, Interpolation::BSpline, true, 0.01),
        (Method::Variance, Interpolation::BSpline, false, 0.04),
        (Method::Variance, Interpolation::Cubic, false, 0.05),
        (Method::Variance, Interpolation::Linear, false, 0.1),
        (Method::NccFirst, Interpolation::BSpline, false, 0.03),
        (Method::NccMean, Interpolation::Cubic, false, 0.03),
    ] {
        let options = MatchOptions { fit, interpolation, ..MatchOptions::for_method(method) };
        let (_, report) = measure(SimulatorConfig::textured_plane(128, 48, 17), &options);
        let errors = report.in_both_end_frames;
        assert!(errors.median_px < bound, "{method:?} {interpolation:?} {fit}: {errors:?}");
        // A window of 7 that is the model must lie inside the image: 3 of the 120 columns have none.
        let share = if method == Method::NccFirst { 0.97 } else { 0.98 };
        assert!(errors.answered as f64 > share * errors.pixels as f64, "{method:?}: {errors:?}");
    }
}

#[test]
fn any_reference_frame_and_direction_give_the_same_accuracy() {
    for (carried, reference) in [
        (Carried::Scene, ReferenceFrame::Middle),
        (Carried::Scene, ReferenceFrame::Last),
        (Carried::Camera, ReferenceFrame::First),
        (Carried::Camera, ReferenceFrame::Index(5)),
    ] {
        let mut config = SimulatorConfig::textured_plane(128, 48, 17);
        config.carried = carried;
        config.scene = Scene::Plane { distance_mm: 500.0, slope_x: 0.3, slope_y: 0.2 };
        config.sensor.bit_depth = 12;
        let options = MatchOptions { reference, ..MatchOptions::default() };
        let (maps, report) = measure(config, &options);
        let errors = report.in_both_end_frames;
        assert!(errors.mean_px < 0.01, "{carried:?} {reference:?}: {errors:?}");
        let negative = maps.disparity.values().iter().filter(|value| **value < 0.0).count();
        assert_eq!(negative > 0, carried == Carried::Camera);
    }
}

#[test]
fn positions_that_are_not_equidistant_are_used() {
    let simulator = Simulator::new(SimulatorConfig::textured_plane(128, 48, 17)).unwrap();
    let scan = simulator.config().scan;
    let length = scan.step_mm * 16.0;
    // Steps that grow: the middle frame lies at a quarter of the baseline.
    let positions: Vec<f64> =
        (0..17).map(|t| scan.start_mm + length * (f64::from(t) / 16.0).powi(2)).collect();
    let render = |tau: Tau| {
        let mut volume = Volume::new(48, 128, 8, tau);
        for (index, &position) in positions.iter().enumerate() {
            volume.insert(index, &simulator.expose(position, index as u32)).unwrap();
        }
        volume
    };
    let (_, right) =
        evaluate(&simulator, &render(Tau::from_positions(&positions).unwrap()), &MatchOptions::default());
    assert!(right.in_both_end_frames.mean_px < 0.01, "{right:?}");
    let wrong = match_volume(&render(Tau::equidistant(17).unwrap()), &MatchOptions::default(), &Silent);
    let truth = simulator.truth(8).unwrap();
    let error = wrong.map_or(f64::INFINITY, |maps| {
        compare_with_truth(&maps.disparity, None, &truth.disparity, (0.5, 0.5)).unwrap().all.mean_px
    });
    assert!(error > 5.0 * right.in_both_end_frames.mean_px, "equidistant tau would have done: {error}");
}

/// For noise s the sigma of a window's disparity is known (Cramer-Rao); that of the errors must not exceed it
/// by more than the stated sigma says.
#[test]
fn the_stated_sigma_holds_on_a_noisy_plane() {
    let mut config = SimulatorConfig::textured_plane(200, 120, 41);
    config.scene = Scene::Plane { distance_mm: 500.0, slope_x: 0.2, slope_y: 0.1 };
    config.sensor.read_noise_dn = 2.0;
    // Larger discs than those of 164 px would leave a handful of independent answers.
    let (_, report) =
        measure(config, &MatchOptions { wanted_sigma_px: Some(0.02), ..MatchOptions::default() });
    let errors = report.in_both_end_frames;
    println!("{errors:?}");
    // Discs share observations, so that 24000 pixels are some 150 independent ones, of 164 px each:
    // +-4 %, and as much for the model.
    assert!((0.62..=0.74).contains(&errors.within_1_sigma), "{errors:?}");
    assert!((0.91..=0.98).contains(&errors.within_2_sigma), "{errors:?}");
}

#[test]
fn what_cannot_be_answered_is_not_answered() {
    // A tile on a dark, featureless ground: the ground has no answer, nor has what leaves the image.
    let (maps, report) = measure(SimulatorConfig::tile(256, 41), &MatchOptions::default());
    let simulator = Simulator::new(SimulatorConfig::tile(256, 41)).unwrap();
    let truth = simulator.truth(maps.reference).unwrap();
    let mut invented = 0;
    for y in 0..256_usize {
        for x in 0..256_usize {
            let near_tile = (y.saturating_sub(8)..(y + 9).min(256))
                .any(|v| (x.saturating_sub(8)..(x + 9).min(256)).any(|u| !truth.disparity.at(u, v).is_nan()));
            invented += usize::from(!near_tile && maps.validity.at(x, y) == Validity::Found);
            assert_eq!(maps.validity.at(x, y) == Validity::Found, !maps.disparity.at(x, y).is_nan());
            assert_eq!(maps.disparity.at(x, y).is_nan(), maps.sigma.at(x, y).is_nan());
        }
    }
    assert_eq!(invented, 0, "answers farther from the tile than the largest window reaches");
    assert!(report.all.answered as f64 > 0.99 * report.all.pixels as f64, "{report:?}");

    let options = MatchOptions {
        range: Some(DisparityRange { minimum_px: 30.0, maximum_px: 60.0 }),
        min_visible: 1.0,
        ..of_first_frame()
    };
    let mut config = SimulatorConfig::textured_plane(128, 32, 9);
    config.scan.step_mm *= 5.0;
    let (maps, _) = measure(config, &options);
    // 40 px of disparity: the last 40 columns leave the image. At half the resolution, two more go
    // with the border of either end.
    let first_lost = (0..128).find(|&x| maps.validity.at(x, 16) == Validity::LeavesImage).unwrap();
    assert!((84..=90).contains(&first_lost), "{first_lost}");
    assert!((first_lost..128).all(|x| maps.disparity.at(x, 16).is_nan()));
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let simulator = Simulator::new(SimulatorConfig::cube_edge(96, 15)).unwrap();
    let volume = simulator.render_volume(&Silent).unwrap();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| match_volume(&volume, &MatchOptions::default(), &Silent).unwrap())
    };
    let bits = |maps: DisparityMaps| -> Vec<u32> {
        maps.disparity.values().iter().chain(maps.sigma.values()).map(|value| value.to_bits()).collect()
    };
    assert_eq!(bits(on(1)), bits(on(3)));
}

#[test]
fn slanted_surfaces_are_measured_as_well_as_upright_ones() {
    for slope_x in [-0.6, 0.6] {
        let mut config = SimulatorConfig::textured_plane(160, 64, 25);
        // Disparity 40 px over 500 mm of distance: a slope of 0.6 changes it by some 0.1 px per px and more.
        config.scan.step_mm *= 5.0;
        config.scene = Scene::Plane { distance_mm: 500.0, slope_x, slope_y: 0.0 };
        let (_, report) = measure(config, &MatchOptions::default());
        let errors = report.in_both_end_frames;
        assert!(errors.mean_px < 0.01 && errors.percentile_99_px < 0.05, "{slope_x}: {errors:?}");
    }
}

#[test]
fn noise_is_not_taken_for_texture() {
    let mut config = SimulatorConfig::textured_plane(160, 64, 20);
    config.texture.grain_mm = 1e6;
    config.sensor.read_noise_dn = 20.0;
    for ordering in [OrderingConstraint::On, OrderingConstraint::Off] {
        let range = Some(DisparityRange { minimum_px: 0.0, maximum_px: 16.0 });
        let (maps, _) = measure(
            config.clone(),
            &MatchOptions { ordering_constraint: ordering, range, ..MatchOptions::default() },
        );
        // The gate stands at four times what noise alone gives, and each pixel has picked the best of 65
        // candidates.
        assert!(maps.share(Validity::Found) < 0.01, "{ordering:?}: {}", maps.share(Validity::Found));
    }
}

#[test]
fn a_thing_in_front_of_another_is_noticed() {
    // Two planes, 20 and 60 px of disparity, the nearer one a strip of 60 px in images of 400 px.
    let plane = |disparity: f64, seed| {
        let mut config = SimulatorConfig::textured_plane(400, 48, 21);
        config.scan.step_mm *= disparity / 8.0;
        config.texture.seed = seed;
        Simulator::new(config).unwrap()
    };
    let (far, near) = (plane(20.0, 1), plane(60.0, 2));
    let mut volume = Volume::new(48, 400, 8, Tau::equidistant(21).unwrap());
    for index in 0..21_usize {
        let frame =
            |simulator: &Simulator| simulator.expose(simulator.config().scan.positions_mm()[index], 0);
        let (far, near) = (frame(&far), frame(&near));
        let (mut background, mut samples) = (vec![0.0; 400 * 48], vec![0.0; 400 * 48]);
        far.samples().copy_to_f32(0, &mut background);
        near.samples().copy_to_f32(0, &mut samples);
        // In the middle frame the strip covers columns 170 to 229; it moves by 3 px a frame.
        let left = 170 + 3 * index - 30;
        let value = |(place, &far): (usize, &f32)| {
            let x = place % 400;
            if (left..left + 60).contains(&x) { samples[place] as u8 } else { far as u8 }
        };
        let bytes = background.iter().enumerate().map(value).collect();
        volume.insert(index, &Frame::new(48, 400, 8, Samples::U8(bytes)).unwrap()).unwrap();
    }
    let options = MatchOptions { reference: ReferenceFrame::Middle, ..MatchOptions::default() };
    let maps = match_volume(&volume, &options, &Silent).unwrap();
    assert_eq!(maps.ordering, OrderingUsed::Off);
    // Away from the strip's edges by the reach of the windows.
    for (columns, disparity) in [(20..165, 20.0), (175..225, 60.0), (235..380, 20.0)] {
        let values: Vec<f32> =
            (4..44).flat_map(|y| maps.disparity.row(y)[columns.clone()].to_vec()).collect();
        let right = values.iter().filter(|value| (**value - disparity).abs() < 0.1).count();
        let wrong = values.iter().filter(|value| (**value - disparity).abs() > 1.0).count();
        assert!(right as f64 > 0.95 * values.len() as f64, "{columns:?}: {right} of {}", values.len());
        assert!(wrong as f64 <= 0.01 * values.len() as f64, "{columns:?}: {wrong} wrong");
    }
}
