//! An onlooker sees what the camera receives, and changes nothing.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use epirig_core::frame::Frame;
use epirig_devices::camera::{
    Camera, CameraError, CameraSettings, Onlooker, SimCamera, SimFault, TakenFrame,
};
use epirig_devices::stage::{SimStage, SimStageConfig, Stage, StagePosition};
use epirig_simulator::{Simulator, SimulatorConfig};

/// Keeps the pictures that it sees.
#[derive(Default)]
pub struct Window {
    wants: AtomicBool,
    asked: AtomicUsize,
    seen: Mutex<Vec<Frame>>,
}

impl Window {
    pub fn want(&self, wants: bool) {
        self.wants.store(wants, Ordering::SeqCst);
    }

    pub fn seen(&self) -> Vec<Frame> {
        self.seen.lock().unwrap().clone()
    }
}

impl Onlooker for Window {
    fn wants(&self) -> bool {
        self.asked.fetch_add(1, Ordering::SeqCst);
        self.wants.load(Ordering::SeqCst)
    }

    fn see(&self, frame: &Frame) {
        self.seen.lock().unwrap().push(frame.clone());
    }
}

fn simulator() -> Arc<Simulator> {
    Arc::new(Simulator::new(SimulatorConfig::textured_plane(160, 120, 2)).unwrap())
}

/// A frame after a move, and another after a fault. `window` looks on once the picture is steady.
fn taken(fault: SimFault, window: Option<Arc<Window>>) -> [TakenFrame; 2] {
    let mut stage = SimStage::new(SimStageConfig::ideal(100.0));
    stage.home().unwrap();
    let mut camera = SimCamera::before_simulator(simulator(), stage.watch());
    camera.configure(&CameraSettings::default()).unwrap();
    camera.start().unwrap();
    camera.show_to(window.map(|window| window as Arc<dyn Onlooker>));
    stage.move_to(12.0).unwrap();
    let moment = camera.now();
    let first = camera.grab_after(moment).unwrap();
    camera.device().inject(fault);
    [first, camera.grab_after(moment).unwrap()]
}

#[test]
fn an_onlooker_sees_the_skipped_frames_too() {
    let simulator = simulator();
    let (before, present) = (simulator.expose(0.0, 0), simulator.expose(12.0, 0));
    for fault in [SimFault::NoSignal(false), SimFault::TornFrame, SimFault::BufferError] {
        let window = Arc::new(Window::default());
        window.want(true);
        let [first, second] = taken(fault, Some(Arc::clone(&window)));
        let seen = window.seen();
        // Frames that are too old, the neighbour of the first good frame, and both frames; then the torn one.
        let (stale, torn) = (first.facts.stale, usize::from(fault == SimFault::TornFrame));
        assert!(stale >= 4 && seen.len() >= stale + 3 + second.facts.unsteady, "{fault:?}: {}", seen.len());
        assert!(seen[0] == before && seen[seen.len() - 1] == second.frame && second.frame == present);
        let damaged = seen.iter().filter(|frame| **frame != before && **frame != present).count();
        assert_eq!(damaged, torn, "{fault:?}");
    }
}

#[test]
fn an_onlooker_changes_no_frame_and_is_left_alone_if_it_wants_none() {
    for fault in [SimFault::NoSignal(false), SimFault::TornFrame, SimFault::ShortBuffer, SimFault::Gap(3)] {
        let window = Arc::new(Window::default());
        let alone = taken(fault, None);
        assert_eq!(taken(fault, Some(Arc::clone(&window))), alone);
        assert!(window.asked.load(Ordering::SeqCst) > 0 && window.seen().is_empty());
        window.want(true);
        assert_eq!(taken(fault, Some(Arc::clone(&window))), alone);
        assert!(!window.seen().is_empty());
    }
}

/// Moves the carriage on with every picture.
struct Restless(StagePosition);

impl Onlooker for Restless {
    fn wants(&self) -> bool {
        true
    }

    fn see(&self, _frame: &Frame) {
        self.0.set(self.0.get_mm() + 1.0, self.0.elapsed());
    }
}

#[test]
fn what_moves_is_refused_by_a_grab_and_shown_by_a_look() {
    let carriage = StagePosition::default();
    let mut camera = SimCamera::before_simulator(simulator(), carriage.clone());
    camera.configure(&CameraSettings::default()).unwrap();
    camera.start().unwrap();
    camera.show_to(Some(Arc::new(Restless(carriage.clone()))));
    let moment = camera.now();
    assert!(matches!(camera.grab_after(moment), Err(CameraError::Timeout { .. })));
    assert!(carriage.get_mm() > 3.0);
    camera.look(Duration::from_secs(1)).unwrap().unwrap();
    // A look calls no onlooker.
    let at_mm = carriage.get_mm();
    camera.look(Duration::from_secs(1)).unwrap().unwrap();
    assert_eq!(carriage.get_mm(), at_mm);
}

#[test]
fn pictures_pass_while_the_stage_moves_and_the_next_frame_is_as_good_as_ever() {
    let mut stage = SimStage::new(SimStageConfig::ideal(100.0));
    stage.home().unwrap();
    let (simulator, window) = (simulator(), Arc::new(Window::default()));
    let mut camera = SimCamera::before_simulator(Arc::clone(&simulator), stage.watch());
    camera.configure(&CameraSettings::default()).unwrap();
    camera.show_for(Duration::from_millis(1)).unwrap();
    camera.start().unwrap();
    window.want(true);
    camera.show_to(Some(Arc::clone(&window) as Arc<dyn Onlooker>));
    // Ten frame times of 40 ms.
    camera.show_for(Duration::from_millis(400)).unwrap();
    let shown = window.seen().len();
    assert!((8..=11).contains(&shown), "{shown} pictures");
    stage.move_to(12.0).unwrap();
    let moment = camera.now();
    let taken = camera.grab_after(moment).unwrap();
    assert!(taken.facts.exposure_start >= moment && taken.facts.restarts == 0, "{:?}", taken.facts);
    assert_eq!(taken.frame, simulator.expose(12.0, 0));
    // A stream that breaks down meanwhile is found out and mended by the next grab.
    camera.device().inject(SimFault::FatalError);
    assert!(camera.show_for(Duration::from_millis(400)).is_err());
    let moment = camera.now();
    assert_eq!(camera.grab_after(moment).unwrap().facts.restarts, 1);
}
