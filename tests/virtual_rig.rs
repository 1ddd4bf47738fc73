//! The rig on real kernel drivers: the V4L2 driver `vivid`, which loops its output back to its capture side, and a USB serial port.
//! The program's own simulator plays the stage and shows the twin on the output.
//!
//! These run in the guest that tests/virtual-rig/run.sh boots, as its root; elsewhere they skip. TESTING.md tells how to run
//! `two_scans_agree` on a rig of metal and glass.

#![cfg(feature = "v4l2")]
#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "support/faults.rs"]
mod faults;
#[path = "support/sim_bench.rs"]
mod sim_bench;
#[path = "support/vivid_bench.rs"]
mod vivid_bench;

use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use epirig::camera::pixels::{BayerUse, FourCc, PixelFormat};
use epirig::camera::{Camera, CameraSettings, Difference, Size, TimingRule, V4l2Camera, V4l2Device, average};
use epirig::frame::Frame;
use epirig::sequence::Sequence;
use epirig::stage::StageError;

use faults::{Bench, FAULTS, outcome};
use sim_bench::SimBench;
use vivid_bench::{CAMERA, PORT, Playing, SIZE, VividBench, v4l2_ctl};

/// Whether this is the guest; says so if not.
fn here(name: &str) -> bool {
    let here = std::env::var_os("EPIRIG_VIRTUAL_RIG").is_some();
    if !here {
        println!(
            "SKIPPED {name}: it needs the virtual rig; tests/virtual-rig/run.sh boots it and runs this there"
        );
    }
    here
}

/// What run.sh looks for.
fn passed(name: &str) {
    println!("PASSED {name}");
}

fn program(arguments: &[&str]) -> std::process::Output {
    let program = std::env::var_os("EPIRIG_PROGRAM").unwrap_or_else(|| env!("CARGO_BIN_EXE_epirig").into());
    Command::new(program).args(arguments).output().unwrap()
}

fn succeeds(arguments: &[&str]) -> String {
    let output = program(arguments);
    let talk = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {talk}");
    String::from_utf8(output.stdout).unwrap()
}

/// Keeps the only processor of the guest busy.
struct Load(Arc<AtomicBool>, Vec<std::thread::JoinHandle<()>>);

impl Load {
    fn of(threads: usize) -> Self {
        let quit = Arc::new(AtomicBool::new(false));
        let busy = |quit: Arc<AtomicBool>| {
            std::thread::spawn(move || while !std::hint::black_box(quit.load(Ordering::Relaxed)) {})
        };
        let threads = (0..threads).map(|_| busy(Arc::clone(&quit))).collect();
        Self(quit, threads)
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
        self.1.drain(..).for_each(|thread| thread.join().unwrap());
    }
}

#[test]
fn a_scan_of_twenty_positions_is_the_twins_to_the_byte() {
    const NAME: &str = "a_scan_of_twenty_positions_is_the_twins_to_the_byte";
    if !here(NAME) {
        return;
    }
    let mut playing = Playing::start();
    succeeds(&[
        "capture",
        "--out",
        "/tmp/scan",
        "--start-mm",
        "10",
        "--step-mm",
        "1.5",
        "--frames",
        "20",
        "--settle-ms",
        "0",
        "--port",
        PORT,
        "--camera",
        CAMERA,
        "--format",
        "GREY",
        "--size",
        SIZE,
    ]);
    succeeds(&["verify", "/tmp/scan"]);
    let sequence = Sequence::open(std::path::Path::new("/tmp/scan")).unwrap();
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
    println!("{stale} stale frames were passed over");
    assert!(stale >= 20, "the queue of a real driver holds stale frames after each move");
    passed(NAME);
}

