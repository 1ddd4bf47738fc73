//! Examinations of simulated rigs whose true properties are known.

use std::sync::Arc;
use std::time::Duration;

use super::motion::measure_motion;
use super::repeatability::measure_repeatability;
use super::*;
use crate::capture::CapturePlan;
use crate::profile::{LimitsProfile, PlanProfile};
use epirig_core::progress::Silent;
use epirig_data::sequence::{FocalLength, NominalLens};
use epirig_devices::camera::{Camera, CameraSettings, SimCamera, SimFault, SimView};
use epirig_devices::stage::{
    PositionSettings, SimStage, SimStageConfig, Stage, StageError, StageIdentity, StageState, StopSwitch,
};
use epirig_simulator::{Simulator, SimulatorConfig};

/// 320 px of focal length, 500 mm away: 0.64 px for each mm. Noise of 1.5 DN.
fn simulator(change: impl FnOnce(&mut SimulatorConfig)) -> Arc<Simulator> {
    let mut config = SimulatorConfig::textured_plane(160, 120, 9);
    config.sensor.read_noise_dn = 1.5;
    change(&mut config);
    Arc::new(Simulator::new(config).unwrap())
}

const PX_PER_MM: f64 = 320.0 / 500.0;

/// 41 frames, 1.47 mm apart: 0.9408 px.
fn scan() -> CapturePlan {
    let positions_mm = (0..41).map(|index| 10.0 + 1.47 * f64::from(index)).collect();
    let lens = NominalLens { focal_length: FocalLength::ImageWidths(2.0), principal_point_px: None };
    let limits = LimitsProfile { saturated: 0.001, ..LimitsProfile::default() };
    CapturePlan {
        section: PlanProfile { settle: Duration::from_millis(50), ..PlanProfile::default() },
        lens: Some(lens),
        limits,
        ..CapturePlan::at(positions_mm)
    }
}

fn plan() -> DoctorPlan {
    DoctorPlan {
        scan: scan(),
        distance_mm: Some(500.0),
        relief_mm: Some(5.0),
        mains_hz: Some(50.0),
        free_bytes: Some(1 << 30),
        short: false,
    }
}

fn examined(simulator: &Arc<Simulator>, stage: SimStageConfig, plan: &DoctorPlan) -> Report {
    let mut stage = SimStage::new(stage);
    let mut camera = SimCamera::before_simulator(Arc::clone(simulator), stage.watch());
    examine(&mut stage, &mut camera, plan, &Silent).unwrap()
}

fn check<'a>(report: &'a Report, name: &str) -> &'a Check {
    report.checks.iter().find(|check| check.name == name).unwrap_or_else(|| panic!("no {name}: {report:?}"))
}

#[test]
fn a_good_rig_is_found_good_and_its_numbers_true() {
    let report = examined(&simulator(|_| ()), SimStageConfig::ideal(200.0), &plan());
    for check in &report.checks {
        assert_eq!(check.verdict, Verdict::Good, "{check:?}");
    }
    assert_eq!(report.verdict(), Verdict::Good);
    let motion = report.motion.unwrap();
    assert!((motion.x_px_per_mm / PX_PER_MM - 1.0).abs() < 0.01, "{motion:?}");
    assert!(motion.angle_rad().abs() < 0.005, "{motion:?}");
    // The simulated stage does not swing: the first frame is as good as any.
    assert!(report.settling.unwrap().settle <= Duration::from_millis(80), "{report:?}");
    let predicted = report.predicted.unwrap();
    assert!((predicted.disparity_px / (PX_PER_MM * 58.8) - 1.0).abs() < 0.01, "{predicted:?}");
    assert!(serde_json::to_string(&report).unwrap().contains("\"resolution\":\"resolved\""));
}

#[test]
fn a_camera_that_takes_an_exposure_and_does_not_follow_it_is_found() {
    let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
    let mut camera = SimCamera::before_simulator(simulator(|_| ()), stage.watch());
    camera.device().inject(SimFault::Deaf);
    let report = examine(&mut stage, &mut camera, &plan(), &Silent).unwrap();
    let found = check(&report, "exposure control");
    assert_eq!(found.verdict, Verdict::Warning, "{found:?}");
    assert!(found.advice.as_ref().unwrap().contains("exposure_time_absolute does nothing"), "{found:?}");
    let obeying = examined(&simulator(|_| ()), SimStageConfig::ideal(200.0), &plan());
    let found = check(&obeying, "exposure control");
    assert_eq!(found.verdict, Verdict::Good, "{found:?}");
    // The simulated camera is linear: half of the time, half of the light.
    assert!(found.finding.starts_with("with 5000 us instead of 10000 us"), "{found:?}");
}

