//! Frames that come again, late or wrong; and the thread: who waits for whom, and when it ends.

use std::collections::BTreeMap;
use std::sync::mpsc::channel;

use super::scans::{Maps, frames, plane};
use crate::panel::live_map::binned::Binned;
use crate::panel::live_map::making::make;
use crate::panel::{LiveMap, LiveMapMaker};
use epirig_core::frame::{Frame, Samples};
use epirig_core::tau::Tau;
use epirig_simulator::Simulator;

const FRAMES: usize = 12;

struct Scan {
    simulator: Simulator,
    positions_mm: Vec<f64>,
    frames: Vec<Frame>,
}

fn scan(seed: u64) -> Scan {
    let simulator = Simulator::new(plane(160, 120, FRAMES, seed)).unwrap();
    let positions_mm = simulator.config().scan.positions_mm();
    let frames = frames(&simulator, &positions_mm);
    Scan { simulator, positions_mm, frames }
}

/// The map of these frames, made in this thread.
fn map_of(frames: &[Frame]) -> Option<LiveMap> {
    let binned: BTreeMap<usize, Binned> =
        frames.iter().enumerate().map(|(index, frame)| (index, Binned::of(frame, 1).unwrap())).collect();
    make(&Tau::equidistant(FRAMES).unwrap(), &binned)
}

/// Whether two maps are alike; positions that are rounded differ in the last bits.
fn alike(one: &LiveMap, other: &LiveMap) -> bool {
    let close = |(a, b): (&f32, &f32)| (a.is_nan() && b.is_nan()) || (a - b).abs() < 1e-3;
    one.disparity.values().iter().zip(other.disparity.values()).all(close)
        && (one.frames, one.planned, one.bin) == (other.frames, other.planned, other.bin)
}

#[test]
fn a_retaken_frame_replaces_the_earlier_one() {
    let right = scan(11);
    let mut blurred = right.frames.clone();
    // As if the stage had not moved.
    blurred[7] = right.frames[6].clone();
    let (wanted, wrong) = (map_of(&right.frames).unwrap(), map_of(&blurred).unwrap());
    assert!(!alike(&wanted, &wrong));

    let maps = Maps::new(&right.positions_mm);
    blurred.iter().enumerate().for_each(|(index, frame)| maps.maker.add(index, frame));
    assert!(alike(&maps.of(FRAMES), &wrong));
    maps.maker.add(7, &right.frames[7]);
    assert!(alike(&maps.of(FRAMES), &wanted));
    assert!(maps.end().is_empty());
}

#[test]
fn frames_may_come_in_any_order_but_maps_refer_to_the_first() {
    let scan = scan(12);
    let maps = Maps::new(&scan.positions_mm);
    for (index, frame) in scan.frames.iter().enumerate().rev() {
        maps.maker.add(index, frame);
    }
    // Before frame 0 there is none; so this is the only one.
    assert!(alike(&maps.of(FRAMES), &map_of(&scan.frames).unwrap()));
    assert!(maps.end().is_empty());
}

#[test]
fn frames_outside_the_plan_or_unlike_the_others_are_left_out() {
    let scan = scan(13);
    let maps = Maps::new(&scan.positions_mm);
    maps.maker.add(0, &scan.frames[0]);
    maps.maker.add(FRAMES, &scan.frames[1]);
    maps.maker.add(5, &Frame::new(3, 4, 8, Samples::U8(vec![7; 12])).unwrap());
    maps.maker.add(6, &Frame::new(0, 0, 8, Samples::U8(Vec::new())).unwrap());
    scan.frames.iter().enumerate().skip(1).for_each(|(index, frame)| maps.maker.add(index, frame));
    assert!(alike(&maps.of(FRAMES), &map_of(&scan.frames).unwrap()));
}

