//! The stage's commands, as a user types them, with a simulated stage behind a pseudo-terminal.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{epirig, fails, succeeds};
use serde_json::Value;

/// `epirig simulate`, as long as it is wanted.
struct Simulated {
    process: Child,
    folder: tempfile::TempDir,
}

impl Drop for Simulated {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn program() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("epirig"))
}

fn wait_for(what: &str, done: impl Fn() -> bool) {
    let since = Instant::now();
    while !done() {
        // Only what hangs takes as long as this on a busy machine.
        assert!(since.elapsed() < Duration::from_secs(300), "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn simulated(kind: &str, more: &[&str]) -> Simulated {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["simulate", kind, "--port", "port"];
    // On a busy machine the device waits for its turn rather than the program that it serves: its time, and so its watchdog,
    // stands still meanwhile.
    let mut last = Command::new("nice");
    last.args(["-n", "5"]).arg(assert_cmd::cargo::cargo_bin!("epirig"));
    let process = last.current_dir(&folder).args(arguments).args(more).stderr(Stdio::null()).spawn().unwrap();
    let simulated = Simulated { process, folder };
    wait_for("the port does not come", || simulated.folder.path().join("port").exists());
    simulated
}

impl Simulated {
    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn json(&self, arguments: &[&str]) -> Value {
        serde_json::from_str(&succeeds(self.path(), &[arguments, &["--json", "--port", "port"]].concat()))
            .unwrap()
    }
}

#[test]
fn home_move_where_and_stop_work_one_after_another() {
    let stage = simulated("native", &[]);
    fails(
        stage.path(),
        &["stage", "move", "3", "--port", "port"],
        4,
        &["not been homed", "epirig stage home"],
    );
    assert_eq!(
        succeeds(stage.path(), &["stage", "position", "--port", "port"]),
        "position unknown: not homed\n"
    );
    assert_eq!(stage.json(&["stage", "home"])["position_mm"], 0.0);
    assert_eq!(stage.json(&["stage", "move", "3"])["position_mm"], 3.0);
    assert_eq!(stage.json(&["stage", "move", "--by", "-1.5"])["position_mm"], 1.5);
    assert_eq!(stage.json(&["stage", "move", "1", "--approach-mm", "0.5"])["position_mm"], 1.0);
    fails(
        stage.path(),
        &["stage", "move", "0.2", "--approach-mm", "0.5", "--port", "port"],
        2,
        &["approached from one side"],
    );
    fails(stage.path(), &["stage", "move", "201", "--port", "port"], 2, &["201 mm", "travel of 0 to 200 mm"]);
    fails(stage.path(), &["stage", "move", "NaN", "--port", "port"], 2, &["not a number"]);
    assert_eq!(stage.json(&["stage", "stop"])["moving"], false);
    let found = stage.json(&["stage", "position"]);
    assert_eq!((&found["position_mm"], &found["travel_mm"]), (&Value::from(1.0), &Value::from(200.0)));
}

#[test]
fn the_wrong_driver_is_noticed_on_either_side() {
    let grbl = simulated("grbl", &[]);
    succeeds(grbl.path(), &["stage", "home", "--driver", "grbl", "--port", "port"]);
    fails(grbl.path(), &["stage", "home", "--port", "port"], 4, &["not as a native stage", "--driver grbl"]);
    // The mistake has cost nothing.
    assert_eq!(grbl.json(&["stage", "position", "--driver", "grbl"])["position_mm"], 0.0);
    assert_eq!(grbl.json(&["stage", "home", "--driver", "grbl"])["position_mm"], 0.0);
    assert_eq!(grbl.json(&["stage", "move", "1.5", "--driver", "grbl"])["position_mm"], 1.5);
    let native = simulated("native", &[]);
    fails(
        native.path(),
        &["stage", "position", "--driver", "grbl", "--port", "port"],
        4,
        &["answers as a native stage", "--driver native"],
    );
    let zaber = simulated("zaber", &[]);
    for driver in ["native", "grbl"] {
        let arguments = ["stage", "position", "--driver", driver, "--port", "port"];
        fails(zaber.path(), &arguments, 4, &["answers as a zaber stage", "--driver zaber"]);
    }
}

#[test]
fn lines_sent_by_hand_cost_the_trust_in_the_position() {
    let stage = simulated("grbl", &[]);
    let rig = ["--driver", "grbl", "--port", "port"];
    let run = |words: &[&str]| succeeds(stage.path(), &[words, &rig[..]].concat());
    run(&["stage", "home"]);
    assert_eq!(run(&["stage", "position"]), "0.0000 mm\n");
    let said = run(&["stage", "console", "$110=400", "?", "--transcript", "sent.txt"]);
    assert!(said.starts_with("> $110=400\nok\n> ?\n<Idle|MPos:-1.000"), "{said}");
    assert_eq!(run(&["stage", "position"]), "position unknown: not homed\n");
    assert!(succeeds(stage.path(), &["decode", "sent.txt"]).contains("line \"$110=400\""));
    let exchanges = stage.json(&["stage", "console", "--driver", "grbl", "$$"]);
    let answers = exchanges[0]["answers"].as_array().unwrap();
    assert!(answers.contains(&Value::from("$110=400.000")) && answers.ends_with(&[Value::from("ok")]));
    // A Zaber stage follows its position itself, and takes the commands of its manual.
    let zaber = simulated("zaber", &[]);
    let rig = ["--driver", "zaber", "--microstep-um", "0.49609375", "--port", "port"];
    let run = |words: &[&str]| epirig(zaber.path(), &[words, &rig[..]].concat());
    assert!(run(&["stage", "home"]).status.success());
    let moved = run(&["stage", "console", "/1 move abs 5000", "/get pos"]);
    let (said, told) = (String::from_utf8(moved.stdout).unwrap(), String::from_utf8(moved.stderr).unwrap());
    assert!(said.contains("@01 0 OK BUSY -- 0") && said.contains("> /get pos\n@01 0 OK "), "{said}");
    assert!(!told.contains("not trusted"), "{told}");
    let moved = run(&["stage", "move", "2"]);
    let found = String::from_utf8(moved.stdout).unwrap();
    let said = String::from_utf8(moved.stderr).unwrap();
    assert!(found.starts_with("2.000") || found.starts_with("1.999"), "{found}{said}");
    let native = simulated("native", &[]);
    fails(native.path(), &["stage", "console", "--port", "port"], 2, &["native has no lines"]);
}

/// Each stop takes the driver a moment to send.
#[test]
fn three_interruptions_at_once_leave_no_stage_moving() {
    let stage = simulated("grbl", &[]);
    let rig = ["--driver", "grbl", "--port", "port"];
    succeeds(stage.path(), &[&["stage", "home"], &rig[..]].concat());
    let arguments = [&["stage", "move", "50"], &rig[..]].concat();
    let mut moving = program().current_dir(stage.path()).args(arguments).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(2));
    for _ in 0..3 {
        let kill = Command::new("kill").args(["-INT", &moving.id().to_string()]).status().unwrap();
        assert!(kill.success());
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(moving.wait().unwrap().code(), Some(130));
    // 50 mm take 6 s. Had it gone on, it would be waited for and be where it was sent.
    let found = succeeds(stage.path(), &[&["stage", "position"], &rig[..]].concat());
    assert_ne!(found, "50.0000 mm\n");
}

#[test]
fn a_zaber_stage_needs_its_microstep() {
    let stage = simulated("zaber", &[]);
    fails(
        stage.path(),
        &["stage", "home", "--driver", "zaber", "--port", "port"],
        2,
        &["stage.microstep", "data sheet"],
    );
    let position =
        stage.json(&["stage", "move", "1.5", "--home", "--driver", "zaber", "--microstep-um", "0.49609375"]);
    assert!((position["position_mm"].as_f64().unwrap() - 1.5).abs() < 0.0003, "{position}");
}

#[test]
fn transcripts_are_written_once_and_decoded() {
    let stage = simulated("native", &[]);
    succeeds(stage.path(), &["stage", "move", "1.5", "--home", "--port", "port", "--transcript", "move.txt"]);
    fails(
        stage.path(),
        &["stage", "position", "--port", "port", "--transcript", "move.txt"],
        2,
        &["move.txt exists already"],
    );
    let text = succeeds(stage.path(), &["decode", "move.txt"]);
    for word in ["hello, version 1", "accepted 1", "move 2 to 1.500000 mm", "Done at 1.500000 mm"] {
        assert!(text.contains(word), "no {word} in {text}");
    }
    std::fs::write(stage.path().join("bytes"), b"ok\r\nALARM:9\r\n").unwrap();
    fails(stage.path(), &["decode", "bytes"], 2, &["not a transcript", "--dialect"]);
    let text = succeeds(stage.path(), &["decode", "bytes", "--dialect", "grbl"]);
    assert!(text.contains("ALARM:9: homing never found the limit switch"), "{text}");
    std::fs::write(stage.path().join("bad"), "# epirig transcript 1\nhello\n").unwrap();
    fails(stage.path(), &["decode", "bad"], 5, &["line 2"]);
    fails(stage.path(), &["decode", "nowhere"], 1, &["nowhere"]);
    fails(stage.path(), &["decode", "move.txt", "--dialect", "grbl"], 2, &["dialect native"]);
    std::fs::write(stage.path().join("half"), b"<Idle|MPos:0").unwrap();
    let text = succeeds(stage.path(), &["decode", "half", "--dialect", "grbl"]);
    assert!(text.contains("unfinished: \"<Idle|MPos:0\""), "{text}");
}

#[test]
fn an_interrupted_move_stops_the_stage_and_says_where() {
    for ways in [["-INT"], ["-TERM"]] {
        let stage = simulated("native", &[]);
        succeeds(stage.path(), &["stage", "home", "--port", "port"]);
        let mut moving = program();
        let moving = moving.current_dir(stage.path()).args(["stage", "move", "150", "--port", "port"]);
        let moving = moving.stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(700));
        fails(stage.path(), &["stage", "position", "--port", "port"], 3, &["in use by process"]);
        let pid = moving.id().to_string();
        assert!(Command::new("kill").args(ways).arg(&pid).status().unwrap().success());
        let output = moving.wait_with_output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{stderr}");
        assert!(stderr.contains("the position is known"), "{stderr}");
        let found = stage.json(&["stage", "position"]);
        assert_eq!(found["moving"], false);
        assert!(found["position_mm"].as_f64().unwrap() < 140.0, "{found}");
    }
}

#[test]
fn stop_reaches_the_program_that_has_the_port() {
    let stage = simulated("native", &[]);
    succeeds(stage.path(), &["stage", "home", "--port", "port"]);
    let moving = program()
        .current_dir(stage.path())
        .args(["stage", "move", "150", "--port", "port"])
        .stderr(Stdio::null())
        .spawn();
    let mut moving = moving.unwrap();
    std::thread::sleep(Duration::from_millis(700));
    let output = epirig(stage.path(), &["stage", "stop", "--port", "port"]);
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("was asked to stop the stage"));
    assert_eq!(moving.wait().unwrap().code(), Some(130));
}

