//! Requests and replies over a line that may lose them.

use std::time::Duration;

use firmware_protocol::frame::{
    DELIMITER, Direction, EMERGENCY_STOP, Event, MAX_SEQUENCE, Received, Receiver, decode, encode,
};
use firmware_protocol::message::{Identity, PROTOCOL_VERSION, Reply, Request};

use super::protocol::NAME;
use crate::link::{Inbox, Link, LinkError};
use crate::stage::StageError;
use crate::stage::grbl::is_of_grbl;

/// A board answers within some 10 ms; a USB adapter adds up to 32 ms.
const REPLY_PATIENCE: Duration = Duration::from_millis(60);

/// If one byte in a hundred is lost, doubled and flipped each, half of all exchanges fail: 24 in a row once
/// in 10 million.
const TRIES: u32 = 24;

/// A board that is reset by opening its port is silent for up to 2 s.
const BOOT_PATIENCE: Duration = Duration::from_secs(4);

/// Sequence numbers that there are.
const SEQUENCES: u64 = MAX_SEQUENCE as u64 + 1;

/// Successive answers to hello that show that the line holds no answers to a former process: each has one
/// chance in 128 to be one.
const HELLOS: u32 = 3;

/// Multiplier and increment of Knuth's MMIX generator.
const LCG: (u64, u64) = (6_364_136_223_846_793_005, 1_442_695_040_888_963_407);

/// Whether a reply can be the answer to a request.
fn answers(request: &Request, reply: &Reply) -> bool {
    match reply {
        Reply::Refused(_) => true,
        Reply::Hello(_) => matches!(request, Request::Hello { .. }),
        // A stop is answered by the status.
        Reply::Status(_) => matches!(request, Request::Status | Request::Stop),
        Reply::Accepted { .. } => matches!(request, Request::Home { .. } | Request::Move { .. }),
        Reply::Alive { .. } => matches!(request, Request::Heartbeat),
        Reply::Settings(_) => matches!(request, Request::ReadSettings | Request::WriteSettings(_)),
        Reply::Finished { .. } => false,
    }
}

/// Whether a frame has no byte that commands another kind of device: GRBL obeys a reset, a hold and others
/// from 0x80 on anywhere, and takes lines that have an end.
fn is_harmless(sequence: u8, request: &Request) -> bool {
    let commands = |byte: &u8| matches!(byte, 0x18 | b'!' | b'~' | b'?' | b'\n' | b'\r' | 0x80..=0xAF);
    encode(Direction::Request, sequence, request).is_some_and(|frame| !frame.bytes().iter().any(commands))
}

/// A frame that asks a device who it is.
pub(super) fn hello() -> Vec<u8> {
    let request = Request::Hello { version: PROTOCOL_VERSION };
    let sequence = (0..=MAX_SEQUENCE).find(|sequence| is_harmless(*sequence, &request)).unwrap_or_default();
    encode(Direction::Request, sequence, &request).map_or_else(Vec::new, |frame| frame.bytes().to_vec())
}

/// Whether bytes hold a reply.
pub(super) fn is_of_native(heard: &[u8]) -> bool {
    let mut receiver = Receiver::default();
    heard.iter().any(|byte| match receiver.push(*byte) {
        Some(Event::Payload(payload)) => decode::<Reply>(Direction::Reply, payload).is_ok(),
        _ => false,
    })
}

/// Most bytes of unknown output kept for the error message.
const HEARD: usize = 60;

/// Sends requests and receives their replies, one at a time.
pub(super) struct Conversation {
    link: Box<dyn Link>,
    inbox: Inbox,
    receiver: Receiver,
    sequence: u8,
    /// Id of the last operation that ended.
    finished: Option<u32>,
    /// The last bytes that belonged to no valid frame.
    heard: Vec<u8>,
}

impl Conversation {
    pub(super) fn new(link: Box<dyn Link>) -> Self {
        Self {
            sequence: (link.session() % SEQUENCES) as u8,
            link,
            inbox: Inbox::default(),
            receiver: Receiver::default(),
            finished: None,
            heard: Vec::new(),
        }
    }

    pub(super) fn port(&self) -> &str {
        self.link.name()
    }

