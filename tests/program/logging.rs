//! The log on the terminal, in a file and beside the journal; failures as JSON.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use crate::support::{epirig, images, succeeds};

const CAPTURE: [&str; 9] =
    ["capture", "--rig", "sim", "--size", "64x48", "--set", "plan.frames=6", "--set", "sim.scene=plane"];

/// A scan of six frames into `out`.
fn capture(folder: &Path, out: &str, more: &[&str]) -> Output {
    epirig(folder, &[&CAPTURE, &["--out", out][..], more].concat())
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_epirig"));
    command.args(arguments).current_dir(folder).env("XDG_CONFIG_HOME", folder).env_remove("EPIRIG_LOG");
    command.stdin(Stdio::null());
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The levels that stand in a log on the terminal, without those of lines that are no part of it.
fn levels(log: &str) -> Vec<&str> {
    let names = ["ERROR", "WARN", "INFO", "DEBUG", "TRACE"];
    let found = |name: &&str| log.lines().any(|line| line.split_whitespace().nth(1) == Some(*name));
    names.into_iter().filter(found).collect()
}

/// All lines of a log in a file, each of which must be whole.
fn lines(path: &Path) -> Vec<Value> {
    let text = fs::read_to_string(path).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}")))
        .collect()
}

fn with<'a>(lines: &'a [Value], message: &str) -> Vec<&'a Value> {
    lines.iter().filter(|line| line["message"] == message).collect()
}

#[test]
fn without_a_wish_nothing_is_logged_and_with_one_the_result_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let plain = capture(folder.path(), "seq", &[]);
    assert_eq!(text(&plain.stderr), "camera set to GREY 64 x 48, 25.0000 Hz, exposure 10000 us\n");
    assert!(text(&plain.stdout).starts_with("6 frames in seq\ntook "), "{plain:?}");
    let quiet = capture(folder.path(), "quiet", &["-q"]);
    assert_eq!(text(&quiet.stderr), "");
    assert_eq!(text(&quiet.stdout), text(&plain.stdout).replace("seq", "quiet"));
    let loud = capture(folder.path(), "loud", &["-vvv"]);
    assert_eq!(text(&loud.stdout), text(&plain.stdout).replace("seq", "loud"));
    // `--quiet` on the terminal does not affect a log file.
    let filed = capture(folder.path(), "filed", &["-q", "-vv", "--log-file", "log"]);
    assert_eq!(text(&filed.stderr), "");
    assert!(folder.path().join("log").exists());
}

#[test]
fn options_and_environment_choose_the_levels() {
    let folder = tempfile::tempdir().unwrap();
    let log = |out: &str, more: &[&str], wanted: &str| {
        let arguments = [&CAPTURE, &["--out", out][..], more].concat();
        let output = command(folder.path(), &arguments).env("EPIRIG_LOG", wanted).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        text(&output.stderr)
    };
    assert!(levels(&log("0", &[], "")).is_empty());
    assert_eq!(levels(&log("1", &["-v"], "")), ["INFO"]);
    let debug = log("2", &["-vv"], "");
    assert_eq!(levels(&debug), ["INFO", "DEBUG"]);
    for words in ["frame certified", "position_mm=", "frame{index=5 attempt=1}", "[epirig::capture::step]"] {
        assert!(debug.contains(words), "{words}: {debug}");
    }
    assert_eq!(levels(&log("3", &["-vvv"], "")), ["INFO", "DEBUG", "TRACE"]);
    assert_eq!(levels(&log("4", &[], "debug")), ["INFO", "DEBUG"]);
    let some = log("5", &["-v"], "warn,epirig_devices=trace");
    assert_eq!(levels(&some), ["INFO", "DEBUG", "TRACE"]);
    let others = some.lines().filter(|line| levels(line) != [""; 0] && !line.contains("epirig_devices"));
    assert_eq!(others.count(), 0, "{some}");
    assert!(levels(&log("6", &["-q"], "trace")).is_empty());
}

#[test]
fn a_filter_or_a_file_that_cannot_be_used_is_told_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let output = command(folder.path(), &["plan", "--rig", "sim", "--json"])
        .env("EPIRIG_LOG", "epirig=loud")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stderr);
    assert!(said.starts_with("error: EPIRIG_LOG: \"epirig=loud\"") && said.lines().count() == 1, "{said}");
    assert_eq!(failure(&output), ("usage".to_owned(), 2));
    let output = epirig(folder.path(), &["plan", "--rig", "sim", "--log-file", "none/log"]);
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    assert!(said.starts_with("error: none/log: cannot write the log") && said.lines().count() == 1, "{said}");
}

