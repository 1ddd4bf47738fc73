//! Every verb that writes, interrupted at any moment: by a signal at 300 random moments of each, and by a signal, a kill or a full disk at each of its
//! steps on the disk; in the short form at a quarter of the moments and steps. What was there before, or what was to come, is there whole, and an interruption by hand leaves nothing behind.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Instant;

use crate::size::{is_full, repetitions};
use crate::support::{images, succeeds, write_png};
use epirig::calibrate::read_calibration;
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Silent;
use epirig_data::packed::PackedVolume;
use epirig_data::sequence::{Sequence, verify};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::{Pid, Signal, kill_process};

/// Signals that people and systems send: Ctrl-C, a request to end, a terminal that goes away.
const SIGNALS: [Signal; 3] = [Signal::INT, Signal::TERM, Signal::HUP];
const MOMENTS: usize = 300;

/// A verb, and what it must leave.
struct Case {
    arguments: &'static [&'static str],
    /// The folder or file that it writes.
    target: &'static str,
    /// Whether that was there before.
    replaces: bool,
    /// Whether former and new results change places as a whole: then it is one of the two, with all of its files.
    exchanges: bool,
    /// Whether what is there is whole.
    is_whole: fn(&Path) -> bool,
}

/// The verbs that write, each of which takes other options than what made its former results.
fn cases() -> Vec<Case> {
    let sequence = |path: &Path| {
        Sequence::open(path).is_ok_and(|sequence| verify(&sequence, &Silent).unwrap().findings.is_empty())
    };
    vec![
        Case {
            arguments: &["match", "seq", "--overwrite", "--range", "0..12"],
            target: "seq/results",
            replaces: true,
            exchanges: true,
            is_whole: |path| epirig::results::ResultFiles::open_match(path).is_ok(),
        },
        Case {
            arguments: &["surface", "seq", "--overwrite", "--trend", "plane"],
            target: "seq/results/surface",
            replaces: true,
            exchanges: true,
            is_whole: |path| path.join("surface.json").is_file(),
        },
        Case {
            arguments: &["calibrate", "seq", "--overwrite", "--flat-field", "pixels"],
            target: "seq/calibration",
            replaces: true,
            exchanges: false,
            is_whole: |path| {
                let sequence = Sequence::open(path.parent().unwrap()).unwrap();
                matches!(read_calibration(&sequence), Ok(Some(_)))
            },
        },
        Case {
            arguments: &["import", "photos", "--out", "imported", "--dark", "dark"],
            target: "imported",
            replaces: false,
            exchanges: false,
            is_whole: sequence,
        },
        Case {
            arguments: &["rectify", "seq", "--out", "straight"],
            target: "straight",
            replaces: false,
            exchanges: false,
            is_whole: sequence,
        },
        Case {
            arguments: &["pack", "seq"],
            target: "seq/volume.zarr",
            replaces: false,
            exchanges: false,
            // Whole frames stay, and the next run goes on with them.
            is_whole: |path| {
                let packed = || PackedVolume::open(path)?.rows(0..24, &Silent);
                path.join("packing.json").is_file() || packed().is_ok()
            },
        },
        Case {
            arguments: &[
                "run",
                "--out",
                "ran",
                "--rig",
                "sim",
                "--size",
                "64x48",
                "--set",
                "plan.frames=6",
                "--set",
                "sim.scene=plane",
                "--range",
                "0..12",
                "--anyway",
            ],
            target: "ran",
            replaces: false,
            exchanges: false,
            // A scan that was interrupted can be resumed: what its journal names is there.
            is_whole: |path| {
                let sequence = Sequence::open(path).unwrap();
                let results = path.join("results");
                sequence.frames().iter().all(|frame| sequence.read(frame).is_ok())
                    && (!results.exists() || epirig::results::ResultFiles::open_match(&results).is_ok())
            },
        },
        Case {
            arguments: &["resume", "cut"],
            target: "cut",
            replaces: true,
            exchanges: false,
            is_whole: |path| {
                let sequence = Sequence::open(path).unwrap();
                let frames = sequence.frames();
                frames.len() >= 4 && frames.iter().all(|frame| sequence.read(frame).is_ok())
            },
        },
        Case {
            arguments: &["init", "--out", "rig.toml"],
            target: "rig.toml",
            replaces: false,
            exchanges: false,
            is_whole: |path| fs::read_to_string(path).unwrap().contains("[sim]"),
        },
        Case {
            arguments: &["export", "seq", "--out", "map.npy"],
            target: "map.npy",
            replaces: false,
            exchanges: false,
            is_whole: |path| epirig::results::read_map(path).is_ok(),
        },
        Case {
            arguments: &["target", "print", "--out", "board.pdf"],
            target: "board.pdf",
            replaces: false,
            exchanges: false,
            is_whole: |path| fs::read(path).unwrap().ends_with(b"%%EOF\n"),
        },
        Case {
            arguments: &["grab", "--camera", "sim", "--size", "64x48", "--out", "grabbed.png"],
            target: "grabbed.png",
            replaces: false,
            exchanges: false,
            is_whole: |path| epirig_data::sequence::decode_grey(&fs::read(path).unwrap()).is_ok(),
        },
    ]
}