#[test]
fn two_hundred_moves_under_load_give_no_stale_frame() {
    const NAME: &str = "two_hundred_moves_under_load_give_no_stale_frame";
    if !here(NAME) {
        return;
    }
    let mut bench = VividBench::streaming();
    // Rendering is the twin's load, not the camera's: every place is seen once before.
    for place in 0..11 {
        bench.stage().move_to(20.0 + 0.4 * f64::from(place)).unwrap();
    }
    let load = Load::of(1);
    let began = Instant::now();
    let (mut stale, mut missed) = (0, 0);
    for index in 0..200_u32 {
        // Up and down between eleven places.
        let position_mm = 20.0 + 0.4 * f64::from((index * 7) % 11);
        let facts = bench.move_and_see(position_mm);
        stale += facts.stale;
        missed += facts.missed;
    }
    drop(load);
    println!(
        "200 moves in {:.0} s; {stale} stale frames passed over, {missed} lost by the driver meanwhile",
        began.elapsed().as_secs_f64()
    );
    assert!(stale > 200);
    passed(NAME);
}

#[test]
fn faults_end_with_the_right_frame_or_a_typed_error() {
    const NAME: &str = "faults_end_with_the_right_frame_or_a_typed_error";
    if !here(NAME) {
        return;
    }
    let mut vivid = VividBench::new();
    let mut sim = SimBench::new();
    let mut table =
        String::from("| fault | real driver (`vivid`) | simulated camera |\n| --- | --- | --- |\n");
    // Every place is rendered once before something goes wrong.
    for place in 0..6 {
        vivid.stage().move_to(10.0 + 0.4 * f64::from(place)).unwrap();
    }
    for (step, (fault, words)) in FAULTS.iter().enumerate() {
        let began = Instant::now();
        let of = |bench: &mut dyn Bench| outcome(bench, *fault, step).unwrap_or_else(|| "-".to_owned());
        let (real, simulated) = (of(&mut vivid), of(&mut sim));
        println!("{fault:?}: {real} ({:.1} s)", began.elapsed().as_secs_f64());
        table += &format!("| {words} | {real} | {simulated} |\n");
    }
    println!("\nBEGIN FILE camera-faults.md\n{table}\nEND FILE camera-faults.md");
    passed(NAME);
}

#[test]
fn a_serial_port_pulled_out_in_mid_scan_is_an_error_and_the_scan_goes_on_after_it() {
    const NAME: &str = "a_serial_port_pulled_out_in_mid_scan_is_an_error_and_the_scan_goes_on_after_it";
    if !here(NAME) {
        return;
    }
    let mut bench = VividBench::streaming();
    bench.stage().move_to(10.0).unwrap();
    // In the middle of a long move.
    let plug = std::thread::spawn(|| {
        std::thread::sleep(Duration::from_millis(700));
        vivid_bench::plug_serial_port(false);
    });
    let began = Instant::now();
    let error = bench.stage().move_to(60.0).unwrap_err();
    assert!(matches!(error, StageError::Link(_)), "{error:?}");
    println!("noticed after {:.2} s: {error}", began.elapsed().as_secs_f64());
    assert!(began.elapsed() < Duration::from_secs(10));
    plug.join().unwrap();
    let error = bench.stage().move_to(10.0).unwrap_err();
    assert_eq!(error, StageError::NotHomed);
    // Nobody is quicker; and the stage's watchdog stops it after half a second.
    std::thread::sleep(Duration::from_secs(2));
    vivid_bench::plug_serial_port(true);
    bench.reconnect_stage();
    let error = bench.stage().move_to(10.0).unwrap_err();
    assert_eq!(error, StageError::NotHomed, "the position may not be trusted");
    bench.stage().home().unwrap();
    for position_mm in [10.0, 11.5] {
        bench.move_and_see(position_mm);
    }
    passed(NAME);
}

