//! Files that were damaged, exchanged or made to do harm: nothing hangs, nothing outside is read, and nothing is believed that another record or the
//! files themselves contradict.

mod calibrations;
mod files;
mod places;
mod records;
mod results;
mod words;

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{epirig, fails, images, succeeds};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// A sequence of images that other software took, with positions and a lens.
fn imported(folder: &Path) {
    images(&folder.join("photos"), 9);
    let arguments = ["import", "photos", "--out", "seq", "--step-mm", "1.5", "--focal-length-px", "100"];
    succeeds(folder, &arguments);
}

/// A scan of eight frames with their certificates.
fn captured(folder: &Path) {
    let plan = ["--size", "64x48", "--set", "plan.frames=8", "--set", "sim.scene=plane"];
    succeeds(folder, &[&["capture", "--out", "seq", "--rig", "sim"][..], &plan].concat());
}

/// Replaces a text that is there once in a file of the sequence.
fn edit(folder: &Path, file: &str, from: &str, to: &str) {
    let path = folder.join("seq").join(file);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from} is not in {file}:\n{text}");
    fs::write(&path, text.replacen(from, to, 1)).unwrap();
}

/// The line of the journal about a frame, as JSON.
fn line(folder: &Path, index: usize) -> serde_json::Value {
    let journal = fs::read_to_string(folder.join("seq/journal.jsonl")).unwrap();
    serde_json::from_str(journal.lines().nth(index).unwrap()).unwrap()
}

/// Changes lines of the journal.
fn change_lines(folder: &Path, change: impl Fn(&mut Vec<serde_json::Value>)) {
    let path = folder.join("seq/journal.jsonl");
    let journal = fs::read_to_string(&path).unwrap();
    let mut lines = journal.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    change(&mut lines);
    let lines: Vec<String> = lines.iter().map(|line| format!("{line}\n")).collect();
    fs::write(&path, lines.concat()).unwrap();
}

/// `verify` finds these words, and nothing is calibrated or matched.
fn is_refused(folder: &Path, words: &[&str]) {
    let output = epirig(folder, &["verify", "seq"]);
    let said =
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(5), "{said}");
    for word in words {
        assert!(said.contains(word), "verify does not say \"{word}\": {said}");
    }
    fails(folder, &["match", "seq", "--range", "0..9"], 5, &[]);
    fails(folder, &["calibrate", "seq", "--positions", "texture"], 5, &[]);
    assert!(!folder.join("seq/results").exists() && !folder.join("seq/calibration.json").exists());
}

fn make_pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// The program's exit code and what it said, if it ends by itself within a minute: what waits for a pipe would not.
fn within_a_minute(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
    command.current_dir(folder).env("XDG_CONFIG_HOME", folder).args(arguments);
    let output = command.timeout(std::time::Duration::from_secs(60)).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}
