//! What a person meets in the first hour: the tour of the README, hints, and mistakes that everybody makes.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::support::{epirig, fails, succeeds};

/// A small plane before the simulated rig.
const PLANE: [&str; 8] =
    ["--rig", "sim", "--size", "128x64", "--set", "sim.scene=plane", "--set", "plan.frames=13"];

/// The commands of a text between backticks.
fn named_commands(text: &str) -> Vec<Vec<String>> {
    let quoted = text.split('`').skip(1).step_by(2).filter(|quoted| quoted.starts_with("epirig "));
    quoted.map(|command| command.split_whitespace().skip(1).map(str::to_owned).collect()).collect()
}

/// Runs every command that a text names; each must succeed.
fn run_all(folder: &Path, text: &str) {
    let commands = named_commands(text);
    assert!(!commands.is_empty(), "{text}");
    for command in commands {
        succeeds(folder, &command.iter().map(String::as_str).collect::<Vec<_>>());
    }
}

/// A scan of which only the first frames exist, as after a power cut.
fn interrupted(folder: &Path, name: &str) {
    succeeds(folder, &[&["capture", "--out", name][..], &PLANE].concat());
    let sequence = folder.join(name);
    fs::remove_file(sequence.join("stop.json")).unwrap();
    let journal = fs::read_to_string(sequence.join("journal.jsonl")).unwrap();
    let left: Vec<&str> = journal.lines().take(8).collect();
    fs::write(sequence.join("journal.jsonl"), left.join("\n") + "\n").unwrap();
    for index in 8..13 {
        fs::remove_file(sequence.join(format!("frames/{index:04}.png"))).unwrap();
    }
}

/// What `view` says on both streams until it serves its page.
fn viewed(folder: &Path, sequence: &str) -> String {
    let mut view = Command::new(env!("CARGO_BIN_EXE_epirig"))
        .current_dir(folder)
        .args(["view", sequence])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    for line in BufReader::new(view.stderr.take().unwrap()).lines() {
        said += &(line.unwrap() + "\n");
        if said.contains("open this link") {
            break;
        }
    }
    let _ = view.kill();
    view.wait().unwrap();
    said
}

#[test]
fn the_tour_of_the_readme_works_as_it_is_typed() {
    let readme = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    let tour = readme.split("```sh\n").find(|block| block.starts_with("epirig init --rig sim")).unwrap();
    let tour: Vec<&str> = tour.lines().take_while(|line| !line.starts_with("```")).collect();
    let folder = tempfile::tempdir().unwrap();
    for line in tour {
        let words: Vec<&str> = line.split('#').next().unwrap().split_whitespace().collect();
        assert_eq!(words[0], "epirig");
        if words[1] == "view" {
            assert!(viewed(folder.path(), words[2]).contains("open this link"));
            continue;
        }
        // The same rig with fewer pixels, nearer to the tile so that they show its relief, and with fewer stops.
        let output = assert_cmd::cargo::cargo_bin_cmd!("epirig")
            .current_dir(&folder)
            .env("XDG_CONFIG_HOME", folder.path())
            .envs([("EPIRIG_CAMERA_SIZE", "512x512"), ("EPIRIG_OPTICS_DISTANCE", "450 mm")])
            .envs([("EPIRIG_PLAN_FRAMES", "51"), ("EPIRIG_PLAN_STEP", "3 mm")])
            .args(&words[1..])
            .output()
            .unwrap();
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        if words[1] == "run" {
            let said = String::from_utf8(output.stdout).unwrap();
            assert!(said.lines().count() < 16, "{said}");
            // The answer is set apart.
            let answer = said.split("\n\n").nth(1).unwrap();
            assert!(answer.contains("hollows") && answer.lines().count() == 1, "{said}");
            assert!(said.contains("by the clock of the simulated rig"), "{said}");
            // What is done already is not proposed.
            assert!(!said.contains("epirig match"), "{said}");
        }
    }
    assert!(folder.path().join("tile-0042/results/surface/report.html").exists());
}

#[test]
fn a_simulated_rig_can_be_written_and_what_was_not_looked_for_is_not_missing() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["init", "--rig", "sim", "--out", "lab.toml"]);
    let text = fs::read_to_string(folder.path().join("lab.toml")).unwrap();
    assert!(!text.contains("found"), "{text}");
    assert_eq!(
        succeeds(folder.path(), &["plan", "--rig", "lab.toml"]),
        succeeds(folder.path(), &["plan", "--rig", "sim"])
    );
    fails(folder.path(), &["init", "--rig", "sim", "--out", "lab.toml"], 2, &["exists already"]);
    assert_eq!(epirig(folder.path(), &["init", "--rig", "sum"]).status.code(), Some(2));
    let said = succeeds(folder.path(), &["init", "--non-interactive"]);
    for what in ["USB serial port: ", "camera: "] {
        assert!(said.contains(what), "{said}");
    }
    let devices = epirig(folder.path(), &["devices"]);
    assert!(String::from_utf8_lossy(&devices.stderr).contains("--rig sim a whole rig"), "{devices:?}");
}

