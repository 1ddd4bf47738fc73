//! A rig described in a file: what a user writes, what of it is refused and how, and what comes of it.

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::support::{epirig, fails, succeeds};
use epirig_data::sequence::{Event, Origin, Sequence};

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

/// With variables in the environment.
fn epirig_with(folder: &Path, variables: &[(&str, &str)], arguments: &[&str]) -> Output {
    let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
    command.current_dir(folder).env("XDG_CONFIG_HOME", folder).envs(variables.iter().copied());
    command.args(arguments).output().unwrap()
}

/// Number of frames and step of a plan, in mm.
fn planned(output: &Output) -> (usize, f64) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let plan = json(std::str::from_utf8(&output.stdout).unwrap());
    let positions: Vec<f64> =
        plan["positions_mm"].as_array().unwrap().iter().map(|mm| mm.as_f64().unwrap()).collect();
    (positions.len(), positions[1] - positions[0])
}

#[test]
fn the_simulated_rig_is_built_in_and_its_plan_adds_up() {
    let folder = tempfile::tempdir().unwrap();
    let plan = json(&succeeds(folder.path(), &["plan", "--rig", "sim", "--json"]));
    let positions = plan["positions_mm"].as_array().unwrap();
    assert_eq!(positions.len(), 101);
    assert_eq!((positions[0].as_f64(), positions[100].as_f64()), (Some(10.0), Some(160.0)));
    assert_eq!(plan["bytes"], 101 * 1024 * 1024);
    // Ramps of 0.25 s to 5 mm/s, with 20 mm/s2: x mm take x / 5 + 0.25 s if x is 1.25 or more. To 10 mm, 100 steps, back to 1 mm below
    // the first stop and up to it by two ramps, and home.
    let moving = (10.0 / 5.0 + 0.25)
        + 100.0 * (1.5 / 5.0 + 0.25)
        + (151.0 / 5.0 + 0.25)
        + 2.0 * (1.0_f64 / 20.0).sqrt()
        + (10.0 / 5.0 + 0.25);
    assert!((plan["moving_s"].as_f64().unwrap() - moving).abs() < 1e-6);
    assert!((plan["settling_s"].as_f64().unwrap() - 102.0 * 0.2).abs() < 1e-9);
    let text = succeeds(folder.path(), &["plan", "--rig", "sim"]);
    assert!(text.contains("150.000 mm in all") && text.contains("min"), "{text}");
}

#[test]
fn the_command_line_counts_before_the_environment_and_that_before_the_file() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rig.toml"), "[plan]\nstep = \"2 mm\"\nframes = 5\n").unwrap();
    let plan = ["plan", "--json"];
    assert_eq!(planned(&epirig_with(folder.path(), &[], &plan)), (5, 2.0));
    let variables = [("EPIRIG_PLAN_STEP", "3 mm"), ("EPIRIG_PLAN_FRAMES", "6")];
    assert_eq!(planned(&epirig_with(folder.path(), &variables, &plan)), (6, 3.0));
    let set = ["plan", "--json", "--set", "plan.step=0.4 cm"];
    assert_eq!(planned(&epirig_with(folder.path(), &variables, &set)), (6, 4.0));
    let both = ["plan", "--json", "--set", "plan.step=0.4 cm", "--step-mm", "5"];
    assert_eq!(planned(&epirig_with(folder.path(), &variables, &both)), (6, 5.0));
    // A rig that is named counts instead of the one that lies here; and one that lies where the user's settings are, if none lies here.
    fs::write(folder.path().join("other.toml"), "[plan]\nstep = \"1 mm\"\nframes = 3\n").unwrap();
    let other = [("EPIRIG_RIG", "other.toml")];
    assert_eq!(planned(&epirig_with(folder.path(), &other, &plan)), (3, 1.0));
    fs::create_dir(folder.path().join("epirig")).unwrap();
    fs::rename(folder.path().join("rig.toml"), folder.path().join("epirig/rig.toml")).unwrap();
    assert_eq!(planned(&epirig_with(folder.path(), &[], &plan)), (5, 2.0));
    // A named simulated rig does not use the port of the real one.
    let port = [("EPIRIG_PORT", "/dev/no-such-port"), ("EPIRIG_CAMERA", "/dev/no-such-camera")];
    assert_eq!(planned(&epirig_with(folder.path(), &port, &["plan", "--json", "--rig", "sim"])).0, 101);
}

