//! The camera commands and the camera driver beside `v4l2-ctl`, which knows nothing of ours.

use std::process::Command;
use std::time::Instant;

use epirig_core::frame::Frame;
use epirig_devices::camera::pixels::{BayerUse, FourCc, PixelFormat};
use epirig_devices::camera::{Camera, CameraSettings, Size, TimingRule, V4l2Camera, V4l2Device, average};

use super::guest::{SIZE, here, passed, program, succeeds};
use super::vivid_bench::{CAMERA, Playing, v4l2_ctl};

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
    const NAME: &str = "cameras::frames_come_at_the_rate_of_v4l2_ctl";
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
    const NAME: &str = "cameras::listings_agree_with_v4l2_ctl";
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
    const NAME: &str = "cameras::the_commands_for_cameras_work_and_refuse_what_they_must";
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
    const NAME: &str = "cameras::every_format_shows_the_same_picture";
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