#[test]
fn hints_name_commands_that_are_not_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    run_all(folder, &succeeds(folder, &[&["capture", "--out", "plain"][..], &PLANE].concat()));
    // It has results now, and nothing new was taken.
    let again = succeeds(folder, &["resume", "plain"]);
    assert!(again.contains("`epirig view plain`") && !again.contains("match"), "{again}");

    interrupted(folder, "cut");
    succeeds(folder, &["match", "cut"]);
    let resumed = succeeds(folder, &["resume", "cut"]);
    assert!(resumed.contains("fewer frames") && resumed.contains("--overwrite"), "{resumed}");
    // Until then the frames can be looked at.
    let said = viewed(folder, "cut");
    assert!(said.contains("only the frames are shown"), "{said}");
    run_all(folder, &resumed);
    assert!(!viewed(folder, "cut").contains("only the frames"));

    // A map that is gone: the advice names the verb, and the sequence is that of the command.
    succeeds(folder, &["surface", "plain", "--overwrite"]);
    for (file, map) in [("confidence.tiff", "confidence"), ("surface/height_mm.tiff", "height-without-form")]
    {
        fs::remove_file(folder.join("plain/results").join(file)).unwrap();
        let export = ["export", "plain", "--map", map, "--out", &format!("{map}.tiff")];
        let refused = epirig(folder, &export);
        let said = String::from_utf8(refused.stderr).unwrap();
        let commands = named_commands(&said);
        assert!(!refused.status.success() && commands.len() == 1, "{said}");
        let mut command: Vec<&str> = commands[0].iter().map(String::as_str).collect();
        command.push("plain");
        succeeds(folder, &command);
        succeeds(folder, &["surface", "plain", "--overwrite"]);
        succeeds(folder, &export);
    }
}

