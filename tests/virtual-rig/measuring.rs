//! From a rig that was never seen before to a disparity map: profile, scan, results.

use std::path::Path;

use epirig::profile::Profile;
use epirig::results::{ResultFiles, read_map};
use epirig_data::sequence::Sequence;
use epirig_devices::camera::Size;

use super::guest::{FRAMES, PORT, Rig, SIZE, STEP_MM, Workplace, assert_exact, here, passed, succeeds};
use super::uvc::Format;
use super::uvc_bench::{Kind, UvcRig};
use super::vivid_bench::{CAMERA, Playing, plug_vivid};

/// `init` finds what is connected, and a scan can be planned with that.
fn plan_what_is_connected(rig: &dyn Rig) {
    let workplace = Workplace::new(rig);
    let written = workplace.path("found.toml");
    succeeds(&["init", "--out", &written]);
    let text = std::fs::read_to_string(&written).unwrap();
    let profile = Profile::read(&text, &written, &[]).unwrap();
    assert_eq!(profile.stage.port.as_deref(), Some(PORT));
    assert_eq!(profile.camera.device.as_deref(), Some(rig.camera()));
    let plan = ["--rig", &written, "--set", "plan.step=0.64 mm", "--set", "plan.frames=3", "--json"];
    let planned = succeeds(&[&["plan"], &plan[..]].concat());
    let planned: serde_json::Value = serde_json::from_str(&planned).unwrap();
    assert_eq!(planned["positions_mm"], serde_json::json!([0.0, 0.64, 1.28]));
    assert!(planned["total_s"].is_null(), "nothing was asked how fast it is: {planned}");
    // With the devices that it names; 8 bits a sample.
    let out = workplace.path("none");
    let camera = ["--format", "GREY", "--size", SIZE];
    let dry = succeeds(&[&["capture", "--dry-run", "--out", &out], &plan[..], &camera[..]].concat());
    let dry: serde_json::Value = serde_json::from_str(&dry).unwrap();
    assert_eq!(dry["bytes"], 3 * 160 * 120);
    assert!(dry["total_s"].as_f64().unwrap() > 0.0, "{dry}");
    assert!(!Path::new(&out).exists());
}

#[test]
fn a_profile_of_what_is_connected_is_ready_for_a_plan() {
    const NAME: &str = "measuring::a_profile_of_what_is_connected_is_ready_for_a_plan";
    if !here(NAME) {
        return;
    }
    plan_what_is_connected(&Playing::start());
    passed(NAME);
}

#[test]
fn a_profile_with_a_uvc_camera_is_ready_for_a_plan() {
    const NAME: &str = "measuring::a_profile_with_a_uvc_camera_is_ready_for_a_plan";
    if !here(NAME) {
        return;
    }
    plug_vivid(false);
    let rig = UvcRig::start(Kind::bulk(Format::Grey));
    plan_what_is_connected(&rig);
    drop(rig);
    plug_vivid(true);
    passed(NAME);
}