/// A folder in which every verb has something to do.
fn prepared() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    images(&path.join("photos"), 9);
    for (kind, level) in [("dark", 3), ("white", 200)] {
        fs::create_dir(path.join(kind)).unwrap();
        for index in 0..4_usize {
            let samples = (0..24 * 64_usize).map(|pixel| level + ((pixel * 7 + index * 5) % 3) as u8);
            let frame = Frame::new(24, 64, 8, Samples::U8(samples.collect())).unwrap();
            write_png(&path.join(kind).join(format!("{index}.png")), &frame);
        }
    }
    let import = ["import", "photos", "--out", "seq", "--step-mm", "1.5", "--focal-length-px", "100"];
    succeeds(path, &[&import[..], &["--dark", "dark", "--flat", "white"]].concat());
    succeeds(path, &["calibrate", "seq", "--flat-field", "order:1"]);
    succeeds(path, &["match", "seq", "--as-captured"]);
    succeeds(path, &["surface", "seq"]);
    // A scan that was killed after its fourth frame.
    let scan = ["--size", "64x48", "--set", "plan.frames=8", "--set", "sim.scene=plane"];
    succeeds(path, &[&["capture", "--out", "cut", "--rig", "sim"][..], &scan].concat());
    let journal = fs::read_to_string(path.join("cut/journal.jsonl")).unwrap();
    let lines: Vec<&str> = journal.split_inclusive('\n').take(4).collect();
    fs::write(path.join("cut/journal.jsonl"), lines.concat()).unwrap();
    fs::remove_file(path.join("cut/stop.json")).unwrap();
    for index in 4..8 {
        fs::remove_file(path.join(format!("cut/frames/{index:04}.png"))).unwrap();
    }
    folder
}

/// A copy that a verb may change.
fn copied(prepared: &Path) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let copy = Command::new("cp").arg("-r").arg(prepared.join(".")).arg(folder.path()).status();
    assert!(copy.unwrap().success());
    folder
}

/// All files below a folder, or a file itself, with their bytes.
fn content(path: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![path.to_owned()];
    while let Some(path) = folders.pop() {
        match fs::read_dir(&path) {
            Ok(entries) => folders.extend(entries.map(|entry| entry.unwrap().path())),
            Err(_) => drop(fs::read(&path).map(|bytes| found.insert(path, bytes))),
        }
    }
    found
}

/// Hidden things of ours that are left in a folder or below it.
fn left_behind(folder: &Path) -> Vec<PathBuf> {
    let (mut hidden, mut folders) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
            if entry.file_name().to_string_lossy().starts_with('.') {
                hidden.push(entry.path());
            } else if entry.file_type().unwrap().is_dir() {
                folders.push(entry.path());
            }
        }
    }
    hidden
}

/// Names of the files of results, but for what another verb adds to them.
fn names<'a>(files: impl Iterator<Item = &'a PathBuf>, target: &Path) -> BTreeSet<PathBuf> {
    let names = files.filter_map(|path| path.strip_prefix(target).ok());
    names.filter(|name| !name.starts_with("surface")).map(Path::to_owned).collect()
}

/// Whether a file of results is one to its end.
fn is_readable(path: &Path, bytes: &[u8]) -> bool {
    match path.extension().unwrap().to_str().unwrap() {
        "tiff" | "pfm" | "npy" => epirig::results::read_map(path).is_ok(),
        "png" => epirig_data::sequence::decode_grey(bytes).is_ok(),
        "json" => serde_json::from_slice::<serde_json::Value>(bytes).is_ok(),
        "csv" => bytes.ends_with(b"\n"),
        _ => !bytes.is_empty(),
    }
}