#[test]
fn an_interrupted_measurement_goes_on_with_one_command() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    interrupted(folder, "seq");
    let refused = epirig(folder, &["resume", "seq", "--method", "normalised"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--measure"), "{refused:?}");
    // Results of the first frames are replaced.
    succeeds(folder, &["match", "seq"]);
    let said = succeeds(folder, &["resume", "seq", "--measure"]);
    assert!(said.contains("13 frames in seq") && said.contains("look at seq/results/"), "{said}");
    assert!(folder.join("seq/results/surface/report.html").exists());
    // The same for a scan that is complete.
    let output = succeeds(folder, &["resume", "seq", "--measure", "--quick", "--json"]);
    let output: Value = serde_json::from_str(&output).unwrap();
    assert_eq!(
        (&output["captured"]["taken"], &output["summary"]["settings"]["quick"]),
        (&0.into(), &true.into())
    );
}

#[test]
fn a_scan_that_has_not_begun_is_not_said_to_be_resumable() {
    let folder = tempfile::tempdir().unwrap();
    let real_time = ["--set", "sim.real_time=true", "--start-mm", "30"];
    let mut scan = Command::new(env!("CARGO_BIN_EXE_epirig"))
        .current_dir(&folder)
        .args([&["capture", "--out", "seq"][..], &PLANE, &real_time].concat())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(scan.stderr.take().unwrap()).lines();
    // The first place is 6 s away.
    let set = lines.find(|line| line.as_ref().is_ok_and(|line| line.starts_with("camera set to")));
    assert!(set.is_some());
    assert!(Command::new("kill").args(["-INT", &scan.id().to_string()]).status().unwrap().success());
    let said: Vec<String> = lines.map(Result::unwrap).collect();
    assert_eq!(scan.wait().unwrap().code(), Some(130), "{said:?}");
    assert!(said.iter().any(|line| line.contains("nothing to resume")), "{said:?}");
    assert!(!folder.path().join("seq").exists());
}

#[test]
fn a_plan_takes_the_time_that_its_scan_takes() {
    let folder = tempfile::tempdir().unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    for (index, more) in [
        vec![],
        vec!["--start-mm", "5", "--step-mm", "3"],
        vec!["--set", "stage.acceleration=2 mm/s2", "--settle-ms", "50", "--average", "4"],
    ]
    .into_iter()
    .enumerate()
    {
        let arguments = |first: &[&'static str]| [first, &PLANE, &more[..]].concat();
        let plan = succeeds(folder.path(), &arguments(&["plan", "--json"]));
        let plan: Value = serde_json::from_str(&plan).unwrap();
        let out = index.to_string();
        let scan = [&arguments(&["capture", "--json"])[..], &["--out", out.as_str()]].concat();
        let scan: Value = serde_json::from_str(&succeeds(folder.path(), &scan)).unwrap();
        assert_eq!(scan["simulated_time"], true);
        // Both by the clock of the simulated rig. A frame begins at any phase of the camera, at each of the 13 stops and
        // of the closing one. The first move ends when the camera has started, which takes it some frames.
        let interval_s = 1.0 / f64::from(epirig_devices::camera::SimDevice::RATE_HZ);
        for (part, frames) in
            [("moving_s", 10.0), ("settling_s", 1e-3), ("exposing_s", 14.0), ("total_s", 24.0)]
        {
            let (planned, taken) = (number(&plan[part]), number(&scan["times"][part]));
            assert!((planned - taken).abs() < frames * interval_s, "{more:?}, {part}: {planned} and {taken}");
        }
    }
}

#[test]
fn lengths_have_units_and_a_comma_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let moved = |text: &str| succeeds(folder.path(), &["stage", "move", text, "--home", "--driver", "sim"]);
    for text in ["12.5", "12.5 mm", "1.25 cm", "12500um"] {
        assert_eq!(moved(text), "12.5000 mm\n", "{text}");
    }
    let by = ["stage", "move", "--by", "-0.5 mm", "--driver", "sim"];
    assert!(String::from_utf8_lossy(&epirig(folder.path(), &by).stderr).contains("not been homed"));
    for arguments in [
        &["stage", "move", "12,5"][..],
        &["stage", "move", "--by=12,5 mm"],
        &["demo", "--noise", "0,5"],
        &["surface", "seq", "--s-filter-mm", "0,8"],
        &["capture", "--out", "seq", "--rig", "sim", "--step-mm", "1,5"],
    ] {
        let said = String::from_utf8(epirig(folder.path(), arguments).stderr).unwrap();
        assert!(said.contains("decimal point") && !said.contains("float"), "{arguments:?}: {said}");
    }
    let said = String::from_utf8(epirig(folder.path(), &["demo", "--frames", "many"]).stderr).unwrap();
    assert!(said.contains("whole number") && !said.contains("digit found"), "{said}");
    let plan = succeeds(folder.path(), &["plan", "--json", "--step-mm", "1500 um", "--frames", "3"]);
    assert!(plan.starts_with("{\"positions_mm\":[0.0,1.5,3.0]"), "{plan}");
}

#[test]
fn a_scan_that_the_disk_cannot_hold_is_refused_before_it_begins() {
    let folder = tempfile::tempdir().unwrap();
    // 6.4 TB: more than a disk of a test machine has.
    let large = ["--rig", "sim", "--size", "8000x8000", "--frames", "100000", "--step-mm", "0.001"];
    fails(
        folder.path(),
        &[&["capture", "--out", "seq"][..], &large].concat(),
        1,
        &["MB are free", "--anyway"],
    );
    assert!(!folder.path().join("seq").exists());
}

#[test]
fn a_rig_that_is_not_ready_tells_its_figures_to_machines() {
    let folder = tempfile::tempdir().unwrap();
    let output = epirig(folder.path(), &[&["run", "--out", "seq", "--json"][..], &PLANE].concat());
    assert_eq!(output.status.code(), Some(4));
    let failure: Value = serde_json::from_slice(&output.stdout).unwrap();
    let checks = failure["error"]["report"]["checks"].as_array().unwrap();
    let height = checks.iter().find(|check| check["name"] == "height").unwrap();
    assert_eq!(height["verdict"], "bad");
    assert!(height["finding"].as_str().unwrap().contains("noise hides it"), "{height}");
}

#[test]
fn the_table_of_the_doctor_has_straight_columns() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(
        folder.path(),
        &["doctor", "--short", "--rig", "sim", "--size", "320x240", "--set", "target.relief=2 mm"],
    );
    let rows: Vec<&str> = said.lines().filter(|line| !line.starts_with(' ')).collect();
    let names = ["travel", "exposure control", "height"];
    let column = |name: &str| {
        let row =
            rows.iter().find(|row| row.get(9..).is_some_and(|row| row.starts_with(&format!("{name} "))));
        let row = row.unwrap_or_else(|| panic!("no {name}: {said}"));
        9 + name.len() + row[9 + name.len()..].find(|letter| letter != ' ').unwrap()
    };
    let columns = names.map(column);
    assert!(columns.iter().all(|column| *column == columns[0]), "{columns:?}\n{said}");
}
