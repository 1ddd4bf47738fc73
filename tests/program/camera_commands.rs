//! What a user does with a camera, from the command line, without hardware: a simulated camera, or a sequence in a camera's place.

use std::path::Path;

use crate::support::{epirig, fails, succeeds};
use epirig_core::frame::{Frame, Samples};
use epirig_data::formats::MapFormat;
use epirig_data::sequence::{Origin, Sequence, decode_grey};
use epirig_simulator::{SimulatedScan, Simulator, SimulatorConfig};

fn read(path: &Path) -> Frame {
    decode_grey(&std::fs::read(path).unwrap()).unwrap().frame
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

/// What the simulated camera looks at.
fn simulator() -> Simulator {
    Simulator::new(SimulatorConfig::textured_plane(320, 240, 2)).unwrap()
}

#[test]
fn a_grabbed_frame_is_what_the_camera_sees() {
    let folder = tempfile::tempdir().unwrap();
    let grab = ["grab", "--camera", "sim", "--size", "320x240", "--out", "frame.png", "--json"];
    let grabbed = json(&succeeds(folder.path(), &grab));
    let frame = read(&folder.path().join("frame.png"));
    assert!(frame == simulator().expose(0.0, 0));
    let Samples::U8(samples) = frame.samples() else { panic!() };
    let mean = samples.iter().map(|&sample| f64::from(sample)).sum::<f64>() / samples.len() as f64;
    assert!((grabbed["mean_dn"].as_f64().unwrap() - mean).abs() < 1e-9);
    assert_eq!(grabbed["histogram"].as_array().unwrap().len(), 256);
    assert_eq!(grabbed["timing"], "start-of-exposure");
    assert!(grabbed["controls"].as_array().unwrap().contains(&serde_json::json!(["auto_exposure", 1])));
    // Text for a person, and nothing overwritten.
    fails(
        folder.path(),
        &["grab", "--camera", "sim", "--out", "frame.png"],
        2,
        &["frame.png exists already"],
    );
    let text = succeeds(folder.path(), &["grab", "--camera", "sim", "--out", "other.png"]);
    assert!(text.contains("focus") && text.contains("saturated"), "{text}");
    fails(folder.path(), &["grab", "--camera", "sim", "--out", "frame.jpg"], 2, &["ends in .png"]);
}

#[test]
fn light_follows_exposure_and_an_average_has_sixteen_bits_and_its_variance() {
    let folder = tempfile::tempdir().unwrap();
    let grab = |more: &[&str]| {
        let arguments = ["grab", "--camera", "sim", "--size", "320x240", "--json"];
        json(&succeeds(folder.path(), &[&arguments[..], more].concat()))
    };
    let half = grab(&["--out", "half.png", "--exposure-us", "5000"]);
    let full = grab(&["--out", "full.png"]);
    let ratio = full["mean_dn"].as_f64().unwrap() / half["mean_dn"].as_f64().unwrap();
    // Rounding moves a mean by far less than 0.1 DN of some 100.
    assert!((ratio - 2.0).abs() < 0.005, "{ratio}");
    let mean = grab(&["--out", "mean.png", "--average", "3"]);
    assert_eq!((mean["bit_depth"].as_u64(), mean["averaged"].as_u64()), (Some(16), Some(3)));
    let (Samples::U16(mean), Samples::U8(single)) = (
        read(&folder.path().join("mean.png")).samples().clone(),
        simulator().expose(0.0, 0).samples().clone(),
    ) else {
        panic!()
    };
    assert!(mean.iter().zip(&single).all(|(&mean, &single)| mean == u16::from(single) * 257));
    let variance = std::fs::read(folder.path().join("mean-variance.tiff")).unwrap();
    let variance = MapFormat::Tiff.decode(&variance).unwrap();
    assert!(variance.values().iter().all(|&value| value == 0.0), "the simulator has no noise here");
}

#[test]
fn controls_are_read_and_set_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let all = json(&succeeds(folder.path(), &["camera", "get", "--camera", "sim", "--json"]));
    assert_eq!(all.as_array().unwrap().len(), 3);
    let gain = json(&succeeds(folder.path(), &["camera", "set", "gain", "7", "--camera", "sim", "--json"]));
    assert_eq!(gain["value"], 7);
    let text = succeeds(folder.path(), &["camera", "set", "auto_exposure", "Manual Mode", "--camera", "sim"]);
    assert!(text.contains("1 (Manual Mode)"), "{text}");
    let words = ["did you mean exposure_time_absolute?"];
    fails(folder.path(), &["camera", "get", "exposure_time", "--camera", "sim"], 2, &words);
    fails(folder.path(), &["camera", "set", "gain", "101", "--camera", "sim"], 2, &["0 to 100"]);
    let grab = ["grab", "--camera", "sim", "--out", "x.png"];
    let refused = |more: &[&str], words: &[&str]| fails(folder.path(), &[&grab[..], more].concat(), 2, words);
    refused(&["--exposure-us", "50000"], &["exposure_time_absolute", "100 us to 20000 us"]);
    refused(&["--control", "gian=3"], &["did you mean gain?"]);
    refused(&["--control", "gain"], &["NAME=VALUE"]);
    refused(&["--format", "YUYV"], &["format YUYV", "GREY"]);
    refused(&["--size", "32"], &["COLUMNSxROWS"]);
    refused(&["--exposure-us", "0"], &["--exposure-us", "1 ns to 24 h"]);
    assert!(!folder.path().join("x.png").exists());
}

