//! Reading of profiles, and refusals.

mod messages;
mod record;

use std::time::Duration;

use proptest::prelude::*;

use super::schema::stage::drivers_with;
use super::schema::{SECTIONS, Section};
use super::*;
use epirig_calibration::lens::Distortion;
use epirig_calibration::target::{ChessBoard, Target};
use epirig_core::settings::{Key, Setting, Settings};
use epirig_devices::camera::Size;
use epirig_devices::camera::pixels::BayerUse;
use epirig_devices::faults::RigFaults;
use epirig_devices::stage::Driver;
use epirig_surface::conformity::{DecisionRule, Tolerance};

fn set(settings: &[&str]) -> Vec<Override> {
    settings.iter().map(|text| Override::parse(text, "--set").unwrap()).collect()
}

fn read(text: &str) -> Profile {
    Profile::read(text, "rig.toml", &[]).unwrap()
}

#[test]
fn the_simulated_rig_is_the_papers() {
    let profile = Profile::read(SIM, "sim.toml", &[]).unwrap();
    let stage = &profile.stage;
    assert_eq!(stage.driver.name(), "sim");
    for (name, number) in [("travel", 200.0), ("velocity", 5.0), ("acceleration", 20.0)] {
        assert_eq!(stage.settings.get(name), Some(&Setting::Number(number)), "{name}");
    }
    assert_eq!(profile.camera.device.as_deref(), Some("sim"));
    assert_eq!(profile.camera.size, Some(Size { columns: 1024, rows: 1024 }));
    assert_eq!(profile.plan.settle, Duration::from_millis(200));
    let positions_mm = profile.plan.positions_mm().unwrap();
    assert_eq!((positions_mm.len(), positions_mm[0], positions_mm[100]), (101, 10.0, 160.0));
    // 25 mm / (9 mm / 1024) = 2844.4 px.
    let focal_length_px = profile.optics.focal_length_px(1024).unwrap();
    assert!((focal_length_px - 25_600.0 / 9.0).abs() < 1e-9, "{focal_length_px}");
    assert_eq!(profile.optics.distance_mm, Some(900.0));
    assert_eq!(profile.target.relief_mm, Some(0.2));
    assert_eq!(profile.sim, SimProfile { scene: SceneName::Tile, ..SimProfile::default() });
    assert_eq!((profile.target.print(), profile.board.chess_board()), (None, None));
}

#[test]
fn the_real_rig_is_the_simulated_one_with_targets_and_faults() {
    let profile = Profile::read(REAL, "real.toml", &[]).unwrap();
    let square_mm = 7.5;
    let print = Target {
        board: ChessBoard { square_mm, columns: 18, rows: 2 },
        bands: 2,
        // The tile's 150 mm less the squares above the upper first row and the two rows and a square below
        // the lower one.
        band_distance_mm: 150.0 - square_mm - 2.0 * square_mm,
    };
    assert_eq!(profile.target.print(), Some(print));
    assert_eq!(profile.board.chess_board(), Some(ChessBoard { square_mm: 16.0, columns: 9, rows: 6 }));
    let plan = &profile.plan;
    assert_eq!((plan.dark, plan.flat, plan.board), (8, 16, 20));
    let found = &profile.sim;
    let faults = SimProfile {
        noise_dn: found.noise_dn,
        // Degrees x pi / 180.
        roll_rad: 0.7 * std::f64::consts::PI / 180.0,
        pan_rad: 0.4 * std::f64::consts::PI / 180.0,
        k1: -0.02,
        vignetting: 0.18,
        flicker: 0.003,
        drift: 0.0,
        highlight_dn: 0.0,
        step_error_um: 5.0,
        bow_mm: 0.3,
        black_level_dn: 3.0,
        pixel_gains: 0.005,
        hot_pixels: 5,
        scene: SceneName::Tile,
        ..SimProfile::default()
    };
    assert!(
        (found.roll_rad - faults.roll_rad).abs() < 1e-15 && (found.pan_rad - faults.pan_rad).abs() < 1e-15
    );
    assert_eq!(SimProfile { roll_rad: faults.roll_rad, pan_rad: faults.pan_rad, ..found.clone() }, faults);
    // The rest is as with the other one.
    let papers = Profile::read(SIM, "sim.toml", &[]).unwrap();
    let mut rest = profile.sections;
    rest.target = TargetProfile { relief_mm: rest.target.relief_mm, ..TargetProfile::default() };
    (rest.board, rest.sim) = (BoardProfile::default(), papers.sim.clone());
    (rest.plan.dark, rest.plan.flat, rest.plan.board) = (0, 0, 0);
    assert_eq!(rest, papers.sections);
}

