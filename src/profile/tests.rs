use std::time::Duration;

use proptest::prelude::*;

use super::schema::{Key, SECTIONS};
use super::*;
use crate::camera::Size;
use crate::camera::pixels::BayerUse;

fn set(settings: &[&str]) -> Vec<Override> {
    settings.iter().map(|text| Override::parse(text, "--set").unwrap()).collect()
}

fn read(text: &str) -> Profile {
    Profile::read(text, "rig.toml", &[]).unwrap()
}

fn refused(text: &str) -> String {
    Profile::read(text, "rig.toml", &[]).unwrap_err().to_string()
}

#[test]
fn the_simulated_rig_is_the_papers() {
    let profile = Profile::read(SIM, "sim.toml", &[]).unwrap();
    let stage = &profile.stage;
    assert_eq!((stage.driver, stage.travel_mm), (Driver::Sim, Some(200.0)));
    assert_eq!((stage.velocity_mm_s, stage.acceleration_mm_s2), (Some(5.0), Some(20.0)));
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
    assert_eq!(profile.sim, SimProfile { scene: SceneName::Tile, noise_dn: 0.0, seed: 0, real_time: false });
}

#[test]
fn the_papers_rig_says_what_the_paper_says() {
    let profile = read(include_str!("../../calib/paper-2001.toml"));
    assert_eq!(profile.stage, StageProfile { ..Profile::of(&[]).unwrap().stage });
    let positions_mm = profile.plan.positions_mm().unwrap();
    assert_eq!(positions_mm[100] - positions_mm[0], 150.0);
    assert_eq!(profile.optics, Profile::read(SIM, "sim.toml", &[]).unwrap().optics);
    assert_eq!(profile.target.relief_mm, Some(0.2));
}

#[test]
fn what_is_left_out_has_the_promised_defaults() {
    let profile = Profile::of(&[]).unwrap();
    let expected = Profile {
        stage: StageProfile {
            driver: Driver::Native,
            port: None,
            axis: None,
            device: None,
            microstep_um: None,
            approach_mm: 0.0,
            tolerance_mm: 0.0,
            travel_mm: None,
            velocity_mm_s: None,
            acceleration_mm_s2: None,
            position_noise_um: 0.0,
            backlash_um: 0.0,
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
        },
        optics: OpticsProfile {
            focal_length: None,
            sensor_width_mm: None,
            principal_point_px: None,
            distance_mm: None,
        },
        target: TargetProfile { relief_mm: None },
        limits: LimitsProfile {
            retakes: 3,
            saturated: 0.01,
            position_mm: 0.02,
            wait: Duration::from_secs(300),
            shift_px: 0.1,
        },
        sim: SimProfile { scene: SceneName::Plane, noise_dn: 0.0, seed: 0, real_time: false },
    };
    assert_eq!(profile, expected);
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

        [optics]
        focal_length_px = 2844.5
        principal_point_x = "511.5 px"
        principal_point_y_px = -3
        distance = "0.9 m"

        [target]
        relief_um = 200

        [limits]
        retakes = 0
        saturated_percent = 25
        position = "0.03 mm"
        wait = "1 h"
        shift = "0.05 px"
    "#;
    let profile = read(text);
    let stage = &profile.stage;
    assert_eq!((stage.driver, stage.port.as_deref(), stage.device), (Driver::Zaber, Some("usb:A1"), Some(2)));
    assert_eq!((stage.microstep_um, stage.approach_mm, stage.tolerance_mm), (Some(0.047_625), 0.5, 0.01));
    let camera = &profile.camera;
    assert_eq!((camera.rate_hz, camera.exposure_us, camera.mains_hz), (Some(25.0), Some(8000.0), Some(50.0)));
    assert_eq!((camera.bayer, camera.patience), (Some(BayerUse::Binned), Duration::from_secs(60)));
    assert_eq!(camera.format.as_deref(), Some("Y12"));
    let controls = [("gain", "10"), ("exposure_auto", "Manual Mode"), ("power_line", "false")];
    assert_eq!(camera.controls, controls.map(|(name, value)| (name.to_owned(), value.to_owned())));
    let plan = &profile.plan;
    assert_eq!((plan.start_mm, plan.step_mm, plan.settle), (10.0, Some(1.5), Duration::from_millis(200)));
    assert_eq!((plan.average, plan.dark, plan.flat), (4, 16, 8));
    assert_eq!(profile.optics.focal_length, Some(FocalLength::Px(2844.5)));
    assert_eq!(profile.optics.principal_point_px, Some((511.5, -3.0)));
    assert_eq!(profile.optics.distance_mm, Some(900.0));
    assert_eq!(profile.target.relief_mm, Some(0.2));
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
    if let [driver, ..] = key.drivers {
        settings.push(format!("stage.driver={driver}"));
        if *driver == "zaber" && key.name != "microstep" {
            settings.push("stage.microstep=1 um".to_owned());
        }
    }
    settings.extend(
        match key.path().as_str() {
            "optics.focal_length" => Some("optics.sensor_width=8 mm"),
            "optics.principal_point_x" => Some("optics.principal_point_y=1 px"),
            "optics.principal_point_y" => Some("optics.principal_point_x=1 px"),
            path if path.starts_with("sim.") => Some("camera.device=sim"),
            _ => None,
        }
        .map(str::to_owned),
    );
    settings
}