#[test]
fn an_exposure_that_the_camera_rounds_is_a_warning_and_stays_as_it_was() {
    let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
    let mut camera = SimCamera::before_simulator(simulator(|_| ()), stage.watch());
    // 100 is a multiple of 20, its half is none.
    camera.device().inject(SimFault::CoarseExposure(20));
    let report = examine(&mut stage, &mut camera, &plan(), &Silent).unwrap();
    let found = check(&report, "exposure control");
    assert_eq!(found.verdict, Verdict::Warning, "{found:?}");
    let finding = "asked for exposure_time_absolute = 50, the camera silently took 60";
    assert_eq!(found.finding, finding);
    assert_eq!(value(&mut camera, "exposure_time_absolute"), Some(100));
}

/// The plan with a gain set.
fn with_gain(gain: i64) -> DoctorPlan {
    let controls = vec![("gain".to_owned(), gain.to_string())];
    let camera = CameraSettings { exposure_us: Some(5000.0), controls, ..CameraSettings::default() };
    DoctorPlan { short: true, scan: CapturePlan { camera, ..scan() }, ..plan() }
}

fn value(camera: &mut SimCamera, name: &str) -> Option<i64> {
    camera.controls().unwrap().iter().find(|control| control.name == name).unwrap().value
}

#[test]
fn a_gain_that_does_nothing_is_found() {
    // The simulated gain is in hundredths above 1, up to 100.
    for (gain, words) in
        [(20, "with gain = 100 instead of gain = 20"), (60, "with gain = 0 instead of gain = 60")]
    {
        for deaf in [false, true] {
            let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
            let mut camera = SimCamera::before_simulator(simulator(|_| ()), stage.watch());
            if deaf {
                camera.device().inject(SimFault::Deaf);
            }
            let report = examine(&mut stage, &mut camera, &with_gain(gain), &Silent).unwrap();
            let found = check(&report, "gain control");
            assert!(found.finding.starts_with(words), "{found:?}");
            let wanted = if deaf { Verdict::Warning } else { Verdict::Good };
            assert_eq!(found.verdict, wanted, "{found:?}");
            assert_eq!(value(&mut camera, "gain"), Some(gain));
        }
    }
    // A gain that the plan leaves alone is not tried.
    let report = examined(&simulator(|_| ()), SimStageConfig::ideal(200.0), &plan());
    assert!(report.checks.iter().all(|check| check.name != "gain control"), "{report:?}");
}

#[test]
fn a_white_picture_tells_nothing_of_the_gain() {
    let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
    let mut camera = SimCamera::before_simulator(simulator(|_| ()), stage.watch());
    camera.device().view().put(SimView::Flat);
    let mut bright = with_gain(40);
    bright.scan.camera.exposure_us = Some(20_000.0);
    let report = examine(&mut stage, &mut camera, &bright, &Silent).unwrap();
    let found = check(&report, "gain control");
    assert_eq!(found.verdict, Verdict::Unknown, "{found:?}");
}

#[test]
fn a_gain_that_gives_no_picture_is_put_back_and_the_camera_goes_on() {
    let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
    stage.home().unwrap();
    let mut camera = SimCamera::before_simulator(simulator(|_| ()), stage.watch());
    let plan = with_gain(20);
    camera.configure(&plan.scan.camera).unwrap();
    camera.start().unwrap();
    // A start tries four times, and is itself tried four times.
    (0..16).for_each(|_| camera.device().inject(SimFault::StartError));
    let checks = response::gain_responses(&mut camera, &plan.scan.camera).unwrap();
    assert_eq!(checks[0].verdict, Verdict::Unknown, "{checks:?}");
    assert_eq!(value(&mut camera, "gain"), Some(20));
    let moment = camera.now();
    camera.grab_after(moment).unwrap();
}

#[test]
fn the_scatter_of_a_stage_is_found() {
    // 0.2 mm are 0.128 px, ten times the noise of a shift.
    let sigma_um = 200.0;
    let noisy = |seed| SimStageConfig { position_noise_um: sigma_um, seed, ..SimStageConfig::ideal(200.0) };
    let simulator = simulator(|config| config.sensor.read_noise_dn = 0.5);
    let mut squares = 0.0;
    const RUNS: u32 = 8;
    for seed in 0..RUNS {
        let mut stage = SimStage::new(noisy(seed.into()));
        let mut camera = SimCamera::before_simulator(Arc::clone(&simulator), stage.watch());
        camera.configure(&plan().scan.camera).unwrap();
        stage.home().unwrap();
        camera.start().unwrap();
        let found =
            measure_repeatability(&mut stage, &mut camera, Duration::ZERO, [20.0, 2.0], [PX_PER_MM, 0.0], 20)
                .unwrap();
        squares += found.sigma_um.powi(2);
    }
    // 8 x 18 degrees of freedom tell a deviation to 1 / sqrt(2 * 144) = 6 %; three of those.
    let found_um = (squares / f64::from(RUNS)).sqrt();
    assert!((found_um / sigma_um - 1.0).abs() < 0.18, "{found_um}");
    // A relief of 5 mm makes 0.376 px, whose third 0.128 px pass in few series of five returns only.
    let small = DoctorPlan { relief_mm: Some(1.0), ..plan() };
    let report = examined(&simulator, noisy(3), &small);
    assert_eq!(check(&report, "repeatability").verdict, Verdict::Warning, "{report:?}");
}

