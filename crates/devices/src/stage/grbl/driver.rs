//! Registration of the GRBL driver.

use super::console::unmark;
use super::is_of_grbl;
use super::protocol::{BAUD, CYCLE_START, FEED_HOLD, JOG_CANCEL, NAME, SOFT_RESET, STATUS_QUERY};
use super::response::Response;
use super::{AxisLetter, GrblAxis, GrblOptions};
use crate::link::Side;
use crate::stage::decode::{Decoder, LineDecoder};
use crate::stage::simulator::{FaultScript, GrblDevice, SimulatedStage};
use crate::stage::{Axis, Connection, Console, Greeting, StageDriver, StageError};
use epirig_core::choice::{Choice as _, names};
use epirig_core::settings::{Key, Kind, Settings};

/// What a person may send at once; a reset has no key.
const REAL_TIME: &[u8] = &[STATUS_QUERY, FEED_HOLD, CYCLE_START, SOFT_RESET];

static AXIS: Key =
    Key::new("stage", "axis", Kind::Choice(names::<AxisLetter>), "y", "The axis of the stage").or("x");

/// Stages with GRBL 1.1.
pub struct Grbl;

impl StageDriver for Grbl {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> &'static str {
        "GRBL 1.1"
    }

    fn page(&self) -> &'static str {
        include_str!("README.md")
    }

    fn keys(&self) -> Vec<&'static Key> {
        vec![&AXIS]
    }

    fn connect(
        &self,
        connection: &mut Connection<'_>,
        settings: &Settings,
    ) -> Result<Box<dyn Axis>, StageError> {
        let axis = settings.text(&AXIS).and_then(AxisLetter::from_name).unwrap_or_default();
        let options = GrblOptions { axis, when_moving: connection.when_moving };
        Ok(Box::new(GrblAxis::connect((connection.open_line)(BAUD)?, options)?))
    }

    fn console(&self) -> Option<Console> {
        Some(Console { baud: BAUD, real_time: REAL_TIME, distrust: Some(unmark) })
    }

    fn greeting(&self) -> Option<Greeting> {
        let question = || vec![STATUS_QUERY];
        Some(Greeting { baud: BAUD, question, is_answer: is_of_grbl })
    }

    fn decoder(&self) -> Option<Box<dyn Decoder>> {
        Some(Box::new(LineDecoder::new(line_text).with_real_time(real_time_text)))
    }

    fn simulated(&self, faults: FaultScript, _boot: u32) -> Option<SimulatedStage> {
        let device = GrblDevice::new(faults);
        let plant = device.plant();
        Some(SimulatedStage::new(device, plant, GrblDevice::mm_from_home, GrblDevice::STEP_MM))
    }
}

fn line_text(side: Side, line: &str) -> String {
    match side {
        Side::Host => format!("line {line:?}"),
        Side::Device => Response::parse(line).to_string(),
    }
}

/// GRBL handles these bytes at once, in any position of a line.
fn real_time_text(side: Side, byte: u8) -> Option<&'static str> {
    match (side, byte) {
        (Side::Device, _) => None,
        (_, STATUS_QUERY) => Some("status?"),
        (_, FEED_HOLD) => Some("feed hold"),
        (_, CYCLE_START) => Some("resume"),
        (_, SOFT_RESET) => Some("soft reset"),
        (_, JOG_CANCEL) => Some("jog cancel"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_explained() {
        let mut decoder = Grbl.decoder().unwrap();
        assert_eq!(decoder.push(Side::Host, b"?G90 G0 X-1\n"), ["status?", "line \"G90 G0 X-1\""]);
        let texts = decoder.push(Side::Device, b"ALARM:9\r\n");
        assert!(texts[0].starts_with("ALARM:9: homing never found the limit switch"), "{texts:?}");
        assert_eq!(decoder.push(Side::Device, b"ok\r\n"), ["ok: accepted"]);
    }
}