/// Without truth: what was at a position is there again. With EPIRIG_REAL_RIG=1 on the rig that EPIRIG_PORT, EPIRIG_DRIVER and
/// EPIRIG_CAMERA name.
#[test]
fn two_scans_agree() {
    const NAME: &str = "two_scans_agree";
    let real = std::env::var_os("EPIRIG_REAL_RIG").is_some();
    if !real && !here(NAME) {
        return;
    }
    let playing = (!real).then(Playing::start);
    let virtual_rig = ["--port", PORT, "--camera", CAMERA, "--format", "GREY", "--size", SIZE];
    let rig = if real { &[][..] } else { &virtual_rig[..] };
    let folder = tempfile::tempdir().unwrap();
    let scan = |name: &str| {
        let out = folder.path().join(name);
        let plan = ["--start-mm", "10", "--step-mm", "1.5", "--frames", "8", "--approach-mm", "0.2"];
        succeeds(&[&["capture", "--out", out.to_str().unwrap()], &plan[..], rig].concat());
        succeeds(&["verify", out.to_str().unwrap()]);
        Sequence::open(&out).unwrap()
    };
    let (one, other) = (scan("one"), scan("other"));
    assert_eq!((one.frames().len(), other.frames().len()), (8, 8));
    let mut before: Option<Frame> = None;
    for (first, second) in one.frames().iter().zip(other.frames()) {
        for exposure in [&first.exposure, &second.exposure].map(|exposure| exposure.as_ref().unwrap()) {
            assert!(exposure.exposure_start_ns >= exposure.requested_ns);
        }
        let (frame, again) = (one.read(first).unwrap(), other.read(second).unwrap());
        let difference = Difference::between(&frame, &again).unwrap();
        println!(
            "{:?} mm: {:.2} DN, at most {:.2} DN",
            first.commanded_mm, difference.typical_dn, difference.largest_dn
        );
        // As frames of one scan do: within their noise, and what a lamp and a stage may add to it.
        let noise =
            [&first.exposure, &second.exposure].map(|exposure| exposure.as_ref().unwrap().difference_dn);
        let noise = noise.into_iter().flatten().fold(0.0, f64::max);
        assert_eq!(difference.objection(Some(noise)), None);
        // Or there would be nothing to agree on.
        assert!(
            before.replace(frame.clone()).is_none_or(|before| before != frame),
            "the stage moves nothing in view"
        );
    }
    drop(playing);
    passed(NAME);
}

/// Frames per second that `v4l2-ctl` says, the best of its lines.
fn rate_of_v4l2_ctl(frames: usize) -> f64 {
    let arguments = ["-d", "/dev/video0", "--stream-mmap=4", &format!("--stream-count={frames}")];
    let output = Command::new("v4l2-ctl").args(arguments).output().unwrap();
    let text =
        String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    let rates = text.split("fps").filter_map(|before| before.split_whitespace().last()?.parse::<f64>().ok());
    rates.fold(f64::NAN, f64::max)
}

#[test]
fn frames_come_at_the_rate_of_v4l2_ctl() {
    const NAME: &str = "frames_come_at_the_rate_of_v4l2_ctl";
    const FRAMES: usize = 150;
    if !here(NAME) {
        return;
    }
    v4l2_ctl(&["-d0", "-c", "loop_video=0,osd_text_mode=2"]);
    // 1280 x 720 at 24, 50 and 60 Hz.
    for timings in [3, 6, 7] {
        v4l2_ctl(&["-d0", &format!("--set-dv-bt-timings=index={timings}")]);
        v4l2_ctl(&["-d0", "--set-fmt-video=width=1280,height=720,pixelformat=GREY"]);
        let reference = rate_of_v4l2_ctl(FRAMES);
        let mut camera = V4l2Camera::new(V4l2Device::open("/dev/video0").unwrap());
        let configuration = camera
            .configure(&CameraSettings {
                four_cc: Some(FourCc(*b"GREY")),
                size: Some(Size { columns: 1280, rows: 720 }),
                ..CameraSettings::default()
            })
            .unwrap();
        camera.start().unwrap();
        let moment = camera.now();
        let began = Instant::now();
        for _ in 0..FRAMES {
            camera.grab_after(moment).unwrap();
        }
        let rate = FRAMES as f64 / began.elapsed().as_secs_f64();
        let nominal = configuration.interval.map_or(f64::NAN, |interval| interval.rate_hz());
        println!(
            "1280 x 720 at {nominal:.2} Hz: {rate:.2} fps, v4l2-ctl {reference:.2} fps, ratio {:.3}",
            rate / reference
        );
        camera.stop().unwrap();
    }
    passed(NAME);
}