#[test]
fn backlash_is_found_and_gone_with_an_approach_from_one_side() {
    let slack = SimStageConfig { backlash_um: 300.0, ..SimStageConfig::ideal(200.0) };
    let simulator = simulator(|_| ());
    let report = examined(&simulator, slack.clone(), &plan());
    let found = report.repeatability.unwrap();
    assert!((found.reversal_um - 300.0).abs() < 30.0, "{found:?}");
    assert!(found.sigma_um < 30.0, "{found:?}");
    let mut stage = SimStage::new(slack).approaching_by(1.0);
    let mut camera = SimCamera::before_simulator(simulator, stage.watch());
    let report = examine(&mut stage, &mut camera, &plan(), &Silent).unwrap();
    assert!(report.repeatability.unwrap().reversal_um.abs() < 30.0);
    // 10 mm leave room for an approach, 0.5 mm do not.
    let low = DoctorPlan { scan: CapturePlan { positions_mm: vec![0.5, 3.0, 6.0], ..scan() }, ..plan() };
    let report = examine(&mut stage, &mut camera, &low, &Silent).unwrap();
    assert_eq!(check(&report, "approach").verdict, Verdict::Bad);
    assert!(report.motion.is_none());
}

#[test]
fn too_much_light_too_little_and_none_are_told() {
    let ideal = || SimStageConfig::ideal(200.0);
    let bright = DoctorPlan {
        short: true,
        scan: CapturePlan {
            camera: CameraSettings {
                controls: vec![("gain".to_owned(), "100".to_owned())],
                ..CameraSettings::default()
            },
            ..scan()
        },
        ..plan()
    };
    let report = examined(&simulator(|_| ()), ideal(), &bright);
    assert_eq!(check(&report, "saturation").verdict, Verdict::Bad, "{report:?}");
    assert!(report.settling.is_none() && report.repeatability.is_none(), "the short form moves little");
    let dimmed = |exposure_us| DoctorPlan {
        short: true,
        scan: CapturePlan {
            camera: CameraSettings { exposure_us: Some(exposure_us), ..CameraSettings::default() },
            ..scan()
        },
        ..plan()
    };
    let silent = simulator(|config| config.sensor.read_noise_dn = 0.0);
    let report = examined(&silent, ideal(), &dimmed(2000.0));
    assert_eq!(check(&report, "brightness").verdict, Verdict::Warning, "{report:?}");
    assert_eq!(check(&report, "exposure").verdict, Verdict::Warning, "{report:?}");
    let report = examined(&silent, ideal(), &dimmed(500.0));
    assert_eq!(check(&report, "brightness").verdict, Verdict::Bad, "{report:?}");
    // With nothing but noise, no two frames agree.
    let report = examined(&simulator(|config| config.sensor.read_noise_dn = 5.0), ideal(), &dimmed(1000.0));
    assert_eq!(check(&report, "steadiness").verdict, Verdict::Bad, "{report:?}");
}

#[test]
fn a_picture_that_does_not_move_is_bad() {
    let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
    let mut other = SimStage::new(SimStageConfig::ideal(200.0));
    other.home().unwrap();
    // The camera looks at another stage.
    let mut camera = SimCamera::before_simulator(simulator(|_| ()), other.watch());
    let report = examine(&mut stage, &mut camera, &plan(), &Silent).unwrap();
    assert_eq!(check(&report, "motion").verdict, Verdict::Bad, "{report:?}");
    assert_eq!(report.verdict(), Verdict::Bad);
}

/// A stage that makes only a part of each move, but reports all of it.
struct Slipping {
    inner: SimStage,
    share: f64,
}

impl Stage for Slipping {
    fn identity(&self) -> StageIdentity {
        self.inner.identity()
    }

    fn travel_mm(&self) -> f64 {
        self.inner.travel_mm()
    }

    fn position_settings(&mut self) -> Result<PositionSettings, StageError> {
        self.inner.position_settings()
    }

    fn home(&mut self) -> Result<(), StageError> {
        self.inner.home()
    }

    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError> {
        self.inner.move_to(self.share * position_mm)
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        self.inner.state()
    }

    fn stop(&mut self) -> Result<(), StageError> {
        self.inner.stop()
    }

    fn stop_switch(&self) -> StopSwitch {
        self.inner.stop_switch()
    }
}