/// How a verb ended that was disturbed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Disturbance {
    /// A signal that it can hear.
    Signal,
    /// It was killed, or the disk was full.
    Harder,
}

/// Holds what is there now to what was there before.
fn judge(case: &Case, folder: &Path, before: &BTreeMap<PathBuf, Vec<u8>>, output: &Output, by: Disturbance) {
    let Case { arguments, target, .. } = case;
    let said = String::from_utf8_lossy(&output.stderr);
    let context = format!("{arguments:?} ended with {:?}: {said}", output.status);
    assert!(!said.contains("panicked"), "{context}");
    let target = folder.join(target);
    if target.exists() {
        assert!((case.is_whole)(&target), "half of a result: {context}");
        if case.exchanges {
            let now = content(&target);
            assert_eq!(names(now.keys(), &target), names(before.keys(), &target), "{context}");
            for (path, bytes) in &now {
                assert!(is_readable(path, bytes), "half of {}: {context}", path.display());
            }
        }
    } else {
        assert!(!case.replaces, "the former result is gone: {context}");
        assert!(!output.status.success(), "{context}");
    }
    // All other files are unchanged.
    let spared = |path: &&PathBuf| !path.starts_with(&target) && !path.ends_with("calibration.json");
    for (path, bytes) in before.iter().filter(|(path, _)| spared(path)) {
        assert_eq!(fs::read(path).ok().as_ref(), Some(bytes), "{}: {context}", path.display());
    }
    if by == Disturbance::Signal {
        assert!(left_behind(folder).is_empty(), "{:?} is left behind: {context}", left_behind(folder));
    }
}

/// After any interruption the verb works, and leaves nothing of the interrupted run.
fn goes_on(case: &Case, folder: &Path) {
    let target = folder.join(case.target);
    if !case.replaces && target.exists() {
        match target.is_dir() {
            true => fs::remove_dir_all(&target).unwrap(),
            false => fs::remove_file(&target).unwrap(),
        }
    }
    succeeds(folder, case.arguments);
    assert!((case.is_whole)(&target), "{:?}", case.arguments);
    assert!(left_behind(folder).is_empty(), "{:?}: {:?}", case.arguments, left_behind(folder));
}