/// From profile to disparity, with every frame exact.
fn measure(rig: &mut dyn Rig) {
    let workplace = Workplace::new(rig);
    let out = workplace.path("measured");
    succeeds(&["run", "--out", &out, "--rig", &workplace.path("rig.toml")]);
    let sequence = assert_exact(&out, rig);
    assert!(sequence.stop().unwrap().closure.is_some());
    // Of a plane that faces the camera, whatever lies on its axis: focal length x baseline / distance = 320 px x 15 x 0.64 mm / 500 mm.
    const TRUTH_PX: f64 = 6.144;
    assert!((320.0 * (FRAMES - 1) as f64 * STEP_MM / 500.0 - TRUTH_PX).abs() < 1e-9);
    let results = Path::new(&out).join("results");
    let disparity = read_map(&results.join("disparity.tiff")).unwrap();
    let size: Size = SIZE.parse().unwrap();
    assert_eq!((disparity.columns(), disparity.rows()), (size.columns, size.rows));
    let (_, summary) = ResultFiles::open_match(&results).unwrap();
    // A point at x in the reference frame is at x - before in the first and at x + after in the last.
    let (before, after) = (summary.tau_before * TRUTH_PX, summary.tau_after * TRUTH_PX);
    let in_view = |x: usize| x as f64 >= before && x as f64 + after <= (size.columns - 1) as f64;
    let columns: Vec<usize> = (0..size.columns).filter(|&x| in_view(x)).collect();
    let places = (0..size.rows).flat_map(|y| columns.iter().map(move |&x| (x, y)));
    let found = places.filter(|&(x, y)| disparity.at(x, y).is_finite()).count();
    let answered = found as f64 / (columns.len() * size.rows) as f64;
    let found = disparity.values().iter().filter(|d| d.is_finite());
    let mut errors: Vec<f64> = found.map(|&d| (f64::from(d) - TRUTH_PX).abs()).collect();
    errors.sort_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    let within = errors.partition_point(|error| *error < 0.1) as f64 / errors.len() as f64;
    println!(
        "disparity: {answered:.3} of what stays in view answered, error {median:.4} px in the median, {within:.4} within 0.1 px, \
         at most {:.3} px; matched in {:.1} s",
        errors[errors.len() - 1],
        summary.seconds
    );
    assert!(answered > 0.6, "{answered}");
    assert!(median < 0.02, "{median}");
    assert!(within >= 0.99, "{within}");
    // Nearer by the share that the disparity is larger: 0.01 px of 6.144 px are 0.8 mm of 500 mm.
    let distance_mm = summary.distance_mm.unwrap();
    assert!((distance_mm - 500.0).abs() < 0.8, "{distance_mm}");
}

#[test]
fn a_measurement_is_exact_in_its_frames_and_right_in_its_disparity() {
    const NAME: &str = "measuring::a_measurement_is_exact_in_its_frames_and_right_in_its_disparity";
    if !here(NAME) {
        return;
    }
    measure(&mut Playing::start());
    passed(NAME);
}

#[test]
fn a_measurement_with_a_uvc_camera_is_exact_and_right_too() {
    const NAME: &str = "measuring::a_measurement_with_a_uvc_camera_is_exact_and_right_too";
    if !here(NAME) {
        return;
    }
    measure(&mut UvcRig::start(Kind::bulk(Format::Grey)));
    passed(NAME);
}

#[test]
fn a_scan_of_twenty_positions_is_the_simulators_to_the_byte() {
    const NAME: &str = "measuring::a_scan_of_twenty_positions_is_the_simulators_to_the_byte";
    if !here(NAME) {
        return;
    }
    let mut playing = Playing::start();
    let workplace = Workplace::new(&playing);
    let scan = workplace.path("scan");
    // Without a profile.
    let plan = ["--start-mm", "10", "--step-mm", "1.5", "--frames", "20", "--settle-ms", "0"];
    let rig = ["--port", PORT, "--camera", CAMERA, "--format", "GREY", "--size", SIZE];
    succeeds(&[&["capture", "--out", &scan], &plan[..], &rig[..]].concat());
    succeeds(&["verify", &scan]);
    let sequence = Sequence::open(Path::new(&scan)).unwrap();
    assert_eq!(sequence.frames().len(), 20);
    let mut stale = 0;
    for (index, record) in sequence.frames().iter().enumerate() {
        let position_mm = 10.0 + 1.5 * index as f64;
        assert_eq!(record.commanded_mm, Some(position_mm));
        assert!(sequence.read(record).unwrap() == playing.truth(position_mm), "frame {index}: A WRONG FRAME");
        let exposure = record.exposure.as_ref().unwrap();
        assert!(exposure.exposure_start_ns >= exposure.requested_ns, "frame {index}");
        stale += exposure.stale;
    }
    println!("{stale} stale frames were skipped");
    assert!(stale >= 20, "the queue of a real driver holds stale frames after each move");
    passed(NAME);
}