fn of(settings: &[String]) -> Result<Profile, ProfileError> {
    Profile::of(&set(&settings.iter().map(String::as_str).collect::<Vec<_>>()))
}

#[test]
fn no_key_is_without_effect_and_every_example_and_default_is_right() {
    for key in SECTIONS.iter().flat_map(|section| section.keys) {
        let around = surroundings(key);
        let with = |value: &str| {
            let mut settings = around.clone();
            settings.push(format!("{}={value}", key.path()));
            of(&settings).unwrap_or_else(|error| panic!("{error}"))
        };
        let with_example = with(key.example);
        // A half of a principal point, and a microstep that is needed, cannot be left out: another value does.
        let without = match key.path().as_str() {
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
fn messages_name_the_line_and_what_to_write() {
    for (text, message) in [
        (
            "[plan]\nstep = 1.5",
            r#"line 2: plan.step = 1.5 has no unit; write step = "1.5 mm" or step_mm = 1.5"#,
        ),
        (
            "[plan]\nstep = \"1.5\"",
            r#"line 2: plan.step = "1.5" has no unit; write step = "1.5 mm" or step_mm = 1.5"#,
        ),
        (
            "[optics]\nfocal_length = 25",
            r#"line 2: optics.focal_length = 25 has no unit; write focal_length = "25 mm" or focal_length_mm = 25, or focal_length = "25 px""#,
        ),
        (
            "[plan]\nstep = \"3 s\"",
            r#"line 2: plan.step = "3 s": s is the unit of a time, the units of this key are nm, um, mm, cm, m; write such as step = "1.5 mm""#,
        ),
        (
            "[plan]\n\nstep = \"3 furlongs\"",
            r#"line 3: plan.step = "3 furlongs": furlongs is no unit of this key, which has nm, um, mm, cm, m; write such as step = "1.5 mm""#,
        ),
        (
            "[plan]\nstep = \"1,5 mm\"",
            r#"line 2: plan.step = "1,5 mm": this does not begin with a number, with a point before its decimals; write such as step = "1.5 mm""#,
        ),
        (
            "[plan]\nstep_mm = \"1.5 mm\"",
            r#"line 2: plan.step_mm = "1.5 mm" is no number, which it must be because the unit stands in the key; write step_mm = 1.5, or step = "1.5 mm""#,
        ),
        (
            "[plan]\nstep = \"1.5 mm\"\nstep_um = 1500",
            "line 3: plan.step is given a second time, first at rig.toml, line 2; leave one out",
        ),
        (
            "[plan]\nstep = \"-1 mm\"",
            r#"line 2: plan.step = "-1 mm" is not possible; it must be a length greater than 0"#,
        ),
        (
            "[plan]\nframes = 1",
            "line 2: plan.frames = 1 is not possible; it must be a whole number from 2 to 100000",
        ),
        (
            "[plan]\nframes = 101.0",
            "line 2: plan.frames = 101.0 is not possible; it must be a whole number from 2 to 100000",
        ),
        ("[plan]\nstpe_mm = 1", "line 2: there is no key plan.stpe_mm; did you mean step_mm?"),
        (
            "[plan]\nstep_inch = 1",
            "line 2: there is no key plan.step_inch: inch is no unit of it; write step_mm, or another of nm, um, mm, cm, m",
        ),
        (
            "[plan]\nexposure_us = 8",
            "line 2: there is no key plan.exposure_us; did you mean camera.exposure_us?",
        ),
        ("\n[plna]\nstep_mm = 1", "line 2: there is no section plna; did you mean plan?"),
        ("step_mm = 1", "line 1: step_mm stands in no section; write it below [plan]"),
        ("plan = 1", "line 1: plan is a section; write [plan] and its keys in the lines below it"),
        (
            "[[plan]]\nstep_mm = 1",
            "line 1: plan is a section; write [plan] and its keys in the lines below it",
        ),
        (
            "[camera]\ncontrols = 1",
            "line 2: camera.controls is a section; write [camera.controls] and its keys in the lines below it",
        ),
        (
            "[camera.controls]\ngain = [1]",
            "line 2: camera.controls.gain = (a list) is not possible; it must be a whole number, true, false or text",
        ),
        (
            "[camera.controls]\ngain = 1\nGain = 2",
            "line 3: camera.controls.gain is given a second time, first at rig.toml, line 2; leave one out",
        ),
        (
            "[camera]\nmains = \"55 Hz\"",
            r#"line 2: camera.mains = "55 Hz" is not possible; it must be 50 Hz or 60 Hz"#,
        ),
        (
            "[limits]\nsaturated = \"101 %\"",
            r#"line 2: limits.saturated = "101 %" is not possible; it must be a share from 0 % to 100 %"#,
        ),
        (
            "[camera]\npatience = \"0 s\"",
            r#"line 2: camera.patience = "0 s" is not possible; it must be a time from 1 ns to 24 h"#,
        ),
        (
            "[camera]\npatience = \"25 h\"",
            r#"line 2: camera.patience = "25 h" is not possible; it must be a time from 1 ns to 24 h"#,
        ),
        (
            "[stage]\ndriver = \"gbrl\"",
            r#"line 2: stage.driver = "gbrl" is not possible; it must be one of native, grbl, zaber, sim"#,
        ),
        (
            "[stage]\ndriver = \"zaber\"\naxis = \"x\"\nmicrostep_um = 1",
            r#"line 3: stage.axis means nothing with driver = "zaber"; leave it out"#,
        ),
        (
            "[stage]\ndriver = \"zaber\"",
            "line 2: stage.driver (zaber) needs stage.microstep; it is in the stage's data sheet",
        ),
        (
            "[stage]\ndriver = \"sim\"\ntolerance_mm = 0.1",
            r#"line 3: stage.tolerance means nothing with driver = "sim"; leave it out"#,
        ),
        (
            "[sim]\nnoise = \"1 DN\"",
            r#"line 2: sim.noise means nothing without driver = "sim" of the stage or device = "sim" of the camera; leave it out"#,
        ),
        (
            "[optics]\nfocal_length = \"25 mm\"",
            "line 2: optics.focal_length (a length) needs optics.sensor_width; add it, or give the focal length in px",
        ),
        (
            "[optics]\nprincipal_point_y = \"25 px\"",
            "line 2: optics.principal_point_y (given) needs optics.principal_point_x; give both or none",
        ),
    ] {
        assert_eq!(refused(text), format!("rig.toml, {message}"));
    }
    let error = refused("[plan]\nstep = \n");
    assert!(error.starts_with("rig.toml, line 2: this is no TOML: "), "{error}");
    let error = refused("[plan]\nstep_mm = 1\nstep_mm = 2\n");
    assert!(error.starts_with("rig.toml, line 3: this is no TOML: "), "{error}");
}

#[test]
fn all_mistakes_are_told_one_a_line() {
    let error = refused("[plan]\nstep = 1\nframes = 1\n[stage]\nprot = \"x\"\n");
    assert_eq!(error.lines().count(), 3, "{error}");
    assert!(error.lines().all(|line| line.starts_with("rig.toml, line ")), "{error}");
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
    let profile = Profile::of(&set(&["stage.driver=sim", "sim.real_time=true", "sim.seed=9"])).unwrap();
    assert!(profile.sim.real_time && profile.sim.seed == 9);
}

#[test]
fn messages_name_the_override() {
    for (setting, message) in [
        ("plan.step=1.5", "--set: plan.step = 1.5 has no unit; write 1.5 mm"),
        ("optics.focal_length=1.5", "--set: optics.focal_length = 1.5 has no unit; write 1.5 mm or 1.5 px"),
        ("plan.stpe=1.5 mm", "--set: there is no key plan.stpe; did you mean step?"),
        ("pln.step=1.5 mm", "--set: there is no section pln; did you mean plan?"),
        (
            "plan.frames=1",
            "--set: plan.frames = 1 is not possible; it must be a whole number from 2 to 100000",
        ),
        ("stage.axis=x", "--set: stage.axis means nothing with driver = \"native\"; leave it out"),
    ] {
        assert_eq!(Profile::of(&set(&[setting])).unwrap_err().to_string(), message);
    }
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