#[test]
fn the_simulated_stage_can_be_tried_beside_the_profile_of_a_real_one() {
    let folder = tempfile::tempdir().unwrap();
    let text = "[stage]\ndriver = \"grbl\"\nport = \"/dev/no-such-port\"\naxis = \"y\"\n";
    fs::write(folder.path().join("rig.toml"), text).unwrap();
    succeeds(folder.path(), &["stage", "home", "--driver", "sim"]);
    fails(
        folder.path(),
        &["stage", "home", "--driver", "sim", "--port", "port"],
        2,
        &["--port", "stage.port"],
    );
}

#[test]
fn mistakes_are_told_with_place_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    fails(folder.path(), &["plan"], 2, &["plan.step", "epirig init", "--rig sim"]);
    fails(folder.path(), &["capture", "--out", "seq"], 2, &["epirig init", "--rig sim"]);
    fails(
        folder.path(),
        &["doctor", "--rig", "nowhere.toml"],
        2,
        &["nowhere.toml", "epirig init", "--rig sim"],
    );
    let refused = |text: &str, words: &[&str]| {
        fs::write(folder.path().join("rig.toml"), text).unwrap();
        fails(folder.path(), &["plan"], 2, words);
    };
    refused("[plan]\nstep = 1.5\n", &["rig.toml, line 2", "step = \"1.5 mm\""]);
    refused("[plan]\nstop = \"1.5 mm\"\n", &["line 2", "plan.stop", "step"]);
    refused("[plans]\nframes = 3\n", &["plans", "plan"]);
    refused("[plan]\nframes = 1\n", &["plan.frames", "2"]);
    refused("[plan\n", &["rig.toml, line 1"]);
    fails(folder.path(), &["plan", "--rig", "sim", "--set", "plan.fames=3"], 2, &["--set", "mean frames?"]);
    fails(folder.path(), &["plan", "--rig", "sim", "--set", "plan"], 2, &["--set"]);
    let wrong = [("EPIRIG_PLAN_STEPS", "3 mm")];
    let output = epirig_with(folder.path(), &wrong, &["plan", "--rig", "sim"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("EPIRIG_PLAN_STEP"), "{output:?}");
}

#[test]
fn init_writes_a_profile_that_other_commands_take() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["init", "--json"]);
    let text = fs::read_to_string(folder.path().join("rig.toml")).unwrap();
    assert!(text.contains("[stage]") && text.contains("[limits]") && text.contains("focal_length"), "{text}");
    let output =
        epirig(folder.path(), &["plan", "--json", "--set", "plan.step=1 mm", "--set", "plan.frames=7"]);
    assert_eq!(planned(&output), (7, 1.0));
    fails(folder.path(), &["init"], 2, &["rig.toml exists already"]);
    assert_eq!(fs::read_to_string(folder.path().join("rig.toml")).unwrap(), text);
}

#[test]
fn doctor_says_what_the_rig_will_give_and_refuses_what_it_cannot() {
    let folder = tempfile::tempdir().unwrap();
    let small = ["--rig", "sim", "--size", "320x240", "--set", "target.relief=2 mm"];
    let report = json(&succeeds(folder.path(), &[&["doctor", "--json"][..], &small].concat()));
    let checks = report["checks"].as_array().unwrap();
    let verdict = |name: &str| checks.iter().find(|check| check["name"] == name).unwrap()["verdict"].clone();
    for name in ["travel", "holding", "disk", "saturation", "motion", "settling", "repeatability", "height"] {
        assert_eq!(verdict(name), "good", "{name}: {checks:?}");
    }
    // f / Z = 25 / 9 x 320 px / 900 mm, of an object whose surface lies in hollows, too.
    let px_per_mm = report["motion"]["x_px_per_mm"].as_f64().unwrap();
    assert!((px_per_mm / (25.0 / 9.0 * 320.0 / 900.0) - 1.0).abs() < 0.01, "{px_per_mm}");
    let beyond = [&["doctor", "--short"][..], &small, &["--set", "plan.start=60 mm"]].concat();
    fails(folder.path(), &beyond, 4, &["travel"]);
    let hidden = [&["doctor", "--short"][..], &small, &["--set", "target.relief=1 um"]].concat();
    fails(folder.path(), &hidden, 4, &["height"]);
}

