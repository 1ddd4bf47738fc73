//! A camera that looks at the twin, with the faults of real ones.

mod device;
mod fault;
mod pictures;
mod view;

use std::sync::Arc;

use super::CheckedCamera;
use crate::stage::StagePosition;
use crate::twin::Twin;

pub use device::SimDevice;
pub use fault::{SimFault, SimStamps};
pub use view::{SimView, ViewSwitch};

/// The simulated camera: sees the twin's scene where the simulated stage has carried it.
///
/// ```
/// use std::sync::Arc;
/// use epirig::camera::{Camera, CameraSettings, SimCamera, SimFault};
/// use epirig::stage::{SimStage, SimStageConfig, Stage};
/// use epirig::twin::{Twin, TwinConfig};
///
/// let twin = Arc::new(Twin::new(TwinConfig::textured_plane(64, 48, 9))?);
/// let mut stage = SimStage::new(SimStageConfig::ideal(100.0));
/// let mut camera = SimCamera::before_twin(Arc::clone(&twin), stage.watch());
/// camera.configure(&CameraSettings::default())?;
/// camera.start()?;
/// stage.home()?;
/// stage.move_to(12.0)?;
/// camera.device().inject(SimFault::TornFrame);
/// let moment = camera.now();
/// let taken = camera.grab_after(moment)?;
/// assert_eq!(taken.frame, twin.expose(12.0, 0));
/// assert!(taken.facts.stale > 0 && taken.facts.exposure_start >= moment);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type SimCamera = CheckedCamera<SimDevice>;

impl SimCamera {
    /// A camera in front of `twin`, whose scene (or camera) is carried by the stage that `position` watches.
    pub fn before_twin(twin: Arc<Twin>, position: StagePosition) -> Self {
        Self::new(SimDevice::new(twin, position))
    }
}
