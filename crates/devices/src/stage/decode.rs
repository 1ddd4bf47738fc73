//! What went over a line, as text.

use firmware_protocol::frame::{Direction, Event, FrameError, Received, Receiver, decode};
use firmware_protocol::message::{Reply, Request, Settings, Status};
use serde::de::DeserializeOwned;

use super::Dialect;
use super::grbl::Response;
use super::zaber::ZaberReply;
use crate::link::Side;

const NM_PER_MM: f64 = 1e6;
/// Lines of the text dialects are shorter; what is longer is cut.
const LONGEST_LINE: usize = 256;

/// Turns a stream of bytes into one line of text for each message. Its memory is bounded, whatever comes.
///
/// ```
/// use epirig_devices::link::Side;
/// use epirig_devices::stage::Dialect;
/// use epirig_devices::stage::decode::Decoder;
///
/// let mut decoder = Decoder::new(Dialect::Native);
/// let frame = [0x00, 0x0a, 0x03, 0x03, 0x02, 0xc0, 0x8d, 0xb7, 0x01, 0x3b, 0xfe, 0x00];
/// assert_eq!(decoder.push(Side::Host, &frame), ["#3 move 2 to 1.500000 mm"]);
/// let mut decoder = Decoder::new(Dialect::Grbl);
/// assert_eq!(decoder.push(Side::Device, b"ok\r\n"), ["ok: accepted"]);
/// ```
#[derive(Debug)]
pub struct Decoder {
    dialect: Dialect,
    host: OneSide,
    device: OneSide,
}

#[derive(Debug, Default)]
struct OneSide {
    receiver: Receiver,
    line: Vec<u8>,
}

impl Decoder {
    /// A decoder for both sides of a line.
    pub fn new(dialect: Dialect) -> Self {
        Self { dialect, host: OneSide::default(), device: OneSide::default() }
    }

    /// What has come of one side and is not complete.
    pub fn unfinished(&self, side: Side) -> Option<String> {
        let state = match side {
            Side::Host => &self.host,
            Side::Device => &self.device,
        };
        match self.dialect {
            Dialect::Native => match state.receiver.pending() {
                0 => None,
                count => Some(format!("unfinished: {count} bytes without a delimiter")),
            },
            _ if state.line.is_empty() => None,
            _ => Some(format!("unfinished: {:?}", String::from_utf8_lossy(&state.line))),
        }
    }

    /// Takes the next bytes of one side; what they complete comes back.
    pub fn push(&mut self, side: Side, bytes: &[u8]) -> Vec<String> {
        let state = match side {
            Side::Host => &mut self.host,
            Side::Device => &mut self.device,
        };
        let mut texts = Vec::new();
        for &byte in bytes {
            let text = match self.dialect {
                Dialect::Native => state.native(side, byte),
                Dialect::Grbl if side == Side::Host => state.grbl_command(byte),
                Dialect::Grbl => state.line(byte).map(|line| Response::parse(&line).to_string()),
                Dialect::Zaber => state.line(byte).map(|line| zaber_text(side, &line)),
                Dialect::Simulated => None,
            };
            texts.extend(text);
        }
        texts
    }
}

impl OneSide {
    fn native(&mut self, side: Side, byte: u8) -> Option<String> {
        Some(match self.receiver.push(byte)? {
            Event::EmergencyStop => "EMERGENCY STOP".to_owned(),
            Event::Overlong => "noise: more bytes than a frame can have".to_owned(),
            Event::Payload(payload) => {
                let count = payload.len();
                match side {
                    Side::Host => frame_text(Direction::Request, payload, request_text),
                    Side::Device => frame_text(Direction::Reply, payload, reply_text),
                }
                .unwrap_or_else(|error| match error {
                    FrameError::Malformed => format!("damaged: {count} bytes that are no frame"),
                    FrameError::Crc => format!("damaged: a frame of {count} bytes with a wrong CRC"),
                    FrameError::Direction => format!("echo: a frame of {count} bytes from the other side"),
                    FrameError::Unknown { sequence } => format!("#{sequence} a message of another version"),
                })
            }
        })
    }

    fn line(&mut self, byte: u8) -> Option<String> {
        match byte {
            b'\r' | b'\n' if self.line.is_empty() => None,
            b'\r' | b'\n' => Some(String::from_utf8_lossy(&std::mem::take(&mut self.line)).into_owned()),
            _ if self.line.len() < LONGEST_LINE => {
                self.line.push(byte);
                None
            }
            _ => None,
        }
    }

    fn grbl_command(&mut self, byte: u8) -> Option<String> {
        let real_time = match byte {
            b'?' => "status?",
            b'!' => "feed hold",
            b'~' => "resume",
            0x18 => "soft reset",
            0x85 => "jog cancel",
            _ => return self.line(byte).map(|line| format!("line {:?}", line)),
        };
        Some(real_time.to_owned())
    }
}

fn frame_text<T: DeserializeOwned>(
    direction: Direction,
    payload: &mut [u8],
    text: impl Fn(T) -> String,
) -> Result<String, FrameError> {
    let Received { sequence, message } = decode::<T>(direction, payload)?;
    Ok(format!("#{sequence} {}", text(message)))
}