#[test]
fn listings_agree_with_v4l2_ctl() {
    const NAME: &str = "listings_agree_with_v4l2_ctl";
    if !here(NAME) {
        return;
    }
    let devices: serde_json::Value = serde_json::from_str(&succeeds(&["devices", "--json"])).unwrap();
    let cameras = devices["cameras"].as_array().unwrap();
    assert_eq!(cameras.len(), 1, "the output is no camera: {cameras:?}");
    assert_eq!(cameras[0]["path"], "/dev/video0");
    assert!(cameras[0]["links"].as_array().unwrap().iter().any(|link| link == CAMERA));
    assert_eq!(devices["ports"].as_array().unwrap().iter().filter(|port| !port["usb"].is_null()).count(), 1);
    let listed = v4l2_ctl(&["-d0", "--list-formats"]);
    let theirs: Vec<&str> =
        listed.lines().filter_map(|line| line.split('\'').nth(1)).map(str::trim).collect();
    let ours: Vec<&str> = cameras[0]["formats"]
        .as_array()
        .unwrap()
        .iter()
        .map(|format| format["format"].as_str().unwrap())
        .collect();
    assert!(theirs.len() > 50);
    // v4l2-ctl writes a blank before the -BE of big-endian formats.
    let plain = |name: &str| name.replace(" -BE", "-BE");
    assert_eq!(ours, theirs.iter().map(|name| plain(name)).collect::<Vec<_>>());
    // Names, kinds and values of the controls, but for those that change by themselves or are of kinds that are not read.
    let listed = v4l2_ctl(&["-d0", "--list-ctrls"]);
    let mut compared = 0;
    for control in cameras[0]["controls"].as_array().unwrap() {
        let name = control["name"].as_str().unwrap();
        let line = listed.lines().find(|line| line.split_whitespace().next() == Some(name));
        let line = line.unwrap_or_else(|| panic!("v4l2-ctl has no {name}:\n{listed}"));
        let Some(value) = control["value"].as_i64().filter(|_| name != "read_only_integer_32_bits") else {
            continue;
        };
        let theirs = line.split("value=").nth(1).and_then(|rest| rest.split_whitespace().next()).unwrap();
        let theirs = theirs.strip_prefix("0x").map_or_else(
            || theirs.parse::<i64>().unwrap(),
            |digits| i64::from_str_radix(digits, 16).unwrap(),
        );
        assert_eq!(value & 0xffff_ffff, theirs & 0xffff_ffff, "{line}");
        compared += 1;
    }
    assert!(compared > 30, "{compared} controls compared");
    passed(NAME);
}