#[test]
fn faults_by_script_end_in_one_clear_line() {
    let stage = simulated("native", &["--fault", "reset@1+0.1s"]);
    succeeds(stage.path(), &["stage", "home", "--port", "port"]);
    fails(
        stage.path(),
        &["stage", "move", "50", "--port", "port"],
        4,
        &["has restarted", "in the move to 50.000 mm", "home it"],
    );
    let stage = simulated("grbl", &["--fault", "switch-never-closes"]);
    fails(
        stage.path(),
        &["stage", "home", "--driver", "grbl", "--port", "port"],
        4,
        &["ALARM:9", "check switch and cable"],
    );
    fails(
        stage.path(),
        &["simulate", "grbl", "--port", "p", "--fault", "fire@1"],
        2,
        &["\"fire@1\" is not a complete fault"],
    );
    fails(stage.path(), &["simulate", "grbl", "--port", "p", "--noise", "2"], 2, &["0 to 1"]);
    // A simulator takes no link away from another one.
    fails(stage.path(), &["simulate", "grbl", "--port", "port"], 1, &["it exists"]);
}

#[test]
fn without_hardware_a_stage_can_be_tried() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(
        succeeds(folder.path(), &["stage", "move", "12.5", "--home", "--driver", "sim"]),
        "12.5000 mm\n"
    );
    fails(
        folder.path(),
        &["stage", "home", "--port", "/dev/no-such-port"],
        3,
        &["no port /dev/no-such-port", "epirig devices"],
    );
    fails(
        folder.path(),
        &["stage", "home", "--port", "usb:no-such-serial"],
        3,
        &["usb:no-such-serial is not connected"],
    );
    fails(folder.path(), &["stage", "home", "--port", "usb:"], 2, &["serial number or VID:PID"]);
    fails(folder.path(), &["stage", "move"], 2, &["required"]);
    // Ports or none: never a crash.
    let devices = epirig(folder.path(), &["devices", "--json"]);
    assert!(matches!(devices.status.code(), Some(0 | 3)), "{devices:?}");
}