#[test]
fn the_papers_rig_says_what_the_paper_says() {
    let profile = read(include_str!("../../../calib/paper-2001.toml"));
    assert_eq!(profile.stage, Profile::of(&[]).unwrap().stage, "the paper says nothing of the stage");
    let positions_mm = profile.plan.positions_mm().unwrap();
    assert_eq!(positions_mm[100] - positions_mm[0], 150.0);
    assert_eq!(profile.optics, Profile::read(SIM, "sim.toml", &[]).unwrap().optics);
    assert_eq!(profile.target.relief_mm, Some(0.2));
}

#[test]
fn what_is_left_out_has_the_promised_defaults() {
    let profile = Profile::of(&[]).unwrap();
    let expected = Sections {
        stage: StageProfile {
            driver: Driver::named("native").unwrap(),
            port: None,
            approach_mm: 0.0,
            tolerance_mm: 0.0,
            settings: Settings::default(),
        },
        camera: CameraProfile {
            device: None,
            format: None,
            size: None,
            rate_hz: None,
            exposure_us: None,
            bayer: None,
            patience: Duration::from_secs(10),
            mains_hz: None,
            controls: Vec::new(),
        },
        plan: PlanProfile {
            start_mm: 0.0,
            step_mm: None,
            frames: None,
            settle: Duration::from_millis(200),
            average: 1,
            dark: 0,
            flat: 0,
            board: 0,
        },
        optics: OpticsProfile {
            focal_length: None,
            focal_length_sigma: 0.02,
            sensor_width_mm: None,
            principal_point_x_px: None,
            principal_point_y_px: None,
            distance_mm: None,
            k1: 0.0,
            k2: 0.0,
            p1: 0.0,
            p2: 0.0,
            k3: 0.0,
        },
        target: TargetProfile {
            relief_mm: None,
            tolerance: Tolerance::default(),
            decision_rule: DecisionRule::GuardedRisk,
            risk: 0.05,
            square_mm: None,
            columns: None,
            rows: None,
            bands: 1,
            band_distance_mm: None,
        },
        board: BoardProfile { square_mm: None, columns: None, rows: None },
        limits: LimitsProfile {
            retakes: 3,
            saturated: 0.01,
            position_mm: 0.02,
            wait: Duration::from_secs(300),
            shift_px: 0.1,
        },
        report: ReportProfile {
            customer: None,
            object: None,
            serial_number: None,
            operator: None,
            place: None,
            temperature: None,
            instrument: None,
            procedure: None,
            logo: None,
        },
        sim: SimProfile {
            scene: SceneName::Plane,
            noise_dn: 0.0,
            seed: 0,
            scan: 0,
            texture_seed: 1,
            real_time: false,
            roll_rad: 0.0,
            pan_rad: 0.0,
            k1: 0.0,
            vignetting: 0.0,
            flicker: 0.0,
            drift: 0.0,
            highlight_dn: 0.0,
            step_error_um: 0.0,
            bow_mm: 0.0,
            black_level_dn: 0.0,
            pixel_gains: 0.0,
            hot_pixels: 0,
            faults: RigFaults::default(),
        },
    };
    assert_eq!(profile.sections, expected);
    assert_eq!((LimitsProfile::default(), PlanProfile::default()), (expected.limits, expected.plan));
}

