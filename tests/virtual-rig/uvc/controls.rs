//! The camera's controls, after UVC 1.1 (4.2.2): values, ranges, and requests for them.

use super::descriptors::{PROCESSING, TERMINAL};
use super::faults::Faults;
use super::picture::Settings;

// Requests.
pub const SET_CUR: u8 = 0x01;
pub const GET_CUR: u8 = 0x81;
pub const GET_MIN: u8 = 0x82;
pub const GET_MAX: u8 = 0x83;
const GET_RES: u8 = 0x84;
pub const GET_LEN: u8 = 0x85;
pub const GET_INFO: u8 = 0x86;
pub const GET_DEF: u8 = 0x87;

// Why a request was stalled.
const WRONG_STATE: u8 = 2;
const OUT_OF_RANGE: u8 = 4;
const INVALID_CONTROL: u8 = 6;
pub const INVALID_REQUEST: u8 = 7;

/// Exposure by hand, and with the automatic: bits of its mode.
const MANUAL: i64 = 1;
const APERTURE_PRIORITY: i64 = 8;

// Names for faults.
pub const EXPOSURE: &str = "exposure";
pub const GAIN: &str = "gain";

/// The value of `exposure` when the camera is plugged in, in units of 100 us.
pub const EXPOSURE_DEFAULT: u16 = 157;

struct Control {
    name: &'static str,
    unit: u8,
    selector: u8,
    bytes: usize,
    minimum: i64,
    maximum: i64,
    step: i64,
    default: i64,
    current: i64,
    /// Which control must be switched to which value before this one may be set.
    needs: Option<(&'static str, i64)>,
}

/// All controls.
pub struct Controls(Vec<Control>);

impl Controls {
    /// As they are when the camera gets power.
    pub fn new() -> Self {
        let control = |name, unit, selector, bytes, [minimum, maximum, step, default]: [i64; 4], needs| {
            Control { name, unit, selector, bytes, minimum, maximum, step, default, current: default, needs }
        };
        Self(vec![
            // Its step tells which modes there are.
            control("mode", TERMINAL, 0x02, 1, [1, 8, MANUAL | APERTURE_PRIORITY, APERTURE_PRIORITY], None),
            control(
                EXPOSURE,
                TERMINAL,
                0x04,
                4,
                [1, 5000, 1, EXPOSURE_DEFAULT.into()],
                Some(("mode", MANUAL)),
            ),
            control("focus", TERMINAL, 0x06, 2, [0, 250, 5, 100], Some(("focus-auto", 0))),
            control("focus-auto", TERMINAL, 0x08, 1, [0, 1, 1, 1], None),
            control(GAIN, PROCESSING, 0x04, 2, [0, 255, 5, 0], None),
            control("mains", PROCESSING, 0x05, 1, [0, 2, 1, 1], None),
            control("white", PROCESSING, 0x0A, 2, [2800, 6500, 10, 4600], Some(("white-auto", 0))),
            control("white-auto", PROCESSING, 0x0B, 1, [0, 1, 1, 1], None),
        ])
    }

    fn value(&self, name: &str) -> i64 {
        self.0.iter().find(|control| control.name == name).unwrap().current
    }

    /// What shows in a picture that is taken now. An automatic exposure wanders.
    pub fn settings(&self, frame: u32) -> Settings {
        let exposure = self.value(EXPOSURE) as u16;
        let wandering = exposure + exposure / 40 * (frame % 16) as u16;
        Settings {
            exposure: if self.value("mode") == MANUAL { exposure } else { wandering },
            gain: self.value(GAIN) as u16,
            white: self.value("white") as u16,
            focus: self.value("focus") as u8,
            mains: self.value("mains") as u8,
        }
    }

    /// Answers a request, or stalls it with an error code.
    pub fn request(
        &mut self,
        request: u8,
        (unit, selector): (u8, u8),
        data: &[u8],
        faults: &Faults,
    ) -> Reply {
        let place = self.0.iter().position(|control| (control.unit, control.selector) == (unit, selector));
        let place = place.ok_or(INVALID_CONTROL)?;
        let automatic = self.0[place].needs.is_some_and(|(name, value)| self.value(name) != value);
        let control = &mut self.0[place];
        let stalled = faults.stall.filter(|(name, _)| *name == control.name);
        if let Some((_, code)) = stalled.filter(|_| matches!(request, SET_CUR | GET_CUR)) {
            return Err(code);
        }
        let value = match request {
            GET_LEN => return Ok((control.bytes as u16).to_le_bytes().to_vec()),
            // It can be read and set; an automatic has it; it may change by itself, so it is asked each time.
            GET_INFO => {
                let by_itself = matches!(control.name, EXPOSURE | "white" | "focus");
                return Ok(vec![0b11 | u8::from(automatic) << 2 | u8::from(by_itself) << 3]);
            }
            GET_CUR => control.current,
            GET_MIN => control.minimum,
            GET_MAX => control.maximum,
            GET_RES => control.step,
            GET_DEF => control.default,
            SET_CUR => {
                let mut bytes = [0; 8];
                bytes[..control.bytes].copy_from_slice(data.get(..control.bytes).ok_or(INVALID_REQUEST)?);
                let value = i64::from_le_bytes(bytes);
                if automatic {
                    return Err(WRONG_STATE);
                }
                if !(control.minimum..=control.maximum).contains(&value) {
                    return Err(OUT_OF_RANGE);
                }
                if faults.deaf != Some(control.name) {
                    control.current = value;
                }
                return Ok(Vec::new());
            }
            _ => return Err(INVALID_REQUEST),
        };
        Ok(value.to_le_bytes()[..control.bytes].to_vec())
    }
}

/// The data of an answer, or the error code of a request that is stalled.
pub type Reply = Result<Vec<u8>, u8>;
