//! How messages travel: `00 COBS(header, message, CRC) 00`, and one raw byte that stops at once.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Largest encoded frame without its delimiters, in bytes. Longer ones are noise.
pub const MAX_ENCODED: usize = 64;

/// Stops the stage at once if it comes where a frame could begin, i.e. after a delimiter. No frame begins with it:
/// the first byte of a COBS frame of at most [`MAX_ENCODED`] bytes is smaller.
pub const EMERGENCY_STOP: u8 = 0xFF;

/// Stands before and after each frame, and nowhere in it.
pub const DELIMITER: u8 = 0;

/// Sequence numbers go from 0 to this and start again.
pub const MAX_SEQUENCE: u8 = 0x7F;

const CRC: crc::Crc<u16, crc::NoTable> = crc::Crc::<u16, crc::NoTable>::new(&crc::CRC_16_IBM_3740);
const CRC_BYTES: usize = 2;

/// Who speaks: the top bit of a frame's header, so that an echo is never taken for an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Host to stage.
    Request,
    /// Stage to host.
    Reply,
}

impl Direction {
    const fn bit(self) -> u8 {
        match self {
            Self::Request => 0,
            Self::Reply => 0x80,
        }
    }
}

/// A message as it came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Received<T> {
    /// Number of the request that it is or answers, 0 to [`MAX_SEQUENCE`].
    pub sequence: u8,
    /// What was said.
    pub message: T,
}

/// Why bytes between two delimiters are no message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameError {
    /// Not COBS, or shorter than a header and a CRC.
    Malformed,
    /// The CRC does not fit: something was lost, doubled or flipped.
    Crc,
    /// A sound frame from the wrong side, as an echo would be.
    Direction,
    /// A sound frame that holds no message of this version. The sequence number is good.
    Unknown {
        /// Of the frame.
        sequence: u8,
    },
}

/// A frame ready to be sent, with its delimiters.
#[derive(Debug, Clone, Copy)]
pub struct Encoded {
    buffer: [u8; MAX_ENCODED + 2],
    length: usize,
}

impl Encoded {
    /// The bytes to send.
    pub fn bytes(&self) -> &[u8] {
        &self.buffer[..self.length]
    }
}

/// Makes a frame; `None` if the message is longer than a frame may be, which no message of this crate is.
pub fn encode<T: Serialize>(direction: Direction, sequence: u8, message: &T) -> Option<Encoded> {
    let mut plain = [0; MAX_ENCODED - 1];
    plain[0] = direction.bit() | (sequence & MAX_SEQUENCE);
    let room = plain.len() - CRC_BYTES;
    let length = 1 + postcard::to_slice(message, &mut plain[1..room]).ok()?.len();
    let crc = CRC.checksum(&plain[..length]);
    plain[length..length + CRC_BYTES].copy_from_slice(&crc.to_le_bytes());
    let mut buffer = [DELIMITER; MAX_ENCODED + 2];
    let encoded = cobs::encode(&plain[..length + CRC_BYTES], &mut buffer[1..=MAX_ENCODED]);
    Some(Encoded { buffer, length: encoded + 2 })
}

/// Reads what stood between two delimiters; `payload` is overwritten.
///
/// # Errors
/// [`FrameError`] if it is no message, or one from the wrong side.
pub fn decode<T: DeserializeOwned>(
    direction: Direction,
    payload: &mut [u8],
) -> Result<Received<T>, FrameError> {
    let length = cobs::decode_in_place(payload).map_err(|_| FrameError::Malformed)?;
    let Some(plain) = payload.get(..length).filter(|plain| plain.len() > CRC_BYTES) else {
        return Err(FrameError::Malformed);
    };
    let (body, crc) = plain.split_at(length - CRC_BYTES);
    if crc != CRC.checksum(body).to_le_bytes() {
        return Err(FrameError::Crc);
    }
    if body[0] & 0x80 != direction.bit() {
        return Err(FrameError::Direction);
    }
    let sequence = body[0] & MAX_SEQUENCE;
    match postcard::take_from_bytes(&body[1..]) {
        Ok((message, [])) => Ok(Received { sequence, message }),
        _ => Err(FrameError::Unknown { sequence }),
    }
}

/// Cuts a stream of bytes into frames. Its memory is fixed, whatever comes.
#[derive(Debug, Clone)]
pub struct Receiver {
    buffer: [u8; MAX_ENCODED],
    /// Bytes since the delimiter; larger than the buffer if they are noise.
    length: usize,
}

/// What a byte completed.
#[derive(Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// Bytes between two delimiters, to be given to [`decode`].
    Payload(&'a mut [u8]),
    /// [`EMERGENCY_STOP`] where a frame could begin.
    EmergencyStop,
    /// More bytes between two delimiters than a frame can have; they are gone.
    Overlong,
}

