//! The simulated rig as a bench for faults.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::sync::Arc;
use std::time::Duration;

use epirig_core::frame::Frame;
use epirig_devices::camera::{Camera, CameraSettings, SimCamera, SimFault, SimStamps};
use epirig_devices::stage::{SimStage, SimStageConfig, Stage};
use epirig_simulator::{Simulator, SimulatorConfig};

use super::faults::{Bench, Fault};

pub struct SimBench {
    simulator: Arc<Simulator>,
    stage: SimStage,
    camera: SimCamera,
}

impl SimBench {
    pub fn new() -> Self {
        let simulator = Arc::new(Simulator::new(SimulatorConfig::textured_plane(160, 120, 2)).unwrap());
        let mut stage = SimStage::new(SimStageConfig::ideal(100.0));
        stage.home().unwrap();
        let camera = SimCamera::before_simulator(Arc::clone(&simulator), stage.watch());
        Self { simulator, stage, camera }
    }
}

impl Bench for SimBench {
    fn stage(&mut self) -> &mut dyn Stage {
        &mut self.stage
    }

    fn camera(&mut self) -> &mut dyn Camera {
        &mut self.camera
    }

    fn settings(&self) -> CameraSettings {
        CameraSettings {
            patience: Duration::from_secs(10),
            controls: vec![("gain".to_owned(), "0".to_owned())],
            ..CameraSettings::default()
        }
    }

    fn truth(&mut self, position_mm: f64) -> Frame {
        self.simulator.expose(position_mm, 0)
    }

    fn inject(&mut self, fault: Fault) -> bool {
        let faults: &[SimFault] = match fault {
            Fault::DroppedBuffers => &[SimFault::Dropped(0.5)],
            Fault::ErrorFlag => &[SimFault::BufferError],
            Fault::QueueError => &[SimFault::QueueError],
            Fault::RequestError => &[SimFault::RequestError],
            Fault::StartError => &[SimFault::StartError],
            Fault::FatalError => &[SimFault::FatalError],
            Fault::Disconnect => &[SimFault::Disconnect { failing: 3 }],
            Fault::AnotherCamera => &[SimFault::Replaced, SimFault::Disconnect { failing: 0 }],
            Fault::SequenceWrap => &[SimFault::SequenceAt(u32::MAX - 127)],
            Fault::NoSignal => &[SimFault::NoSignal(true)],
            Fault::StampsOfTheStart => &[SimFault::Stamps(SimStamps::Mislabelled)],
            Fault::StampsOfTheEnd => &[SimFault::Stamps(SimStamps::EndOfFrame)],
            Fault::StampsOfAnotherClock => &[SimFault::Stamps(SimStamps::Ahead)],
            Fault::StampsOfZero => &[SimFault::Stamps(SimStamps::Zero)],
            Fault::StampsRunningBack => &[SimFault::Stamps(SimStamps::Backwards)],
            Fault::StampsOfALaterStart => &[SimFault::Stamps(SimStamps::Behind)],
            Fault::Unnumbered => &[SimFault::Unnumbered],
            Fault::Gap => &[SimFault::Gap(3)],
            Fault::ShortBuffer => &[SimFault::ShortBuffer],
            Fault::TornFrame => &[SimFault::TornFrame],
            Fault::LateContents => &[SimFault::LateContents],
            Fault::LateControls => &[SimFault::LateControls(6), SimFault::GainDrifts],
            Fault::ControlChanged => &[SimFault::GainDrifts],
            Fault::Halt => &[SimFault::Halt],
            Fault::Halts => &[SimFault::Halt, SimFault::Unheard],
            Fault::Silence => &[SimFault::Silence(25)],
            Fault::LongSilence => &[SimFault::Silence(100_000)],
            // Of an HDMI receiver's.
            Fault::UnbindAndBind
            | Fault::NoLock
            | Fault::TimingsOutOfRange
            | Fault::OtherTimings
            | Fault::InputSetOtherwise
            // Of a USB camera's.
            | Fault::AnotherSocket
            | Fault::FrameMarkMissing
            | Fault::FrameMarkInside
            | Fault::LostPacket
            | Fault::CompressedShort
            | Fault::ControlStalled => return false,
        };
        faults.iter().for_each(|fault| self.camera.device().inject(*fault));
        true
    }

    fn bring_back(&mut self, _fault: Fault) {}

    fn mend(&mut self, _fault: Fault) {
        // A new camera before the same stage.
        self.camera = SimCamera::before_simulator(Arc::clone(&self.simulator), self.stage.watch());
        self.camera.configure(&self.settings()).unwrap();
    }
}
