//! A camera that looks at the twin.

use std::sync::Arc;

use super::{Camera, CameraError, TakenFrame};
use crate::stage::StagePosition;
use crate::twin::Twin;

/// The simulated camera: sees the twin's scene where the simulated stage has carried it.
#[derive(Debug, Clone)]
pub struct SimCamera {
    twin: Arc<Twin>,
    position: StagePosition,
    exposures: u32,
}

impl SimCamera {
    /// A camera in front of `twin`, whose scene (or camera) is carried by the stage that `position` watches.
    pub fn new(twin: Arc<Twin>, position: StagePosition) -> Self {
        Self { twin, position, exposures: 0 }
    }
}

impl Camera for SimCamera {
    fn identity(&self) -> String {
        let optics = &self.twin.config().optics;
        let bits = self.twin.config().sensor.bit_depth;
        format!("simulated camera, {} x {} of {bits} bit", optics.columns, optics.rows)
    }

    fn grab(&mut self) -> Result<TakenFrame, CameraError> {
        let sequence = self.exposures;
        self.exposures = self.exposures.wrapping_add(1);
        Ok(TakenFrame { frame: self.twin.expose(self.position.get_mm(), sequence), sequence })
    }
}