impl Default for Receiver {
    fn default() -> Self {
        Self { buffer: [0; MAX_ENCODED], length: 0 }
    }
}

impl Receiver {
    /// Bytes since the last delimiter.
    pub fn pending(&self) -> usize {
        self.length
    }

    /// Takes the next byte of the stream.
    pub fn push(&mut self, byte: u8) -> Option<Event<'_>> {
        if byte == DELIMITER {
            let length = core::mem::take(&mut self.length);
            return match length {
                0 => None,
                1..=MAX_ENCODED => Some(Event::Payload(&mut self.buffer[..length])),
                _ => Some(Event::Overlong),
            };
        }
        if byte == EMERGENCY_STOP && self.length == 0 {
            return Some(Event::EmergencyStop);
        }
        if let Some(free) = self.buffer.get_mut(self.length) {
            *free = byte;
        }
        self.length = (self.length + 1).min(MAX_ENCODED + 1);
        None
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use proptest::prelude::*;
    use std::vec::Vec;

    use super::*;
    use crate::message::{Request, Settings};

    /// The largest request: every number as long as it can be.
    const LONGEST: Request = Request::WriteSettings(Settings {
        velocity_nm_s: u32::MAX,
        acceleration_nm_s2: u32::MAX,
        seek_velocity_nm_s: u32::MAX,
        touch_velocity_nm_s: u32::MAX,
        pull_off_nm: u32::MAX,
        watchdog_ms: u16::MAX,
    });

    fn messages(stream: &[u8]) -> Vec<Result<Received<Request>, FrameError>> {
        let mut receiver = Receiver::default();
        let mut found = Vec::new();
        for &byte in stream {
            if let Some(Event::Payload(payload)) = receiver.push(byte) {
                found.push(decode(Direction::Request, payload));
            }
        }
        found
    }

    #[test]
    fn frames_come_through_noise_and_one_another() {
        let mut stream = std::vec![9, 8, 7];
        for sequence in [0, 1, MAX_SEQUENCE] {
            stream.extend_from_slice(encode(Direction::Request, sequence, &LONGEST).unwrap().bytes());
            stream.extend([1; 300]);
        }
        let found = messages(&stream);
        let good: Vec<_> = found.iter().flatten().map(|received| received.sequence).collect();
        assert_eq!(good, [0, 1, MAX_SEQUENCE]);
    }

    #[test]
    fn an_echo_and_an_unknown_message_are_told_apart() {
        let mut echo = encode(Direction::Request, 5, &Request::Status).unwrap();
        let length = echo.length;
        let payload = &mut echo.buffer[1..length - 1];
        assert_eq!(decode::<Request>(Direction::Reply, payload), Err(FrameError::Direction));
        let mut unknown = encode(Direction::Request, 5, &200_u8).unwrap();
        let length = unknown.length;
        let payload = &mut unknown.buffer[1..length - 1];
        assert_eq!(decode::<Request>(Direction::Request, payload), Err(FrameError::Unknown { sequence: 5 }));
    }

    #[test]
    fn the_stop_byte_counts_between_frames_only() {
        let mut receiver = Receiver::default();
        assert_eq!(receiver.push(EMERGENCY_STOP), Some(Event::EmergencyStop));
        assert_eq!(receiver.push(5), None);
        assert_eq!(receiver.push(EMERGENCY_STOP), None);
        assert_eq!(receiver.push(DELIMITER), Some(Event::Payload(&mut [5, EMERGENCY_STOP])));
        assert_eq!(receiver.push(EMERGENCY_STOP), Some(Event::EmergencyStop));
    }

    /// CRC-16 finds a changed data byte for certain; a changed COBS byte moves zeros about, and goes unnoticed once in 65536.
    #[test]
    fn a_changed_byte_is_noticed() {
        let request = Request::Move { id: 7, position_nm: 1_500_000 };
        let good = encode(Direction::Request, 1, &request).unwrap();
        for at in 1..good.length - 1 {
            for change in 1..=255 {
                let mut changed = good;
                changed.buffer[at] ^= change;
                let read = messages(changed.bytes());
                assert!(read.iter().all(Result::is_err), "byte {at} changed by {change:#04x}: {read:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn no_frame_begins_with_the_stop_byte(id: u32, position_nm: i64, sequence in 0..=MAX_SEQUENCE) {
            for request in [Request::Move { id, position_nm }, LONGEST] {
                let encoded = encode(Direction::Request, sequence, &request).unwrap();
                prop_assert!(encoded.bytes()[1] < EMERGENCY_STOP);
                prop_assert!(!encoded.bytes()[1..encoded.length - 1].contains(&DELIMITER));
                prop_assert_eq!(messages(encoded.bytes()), [Ok(Received { sequence, message: request })]);
            }
        }

        #[test]
        fn any_bytes_at_all_are_survived(stream: Vec<u8>) {
            messages(&stream);
        }
    }
}
