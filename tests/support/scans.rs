//! Small simulated scans, and what is to come of them.

#![allow(dead_code, reason = "each test program uses a part of this")]
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use epirig::capture::{
    Arrangement, Assistant, CaptureError, CapturePlan, PauseSwitch, Rig, Unwatched, capture, resume,
};
use epirig::profile::PlanProfile;
use epirig_core::progress::Silent;
use epirig_data::sequence::{ClosureRecord, Sequence, verify};
use epirig_data::storage::Disk;
use epirig_devices::camera::{Camera, SimCamera, ViewSwitch};
use epirig_devices::stage::{SimStage, SimStageConfig, Stage, StagePosition};
use epirig_simulator::{HandBoard, Simulator, SimulatorConfig};

pub const FRAMES: usize = 6;

/// A noise-free simulator: frames of one place are the same to the byte.
pub fn simulator() -> Arc<Simulator> {
    let mut config = SimulatorConfig::textured_plane(64, 48, FRAMES);
    config.board = Some(HandBoard { square_mm: 30.0, columns: 4, rows: 3 });
    Arc::new(Simulator::new(config).unwrap())
}

pub fn plan(simulator: &Simulator) -> CapturePlan {
    let settle = Duration::ZERO;
    let section = PlanProfile { settle, dark: 1, flat: 1, board: 2, ..PlanProfile::default() };
    CapturePlan { section, ..CapturePlan::at(simulator.config().scan.positions_mm()) }
}

/// Arranges what is asked for in front of the simulated camera.
struct Willing(ViewSwitch);

impl Assistant for Willing {
    fn is_there(&self) -> bool {
        true
    }

    fn arrange(&mut self, arrangement: Arrangement, _camera: &mut dyn Camera) -> bool {
        self.0.put(arrangement.simulated());
        true
    }
}

/// A new scan, or a resumed one, with a rig that has just been switched on.
pub fn scan(
    simulator: &Arc<Simulator>,
    plan: &CapturePlan,
    folder: &Path,
    disk: Box<dyn Disk>,
    pause: &PauseSwitch,
) -> Result<Option<ClosureRecord>, CaptureError> {
    scan_on(SimStageConfig::ideal(200.0), simulator, plan, folder, disk, pause)
}

/// The same on a stage of this make.
pub fn scan_on(
    stage: SimStageConfig,
    simulator: &Arc<Simulator>,
    plan: &CapturePlan,
    folder: &Path,
    disk: Box<dyn Disk>,
    pause: &PauseSwitch,
) -> Result<Option<ClosureRecord>, CaptureError> {
    let watch = StagePosition::default();
    let seen = watch.clone();
    let mut stages =
        move || Ok(Box::new(SimStage::seen_through(stage.clone(), seen.clone())) as Box<dyn Stage>);
    let mut camera = SimCamera::before_simulator(Arc::clone(simulator), watch);
    let view = camera.device().view();
    let mut rig = Rig {
        stages: &mut stages,
        camera: &mut camera,
        assistant: &mut Willing(view),
        pause: pause.clone(),
        progress: &Silent,
        watcher: &Unwatched,
    };
    if folder.join("sequence.json").exists() {
        resume(&mut rig, plan, folder, disk)
    } else {
        capture(&mut rig, plan, folder, disk)
    }
}

/// The frames are all there, as their records say, and as an undisturbed scan would have them.
pub fn assert_whole(simulator: &Simulator, folder: &Path) {
    let sequence = Sequence::open(folder).unwrap();
    let report = verify(&sequence, &Silent).unwrap();
    assert_eq!(report.findings, []);
    assert_eq!(report.good_frames, simulator.config().scan.frames);
    for (record, position_mm) in sequence.frames().iter().zip(simulator.config().scan.positions_mm()) {
        assert_eq!(record.reported_mm, Some(position_mm));
        assert!(sequence.read(record).unwrap() == simulator.expose(position_mm, 0), "frame {}", record.index);
    }
    let hidden = std::fs::read_dir(folder.join("frames")).unwrap();
    assert_eq!(hidden.count(), simulator.config().scan.frames, "nothing half-made is left");
}
