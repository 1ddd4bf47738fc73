//! What the whole-program tests share: small folders of images, and the program run on them.

#![allow(dead_code, reason = "each test program uses a part of this")]
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::path::Path;
use std::process::Output;

use epirig_core::frame::Frame;
use epirig_data::sequence::encode_png;
use epirig_simulator::{Simulator, SimulatorConfig};

/// Runs the program and waits for it.
pub fn epirig(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = assert_cmd::cargo::cargo_bin_cmd!("epirig");
    // Profile and environment of the user who runs the tests must not matter.
    command.current_dir(folder).env("XDG_CONFIG_HOME", folder).env_remove("EPIRIG_LOG");
    command.args(arguments).output().unwrap()
}

/// Runs the program, which must succeed, and gives what it prints.
pub fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let output = epirig(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program, which must fail with this exit code and one line that holds all of `words`.
pub fn fails(folder: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let output = epirig(folder, arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    let line = stderr
        .lines()
        .find(|line| line.starts_with("error: "))
        .unwrap_or_else(|| panic!("no error: {stderr}"));
    for word in words {
        assert!(line.contains(word), "{arguments:?} does not say \"{word}\": {line}");
    }
    assert!(!stderr.contains("panicked"), "{stderr}");
}

/// A small simulator: a textured plane with 8 px of disparity.
pub fn simulator(frames: usize) -> Simulator {
    Simulator::new(SimulatorConfig::textured_plane(64, 24, frames)).unwrap()
}

/// Writes frame 0.png, 1.png ... of a small simulator into `folder`.
pub fn images(folder: &Path, frames: usize) {
    std::fs::create_dir_all(folder).unwrap();
    let simulator = simulator(frames);
    for (index, &position) in simulator.config().scan.positions_mm().iter().enumerate() {
        write_png(&folder.join(format!("frame_{index}.png")), &simulator.expose(position, index as u32));
    }
}

/// Writes the images of a simulator's scan, whose steps are 5 mm, and imports them as `seq`, with `more` options.
pub fn import_scan(folder: &Path, simulator: &Simulator, more: &[&str]) {
    std::fs::create_dir(folder.join("photos")).unwrap();
    for (index, &position) in simulator.config().scan.positions_mm().iter().enumerate() {
        write_png(&folder.join(format!("photos/{index:03}.png")), &simulator.expose(position, index as u32));
    }
    let focal_length = simulator.config().optics.focal_length_px.to_string();
    let scale = ["--step-mm", "5", "--focal-length-px", &focal_length];
    succeeds(folder, &[&["import", "photos", "--out", "seq"], &scale[..], more].concat());
}

/// Writes a frame as PNG.
pub fn write_png(path: &Path, frame: &Frame) {
    std::fs::write(path, encode_png(frame).unwrap()).unwrap();
}

/// Names in a folder, sorted; hidden ones too.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}
