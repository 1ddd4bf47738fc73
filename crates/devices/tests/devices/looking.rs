//! A look shows the newest picture as it comes, and leaves no trace in the frames that are taken after it.

use std::sync::Arc;
use std::time::Duration;

use epirig_core::frame::Frame;
use epirig_devices::camera::{Camera, CameraError, CameraSettings, SimCamera, SimFault, VideoDevice};
use epirig_devices::stage::StagePosition;
use epirig_simulator::{Simulator, SimulatorConfig};

/// Time from frame to frame.
const FRAME: Duration = Duration::from_millis(40);
/// Enough for several frames.
const PATIENCE: Duration = Duration::from_secs(1);

/// A configured camera before a carriage that the test moves.
struct Bench {
    simulator: Arc<Simulator>,
    carriage: StagePosition,
    camera: SimCamera,
}

impl Bench {
    fn new() -> Self {
        let simulator = Arc::new(Simulator::new(SimulatorConfig::textured_plane(160, 120, 2)).unwrap());
        let carriage = StagePosition::default();
        let mut camera = SimCamera::before_simulator(Arc::clone(&simulator), carriage.clone());
        camera.configure(&CameraSettings::default()).unwrap();
        Self { simulator, carriage, camera }
    }

    /// Puts the carriage somewhere in no time.
    fn put(&self, position_mm: f64) {
        self.carriage.set(position_mm, self.carriage.elapsed());
    }

    fn truth(&self, position_mm: f64) -> Frame {
        self.simulator.expose(position_mm, 0)
    }

    fn look(&mut self) -> Frame {
        self.camera.look(PATIENCE).unwrap().unwrap()
    }

    fn grab(&mut self) -> Result<Frame, CameraError> {
        let moment = self.camera.now();
        self.camera.grab_after(moment).map(|taken| taken.frame)
    }
}

#[test]
fn a_look_shows_the_scene_while_the_stage_moves() {
    let mut bench = Bench::new();
    for step in 0..20 {
        let position_mm = f64::from(step) * 0.5;
        bench.put(position_mm);
        let picture = bench.look();
        // A frame that began before the carriage was there shows where it was before.
        let (present, former) = (bench.truth(position_mm), bench.truth((position_mm - 0.5).max(0.0)));
        assert!(picture == present || picture == former, "an old picture at {position_mm} mm");
    }
    // Two frames later the last place is seen.
    let present = bench.truth(9.5);
    assert!((0..3).any(|_| bench.look() == present));
}

#[test]
fn a_look_shows_the_newest_of_the_pictures_that_wait() {
    let mut bench = Bench::new();
    bench.look();
    for position_mm in [1.0, 2.0, 3.0] {
        bench.put(position_mm);
        bench.camera.device().pause(FRAME);
    }
    // Three pictures wait, one of each place.
    assert!(bench.look() == bench.truth(3.0));
    // All buffers become full of an old view, so the driver can take no new pictures.
    bench.camera.device().pause(FRAME * 10);
    bench.put(30.0);
    bench.camera.device().pause(FRAME * 10);
    assert!(bench.look() == bench.truth(30.0));
}

#[test]
fn frames_after_a_look_are_what_they_were_before() {
    let mut bench = Bench::new();
    bench.put(12.0);
    bench.camera.start().unwrap();
    let before = bench.grab().unwrap();
    assert!(before == bench.truth(12.0));
    // A look may take over the stream of a scan, or start one.
    for restart in [false, true] {
        if restart {
            bench.camera.stop().unwrap();
        }
        bench.put(50.0);
        bench.look();
        assert!(matches!(bench.grab(), Err(CameraError::NotStarted { .. })));
        bench.look();
        bench.put(12.0);
        bench.camera.start().unwrap();
        assert!(bench.grab().unwrap() == before);
    }
    bench.look();
    bench.camera.stop().unwrap();
    assert!(matches!(bench.grab(), Err(CameraError::NotStarted { .. })));
    bench.look();
    bench.camera.configure(&CameraSettings::default()).unwrap();
    assert!(matches!(bench.grab(), Err(CameraError::NotStarted { .. })));
    bench.camera.start().unwrap();
    assert!(bench.grab().unwrap() == before);
}

#[test]
fn damaged_pictures_are_skipped_and_a_silent_camera_shows_none() {
    let mut bench = Bench::new();
    bench.put(7.0);
    let truth = bench.truth(7.0);
    for fault in [SimFault::BufferError, SimFault::ShortBuffer, SimFault::QueueError, SimFault::FatalError] {
        bench.look();
        bench.camera.device().inject(fault);
        assert!(bench.look() == truth, "{fault:?}");
    }
    bench.camera.device().inject(SimFault::Silence(1000));
    assert!(bench.camera.look(PATIENCE).unwrap().is_none());
    let unconfigured = &mut SimCamera::before_simulator(Arc::clone(&bench.simulator), bench.carriage.clone());
    assert!(matches!(unconfigured.look(PATIENCE), Err(CameraError::NotStarted { .. })));
}

#[test]
fn a_camera_that_goes_during_a_look_can_be_reconnected() {
    let mut bench = Bench::new();
    bench.look();
    bench.camera.device().inject(SimFault::Disconnect { failing: 2 });
    assert!(matches!(bench.camera.look(PATIENCE), Err(CameraError::Gone { .. })));
    assert!(matches!(bench.camera.look(PATIENCE), Err(CameraError::Gone { .. })));
    bench.camera.reconnect(Duration::from_secs(5)).unwrap();
    bench.put(3.0);
    assert!(bench.grab().unwrap() == bench.truth(3.0));
    bench.look();
    bench.camera.device().inject(SimFault::NoSignal(true));
    assert!(matches!(bench.camera.look(PATIENCE), Err(CameraError::NoSignal { .. })));
    bench.camera.device().inject(SimFault::NoSignal(false));
    bench.look();
}

#[test]
fn controls_set_during_a_look_show_in_later_pictures() {
    let mut bench = Bench::new();
    let before = bench.look().samples().mean();
    let until = bench.camera.now();
    bench.camera.set_control("gain", "40").unwrap();
    // Settling would take many frames.
    assert!(bench.camera.now().since(until) < FRAME);
    (0..4).for_each(|_| drop(bench.look()));
    let after = bench.look().samples().mean();
    assert!((after / before - 1.4).abs() < 0.02, "{before} {after}");
    // It is the wanted value from now on.
    bench.camera.start().unwrap();
    let moment = bench.camera.now();
    let facts = bench.camera.grab_after(moment).unwrap().facts;
    assert!(facts.controls.contains(&("gain".to_owned(), 40)));
}

#[test]
fn in_real_time_the_time_of_the_stage_has_passed_already() {
    let mut bench = Bench::new();
    bench.camera.device().in_real_time();
    bench.look();
    // A camera that waited for this would never return.
    bench.carriage.set(2.0, Duration::from_secs(1_000_000));
    let truth = bench.truth(2.0);
    assert!((0..5).any(|_| bench.look() == truth));
}
