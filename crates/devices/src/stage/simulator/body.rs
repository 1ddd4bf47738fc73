//! What all simulated stages share: mechanics, scripted faults, clock, and the way to the host.

use std::time::Duration;

use super::{FaultScript, Plant, Troubles};
use crate::link::LineNoise;

/// Time steps of a simulated device, per second.
pub const TICK_HZ: u32 = 10_000;

const TICK_NS: u64 = 1_000_000_000 / TICK_HZ as u64;

/// The part of a simulated stage that does not depend on its dialect.
#[derive(Debug)]
pub struct Body {
    /// The carriage and its switches.
    pub plant: Plant,
    /// The scripted faults.
    pub troubles: Troubles,
    /// Length of a step, in mm.
    step_mm: f64,
    to_device: LineNoise,
    from_device: LineNoise,
    sent: Vec<u8>,
    leftover_ns: u64,
}

/// One byte in a hundred each is lost, doubled and flipped by a noisy line.
const NOISE: f64 = 0.01;

impl Body {
    /// A carriage at 0 steps of `step_mm`, with switches that close at and beyond these positions.
    pub fn new(script: FaultScript, step_mm: f64, low_switch_at: i64, high_switch_at: i64) -> Self {
        let to_device = LineNoise::bad(0, NOISE);
        let troubles = Troubles::new(script);
        let plant = Plant::new(low_switch_at, high_switch_at);
        plant.set_switches_work(troubles.switches_work());
        let from_device = to_device.reversed();
        Self { plant, troubles, step_mm, to_device, from_device, sent: Vec::new(), leftover_ns: 0 }
    }

    /// Begins a move. Homing is not counted.
    pub fn move_begins(&mut self) {
        self.count_move();
        self.plant.set_stalled(self.troubles.no_motion());
    }

    /// Begins a move of a device that stops its motor itself if the carriage stands still.
    pub fn count_move(&mut self) {
        let behind_mm = self.troubles.move_begins();
        self.plant.lose_steps((behind_mm / self.step_mm).round() as u64);
    }

    /// What arrives of a byte from the host: nothing without a cable, and more or less of it on a noisy line.
    pub fn heard(&mut self, byte: u8) -> impl Iterator<Item = u8> + use<> {
        let arrives = self.troubles.connected().then_some(byte);
        let (noisy, sound) = if self.troubles.noisy() { (arrives, None) } else { (None, arrives) };
        noisy.map(|byte| self.to_device.pass(byte)).into_iter().flatten().chain(sound)
    }

    /// Ends the move. What it has not lost of its steps is not lost in another one.
    pub fn move_ends(&mut self) {
        self.plant.lose_steps(0);
        self.troubles.move_ends();
    }

    /// Sends bytes to the host, unless they are lost.
    pub fn say(&mut self, bytes: &[u8]) {
        if self.troubles.muted() || !self.troubles.connected() {
            return;
        }
        if self.troubles.noisy() {
            self.sent.extend(bytes.iter().flat_map(|byte| self.from_device.pass(*byte)));
        } else {
            self.sent.extend_from_slice(bytes);
        }
    }

    /// The bytes sent since the last call.
    pub fn take_sent(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.sent)
    }

    /// The whole ticks of [`TICK_HZ`] in `time` plus the former remainder.
    pub fn ticks(&mut self, time: Duration) -> u64 {
        let total = self.leftover_ns + u64::try_from(time.as_nanos()).unwrap_or(u64::MAX / 2);
        self.leftover_ns = total % TICK_NS;
        total / TICK_NS
    }
}
