//! Decodes the traffic of a native stage to text.

use firmware_protocol::frame::{Direction, Event, FrameError, Received, Receiver, decode};
use firmware_protocol::message::{Reply, Request, Settings, Status};
use serde::de::DeserializeOwned;

use super::protocol::NM_PER_MM;
use crate::link::Side;
use crate::stage::decode::Decoder;

/// Frames of both sides.
#[derive(Debug, Default)]
pub(super) struct FrameDecoder([Receiver; 2]);

impl Decoder for FrameDecoder {
    fn push(&mut self, side: Side, bytes: &[u8]) -> Vec<String> {
        let receiver = &mut self.0[side as usize];
        bytes.iter().filter_map(|byte| event_text(side, receiver.push(*byte)?)).collect()
    }

    fn unfinished(&self, side: Side) -> Option<String> {
        let count = self.0[side as usize].pending();
        (count > 0).then(|| format!("unfinished: {count} bytes without a delimiter"))
    }
}

fn event_text(side: Side, event: Event<'_>) -> Option<String> {
    Some(match event {
        Event::EmergencyStop => "EMERGENCY STOP".to_owned(),
        Event::Overlong => "noise: more bytes than a frame can have".to_owned(),
        Event::Payload(payload) => {
            let count = payload.len();
            match side {
                Side::Host => frame_text(Direction::Request, payload, request_text),
                Side::Device => frame_text(Direction::Reply, payload, reply_text),
            }
            .unwrap_or_else(|error| match error {
                FrameError::Malformed => format!("damaged: {count} bytes that are not a frame"),
                FrameError::Crc => format!("damaged: a frame of {count} bytes with a wrong CRC"),
                FrameError::Direction => format!("echo: a frame of {count} bytes from the other side"),
                FrameError::Unknown { sequence } => format!("#{sequence} a message of another version"),
            })
        }
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damage_is_named() {
        let mut decoder = FrameDecoder::default();
        let mut frame = [0x00, 0x0a, 0x03, 0x03, 0x02, 0xc0, 0x8d, 0xb7, 0x01, 0x3b, 0xfe, 0x00];
        assert_eq!(decoder.push(Side::Device, &frame), ["echo: a frame of 10 bytes from the other side"]);
        frame[5] ^= 1;
        assert_eq!(decoder.push(Side::Host, &frame), ["damaged: a frame of 10 bytes with a wrong CRC"]);
        assert_eq!(decoder.push(Side::Host, &[0xFF]), ["EMERGENCY STOP"]);
        assert_eq!(decoder.push(Side::Host, &[1; 100]), Vec::<String>::new());
        assert_eq!(decoder.push(Side::Host, &[0]), ["noise: more bytes than a frame can have"]);
    }
}
