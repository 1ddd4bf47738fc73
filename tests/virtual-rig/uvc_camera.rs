//! The camera driver on `uvcvideo`: listings, every format both ways, settings that show late, and pictures
//! that are judged by what they say of themselves.

use std::time::Duration;

use epirig::capture::CapturePlan;
use epirig::doctor::{DoctorPlan, Report, Verdict, examine};
use epirig_core::progress::Silent;
use epirig_devices::camera::{Camera, CameraError, CameraSettings, Moment, TimingRule};

use super::faults::Bench as _;
use super::guest::{Rig as _, SIZE, here, passed, program, succeeds};
use super::uvc::{EXPOSURE, EXPOSURE_DEFAULT, Format, GAIN, UvcCamera};
use super::uvc_bench::{DELAY, Kind, LAG, SERIAL_NUMBER, UvcBench, UvcRig};

#[test]
fn a_uvc_camera_is_listed_once_with_its_formats() {
    const NAME: &str = "uvc_camera::a_uvc_camera_is_listed_once_with_its_formats";
    if !here(NAME) {
        return;
    }
    let rig = UvcRig::start(Kind::bulk(Format::Yuyv));
    let devices: serde_json::Value = serde_json::from_str(&succeeds(&["devices", "--json"])).unwrap();
    let cameras = devices["cameras"].as_array().unwrap();
    let ours: Vec<&serde_json::Value> =
        cameras.iter().filter(|camera| camera["driver"] == "uvcvideo").collect();
    assert_eq!(ours.len(), 1, "the node of its metadata is no camera: {cameras:?}");
    assert_eq!(ours[0]["path"], rig.camera.node().unwrap().to_str().unwrap());
    assert!(ours[0]["links"].as_array().unwrap().iter().any(|link| link == rig.camera()));
    assert_eq!(ours[0]["usb_serial_number"], SERIAL_NUMBER);
    let formats = ours[0]["formats"].as_array().unwrap();
    let formats: Vec<&str> = formats.iter().map(|format| format["format"].as_str().unwrap()).collect();
    assert_eq!(formats, Format::ALL.map(Format::four_cc));
    passed(NAME);
}

#[test]
fn every_format_is_exact_over_bulk_and_isochronous_transfers() {
    const NAME: &str = "uvc_camera::every_format_is_exact_over_bulk_and_isochronous_transfers";
    if !here(NAME) {
        return;
    }
    let mut bench = UvcBench::new(Kind::bulk(Format::Yuyv));
    for format in Format::ALL {
        for kind in [Kind::bulk(format), Kind::isochronous(format)] {
            bench.change_camera(kind);
            bench.begin();
            let mut late_us = (u64::MAX, 0);
            for place in 0..3 {
                let position_mm = 10.0 + 0.4 * f64::from(place);
                bench.stage().move_to(position_mm).unwrap();
                let moment = bench.camera.now();
                let taken = bench.camera.grab_after(moment).unwrap();
                assert!(
                    bench.shows(&taken.frame, position_mm),
                    "{kind:?} at {position_mm} mm: A WRONG FRAME"
                );
                assert_eq!(taken.facts.timing, TimingRule::StartOfExposure);
                let began = bench.rig.taken(&taken.frame, moment).unwrap();
                // The picture tells in whole microseconds.
                let us = |moment: Moment| moment.as_ns() / 1000;
                assert!(us(began) >= us(moment), "{kind:?}: an old frame");
                assert!(us(taken.facts.exposure_start) <= us(began) + 1, "{kind:?}: {:?}", taken.facts);
                let late = us(taken.facts.stamp).saturating_sub(us(began));
                late_us = (late_us.0.min(late), late_us.1.max(late));
            }
            println!(
                "{kind:?}: stamps {:.1} to {:.1} ms after the start of the exposure",
                late_us.0 as f64 / 1000.0,
                late_us.1 as f64 / 1000.0
            );
            // Called the start of the exposure by the driver, and in truth the arrival of the first byte.
            assert!(late_us.0 >= 20_000, "the camera is faster than it is made to be");
        }
    }
    passed(NAME);
}