fn spawn(program: &mut Command, folder: &Path) -> Child {
    program
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn send(signal: Signal, child: &Child) {
    // It may have ended before, and nobody has waited for it: its number is its own.
    let _ = kill_process(Pid::from_child(child), signal);
}

#[test]
#[ignore = "takes minutes; `.ci/run` runs it"]
fn signals_to_each_verb_at_random_moments_lose_nothing() {
    let seed = 20_261_123;
    println!("seed {seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let prepared = prepared();
    for case in cases() {
        let folder = copied(prepared.path());
        let began = Instant::now();
        assert!(
            spawn(Command::new(env!("CARGO_BIN_EXE_epirig")).args(case.arguments), folder.path())
                .wait()
                .unwrap()
                .success()
        );
        let whole = began.elapsed();
        let (mut interrupted, mut done, mut unheard) = (0, 0, 0);
        let mut folder = copied(prepared.path());
        for moment in 0..repetitions(MOMENTS) {
            let before = content(folder.path());
            let child = spawn(Command::new(env!("CARGO_BIN_EXE_epirig")).args(case.arguments), folder.path());
            std::thread::sleep(whole.mul_f64(random.random_range(0.0..1.1)));
            send(SIGNALS[moment % SIGNALS.len()], &child);
            let output = child.wait_with_output().unwrap();
            // A signal that came before the program listens ends it at once; nothing is begun by then.
            match output.status.code() {
                Some(0) => done += 1,
                // A scan says that it can be resumed.
                Some(130 | 7) => interrupted += 1,
                None => unheard += 1,
                Some(_) => panic!("{:?}: {}", case.arguments, String::from_utf8_lossy(&output.stderr)),
            }
            judge(&case, folder.path(), &before, &output, Disturbance::Signal);
            // If nothing is left to do, it starts again.
            if !case.exchanges && folder.path().join(case.target).exists() {
                folder = copied(prepared.path());
            }
        }
        goes_on(&case, folder.path());
        println!(
            "{} ({} ms): {interrupted} interrupted, {done} done before, {unheard} before it listened",
            case.arguments[0],
            whole.as_millis()
        );
    }
}

/// System calls by which names change and files reach the disk: the steps of the disk, but for those that write bytes.
const STEPS: &str = "rename,renameat,renameat2,mkdir,mkdirat,unlink,unlinkat,rmdir,fsync,linkat";
const STEPS_AND_WRITES: &str =
    "rename,renameat,renameat2,mkdir,mkdirat,unlink,unlinkat,rmdir,fsync,linkat,write";

/// Runs a verb in which `inject` happens at its nth step on the disk; whether there was such a step.
fn traced(case: &Case, folder: &Path, (steps, inject): (&str, &str), step: usize) -> Option<(Output, bool)> {
    let place = tempfile::tempdir().unwrap();
    let log = place.path().join("strace");
    let mut command = Command::new("strace");
    command.args(["-f", "-qq", "--seccomp-bpf", "-e", "signal=none", "-o"]).arg(&log);
    command.args(["-e", &format!("trace={steps}"), "-e", &format!("inject={steps}:{inject}:when={step}")]);
    command.arg(env!("CARGO_BIN_EXE_epirig")).args(case.arguments);
    let output = spawn(&mut command, folder).wait_with_output().unwrap();
    let log = fs::read_to_string(log).ok()?;
    // Steps are counted for each thread; one of them does nearly all.
    let mut steps: BTreeMap<&str, usize> = BTreeMap::new();
    for line in log.lines().filter(|line| line.contains('(') && !line.contains("resumed>")) {
        *steps.entry(line.split(' ').next().unwrap()).or_default() += 1;
    }
    let most = steps.into_values().max().unwrap_or(0);
    Some((output, most >= step))
}

/// Whether this machine lets a test follow a program's system calls.
fn can_trace(name: &str) -> bool {
    let traced =
        Command::new("strace").args(["-f", "-qq", "--seccomp-bpf", "-e", "trace=none", "true"]).output();
    let can = traced.is_ok_and(|output| output.status.success());
    if !can {
        eprintln!("SKIPPED {name}: there is no strace, or it may not trace");
    }
    can
}

/// Each verb, disturbed at each of its steps on the disk in turn.
fn disturb_each_step(steps_of: &str, inject: &str, by: Disturbance) {
    let prepared = prepared();
    for case in cases() {
        let mut steps = 0;
        // In the short form the first ones, and every fourth of the others.
        let stride = if is_full() { 1 } else { 4 };
        for step in (1..=3).chain((4..).step_by(stride)) {
            let folder = copied(prepared.path());
            let before = content(folder.path());
            let (output, happened) = traced(&case, folder.path(), (steps_of, inject), step).unwrap();
            judge(&case, folder.path(), &before, &output, by);
            if !happened {
                assert!(output.status.success(), "{:?}: {output:?}", case.arguments);
                break;
            }
            steps = step;
            goes_on(&case, folder.path());
        }
        println!("{}: {inject} at steps up to {steps}", case.arguments[0]);
        // A file or folder is at least written whole: synced, renamed, its folder synced.
        assert!(steps >= 3, "{:?}: the test has gone blind", case.arguments);
    }
}

#[test]
#[ignore = "takes minutes; `.ci/run` runs it"]
fn a_signal_at_each_step_of_the_disk_loses_nothing() {
    if can_trace("a_signal_at_each_step_of_the_disk_loses_nothing") {
        disturb_each_step(STEPS, "signal=TERM", Disturbance::Signal);
    }
}

#[test]
#[ignore = "takes minutes; `.ci/run` runs it"]
fn a_kill_at_each_step_of_the_disk_loses_nothing() {
    if can_trace("a_kill_at_each_step_of_the_disk_loses_nothing") {
        disturb_each_step(STEPS, "signal=KILL", Disturbance::Harder);
    }
}

#[test]
#[ignore = "takes minutes; `.ci/run` runs it"]
fn a_disk_that_refuses_any_one_step_loses_nothing() {
    if can_trace("a_disk_that_refuses_any_one_step_loses_nothing") {
        disturb_each_step(STEPS_AND_WRITES, "error=ENOSPC", Disturbance::Harder);
    }
}
