//! A simulated camera, with the faults of real ones.

mod device;
mod fault;
mod pictures;
mod view;

use std::sync::Arc;

use super::CheckedCamera;
use crate::stage::StagePosition;
use epirig_simulator::Simulator;

pub use device::SimDevice;
pub use fault::{SimFault, SimStamps};
pub use view::{SimView, ViewSwitch};

/// The simulated camera: sees the simulator's scene at the position of the simulated stage.
///
/// ```
/// use std::sync::Arc;
/// use epirig_devices::camera::{Camera, CameraSettings, SimCamera, SimFault};
/// use epirig_devices::stage::{SimStage, SimStageConfig, Stage};
/// use epirig_simulator::{Simulator, SimulatorConfig};
///
/// let simulator = Arc::new(Simulator::new(SimulatorConfig::textured_plane(64, 48, 9))?);
/// let mut stage = SimStage::new(SimStageConfig::ideal(100.0));
/// let mut camera = SimCamera::before_simulator(Arc::clone(&simulator), stage.watch());
/// camera.configure(&CameraSettings::default())?;
/// camera.start()?;
/// stage.home()?;
/// stage.move_to(12.0)?;
/// camera.device().inject(SimFault::TornFrame);
/// let moment = camera.now();
/// let taken = camera.grab_after(moment)?;
/// assert_eq!(taken.frame, simulator.expose(12.0, 0));
/// assert!(taken.facts.stale > 0 && taken.facts.exposure_start >= moment);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type SimCamera = CheckedCamera<SimDevice>;

impl SimCamera {
    /// A camera that sees `simulator`, whose scene (or camera) is moved by the stage that `position` watches.
    pub fn before_simulator(simulator: Arc<Simulator>, position: StagePosition) -> Self {
        Self::new(SimDevice::new(simulator, position))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, CameraSettings};
    use crate::stage::{SimStage, SimStageConfig, Stage};
    use epirig_simulator::SimulatorConfig;

    /// Number of neighbouring pairs that did not agree, in a hundred grabs of a tile under a lamp with a
    /// flicker of 0.3 %.
    fn refused(noise_dn: f64) -> usize {
        let mut config = SimulatorConfig::real_tile(128, 2);
        config.sensor.read_noise_dn = noise_dn;
        let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
        let mut camera =
            SimCamera::before_simulator(Arc::new(Simulator::new(config).unwrap()), stage.watch());
        camera.configure(&CameraSettings::default()).unwrap();
        camera.start().unwrap();
        stage.home().unwrap();
        stage.move_to(85.0).unwrap();
        let grab = |_| {
            let moment = camera.now();
            camera.grab_after(moment).unwrap().facts.unsteady
        };
        (0..100).map(grab).sum()
    }

    #[test]
    fn a_lamp_that_flickers_a_little_is_steady_enough() {
        // Noise at 45 dB below full scale of 8 bit.
        assert_eq!(refused(1.43), 0);
        assert_eq!(refused(0.0), 0);
    }

    #[test]
    fn the_board_is_seen_in_its_pose() {
        let simulator = Arc::new(Simulator::new(SimulatorConfig::real_tile(128, 2)).unwrap());
        let stage = SimStage::new(SimStageConfig::ideal(200.0));
        let mut pictures = pictures::Pictures::new(Arc::clone(&simulator));
        for pose in [0, 3, 0] {
            let expected = simulator.digitise(&simulator.board_irradiance(pose), 7);
            assert_eq!(pictures.frame(SimView::Board(pose), stage.watch().get_mm(), 1.0, 7), expected);
        }
    }
}