#[test]
fn a_file_takes_lines_of_json_with_fields_after_those_that_are_there() {
    let folder = tempfile::tempdir().unwrap();
    for out in ["one", "two"] {
        assert!(capture(folder.path(), out, &["--log-file", "log"]).status.success());
    }
    let log = lines(&folder.path().join("log"));
    let begun = with(&log, "begun");
    assert_eq!(begun.len(), 2);
    let certified = with(&log, "frame certified");
    assert_eq!(certified.len(), 12);
    for (index, line) in certified.iter().enumerate() {
        assert_eq!(line["level"], "INFO");
        assert_eq!(line["spans"][0]["verb"], "capture");
        assert_eq!(
            (&line["spans"][1]["name"], &line["spans"][1]["index"]),
            (&"frame".into(), &(index % 6).into())
        );
        assert_eq!(line["position_mm"], 10.0 + 1.5 * (index % 6) as f64);
        assert!(line["sequence"].is_u64() && line["timestamp"].is_string(), "{line}");
    }
    let moved = with(&log, "moved");
    assert!(moved.iter().all(|line| line["device"].is_string() && line["seconds"].is_f64()), "{moved:?}");
    let written = with(&log, "frame written");
    // The thread that writes belongs to the scan.
    assert!(written.iter().all(|line| line["bytes"].is_u64() && line["spans"][0]["verb"] == "capture"));
    assert_eq!(written.len(), 12);
    assert_eq!(with(&log, "done").len(), 2);
}

#[test]
fn matching_and_calibrating_tell_their_stations() {
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 11);
    succeeds(folder.path(), &["import", "photos", "--out", "seq", "--step-mm", "1.5"]);
    let plain = succeeds(folder.path(), &["match", "seq", "--out", "plain", "--json"]);
    let logged = ["match", "seq", "--out", "logged", "--json", "--log-file", "log", "-vvv"];
    let settings = |text: &str| serde_json::from_str::<Value>(text).unwrap()["settings"].clone();
    assert_eq!(settings(&succeeds(folder.path(), &logged)), settings(&plain));
    let map = |name: &str| fs::read(folder.path().join(name).join("disparity.tiff")).unwrap();
    assert_eq!(map("plain"), map("logged"));
    let log = lines(&folder.path().join("log"));
    let found = |station: &str| {
        log.iter().any(|line| line["spans"].as_array().unwrap().iter().any(|span| span["name"] == station))
    };
    for station in ["reading", "matching", "search", "fit", "surface", "results"] {
        assert!(found(station), "{station}");
    }
    assert!(with(&log, "matched")[0]["answered"].as_f64().unwrap() > 0.5);
}