#[test]
fn a_stage_that_drifts_or_stalls_is_bad_however_clearly_the_picture_shows_it() {
    // The longest move is 58.8 mm = 37.6 px: of it 0.03 px are drift, and 15 px are less than half.
    for (share, words) in [(0.0008, "does not move"), (0.4, "lens and distance give 0.640 px/mm")] {
        let mut stage = Slipping { inner: SimStage::new(SimStageConfig::ideal(200.0)), share };
        let mut camera = SimCamera::before_simulator(
            simulator(|config| config.sensor.read_noise_dn = 0.0),
            stage.inner.watch(),
        );
        let report = examine(&mut stage, &mut camera, &plan(), &Silent).unwrap();
        let motion = check(&report, "motion");
        assert!(motion.verdict == Verdict::Bad && motion.finding.contains(words), "{motion:?}");
    }
}

#[test]
fn wrong_geometry_and_repeated_phases_are_told() {
    let short = DoctorPlan { short: true, ..plan() };
    let wrong = DoctorPlan { distance_mm: Some(600.0), ..short.clone() };
    let report = examined(&simulator(|_| ()), SimStageConfig::ideal(200.0), &wrong);
    assert_eq!(check(&report, "motion").verdict, Verdict::Warning, "{report:?}");
    // 1.5625 mm are 1 px.
    let positions_mm = (0..41).map(|index| 10.0 + 1.5625 * f64::from(index)).collect();
    let repeating = DoctorPlan { scan: CapturePlan { positions_mm, ..scan() }, ..short };
    let report = examined(&simulator(|_| ()), SimStageConfig::ideal(200.0), &repeating);
    let sampling = check(&report, "sampling");
    assert_eq!(sampling.verdict, Verdict::Warning, "{sampling:?}");
    assert!(sampling.advice.as_ref().unwrap().starts_with("step by 1."), "{sampling:?}");
}

#[test]
fn a_plan_beyond_the_travel_or_the_disk_is_bad_and_the_rest_is_told_all_the_same() {
    let far = DoctorPlan {
        free_bytes: Some(1000),
        scan: CapturePlan { lens: None, ..scan() },
        distance_mm: None,
        ..plan()
    };
    let report = examined(&simulator(|_| ()), SimStageConfig::ideal(50.0), &far);
    assert_eq!(check(&report, "travel").verdict, Verdict::Bad);
    assert_eq!(check(&report, "disk").verdict, Verdict::Bad);
    assert_eq!(check(&report, "height").verdict, Verdict::Unknown);
    assert!(check(&report, "disk").finding.starts_with("the sequence takes 1.1 MB at most"), "{report:?}");
    let single = DoctorPlan { scan: CapturePlan { positions_mm: vec![3.0], ..scan() }, ..plan() };
    let mut stage = SimStage::new(SimStageConfig::ideal(50.0));
    let mut camera = SimCamera::before_simulator(simulator(|_| ()), stage.watch());
    let error = examine(&mut stage, &mut camera, &single, &Silent).unwrap_err();
    assert!(matches!(error, DoctorError::EmptyPlan(1)));
    camera.device().inject(SimFault::Disconnect { failing: 1 });
    assert!(matches!(examine(&mut stage, &mut camera, &plan(), &Silent), Err(DoctorError::Camera(_))));
}

#[test]
fn steps_too_long_or_too_short_to_see_are_changed_until_they_can_be_seen() {
    let simulator = simulator(|_| ());
    for (step_mm, expected_mm) in [(100.0, 25.0), (0.2, 12.8), (10.0, 10.0)] {
        let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
        let mut camera = SimCamera::before_simulator(Arc::clone(&simulator), stage.watch());
        camera.configure(&plan().scan.camera).unwrap();
        stage.home().unwrap();
        stage.move_to(10.0).unwrap();
        camera.start().unwrap();
        let found = measure_motion(&mut stage, &mut camera, Duration::ZERO, [10.0, 150.0], step_mm).unwrap();
        assert_eq!(found.move_mm, expected_mm);
        // Five sigma, and 0.005 px of interpolation.
        let bound = 5.0 * found.sigma_px_per_mm + 0.005 / found.move_mm;
        assert!((found.x_px_per_mm - PX_PER_MM).abs() < bound, "{found:?}");
    }
}

#[test]
fn frames_that_a_camera_spoils_change_no_number() {
    let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
    let mut camera = SimCamera::before_simulator(simulator(|_| ()), stage.watch());
    // Damaged, late and torn frames are the camera's own business; what is left is right.
    for fault in [SimFault::BufferError, SimFault::TornFrame, SimFault::LateContents] {
        camera.device().inject(fault);
    }
    let report = examine(&mut stage, &mut camera, &plan(), &Silent).unwrap();
    assert!((report.motion.unwrap().x_px_per_mm / PX_PER_MM - 1.0).abs() < 0.01, "{report:?}");
}