fn mm(nm: i64) -> String {
    format!("{:.6} mm", nm as f64 / NM_PER_MM)
}

fn settings_text(settings: &Settings) -> String {
    let per_second = |nm: u32| f64::from(nm) / NM_PER_MM;
    format!(
        "{} mm/s, {} mm/s2, seek {} mm/s, touch {} mm/s, pull off {} mm, watchdog {} ms",
        per_second(settings.velocity_nm_s),
        per_second(settings.acceleration_nm_s2),
        per_second(settings.seek_velocity_nm_s),
        per_second(settings.touch_velocity_nm_s),
        per_second(settings.pull_off_nm),
        settings.watchdog_ms
    )
}

fn request_text(request: Request) -> String {
    match request {
        Request::Hello { version } => format!("hello, version {version}"),
        Request::Status => "status?".to_owned(),
        Request::Home { id } => format!("home {id}"),
        Request::Move { id, position_nm } => format!("move {id} to {}", mm(position_nm)),
        Request::Stop => "stop".to_owned(),
        Request::Heartbeat => "heartbeat".to_owned(),
        Request::ReadSettings => "settings?".to_owned(),
        Request::WriteSettings(settings) => format!("settings := {}", settings_text(&settings)),
    }
}

fn reply_text(reply: Reply) -> String {
    match reply {
        Reply::Hello(identity) => format!(
            "hello, version {}, build {}, {} steps/mm, travel {}, boot {}, last operation {}",
            identity.version,
            identity.build,
            identity.steps_per_mm,
            mm(identity.travel_nm),
            identity.boot_id,
            identity.last_operation
        ),
        Reply::Status(status) => status_text(&status),
        Reply::Accepted { id, target_nm } => format!("accepted {id}, to {}", mm(target_nm)),
        Reply::Finished { id, outcome, position_nm } => {
            format!("finished {id}: {outcome:?} at {}", mm(position_nm))
        }
        Reply::Refused(refusal) => format!("refused: {refusal:?}"),
        Reply::Alive { boot_id, moving } => {
            format!("alive, boot {boot_id}, {}", if moving { "moving" } else { "at rest" })
        }
        Reply::Settings(settings) => format!("settings are {}", settings_text(&settings)),
    }
}

fn status_text(status: &Status) -> String {
    let homed = if status.homed { "homed" } else { "NOT homed" };
    let moving = if status.moving { "moving" } else { "at rest" };
    let limits = match status.limits {
        0 => String::new(),
        bits => format!(", limits {bits:02b}"),
    };
    format!(
        "at {}, {moving}, {homed}{limits}, boot {}, operation {} {:?}, fault {:?}, home shift {}",
        mm(status.position_nm),
        status.boot_id,
        status.operation,
        status.outcome,
        status.fault,
        mm(status.home_shift_nm)
    )
}

fn zaber_text(side: Side, line: &str) -> String {
    match (side, ZaberReply::parse(line)) {
        (Side::Host, _) => format!("command {line:?}"),
        (Side::Device, Some(reply)) => {
            let ZaberReply { device, axis, id, accepted, busy, warning, data } = reply;
            let verdict = if accepted { "OK" } else { "REJECTED" };
            let state = if busy { "busy" } else { "idle" };
            format!("#{id} device {device} axis {axis}: {verdict}, {state}, warning {warning}, {data}")
        }
        (Side::Device, None) => format!("no reply with id and checksum: {line:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damage_is_named() {
        let mut decoder = Decoder::new(Dialect::Native);
        let mut frame = [0x00, 0x0a, 0x03, 0x03, 0x02, 0xc0, 0x8d, 0xb7, 0x01, 0x3b, 0xfe, 0x00];
        assert_eq!(decoder.push(Side::Device, &frame), ["echo: a frame of 10 bytes from the other side"]);
        frame[5] ^= 1;
        assert_eq!(decoder.push(Side::Host, &frame), ["damaged: a frame of 10 bytes with a wrong CRC"]);
        assert_eq!(decoder.push(Side::Host, &[0xFF]), ["EMERGENCY STOP"]);
        assert_eq!(decoder.push(Side::Host, &[1; 100]), Vec::<String>::new());
        assert_eq!(decoder.push(Side::Host, &[0]), ["noise: more bytes than a frame can have"]);
    }

    #[test]
    fn the_text_dialects_are_explained() {
        let mut decoder = Decoder::new(Dialect::Grbl);
        assert_eq!(decoder.push(Side::Host, b"?G90 G0 X-1\n"), ["status?", "line \"G90 G0 X-1\""]);
        let texts = decoder.push(Side::Device, b"ALARM:9\r\n");
        assert!(texts[0].starts_with("ALARM:9: homing never found the limit switch"), "{texts:?}");
        let mut decoder = Decoder::new(Dialect::Zaber);
        assert_eq!(
            decoder.push(Side::Device, b"@01 1 42 OK IDLE WR 0:B7\r\n"),
            ["#42 device 1 axis 1: OK, idle, warning WR, 0"]
        );
    }
}
