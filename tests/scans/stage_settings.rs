//! The settings of the stage that decide its positions change between an interruption and `resume`, or in mid scan: no frame is taken
//! with others than those of the record.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::faulty_rig::{Once, Watched, connect};
use crate::scan_outcome::ScanResult;
use epirig::capture::{
    CaptureError, CapturePlan, ChangedSetting, PauseSwitch, Rig, Unattended, Unwatched, capture, resume,
};
use epirig_data::sequence::{Origin, Sequence};
use epirig_data::storage::RealDisk;
use epirig_devices::camera::SimCamera;
use epirig_devices::link::{LineNoise, SimulatedDevice};
use epirig_devices::stage::simulator::FaultScript;
use epirig_devices::stage::{Driver, StagePosition};
use epirig_simulator::{Simulator, SimulatorConfig};

const FRAMES: usize = 6;

/// A rig with a simulated GRBL, whose settings last from scan to scan.
struct Bench {
    device: Arc<Mutex<Watched>>,
    watch: StagePosition,
    simulator: Arc<Simulator>,
    plan: CapturePlan,
}

impl Bench {
    fn new() -> Self {
        let watch = StagePosition::default();
        let driver = Driver::named("grbl").unwrap();
        let device = Watched::new(driver, &FaultScript::default(), watch.clone(), &LineNoise::quiet(0));
        Self {
            device: Arc::new(Mutex::new(device)),
            watch,
            simulator: Arc::new(Simulator::new(SimulatorConfig::textured_plane(64, 48, FRAMES)).unwrap()),
            // From home on, where a wrong scale shows least.
            plan: CapturePlan::at((0..FRAMES).map(|index| 2.0 * index as f64).collect()),
        }
    }

    /// A line of another program.
    fn tell(&self, line: &str) {
        let mut device = Arc::clone(&self.device);
        format!("{line}\n").bytes().for_each(|byte| device.receive(byte));
        device.advance(Duration::from_millis(100));
        let answer = String::from_utf8(device.take_sent()).unwrap();
        assert!(answer.contains("ok"), "{line}: {answer}");
    }

    /// A scan, new or resumed, that is paused after this number of frames, when `act` is done.
    fn scan(&self, folder: &Path, after: usize, act: impl Fn() + Sync) -> ScanResult {
        let mut stages = || connect(Driver::named("grbl").unwrap(), &self.device);
        let mut camera = SimCamera::before_simulator(Arc::clone(&self.simulator), self.watch.clone());
        let progress = Once::after(after, act);
        let mut rig = Rig {
            stages: &mut stages,
            camera: &mut camera,
            assistant: &mut Unattended,
            pause: PauseSwitch::default(),
            progress: &progress,
            watcher: &Unwatched,
        };
        match folder.join("sequence.json").exists() {
            true => resume(&mut rig, &self.plan, folder, Box::new(RealDisk)),
            false => capture(&mut rig, &self.plan, folder, Box::new(RealDisk)),
        }
    }

    fn carriage(&self) -> i64 {
        self.device.lock().unwrap().plant().carriage_steps()
    }

    /// A scan that is cut off after its third frame.
    fn interrupted(&self, folder: &Path) {
        let plant = self.device.lock().unwrap().plant();
        let ended = self.scan(folder, 3, || plant.press_switches(true));
        // With closed switches it is not homed either.
        assert!(matches!(ended, Err(CaptureError::Interrupted { done: 3, .. })), "{ended:?}");
        plant.press_switches(false);
    }
}

#[test]
fn the_record_has_the_settings_of_the_axis() {
    let (bench, folder) = (Bench::new(), tempfile::tempdir().unwrap());
    let seq = folder.path().join("seq");
    bench.scan(&seq, 0, || {}).unwrap();
    let sequence = Sequence::open(&seq).unwrap();
    let Origin::Captured { stage_settings, .. } = &sequence.record().origin else { panic!() };
    let expected =
        [("$100", 250.0), ("$130", 60.0), ("$2", 0.0), ("$23", 0.0), ("$27", 1.0), ("$3", 0.0), ("$4", 0.0)];
    let expected = expected.map(|(name, value)| (name.to_owned(), value));
    assert_eq!(*stage_settings, expected.into());
}

#[test]
fn a_scan_is_not_resumed_with_other_settings() {
    for (name, recorded, found) in
        [("$100", 250.0, 251.0), ("$27", 1.0, 1.5), ("$130", 60.0, 61.0), ("$23", 0.0, 1.0), ("$3", 0.0, 1.0)]
    {
        let (bench, folder) = (Bench::new(), tempfile::tempdir().unwrap());
        let seq = folder.path().join("seq");
        bench.interrupted(&seq);
        bench.tell(&format!("{name}={found}"));
        let (at, before) = (bench.carriage(), std::fs::read(seq.join("journal.jsonl")).unwrap());
        let error = bench.scan(&seq, 0, || {}).unwrap_err();
        let CaptureError::SettingsChanged(changes) = error.cause() else { panic!("{error}") };
        let changed = ChangedSetting { name: name.to_owned(), recorded: Some(recorded), found: Some(found) };
        assert_eq!(*changes, [changed]);
        assert!(error.to_string().contains(&format!("{name} was {recorded} and is {found}")), "{error}");
        // Nothing has moved, and nothing was written.
        assert_eq!(bench.carriage(), at);
        assert!(std::fs::read(seq.join("journal.jsonl")).unwrap() == before);
        // The speed is not one of them.
        bench.tell(&format!("{name}={recorded}"));
        bench.tell("$110=400");
        bench.scan(&seq, 0, || {}).unwrap();
        assert_eq!(Sequence::open(&seq).unwrap().frames().len(), FRAMES);
    }
}

#[test]
fn settings_that_change_unnoticed_are_found_at_the_end() {
    let (bench, folder) = (Bench::new(), tempfile::tempdir().unwrap());
    let seq = folder.path().join("seq");
    // In the last position, 10 mm from home; the motion ends there, so nothing else shows it.
    let ended = bench.scan(&seq, FRAMES, || bench.tell("$27=1.25"));
    let Err(CaptureError::NotClosed(how)) = ended else { panic!("{ended:?}") };
    assert!(how.contains("$27 was 1 and is 1.25"), "{how}");
}