    pub(super) fn now(&self) -> Duration {
        self.link.now()
    }

    /// Identifies the device, for as long as a board takes to boot.
    pub(super) fn hello(&mut self) -> Result<Identity, StageError> {
        self.inbox.drain(&mut *self.link)?;
        let since = self.now();
        let request = Request::Hello { version: PROTOCOL_VERSION };
        let (mut random, mut in_a_row) = (self.link.session(), 0);
        while self.now() - since < BOOT_PATIENCE {
            // Answers to a former process may still come, in the order of its requests. So the sequence
            // jumps, and an answer to each of several jumps is behind them all.
            loop {
                random = random.wrapping_mul(LCG.0).wrapping_add(LCG.1);
                self.sequence = (random >> 32) as u8 & MAX_SEQUENCE;
                if is_harmless((self.sequence + 1) & MAX_SEQUENCE, &request) {
                    break;
                }
            }
            match self.try_to_ask(request)? {
                Some(Reply::Hello(identity)) if in_a_row + 1 == HELLOS => return Ok(identity),
                Some(Reply::Hello(_)) => in_a_row += 1,
                _ => in_a_row = 0,
            }
            // For devices with another protocol these frames are noise, and some bytes may be commands.
            if is_of_grbl(&self.heard) {
                break;
            }
        }
        Err(self.silence("hello", BOOT_PATIENCE))
    }

    /// Sends a request until it is answered.
    pub(super) fn ask(&mut self, request: Request) -> Result<Reply, StageError> {
        for _ in 0..TRIES {
            if let Some(reply) = self.try_to_ask(request)? {
                return Ok(reply);
            }
        }
        Err(self.silence(&format!("{request:?}"), REPLY_PATIENCE * TRIES))
    }

    fn silence(&self, asked: &str, patience: Duration) -> StageError {
        let port = self.port();
        if self.heard.is_empty() {
            let hint = "whether its firmware is epirig's (else choose another --driver)";
            return StageError::no_answer(port, asked, patience, hint);
        }
        let text = String::from_utf8_lossy(&self.heard);
        let says = format!("it says \"{}\"", text.escape_default());
        StageError::foreign(port, NAME, says, "check its firmware, or choose another --driver")
    }

    fn try_to_ask(&mut self, request: Request) -> Result<Option<Reply>, StageError> {
        self.sequence = (self.sequence + 1) & MAX_SEQUENCE;
        let Some(frame) = encode(Direction::Request, self.sequence, &request) else { return Ok(None) };
        self.link.send(frame.bytes())?;
        let until = self.now() + REPLY_PATIENCE;
        while let Some(reply) = self.next_reply(until)? {
            // Late answers to earlier requests are none of ours.
            if reply.sequence == self.sequence && answers(&request, &reply.message) {
                return Ok(Some(reply.message));
            }
        }
        Ok(None)
    }

    /// Waits for the end of an operation; `false` after the time-out.
    pub(super) fn finished(&mut self, id: u32, patience: Duration) -> Result<bool, LinkError> {
        let until = self.now() + patience;
        while self.finished != Some(id) {
            if self.next_reply(until)?.is_none() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    pub(super) fn forget_finished(&mut self) {
        self.finished = None;
    }

    /// Sends the byte that stops at once; several times, in case one is lost.
    pub(super) fn emergency_stop(&mut self) -> Result<(), LinkError> {
        let mut bytes = [DELIMITER, EMERGENCY_STOP].repeat(3);
        bytes.push(DELIMITER);
        self.link.send(&bytes)
    }

    /// The next valid frame before `until`.
    fn next_reply(&mut self, until: Duration) -> Result<Option<Received<Reply>>, LinkError> {
        while let Some(byte) = self.inbox.next(&mut *self.link, until)? {
            self.heard.push(byte);
            if self.heard.len() > HEARD {
                self.heard.remove(0);
            }
            if let Some(Event::Payload(payload)) = self.receiver.push(byte)
                && let Ok(reply) = decode::<Reply>(Direction::Reply, payload)
            {
                self.heard.clear();
                if let Reply::Finished { id, .. } = reply.message {
                    self.finished = Some(id);
                }
                return Ok(Some(reply));
            }
        }
        Ok(None)
    }
}