#[test]
fn run_goes_from_the_rig_to_results() {
    let folder = tempfile::tempdir().unwrap();
    let rig = ["--rig", "sim", "--size", "192x96", "--set", "sim.scene=plane", "--set", "plan.frames=13"];
    let run = [&["run", "--out", "plane", "--json"][..], &rig].concat();
    // 13 frames of 192 px do not show 0.2 mm, and it says so before it moves on.
    fails(folder.path(), &run, 4, &["height", "--anyway"]);
    assert!(!folder.path().join("plane").exists());
    let output = json(&succeeds(folder.path(), &[&run[..], &["--anyway"]].concat()));
    assert_eq!(output["captured"]["frames"], 13);
    // f B / Z = 25 / 9 x 192 px x 18 mm / 900 mm.
    let disparity = output["summary"]["median_disparity_px"].as_f64().unwrap();
    assert!((disparity - 25.0 / 9.0 * 192.0 * 18.0 / 900.0).abs() < 0.02, "{disparity}");
    let distance = output["summary"]["distance_mm"].as_f64().unwrap();
    assert!((distance - 900.0).abs() < 2.0, "{distance}");
    assert!(folder.path().join("plane/results/disparity.png").exists());
    fails(folder.path(), &run, 2, &["exists already"]);
}

#[test]
fn a_dry_run_moves_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let dry = ["capture", "--out", "seq", "--rig", "sim", "--size", "64x48", "--dry-run", "--json"];
    let plan = json(&succeeds(folder.path(), &dry));
    assert_eq!(plan["bytes"], 101 * 64 * 48);
    assert!(plan["total_s"].as_f64().unwrap() > 60.0);
    assert!(!folder.path().join("seq").exists());
}

#[test]
fn a_sequence_knows_its_rig_and_its_calibration_frames() {
    let folder = tempfile::tempdir().unwrap();
    let rig = ["--rig", "sim", "--size", "64x48", "--set", "plan.frames=4"];
    let more = ["--set", "plan.dark=2", "--set", "plan.flat=3", "--set", "limits.saturated=2 %"];
    succeeds(folder.path(), &[&["capture", "--out", "seq"][..], &rig, &more].concat());
    succeeds(folder.path(), &["verify", "seq"]);
    let sequence = Sequence::open(&folder.path().join("seq")).unwrap();
    let Origin::Captured { rig: Some(rig), .. } = &sequence.record().origin else { panic!() };
    assert_eq!(
        (rig["stage"]["driver"].as_str(), rig["limits"]["saturated"].as_str()),
        (Some("sim"), Some("2 %"))
    );
    let count = |wanted: fn(&Event) -> bool| sequence.events().iter().filter(|event| wanted(event)).count();
    assert_eq!(count(|event| matches!(event, Event::Dark(_))), 2);
    assert_eq!(count(|event| matches!(event, Event::Flat(_))), 3);
    // A complete sequence is left as it is.
    let journal = fs::read(folder.path().join("seq/journal.jsonl")).unwrap();
    succeeds(folder.path(), &["resume", "seq"]);
    assert_eq!(fs::read(folder.path().join("seq/journal.jsonl")).unwrap(), journal);
    fs::write(folder.path().join("seq/dark/0001.png"), b"damaged").unwrap();
    let verified = epirig(folder.path(), &["verify", "seq"]);
    assert_eq!(verified.status.code(), Some(5));
    assert!(String::from_utf8_lossy(&verified.stdout).contains("dark/0001.png"), "{verified:?}");
}
