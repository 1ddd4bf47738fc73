//! The rig on real kernel drivers: the V4L2 driver `vivid`, which loops its output back to its capture side; `uvcvideo` with a UVC camera
//! that the tests play; and a USB serial port, whose other end is the program's own simulated stage.
//!
//! These run in the guest that tests/virtual-rig/run.sh boots, as its root; elsewhere they skip. TESTING.md tells how to run
//! `two_scans_agree` on a rig of metal and glass.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod cameras;
#[path = "../../crates/devices/tests/devices/faults.rs"]
mod faults;
mod guest;
mod interruptions;
mod measuring;
#[path = "../../crates/devices/tests/devices/sim_bench.rs"]
mod sim_bench;
mod uvc;
mod uvc_bench;
mod uvc_camera;
mod vivid_bench;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use epirig_core::frame::Frame;
use epirig_data::sequence::Sequence;
use epirig_devices::camera::Difference;
use epirig_devices::stage::StageError;

use faults::{Bench, FAULTS, Fault, outcome};
use guest::{PORT, SIZE, here, passed, succeeds};
use sim_bench::SimBench;
use uvc::Format;
use uvc_bench::{Kind, UvcBench};
use vivid_bench::{CAMERA, Playing, VividBench};

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
fn two_hundred_moves_under_load_give_no_stale_frame() {
    const NAME: &str = "two_hundred_moves_under_load_give_no_stale_frame";
    if !here(NAME) {
        return;
    }
    let mut bench = VividBench::streaming();
    // Rendering is the simulator's load, not the camera's: every place is seen once before.
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
        "200 moves in {:.0} s; {stale} stale frames skipped, {missed} lost by the driver meanwhile",
        began.elapsed().as_secs_f64()
    );
    assert!(stale > 200);
    passed(NAME);
}

/// What comes of each fault that is wanted, in the order of the table.
fn outcomes(bench: &mut dyn Bench, wanted: &dyn Fn(Fault) -> bool) -> Vec<Option<String>> {
    // Every place is rendered once before something goes wrong.
    for place in 0..6 {
        bench.stage().move_to(10.0 + 0.4 * f64::from(place)).unwrap();
    }
    let (all, mut found) = (Instant::now(), Vec::new());
    for (step, (fault, _)) in FAULTS.iter().enumerate() {
        let began = Instant::now();
        let words = if wanted(*fault) { outcome(bench, *fault, step) } else { None };
        if let Some(words) = &words {
            println!("{fault:?}: {words} ({:.1} s)", began.elapsed().as_secs_f64());
        }
        found.push(words);
    }
    println!("all of them: {:.0} s", all.elapsed().as_secs_f64());
    found
}

#[test]
fn faults_end_with_the_right_frame_or_a_typed_error() {
    const NAME: &str = "faults_end_with_the_right_frame_or_a_typed_error";
    if !here(NAME) {
        return;
    }
    // One after the other, as they share the stage's line. What a camera cannot have, one of another kind may.
    let kinds = [Kind::bulk(Format::Yuyv), Kind::isochronous(Format::Grey), Kind::bulk(Format::Mjpg)];
    let vivid = outcomes(&mut VividBench::new(), &|_| true);
    let mut usb = vec![None; FAULTS.len()];
    let mut bench = UvcBench::new(kinds[0]);
    for kind in kinds {
        bench.change_camera(kind);
        let left: Vec<Fault> = FAULTS
            .iter()
            .zip(&usb)
            .filter(|(_, seen)| seen.is_none())
            .map(|((fault, _), _)| *fault)
            .collect();
        let found = outcomes(&mut bench, &|fault| left.contains(&fault));
        usb.iter_mut().zip(found).for_each(|(seen, found)| *seen = seen.take().or(found));
    }
    drop(bench);
    let simulated = outcomes(&mut SimBench::new(), &|_| true);
    let mut table =
        String::from("| fault | `vivid` | `uvcvideo` | simulated camera |\n| --- | --- | --- | --- |\n");
    let cell = |words: &Option<String>| words.clone().unwrap_or_else(|| "-".to_owned());
    for (index, (_, words)) in FAULTS.iter().enumerate() {
        let [vivid, usb, simulated] = [&vivid, &usb, &simulated].map(|column| cell(&column[index]));
        table += &format!("| {words} | {vivid} | {usb} | {simulated} |\n");
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
    // No person is faster; and the stage's watchdog stops it after half a second.
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
