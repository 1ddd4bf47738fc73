//! Registration of the Zaber driver.

use super::message::{is_of_zaber, line_text};
use super::{BAUD, NAME, ZaberAxis, ZaberOptions};
use crate::stage::decode::{Decoder, LineDecoder};
use crate::stage::simulator::{FaultScript, SimulatedStage, ZaberDevice};
use crate::stage::{Axis, Connection, Console, Greeting, StageDriver, StageError};
use epirig_core::settings::quantity::UM;
use epirig_core::settings::{Allowed, Key, Kind, Setting, Settings};

static DEVICE: Key =
    Key::new("stage", "device", Kind::Whole(1, 99), "2", "Number of the device in its chain").or("1");

static MICROSTEP: Key = Key::new(
    "stage",
    "microstep",
    Kind::measure(UM, Allowed::Positive),
    "0.047625 um",
    "Length of a microstep, from the data sheet; required",
)
.needed("it is in the stage's data sheet");

/// Stages with the Zaber ASCII protocol.
pub struct Zaber;

impl StageDriver for Zaber {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> &'static str {
        "Zaber ASCII"
    }

    fn page(&self) -> &'static str {
        include_str!("README.md")
    }

    fn keys(&self) -> Vec<&'static Key> {
        vec![&DEVICE, &MICROSTEP]
    }

    fn connect(
        &self,
        connection: &mut Connection<'_>,
        settings: &Settings,
    ) -> Result<Box<dyn Axis>, StageError> {
        let device = settings.whole(&DEVICE).and_then(|number| u8::try_from(number).ok()).unwrap_or(1);
        // Without a microstep no length is known, so the driver refuses 0.
        let microstep_um = settings.number(&MICROSTEP).unwrap_or(0.0);
        let options = ZaberOptions { device, microstep_um };
        Ok(Box::new(ZaberAxis::connect((connection.open_line)(BAUD)?, options)?))
    }

    /// The device follows its position, and knows whether it has its reference.
    fn console(&self) -> Option<Console> {
        Some(Console { baud: BAUD, real_time: &[], distrust: None })
    }

    /// All devices of the chain answer a command without words.
    fn greeting(&self) -> Option<Greeting> {
        Some(Greeting { baud: BAUD, question: || b"\n/\n".to_vec(), is_answer: is_of_zaber })
    }

    fn decoder(&self) -> Option<Box<dyn Decoder>> {
        Some(Box::new(LineDecoder::new(line_text)))
    }

    fn simulated(&self, faults: FaultScript, _boot: u32) -> Option<SimulatedStage> {
        let device = ZaberDevice::new(faults);
        let (plant, step_um) = (device.plant(), ZaberDevice::MICROSTEP_UM);
        let mut stage = SimulatedStage::new(device, plant, ZaberDevice::mm_from_home, step_um / 1000.0);
        stage.settings.set(&MICROSTEP, Setting::Number(step_um));
        Some(stage)
    }
}