#[test]
fn a_scan_is_captured_verified_and_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let scan = [
        "capture",
        "--out",
        "seq",
        "--start-mm",
        "2",
        "--step-mm",
        "0.5",
        "--frames",
        "6",
        "--driver",
        "sim",
    ];
    let camera = ["--camera", "sim", "--size", "320x240"];
    succeeds(folder.path(), &[&scan[..], &camera].concat());
    succeeds(folder.path(), &["verify", "seq"]);
    let sequence = Sequence::open(&folder.path().join("seq")).unwrap();
    let mut config = SimulatorConfig::textured_plane(320, 240, 6);
    config.scan = SimulatedScan { start_mm: 2.0, step_mm: 0.5, frames: 6 };
    let simulator = Simulator::new(config).unwrap();
    for (index, record) in sequence.frames().iter().enumerate() {
        let position_mm = 2.0 + 0.5 * index as f64;
        assert!(sequence.read(record).unwrap() == simulator.expose(position_mm, 0), "frame {index}");
        let exposure = record.exposure.as_ref().unwrap();
        assert!(exposure.exposure_start_ns >= exposure.requested_ns);
        assert!(exposure.stale > 0, "a move leaves stale frames in the queue");
    }
    let Origin::Captured { configuration: Some(camera_record), .. } = &sequence.record().origin else {
        panic!()
    };
    assert_eq!((camera_record.format.as_str(), camera_record.averaged), ("GREY", 1));
    assert_eq!(camera_record.controls["exposure_time_absolute"], 100);
    // The same frames again, from the folder in a camera's place.
    let again = [
        "capture",
        "--out",
        "again",
        "--start-mm",
        "2",
        "--step-mm",
        "0.5",
        "--frames",
        "6",
        "--driver",
        "sim",
    ];
    succeeds(folder.path(), &[&again[..], &["--camera", "replay:seq"]].concat());
    let replayed = Sequence::open(&folder.path().join("again")).unwrap();
    for (one, other) in sequence.frames().iter().zip(replayed.frames()) {
        assert_eq!(one.blake3, other.blake3);
    }
    let more = ["capture", "--out", "more", "--step-mm", "0.5", "--frames", "7", "--driver", "sim"];
    let more = [&more[..], &["--camera", "replay:seq"]].concat();
    fails(folder.path(), &more, 5, &["replay:seq", "all of its 6 frames", "cannot continue until"]);
    // What was taken until then stays, and says how it ended.
    assert_eq!(Sequence::open(&folder.path().join("more")).unwrap().frames().len(), 6);
    fails(folder.path(), &["resume", "more"], 5, &["all of its 6 frames"]);
    // One that can go on, does with the frame that is missing, not with its first.
    std::fs::remove_file(folder.path().join("again/frames/0004.png")).unwrap();
    succeeds(folder.path(), &["resume", "again"]);
    let resumed = Sequence::open(&folder.path().join("again")).unwrap();
    assert_eq!(resumed.frames()[4].blake3, sequence.frames()[4].blake3);
}

#[test]
fn a_scan_that_cannot_be_is_refused_before_anything_moves() {
    let folder = tempfile::tempdir().unwrap();
    let capture = |more: &[&str]| {
        let arguments = ["capture", "--out", "seq", "--step-mm", "1.5", "--frames", "3"];
        [&arguments[..], more].concat().iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let refused = |more: &[&str], code: i32, words: &[&str]| {
        let arguments = capture(more);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        fails(folder.path(), &arguments, code, words);
        assert!(!folder.path().join("seq").exists());
    };
    refused(&["--driver", "sim", "--camera", "sim", "--start-mm", "199"], 2, &["202.000 mm", "0 to 200 mm"]);
    refused(&["--driver", "sim", "--camera", "replay:nothing"], 2, &["nothing"]);
    refused(&["--driver", "sim", "--camera", "/dev/no-such-camera"], 3, &["/dev/no-such-camera"]);
    refused(&["--port", "/dev/no-such-port", "--camera", "sim"], 3, &["/dev/no-such-port"]);
}

#[test]
fn every_build_on_linux_looks_for_cameras() {
    let folder = tempfile::tempdir().unwrap();
    let output = epirig(folder.path(), &["grab", "--camera", "/dev/no-such-camera", "--out", "x.png"]);
    assert_eq!(output.status.code(), Some(3));
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    let expected = if cfg!(target_os = "linux") { "there is no camera" } else { "on Linux only" };
    assert!(stderr.contains(expected), "{stderr}");
    let devices = epirig(folder.path(), &["devices"]);
    assert!(matches!(devices.status.code(), Some(0 | 3)));
    let note = String::from_utf8_lossy(&devices.stderr).contains("cameras were not looked for");
    assert_eq!(note, !cfg!(target_os = "linux"));
}