#[test]
fn every_section_is_read_in_any_spelling() {
    let text = r#"
        [stage]
        driver = "zaber"
        port = "usb:A1"
        device = 2
        microstep_nm = 47.625
        approach = "500 µm"
        tolerance_mm = 0.01

        [camera]
        device = "usb-046d_C920_A1-video-index0"
        format = "Y12"
        size = "1024x768"
        rate = "0.025kHz"
        exposure_ms = 8
        bayer = "binned"
        patience = "1 min"
        mains_hz = 50
        controls.gain = 10
        controls."Exposure Auto" = "Manual Mode"
        controls.power_line = false

        [plan]
        start_cm = 1
        step_um = 1_500
        frames = 101
        settle = "0.2 s"
        average = 4
        dark = 16
        flat = 8
        board = 30

        [optics]
        focal_length_px = 2844.5
        principal_point_x = "511.5 px"
        principal_point_y_px = -3
        distance = "0.9 m"
        focal_length_sigma_percent = 1
        k1 = -2e-1
        k2 = 1
        p1 = 0.001
        p2 = -0.002
        k3 = 1_0.5

        [target]
        relief_um = 200
        square_cm = 0.75
        columns = 18
        rows = 2
        bands = 2
        band_distance = "127.5 mm"

        [board]
        square = "16 mm"
        columns = 9
        rows = 6

        [limits]
        retakes = 0
        saturated_percent = 25
        position = "0.03 mm"
        wait = "1 h"
        shift = "0.05 px"
    "#;
    let profile = read(text);
    let stage = &profile.stage;
    assert_eq!((stage.driver.name(), stage.port.as_deref()), ("zaber", Some("usb:A1")));
    assert_eq!(stage.settings.get("device"), Some(&Setting::Whole(2)));
    assert_eq!(stage.settings.get("microstep"), Some(&Setting::Number(0.047_625)));
    assert_eq!((stage.approach_mm, stage.tolerance_mm), (0.5, 0.01));
    let camera = &profile.camera;
    assert_eq!((camera.rate_hz, camera.exposure_us, camera.mains_hz), (Some(25.0), Some(8000.0), Some(50.0)));
    assert_eq!((camera.bayer, camera.patience), (Some(BayerUse::Binned), Duration::from_secs(60)));
    assert_eq!(camera.format.as_deref(), Some("Y12"));
    let controls = [("gain", "10"), ("exposure_auto", "Manual Mode"), ("power_line", "false")];
    assert_eq!(camera.controls, controls.map(|(name, value)| (name.to_owned(), value.to_owned())));
    let plan = &profile.plan;
    assert_eq!((plan.start_mm, plan.step_mm, plan.settle), (10.0, Some(1.5), Duration::from_millis(200)));
    assert_eq!((plan.average, plan.dark, plan.flat, plan.board), (4, 16, 8, 30));
    assert_eq!(profile.optics.focal_length, Some(FocalLength::Px(2844.5)));
    assert_eq!(profile.optics.principal_point_px(), Some((511.5, -3.0)));
    assert_eq!(profile.optics.distance_mm, Some(900.0));
    assert_eq!(profile.optics.focal_length_sigma, 0.01);
    let distortion = Distortion { k1: -0.2, k2: 1.0, p1: 0.001, p2: -0.002, k3: 10.5 };
    assert_eq!(profile.optics.lens(9, 9).unwrap().distortion, distortion);
    let board = ChessBoard { square_mm: 7.5, columns: 18, rows: 2 };
    let print = Target { board, bands: 2, band_distance_mm: 127.5 };
    assert_eq!((profile.target.relief_mm, profile.target.print()), (Some(0.2), Some(print)));
    assert_eq!(profile.board.chess_board(), Some(ChessBoard { square_mm: 16.0, columns: 9, rows: 6 }));
    let limits = LimitsProfile {
        retakes: 0,
        saturated: 0.25,
        position_mm: 0.03,
        wait: Duration::from_secs(3600),
        shift_px: 0.05,
    };
    assert_eq!(profile.limits, limits);
}