#[test]
fn settings_that_show_frames_later_are_in_the_first_frame_that_counts() {
    const NAME: &str = "uvc_camera::settings_that_show_frames_later_are_in_the_first_frame_that_counts";
    if !here(NAME) {
        return;
    }
    let mut bench = UvcBench::streaming(Kind::bulk(Format::Yuyv));
    let shown = |bench: &mut UvcBench| {
        let moment = bench.camera.now();
        let taken = bench.camera.grab_after(moment).unwrap();
        bench.rig.stamp(&taken.frame).expect("a picture of the camera").settings
    };
    // The automatics are off: an automatic exposure would wander.
    assert_eq!(shown(&mut bench).exposure, EXPOSURE_DEFAULT);
    bench.camera.set_control("exposure_time_absolute", "80").unwrap();
    assert_eq!(shown(&mut bench).exposure, 80);
    bench.camera.set_control("gain", "50").unwrap();
    bench.camera.set_control("white_balance_temperature", "3000").unwrap();
    bench.camera.set_control("focus_absolute", "150").unwrap();
    bench.camera.set_control("power_line_frequency", "2").unwrap();
    let settings = shown(&mut bench);
    assert_eq!((settings.exposure, settings.gain, settings.white), (80, 50, 3000));
    assert_eq!((settings.focus, settings.mains), (150, 2));
    passed(NAME);
}