#[test]
fn nobody_waits_and_the_newest_frames_win() {
    let scan = scan(14);
    let (made, maps) = channel();
    let (go_on, wait) = channel::<()>();
    let maker = LiveMapMaker::new(&scan.positions_mm, move |map| {
        let _ = made.send(map.frames);
        // The thread stands still until the test lets it go on.
        let _ = wait.recv();
    });
    scan.frames[..6].iter().enumerate().for_each(|(index, frame)| maker.add(index, frame));
    let first = maps.recv().unwrap();
    assert!((5..=6).contains(&first), "{first}");
    // If these waited for the thread, the test would never end.
    scan.frames.iter().enumerate().for_each(|(index, frame)| maker.add(index, frame));
    go_on.send(()).unwrap();
    assert_eq!(maps.recv().unwrap(), FRAMES);
    // Neither does the drop wait; frames that came meanwhile make no map any more.
    maker.add(0, &scan.frames[0]);
    drop(maker);
    drop(go_on);
    // The thread owned the sender: it has ended.
    assert!(maps.recv().is_err());
}

#[test]
fn a_scene_without_texture_makes_no_map_and_no_end() {
    let scan = scan(15);
    assert!(map_of(&scan.frames[..5]).is_some());
    let blank = Frame::new(120, 160, 8, Samples::U8(vec![100; 120 * 160])).unwrap();
    let grey = scan.simulator.uniform_irradiance(0.5);
    let noise: Vec<Frame> =
        (0..FRAMES as u32).map(|exposure| scan.simulator.digitise(&grey, exposure)).collect();
    for frames in 1..=FRAMES {
        assert!(map_of(&vec![blank.clone(); frames]).is_none());
        assert!(map_of(&noise[..frames]).is_none(), "{frames} frames of noise");
    }
    // The thread has seen them, too, and goes on.
    let maps = Maps::new(&scan.positions_mm);
    noise.iter().enumerate().for_each(|(index, frame)| maps.maker.add(index, frame));
    scan.frames.iter().enumerate().for_each(|(index, frame)| maps.maker.add(index, frame));
    let wanted = map_of(&scan.frames).unwrap();
    while !alike(&maps.of(FRAMES), &wanted) {}
}

#[test]
fn positions_without_a_baseline_make_no_maps() {
    let scan = scan(16);
    for positions_mm in [vec![], vec![1.0], vec![2.0; FRAMES], vec![0.0, f64::NAN, 2.0], vec![0.0, 5.0, 3.0]]
    {
        let maps = Maps::new(&positions_mm);
        scan.frames.iter().enumerate().for_each(|(index, frame)| maps.maker.add(index, frame));
        assert!(maps.end().is_empty());
    }
}

#[test]
fn a_listener_that_panics_ends_the_maps_only() {
    let scan = scan(17);
    let (made, maps) = channel();
    let maker = LiveMapMaker::new(&scan.positions_mm, move |map| {
        let _ = made.send(map.frames);
        panic!("a panic of this test");
    });
    scan.frames.iter().enumerate().for_each(|(index, frame)| maker.add(index, frame));
    assert!(maps.recv().is_ok());
    assert!(maps.recv().is_err());
    maker.add(0, &scan.frames[0]);
}

#[cfg(target_os = "linux")]
#[test]
fn the_thread_gives_way_to_the_scan() {
    use rustix::process::getpriority_process;

    let before = getpriority_process(None).unwrap();
    let scan = scan(18);
    let (made, maps) = channel();
    let maker = LiveMapMaker::new(&scan.positions_mm, move |_| {
        let here = std::thread::current().name().map(str::to_owned);
        let _ = made.send((getpriority_process(None).unwrap(), here, rayon::current_num_threads()));
    });
    scan.frames.iter().enumerate().for_each(|(index, frame)| maker.add(index, frame));
    let (priority, name, threads) = maps.recv().unwrap();
    assert_eq!(priority, (before + 10).min(19));
    assert_eq!((name.as_deref(), threads), (Some("live-map"), 1));
    assert_eq!(getpriority_process(None).unwrap(), before);
}