#[test]
fn the_commands_for_cameras_work_and_refuse_what_they_must() {
    const NAME: &str = "the_commands_for_cameras_work_and_refuse_what_they_must";
    if !here(NAME) {
        return;
    }
    let _playing = Playing::start();
    let set = |control: &str, value: &str| program(&["camera", "set", control, value, "--json"]);
    let output = set("brightness", "77");
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value["value"], 77);
    assert_eq!(v4l2_ctl(&["-d0", "-C", "brightness"]).trim(), "brightness: 77");
    let output = set("brightnes", "77");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("did you mean brightness?"));
    for (control, value) in
        [("brightness", "300"), ("read_only_integer_32_bits", "1"), ("test_pattern", "pink")]
    {
        assert_eq!(set(control, value).status.code(), Some(2), "{control}={value}");
    }
    // Kinds of controls that crate v4l cannot read: masks, menus of numbers, 64 bits.
    for (control, value) in
        [("bitmask", "0x80002000"), ("integer_menu", "3"), ("integer_64_bits", "1000000000000")]
    {
        let output = set(control, value);
        assert!(output.status.success(), "{control}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let grab =
        ["grab", "--out", "/tmp/mean.png", "--average", "8", "--format", "GREY", "--size", SIZE, "--json"];
    v4l2_ctl(&["-d0", "-c", "gain_automatic=1"]);
    let output = succeeds(&grab);
    let grabbed: serde_json::Value = serde_json::from_str(&output).unwrap();
    assert_eq!((grabbed["bit_depth"].as_u64(), grabbed["averaged"].as_u64()), (Some(16), Some(8)));
    assert_eq!(grabbed["timing"], "end-of-frame");
    // Nothing is left to itself.
    assert_eq!(v4l2_ctl(&["-d0", "-C", "gain_automatic"]).trim(), "gain_automatic: 0");
    assert!(grabbed["controls"].as_array().unwrap().contains(&serde_json::json!(["gain_automatic", 0])));
    assert!(std::path::Path::new("/tmp/mean-variance.tiff").exists());
    // What is there already, what is not offered, what is not there.
    assert_eq!(program(&grab).status.code(), Some(2));
    let refused = |arguments: &[&str], code: i32, words: &str| {
        let output = program(&[&["grab", "--out", "/tmp/none.png"], arguments].concat());
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        assert!(stderr.contains(words) && !stderr.contains("panicked"), "{arguments:?}: {stderr}");
        assert!(!std::path::Path::new("/tmp/none.png").exists());
    };
    refused(&["--format", "MJPG"], 2, "format MJPG");
    refused(&["--format", "RGGB"], 2, "--bayer green");
    refused(&["--format", "GREY", "--size", "17x16"], 2, "size of 17 x 16");
    refused(&["--exposure-us", "10000"], 2, "exposure time");
    refused(&["--rate-hz", "13"], 4, "13 Hz");
    refused(&["--camera", "/dev/video7"], 3, "no camera /dev/video7");
    refused(&["--camera", "/dev/video1"], 3, "gives no images");
    refused(&["--camera", "/dev/null"], 3, "/dev/null cannot be used as a camera");
    refused(&["--camera", "usb:nothing"], 3, "usb:nothing is not connected");
    passed(NAME);
}

#[test]
fn every_format_shows_the_same_picture() {
    const NAME: &str = "every_format_shows_the_same_picture";
    if !here(NAME) {
        return;
    }
    v4l2_ctl(&["-d0", "-c", "loop_video=0,osd_text_mode=2,test_pattern=0"]);
    v4l2_ctl(&["-d0", "--set-dv-bt-timings=index=0"]);
    let mut camera = V4l2Camera::new(V4l2Device::open("/dev/video0").unwrap());
    let mut grab = |code: &str| {
        let four_cc: FourCc = code.parse().unwrap();
        let mosaic = PixelFormat::from_four_cc(four_cc).unwrap().is_bayer();
        let settings = CameraSettings {
            four_cc: Some(four_cc),
            size: Some(Size { columns: 640, rows: 480 }),
            bayer: mosaic.then_some(BayerUse::Green),
            ..CameraSettings::default()
        };
        camera.configure(&settings).unwrap();
        camera.start().unwrap();
        let moment = camera.now();
        let mean = average(&mut camera, moment, 2, &|| true).unwrap();
        camera.stop().unwrap();
        assert_eq!(mean.facts[0].timing, TimingRule::EndOfFrame);
        mean
    };
    let samples = |frame: &Frame| {
        let mut values = vec![0.0; frame.rows() * frame.columns()];
        frame.samples().copy_to_f32(0, &mut values);
        values
    };
    // The driver draws its colour bars in each format by itself: grey formats agree but for rounding, luma within the difference of
    // its range (16 to 235 of 255).
    let grey = samples(&grab("GREY").frame);
    for code in ["Y10", "Y12", "Y16", "Y16-BE"] {
        let other = samples(&grab(code).frame);
        let worst = grey.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        println!("{code}: at most {:.2} DN of 8 bit from GREY", worst / 257.0);
        assert!(worst / 257.0 <= 1.0, "{code}");
    }
    let luma = samples(&grab("YUYV").frame);
    for code in ["UYVY", "YVYU", "VYUY", "NV12", "NV21", "NV16", "YU12", "YV12", "422P"] {
        assert_eq!(samples(&grab(code).frame), luma, "{code}");
    }
    // The greens of a mosaic: each row of bars is the same, so that the four arrangements agree.
    let green = grab("GRBG").frame;
    assert_eq!((green.rows(), green.columns()), (240, 320));
    for code in ["BA81", "GBRG", "RGGB", "BG10", "GB12", "BYR2"] {
        let other = samples(&grab(code).frame);
        let worst = samples(&green).iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        println!("{code}: greens at most {:.2} DN of 8 bit from GRBG", worst / 257.0);
        assert!(worst / 257.0 <= 1.0, "{code}");
    }
    passed(NAME);
}