/// What a key needs beside it to be allowed.
fn surroundings(key: &Key) -> Vec<String> {
    let mut settings = Vec::new();
    if let Some(driver) = drivers_with(key).first() {
        settings.push(format!("stage.driver={driver}"));
        if *driver == "zaber" && key.name != "microstep" {
            settings.push("stage.microstep=1 um".to_owned());
        }
    }
    let board = |section: &str| {
        let others = ["square=1 mm", "columns=7", "rows=7"];
        let others = others.into_iter().filter(|other| !other.starts_with(&format!("{}=", key.name)));
        others.map(|other| format!("{section}.{other}")).collect::<Vec<_>>()
    };
    match (key.section, key.name) {
        ("target", "relief") => {}
        ("target", "bands") => settings.extend(board("target")),
        ("target", "band_distance") => {
            settings.extend(board("target"));
            settings.push("target.bands=2".to_owned());
        }
        ("target" | "board", _) => settings.extend(board(key.section)),
        _ => {}
    }
    settings.extend(
        match key.path().as_str() {
            "optics.focal_length" => Some("optics.sensor_width=8 mm"),
            "optics.focal_length_sigma"
            | "optics.k1"
            | "optics.k2"
            | "optics.p1"
            | "optics.p2"
            | "optics.k3" => Some("optics.focal_length=900 px"),
            "sim.bow" => Some("sim.scene=tile"),
            "optics.principal_point_x" => Some("optics.principal_point_y=1 px"),
            "optics.principal_point_y" => Some("optics.principal_point_x=1 px"),
            _ => None,
        }
        .map(str::to_owned),
    );
    if key.section == "sim" {
        settings.push("camera.device=sim".to_owned());
    }
    settings
}

fn of(settings: &[String]) -> Result<Profile, ProfileError> {
    Profile::of(&set(&settings.iter().map(String::as_str).collect::<Vec<_>>()))
}

#[test]
fn no_key_is_without_effect_and_every_example_and_default_is_right() {
    for key in SECTIONS.iter().flat_map(Section::keys) {
        let around = surroundings(key);
        let with = |value: &str| {
            let mut settings = around.clone();
            settings.push(format!("{}={value}", key.path()));
            if key.path() == "target.bands" && value == "2" {
                settings.push("target.band_distance=9 mm".to_owned());
            }
            of(&settings).unwrap_or_else(|error| panic!("{error}"))
        };
        let with_example = with(key.example);
        // What others need cannot be left out: another value does.
        let without = match key.path().as_str() {
            "target.square" | "target.band_distance" | "board.square" => with("3 mm"),
            "target.columns" | "target.rows" | "board.columns" | "board.rows" => with("3"),
            "optics.principal_point_x" | "optics.principal_point_y" => with("1 px"),
            "stage.microstep" => with("1 um"),
            _ => of(&around).unwrap(),
        };
        assert_ne!(with_example, without, "{} = {}", key.path(), key.example);
        if let Some(default) = key.default {
            assert_eq!(with(default), of(&around).unwrap(), "{} = {default}", key.path());
        }
    }
}

#[test]
fn overrides_win_over_the_file_in_any_spelling_and_later_ones_over_earlier_ones() {
    let text = "[plan]\nstep_mm = 1\nframes = 5\n[camera.controls]\ngain = 1\nfocus = 2\n";
    let settings =
        ["plan.step=2 mm", "plan.step_um = 3000", "camera.controls.Gain=10", "camera.controls.hue=3"];
    let profile = Profile::read(text, "rig.toml", &set(&settings)).unwrap();
    assert_eq!((profile.plan.step_mm, profile.plan.frames), (Some(3.0), Some(5)));
    let controls = [("gain", "10"), ("focus", "2"), ("hue", "3")];
    assert_eq!(profile.camera.controls, controls.map(|(name, value)| (name.to_owned(), value.to_owned())));
    let profile =
        Profile::of(&set(&["stage.driver=sim", "sim.real_time=true", "sim.seed=9", "sim.texture_seed=3"]))
            .unwrap();
    assert!(profile.sim.real_time);
    assert_eq!((profile.sim.seed, profile.sim.texture_seed), (9, 3));
}

fn from(settings: &[(&str, &str)]) -> Vec<Override> {
    settings.iter().map(|(text, from)| Override::parse(text, from).unwrap()).collect()
}

