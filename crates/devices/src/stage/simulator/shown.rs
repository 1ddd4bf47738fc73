//! A simulated device whose carriage is watched.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::Plant;
use crate::link::SimulatedDevice;
use crate::stage::StagePosition;

/// Shows the true position of the carriage as the time of its device goes by.
pub(super) struct Shown {
    device: Arc<Mutex<dyn SimulatedDevice>>,
    plant: Plant,
    mm_from_home: fn(i64) -> f64,
    watch: StagePosition,
}

impl Shown {
    pub(super) fn new(
        device: Arc<Mutex<dyn SimulatedDevice>>,
        plant: Plant,
        mm_from_home: fn(i64) -> f64,
        watch: StagePosition,
    ) -> Self {
        Self { device, plant, mm_from_home, watch }
    }
}

impl SimulatedDevice for Shown {
    fn receive(&mut self, byte: u8) {
        self.device.receive(byte);
    }

    fn advance(&mut self, time: Duration) {
        self.device.advance(time);
        self.watch.set((self.mm_from_home)(self.plant.carriage_steps()), self.watch.elapsed() + time);
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.device.take_sent()
    }

    fn connected(&self) -> bool {
        self.device.connected()
    }
}