/// A scan ends after the frame in hand at the first Ctrl-C; who types `epirig stage stop` means the stage.
#[test]
fn stop_stops_the_stage_of_a_scan_in_mid_move_and_the_scan_can_be_resumed() {
    let stage = simulated("native", &[]);
    // Frames for a camera that needs no view of this stage: two places, 80 mm apart.
    let frames =
        ["--driver", "sim", "--camera", "sim", "--size", "64x48", "--step-mm", "80", "--frames", "2"];
    succeeds(stage.path(), &[&["capture", "--out", "frames"][..], &frames].concat());
    let scan = ["capture", "--out", "seq", "--port", "port", "--camera", "replay:frames", "--step-mm", "80"];
    let mut scanning = program()
        .current_dir(stage.path())
        .args(scan)
        .args(["--frames", "2"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let journal = stage.path().join("seq/journal.jsonl");
    let frames = || std::fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
    wait_for("there is no first frame", || frames() == 1);
    // The way to the second place takes it 16 s.
    std::thread::sleep(Duration::from_millis(300));
    succeeds(stage.path(), &["stage", "stop", "--port", "port"]);
    assert_eq!(scanning.wait().unwrap().code(), Some(7));
    assert_eq!(frames(), 1);
    let found = stage.json(&["stage", "position"]);
    assert_eq!(found["moving"], false);
    assert!(found["position_mm"].as_f64().unwrap() < 79.0, "{found}");
    let sequence = epirig_data::sequence::Sequence::open(&stage.path().join("seq")).unwrap();
    let ended = sequence.stop().map(|stop| stop.exit_status);
    assert_eq!(ended, Some(epirig_data::sequence::ExitStatus::Aborted));
}

#[test]
fn a_scan_without_its_camera_can_be_rehearsed() {
    let stage = simulated("grbl", &[]);
    let rig = ["--driver", "grbl", "--port", "port", "--camera", "sim", "--size", "64x48"];
    let plan = ["--start-mm", "10", "--step-mm", "0.5", "--frames", "4", "--settle-ms", "0"];
    let output = epirig(stage.path(), &[&["capture", "--out", "seq"], &rig[..], &plan[..]].concat());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && said.contains("a rehearsal"), "{said}");
    succeeds(stage.path(), &["verify", "seq"]);
    // The object has moved by what the stage says: the frames differ.
    let sequence = epirig_data::sequence::Sequence::open(&stage.path().join("seq")).unwrap();
    let hashes: std::collections::BTreeSet<&str> =
        sequence.frames().iter().map(|frame| frame.blake3.as_str()).collect();
    assert_eq!(hashes.len(), 4);
}

#[test]
fn the_log_has_what_goes_over_the_line_and_what_has_failed() {
    let stage = simulated("grbl", &[]);
    let output =
        epirig(stage.path(), &["stage", "move", "9999", "--driver", "grbl", "--port", "port", "-vvv"]);
    // It has not been homed.
    assert_eq!(output.status.code(), Some(4));
    let log = String::from_utf8(output.stderr).unwrap();
    for words in [
        "DEBUG line opened port=\"port\"",
        "TRACE sent port=\"port\" bytes=$$\\n ok=true",
        "TRACE received port=\"port\" bytes=[GC:G0 ",
        "INFO stage connected device=\"GRBL 1.1",
        "WARN move: move failed device=\"GRBL 1.1",
        "ERROR failed ",
    ] {
        assert!(log.contains(words), "{words}: {log}");
    }
}
