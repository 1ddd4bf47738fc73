//! The camera as a USB device: answers requests, and ends transfers that are taken back.

use std::collections::VecDeque;
use std::io::{self, BufReader};
use std::os::unix::net::UnixStream;
use std::sync::{Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use rustix::time::{ClockId, clock_gettime};

use super::controls::{
    Controls, GET_CUR, GET_DEF, GET_INFO, GET_LEN, GET_MAX, GET_MIN, INVALID_REQUEST, Reply, SET_CUR,
};
use super::descriptors::{CLOCK_HZ, Model, PROBE, VIDEO_ENDPOINT, offer};
use super::faults::Faults;
use super::scene::Scene;
use super::usbip::{self, Command, ECONNRESET, EPIPE, Transfer};

pub(super) struct State {
    pub(super) controls: Controls,
    pub(super) faults: Faults,
    /// The negotiated settings of the stream.
    pub(super) probe: [u8; PROBE],
    /// How often the stream was stopped: what is left of a picture is then dropped.
    pub(super) stops: u32,
    /// Transfers that the host asks for on the video endpoint.
    pub(super) waiting: VecDeque<Transfer>,
    /// Why the latest request was stalled.
    request_error: u8,
    /// Number of the next picture.
    pub(super) frame: u32,
    pub(super) unplugged: bool,
}

/// A camera with power.
pub(super) struct Device {
    pub(super) model: Model,
    pub(super) scene: Scene,
    /// A picture shows the settings of this number of frames before.
    pub(super) delay: usize,
    /// Time from the start of an exposure to the first byte on the wire; less than a frame interval.
    pub(super) lag: Duration,
    state: Mutex<State>,
    pub(super) changed: Condvar,
    pub(super) wire: Mutex<UnixStream>,
    began: Instant,
}

/// The lower 32 bits of microseconds on the clock of V4L2's time stamps.
pub fn monotonic_us() -> u32 {
    let time = clock_gettime(ClockId::Monotonic);
    (time.tv_sec * 1_000_000 + time.tv_nsec / 1000) as u32
}

impl Device {
    pub(super) fn new(model: Model, scene: Scene, delay: usize, lag: Duration, wire: UnixStream) -> Self {
        let state = State {
            controls: Controls::new(),
            faults: Faults::default(),
            probe: offer(&model, &[0; PROBE]),
            stops: 0,
            waiting: VecDeque::new(),
            request_error: 0,
            frame: 0,
            unplugged: false,
        };
        Self {
            model,
            scene,
            delay,
            lag,
            state: Mutex::new(state),
            changed: Condvar::new(),
            wire: Mutex::new(wire),
            began: Instant::now(),
        }
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    /// The camera's own clock.
    pub(super) fn clock(&self) -> u64 {
        self.began.elapsed().as_nanos() as u64 / u64::from(1_000_000_000 / CLOCK_HZ)
    }

    /// Answers until the plug is pulled.
    pub(super) fn answer(&self, wire: UnixStream) {
        let mut wire = BufReader::with_capacity(4096, wire);
        while let Ok(command) = usbip::read_command(&mut wire) {
            if self.obey(command).is_err() {
                break;
            }
        }
        self.state().unplugged = true;
        self.changed.notify_all();
    }

    fn obey(&self, command: Command) -> io::Result<()> {
        match command {
            Command::Submit(transfer) if transfer.endpoint == VIDEO_ENDPOINT => {
                self.state().waiting.push_back(transfer);
                self.changed.notify_all();
                Ok(())
            }
            Command::Submit(transfer) => {
                let (status, mut data) = match self.request(&transfer) {
                    Ok(data) => (0, data),
                    Err(code) => {
                        self.state().request_error = code;
                        (EPIPE, Vec::new())
                    }
                };
                data.truncate(transfer.length);
                usbip::complete(&mut *self.wire.lock().unwrap(), &transfer, status, &data)
            }
            Command::Unlink { number, victim } => {
                let mut wire = self.wire.lock().unwrap();
                let mut state = self.state();
                let place = state.waiting.iter().position(|transfer| transfer.number == victim);
                let taken_back = place.and_then(|place| state.waiting.remove(place));
                drop(state);
                usbip::confirm_unlink(&mut *wire, number, taken_back.map_or(0, |_| ECONNRESET))
            }
        }
    }

    fn request(&self, transfer: &Transfer) -> Reply {
        let [kind, request, value, value_high, index, index_high, ..] = transfer.setup;
        match (kind, request) {
            (0x80, 6) => match value_high {
                1 => Some(Model::device()),
                2 => Some(self.model.configuration()),
                3 => self.model.name(value),
                6 => Some(Model::qualifier()),
                _ => None,
            }
            .ok_or(INVALID_REQUEST),
            // Status.
            (0x80..=0x82, 0) => Ok(vec![0, 0]),
            // The end of a halt of the endpoint: that is how the host stops a bulk stream.
            (0x02, 1) => Ok(self.stop()),
            // Configuration, features.
            (0x00, 9) | (0x00..=0x02, 1 | 3) => Ok(Vec::new()),
            // Setting 0 of the streaming interface stops an isochronous stream.
            (0x01, 11) => Ok(if index == 1 && value == 0 { self.stop() } else { Vec::new() }),
            (0x21 | 0xA1, _) if index == 1 => self.negotiate(request, value_high, &transfer.data),
            (0x21 | 0xA1, _) if index == 0 => {
                let mut state = self.state();
                // Selector 2 of the interface itself.
                if (index_high, value_high) == (0, 2) {
                    return Ok(vec![state.request_error]);
                }
                let faults = state.faults.clone();
                state.controls.request(request, (index_high, value_high), &transfer.data, &faults)
            }
            _ => Err(INVALID_REQUEST),
        }
    }

    fn stop(&self) -> Vec<u8> {
        self.state().stops += 1;
        self.changed.notify_all();
        Vec::new()
    }

    /// Selectors 1 and 2: settings that are tried, settings that count.
    fn negotiate(&self, request: u8, selector: u8, data: &[u8]) -> Reply {
        let mut state = self.state();
        match (request, selector) {
            (GET_LEN, _) => Ok(vec![PROBE as u8, 0]),
            (GET_INFO, _) => Ok(vec![0b11]),
            (GET_CUR | GET_MIN | GET_MAX | GET_DEF, 1 | 2) => Ok(state.probe.to_vec()),
            (SET_CUR, 1 | 2) if data.len() >= 26 => {
                state.probe = offer(&self.model, data);
                Ok(Vec::new())
            }
            _ => Err(INVALID_REQUEST),
        }
    }
}