#[test]
fn what_belongs_to_a_driver_that_was_overridden_is_left_out() {
    let grbl = "[stage]\ndriver = \"grbl\"\nport = \"usb:A1\"\naxis = \"y\"\napproach = \"1 mm\"\n";
    let stage = |overrides: &[(&str, &str)]| {
        Profile::read(grbl, "rig.toml", &from(overrides)).unwrap().sections.stage
    };
    let simulated = stage(&[("stage.driver=sim", "--driver")]);
    assert_eq!(
        (simulated.driver.name(), simulated.port, simulated.settings.get("axis")),
        ("sim", None, None)
    );
    assert_eq!(simulated.approach_mm, 1.0, "what every driver has stays");
    let native = stage(&[("stage.driver=native", "EPIRIG_DRIVER")]);
    assert_eq!((native.port.as_deref(), native.settings.get("axis")), (Some("usb:A1"), None));
    // The command line counts more than the environment.
    let port = ("stage.port=/dev/ttyS0", "EPIRIG_PORT");
    assert_eq!(stage(&[port, ("stage.driver=sim", "--driver")]).port, None);
    // What counts as much as the driver, or more, was meant.
    let refused = |text: &str, overrides: &[(&str, &str)]| {
        Profile::read(text, "rig.toml", &from(overrides)).unwrap_err().to_string()
    };
    for (driver, port) in
        [("--driver", "--port"), ("EPIRIG_DRIVER", "EPIRIG_PORT"), ("EPIRIG_DRIVER", "--port")]
    {
        let error = refused(grbl, &[("stage.port=/dev/ttyS0", port), ("stage.driver=sim", driver)]);
        assert_eq!(error, format!("{port}: stage.port has no effect with driver = \"sim\"; remove it"));
    }
    // A driver that the file leaves out is not overridden.
    let error = refused("[stage]\naxis = \"y\"\n", &[("stage.port=/dev/ttyS0", "--port")]);
    assert_eq!(error, "rig.toml, line 2: stage.axis has no effect with driver = \"native\"; remove it");
}

#[test]
fn the_simulated_rig_can_be_given_a_real_stage_and_a_real_camera() {
    let read = |overrides: &[(&str, &str)]| Profile::read(SIM, "sim.toml", &from(overrides));
    let stage = ("stage.driver=native", "--set");
    let profile = read(&[stage]).unwrap();
    assert_eq!(profile.stage.driver.name(), "native");
    assert_eq!(profile.stage.settings.get("travel"), None);
    assert!(profile.camera.is_simulated());
    assert_eq!(profile.sim.scene, SceneName::Tile, "the camera looks at it still");
    let camera = ("camera.device=/dev/video0", "EPIRIG_CAMERA");
    let profile = read(&[camera, stage]).unwrap();
    assert!(!profile.camera.is_simulated());
    assert_eq!(profile.sim.scene, SceneName::Plane, "the default: there is no simulator");
    let error = read(&[camera, stage, ("sim.seed=3", "--set")]).unwrap_err().to_string();
    assert!(error.starts_with("--set: sim.seed has no effect without"), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
}

proptest! {
    #[test]
    fn any_text_is_a_profile_or_an_error(text in "(\\[(plan|camera|stage)\\]\n)?([a-z_.\"]{1,12} ?= ?[-a-z0-9\".\\[{ ]{0,8}\n){0,4}") {
        if let Err(error) = Profile::read(&text, "rig.toml", &[]) {
            prop_assert!(!error.mistakes.is_empty());
            prop_assert_eq!(error.to_string().lines().count(), error.mistakes.len());
        }
    }

    #[test]
    fn any_override_is_taken_or_refused(key in "(plan|camera|stage|sim)\\.[a-z_.]{0,12}", value in "\\PC{0,8}") {
        let value = Override { key, value, from: "--set".to_owned() };
        let _ = Profile::of(&[value]);
    }

    #[test]
    fn a_length_means_the_same_in_any_spelling(um in 1_u32..1_000_000_000) {
        let in_um = read(&format!("[plan]\nstep = \"{um} um\"")).plan.step_mm;
        prop_assert_eq!(in_um, Some(f64::from(um) / 1000.0));
        prop_assert_eq!(in_um, read(&format!("[plan]\nstep_um = {um}")).plan.step_mm);
        prop_assert_eq!(in_um, Profile::of(&set(&[&format!("plan.step={um}um")])).unwrap().plan.step_mm);
    }
}
