//! What all simulated stages share: mechanics, scripted faults, clock, and the way to the host.

use std::time::Duration;

use super::{FaultScript, Plant, Troubles};

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
    sent: Vec<u8>,
    leftover_ns: u64,
}

impl Body {
    /// A carriage at 0 steps, with switches that close at and beyond these positions.
    pub fn new(script: FaultScript, low_switch_at: i64, high_switch_at: i64) -> Self {
        let troubles = Troubles::new(script);
        let plant = Plant::new(low_switch_at, high_switch_at);
        plant.set_switches_work(troubles.switches_work());
        Self { plant, troubles, sent: Vec::new(), leftover_ns: 0 }
    }

    /// Begins a move. Homing is not counted.
    pub fn move_begins(&mut self) {
        self.troubles.move_begins();
        self.plant.set_stalled(self.troubles.no_motion());
    }

    /// Sends bytes to the host, unless they are lost.
    pub fn say(&mut self, bytes: &[u8]) {
        if !self.troubles.muted() && self.troubles.connected() {
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
