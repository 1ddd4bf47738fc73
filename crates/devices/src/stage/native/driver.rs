//! Registration of the native driver.

use firmware_protocol::message::Settings as Motion;

use super::conversation::{hello, is_of_native};
use super::decode::FrameDecoder;
use super::protocol::{BAUD, NAME, NM_PER_MM};
use super::{NativeAxis, NativeOptions};
use crate::stage::decode::Decoder;
use crate::stage::keys::{ACCELERATION, VELOCITY};
use crate::stage::simulator::{FaultScript, NativeDevice, SimulatedStage};
use crate::stage::{Axis, Connection, Greeting, StageDriver, StageError};
use epirig_core::settings::{Key, Settings};

/// Stages with epirig's own firmware.
pub struct Native;

impl StageDriver for Native {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> &'static str {
        "epirig's own firmware"
    }

    fn page(&self) -> &'static str {
        include_str!("README.md")
    }

    fn keys(&self) -> Vec<&'static Key> {
        vec![&VELOCITY, &ACCELERATION]
    }

    fn connect(
        &self,
        connection: &mut Connection<'_>,
        settings: &Settings,
    ) -> Result<Box<dyn Axis>, StageError> {
        let (velocity_mm_s, acceleration_mm_s2) =
            (settings.number(&VELOCITY), settings.number(&ACCELERATION));
        // The device is set to both or to neither: what is not given has the usual value then.
        let is_given = velocity_mm_s.is_some() || acceleration_mm_s2.is_some();
        let default = Motion::default();
        // Saturating: the stage itself refuses values that are too large.
        let nm = |mm: Option<f64>, default: u32| mm.map_or(default, |mm| (mm * NM_PER_MM) as u32);
        let motion = Motion {
            velocity_nm_s: nm(velocity_mm_s, default.velocity_nm_s),
            acceleration_nm_s2: nm(acceleration_mm_s2, default.acceleration_nm_s2),
            ..default
        };
        let options = NativeOptions { settings: is_given.then_some(motion) };
        Ok(Box::new(NativeAxis::connect((connection.open_line)(BAUD)?, options)?))
    }

    fn greeting(&self) -> Option<Greeting> {
        Some(Greeting { baud: BAUD, question: hello, is_answer: is_of_native })
    }

    fn decoder(&self) -> Option<Box<dyn Decoder>> {
        Some(Box::new(FrameDecoder::default()))
    }

    fn simulated(&self, faults: FaultScript, boot: u32) -> Option<SimulatedStage> {
        let device = NativeDevice::new(faults).at_boot(boot);
        let plant = device.plant();
        Some(SimulatedStage::new(device, plant, NativeDevice::mm_from_home, NativeDevice::STEP_MM))
    }
}