#[test]
fn of_two_cameras_with_one_serial_number_none_is_taken_by_chance() {
    const NAME: &str = "uvc_camera::of_two_cameras_with_one_serial_number_none_is_taken_by_chance";
    if !here(NAME) {
        return;
    }
    let rig = UvcRig::start(Kind::bulk(Format::Grey));
    let twin = UvcCamera::new(1, rig.kind.model(SERIAL_NUMBER), rig.scene.clone(), DELAY, LAG);
    let grab = |camera: &str| {
        let settings = ["--camera", camera, "--format", "GREY", "--size", SIZE, "--out", "/tmp/twin.png"];
        let output = program(&[&["grab"], &settings[..]].concat());
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for name in [&format!("usb:{SERIAL_NUMBER}"), rig.camera(), &format!("/dev/v4l/by-id/{}", rig.camera())] {
        let (code, talk) = grab(name);
        assert_eq!(code, Some(2), "{name}: {talk}");
        for camera in [&rig.camera, &twin] {
            assert!(talk.contains(camera.node().unwrap().to_str().unwrap()), "{name}: {talk}");
        }
    }
    let node = twin.node().unwrap();
    let (code, talk) = grab(node.to_str().unwrap());
    assert_eq!(code, Some(0), "{talk}");
    drop(twin);
    passed(NAME);
}

#[test]
fn a_camera_in_another_socket_is_taken_only_if_it_can_be_no_other() {
    const NAME: &str = "uvc_camera::a_camera_in_another_socket_is_taken_only_if_it_can_be_no_other";
    const PATIENCE: Duration = Duration::from_secs(15);
    if !here(NAME) {
        return;
    }
    let mut bench = UvcBench::streaming(Kind::bulk(Format::Grey));
    let position_mm = 10.0;
    bench.stage().move_to(position_mm).unwrap();
    let goes_on = |bench: &mut UvcBench| {
        bench.camera.reconnect(PATIENCE).unwrap();
        let moment = bench.camera.now();
        let taken = bench.camera.grab_after(moment).unwrap();
        assert!(bench.shows(&taken.frame, position_mm), "A WRONG FRAME");
    };
    let refused = |bench: &mut UvcBench, words: &str| {
        let error = bench.camera.reconnect(PATIENCE).unwrap_err();
        println!("{error}");
        assert!(matches!(error, CameraError::AnotherSocket { .. }), "{error:?}");
        assert!(error.to_string().contains(words), "{error}");
    };
    for port in [1, 2] {
        bench.move_to_socket(port);
        goes_on(&mut bench);
    }
    // With a twin beside it, either may be in the new socket.
    let twin = UvcCamera::new(0, bench.rig.kind.model(SERIAL_NUMBER), bench.rig.scene.clone(), DELAY, LAG);
    bench.camera.stop().unwrap();
    bench.open_again();
    bench.move_to_socket(1);
    refused(&mut bench, "other cameras have its serial number");
    bench.rig.camera.unplug();
    // The twin was there before: it is not the camera that comes back.
    let error = bench.camera.reconnect(Duration::from_secs(2)).unwrap_err();
    assert!(matches!(error, CameraError::ReconnectTimeout { .. }), "{error:?}");
    bench.rig.camera.move_to_socket(2);
    bench.rig.camera.plug_in();
    goes_on(&mut bench);
    drop(twin);
    // Without a serial number it may be any of its model.
    bench.camera.stop().unwrap();
    bench.rig.camera.unplug();
    bench.rig.camera.exchange("");
    bench.rig.camera.plug_in();
    bench.open_again();
    bench.move_to_socket(1);
    refused(&mut bench, "it has no serial number");
    bench.rig.camera.unplug();
    bench.rig.camera.move_to_socket(2);
    bench.rig.camera.plug_in();
    goes_on(&mut bench);
    passed(NAME);
}

#[test]
fn controls_that_a_camera_refuses_are_errors_that_name_them() {
    const NAME: &str = "uvc_camera::controls_that_a_camera_refuses_are_errors_that_name_them";
    if !here(NAME) {
        return;
    }
    let mut bench = UvcBench::new(Kind::bulk(Format::Grey));
    // UVC 4.2.1.2: the error codes of a request; 0 is none.
    for code in 0..=8 {
        bench.rig.camera.inject(|faults| faults.stall = Some((GAIN, code)));
        let value = (20 + 5 * code).to_string();
        let error = bench.camera.set_control("gain", &value).unwrap_err();
        println!("code {code}: {error}");
        let told = match &error {
            CameraError::ControlRefused { name, value, .. } => (name.clone(), value.clone()),
            CameraError::ControlUnanswered { name, request, .. } => {
                (name.clone(), request.trim_start_matches("set to ").to_owned())
            }
            other => panic!("{other:?}"),
        };
        assert_eq!(told, ("gain".to_owned(), value));
        // Wrong state, power, range and value stay as they are; the others may pass.
        let refused = matches!(error, CameraError::ControlRefused { .. });
        assert_eq!(refused, [2, 3, 4, 8].contains(&code), "code {code}");
    }
    bench.rig.camera.inject(|faults| faults.stall = None);
    assert_eq!(bench.camera.set_control("gain", "20").unwrap().value, Some(20));
    passed(NAME);
}

#[test]
fn a_control_that_is_taken_and_ignored_shows_in_the_picture_only() {
    const NAME: &str = "uvc_camera::a_control_that_is_taken_and_ignored_shows_in_the_picture_only";
    if !here(NAME) {
        return;
    }
    let mut bench = UvcBench::streaming(Kind::isochronous(Format::Yuyv));
    // The driver answers from its cache, as for most controls of most cameras. `epirig doctor` looks at the picture.
    bench.rig.camera.inject(|faults| faults.deaf = Some(GAIN));
    assert_eq!(bench.camera.set_control("gain", "50").unwrap().value, Some(50));
    let moment = bench.camera.now();
    let taken = bench.camera.grab_after(moment).unwrap();
    assert!(taken.facts.controls.contains(&("gain".to_owned(), 50)));
    assert_eq!(bench.rig.stamp(&taken.frame).unwrap().settings.gain, 0);
    // A control that says that it changes by itself is asked each time.
    bench.rig.camera.inject(|faults| faults.deaf = Some(EXPOSURE));
    let error = bench.camera.set_control("exposure_time_absolute", "80").unwrap_err();
    assert!(matches!(error, CameraError::Substituted { .. }), "{error:?}");
    passed(NAME);
}

#[test]
fn the_doctor_finds_a_gain_that_is_taken_and_ignored() {
    const NAME: &str = "uvc_camera::the_doctor_finds_a_gain_that_is_taken_and_ignored";
    const CHECKS: [&str; 2] = ["exposure control", "gain control"];
    if !here(NAME) {
        return;
    }
    let mut bench = UvcBench::new(Kind::bulk(Format::Yuyv));
    let controls = vec![("gain".to_owned(), "20".to_owned())];
    let camera = CameraSettings { controls, ..bench.settings() };
    let plan = DoctorPlan {
        scan: CapturePlan { camera, ..CapturePlan::at(vec![10.0, 10.64, 11.28]) },
        distance_mm: None,
        relief_mm: None,
        mains_hz: None,
        free_bytes: None,
        short: true,
    };
    let verdicts = |report: &Report| {
        CHECKS.map(|name| {
            let check = report.checks.iter().find(|check| check.name == name).unwrap();
            println!("{name}: {}", check.finding);
            check.verdict
        })
    };
    for deaf in [None, Some(GAIN)] {
        bench.rig.camera.inject(|faults| faults.deaf = deaf);
        let (stage, camera) = bench.both();
        let report = examine(stage, camera, &plan, &Silent).unwrap();
        let of_gain = if deaf.is_some() { Verdict::Warning } else { Verdict::Good };
        assert_eq!(verdicts(&report), [Verdict::Good, of_gain]);
        let controls = bench.camera.controls().unwrap();
        assert_eq!(controls.iter().find(|control| control.name == "gain").unwrap().value, Some(20));
    }
    passed(NAME);
}