#[test]
fn a_scan_has_its_log_beside_its_journal_whatever_ends_it() {
    let folder = tempfile::tempdir().unwrap();
    let (seq, log) = (folder.path().join("seq"), folder.path().join("seq/log.jsonl"));
    let arguments = [&CAPTURE, &["--out", "seq", "--set", "sim.real_time=true"][..]].concat();
    let mut child = command(folder.path(), &arguments)
        .env("A_SECRET", "swordfish")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while fs::read_to_string(&log).map_or(0, |text| text.matches("frame written").count()) < 2 {
        assert!(child.try_wait().unwrap().is_none(), "it has ended too soon");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    // No other program writes into a running scan, not even a refusal.
    let refused = epirig(folder.path(), &["resume", "seq"]);
    assert_eq!(refused.status.code(), Some(1));
    child.kill().unwrap();
    child.wait().unwrap();
    let before = fs::read_to_string(&log).unwrap();
    let whole = before.rfind('\n').unwrap() + 1;
    before[..whole].lines().for_each(|line| drop(serde_json::from_str::<Value>(line).unwrap()));
    assert!(!before.contains(r#""verb":"resume""#));
    // As a loss of power leaves it.
    fs::write(&log, before.clone() + "{\"timestamp\":\"20").unwrap();
    succeeds(folder.path(), &["resume", "seq"]);
    let after = lines(&log);
    assert!(fs::read_to_string(&log).unwrap().starts_with(&before[..whole]));
    let verbs: Vec<&Value> =
        with(&after, "begun").into_iter().map(|line| &line["spans"][0]["verb"]).collect();
    assert_eq!(verbs, ["capture", "resume"]);
    assert_eq!(with(&after, "the scan continues").len(), 1);
    assert!(with(&after, "moved").iter().all(|line| line["level"] == "DEBUG"));
    assert!(!fs::read_to_string(&log).unwrap().contains("swordfish"));
    succeeds(folder.path(), &["verify", "seq"]);
    // A run that refuses a folder does not change its log.
    let kept = fs::read(&log).unwrap();
    assert_eq!(capture(folder.path(), "seq", &[]).status.code(), Some(2));
    assert!(!seq.join("results").exists());
    assert_eq!(fs::read(&log).unwrap(), kept);
    assert_eq!(capture(folder.path(), "dry", &["--dry-run"]).status.code(), Some(0));
    assert!(!folder.path().join("dry").exists());
}

#[test]
fn a_log_that_cannot_be_written_stops_nothing_and_is_told_once() {
    let folder = tempfile::tempdir().unwrap();
    assert!(capture(folder.path(), "seq", &[]).status.success());
    let log = folder.path().join("seq/log.jsonl");
    let resumed = |what: &str| {
        let output = epirig(folder.path(), &["resume", "seq"]);
        assert!(output.status.success(), "{what}: {output:?}");
        let notes = text(&output.stderr).matches("seq/log.jsonl: the scan continues without a log").count();
        assert_eq!(notes, 1, "{what}: {output:?}");
        succeeds(folder.path(), &["verify", "seq"]);
    };
    fs::remove_file(&log).unwrap();
    fs::create_dir(&log).unwrap();
    resumed("a folder");
    fs::remove_dir(&log).unwrap();
    #[cfg(unix)]
    {
        let outside = folder.path().join("outside");
        fs::write(&outside, "mine").unwrap();
        std::os::unix::fs::symlink(&outside, &log).unwrap();
        resumed("a link that leads outside");
        assert_eq!(fs::read_to_string(&outside).unwrap(), "mine");
    }
    #[cfg(target_os = "linux")]
    {
        let full = capture(folder.path(), "full", &["--log-file", "/dev/full"]);
        assert!(full.status.success());
        assert_eq!(text(&full.stderr).matches("cannot write the log").count(), 1, "{full:?}");
        succeeds(folder.path(), &["verify", "full"]);
        // Files of at most 16 blocks of 512 bytes: the log is the first that is full. A line is there as a whole or not at all.
        let script = format!(
            "trap '' XFSZ; ulimit -f 16; exec {} {} --out small",
            env!("CARGO_BIN_EXE_epirig"),
            CAPTURE.join(" ")
        );
        let small = Command::new("sh")
            .args(["-c", &script])
            .current_dir(folder.path())
            .env("XDG_CONFIG_HOME", folder.path())
            .output()
            .unwrap();
        let said = text(&small.stderr);
        assert!(small.status.success(), "{said}");
        assert_eq!(said.matches("small/log.jsonl: cannot write the log").count(), 1, "{said}");
        lines(&folder.path().join("small/log.jsonl"));
    }
}

/// Kind and exit code of the one JSON object that a failure leaves on stdout.
fn failure(output: &Output) -> (String, u64) {
    let stdout = text(&output.stdout);
    let object: Value = serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error}: {stdout}"));
    let error = &object["error"];
    let told = text(&output.stderr);
    let line = told.lines().find_map(|line| line.strip_prefix("error: ")).unwrap();
    assert_eq!(error["message"], line);
    assert_eq!(error["exit_code"].as_i64(), output.status.code().map(i64::from));
    (error["kind"].as_str().unwrap().to_owned(), error["exit_code"].as_u64().unwrap())
}

#[test]
fn a_failure_is_one_json_object() {
    let folder = tempfile::tempdir().unwrap();
    let fails = |arguments: &[&str], kind: &str, code: u64| {
        let output = epirig(folder.path(), &[arguments, &["--json"]].concat());
        assert_eq!(failure(&output), (kind.to_owned(), code), "{arguments:?}");
        let plain = epirig(folder.path(), arguments);
        assert_eq!((plain.status.code(), text(&plain.stdout)), (output.status.code(), String::new()));
    };
    fails(&["verify", "none"], "usage", 2);
    fails(&["match", "none"], "usage", 2);
    fails(&["stage", "position", "--port", "none"], "no-device", 3);
    fails(&["camera", "get", "--camera", "/none"], "no-device", 3);
    images(&folder.path().join("photos"), 5);
    succeeds(folder.path(), &["import", "photos", "--out", "seq"]);
    fails(&["import", "photos", "--out", "seq"], "usage", 2);
    fs::write(folder.path().join("seq/frames/0002.png"), "damaged").unwrap();
    fails(&["match", "seq"], "data", 5);
    // What it has found is its result, although it fails.
    let verified = epirig(folder.path(), &["verify", "seq", "--json"]);
    assert_eq!(verified.status.code(), Some(5));
    let result: Value = serde_json::from_str(&text(&verified.stdout)).unwrap();
    assert_eq!(result["good_frames"], 4);
}

#[test]
#[cfg(unix)]
fn an_interruption_is_one_json_object() {
    let folder = tempfile::tempdir().unwrap();
    images(&folder.path().join("photos"), 5);
    // The positions never come. A scan ends after the frame in hand.
    let import = ["import", "photos", "--out", "seq", "--positions", "/dev/stdin"];
    let scan = [&CAPTURE, &["--out", "scan", "--set", "sim.real_time=true"][..]].concat();
    for (arguments, awaited, kind, code) in
        [(&import[..], "begun", "interrupted", 130), (&scan[..], "frame written", "resumable", 7)]
    {
        let log = folder.path().join(kind);
        let arguments = [arguments, &["--json", "--log-file", kind]].concat();
        let mut command = command(folder.path(), &arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let _open = child.stdin.take();
        while !fs::read_to_string(&log).is_ok_and(|text| text.contains(awaited)) {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        let pid = child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
        assert_eq!(failure(&child.wait_with_output().unwrap()), (kind.to_owned(), code));
    }
}
