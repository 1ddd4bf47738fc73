//! A stage that waits for its picture.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::time::Duration;

use crate::link::SimulatedDevice;
use crate::stage::simulator::{NativeDevice, Plant};

/// Time passes in steps of this, so that the end of a move is noticed when it comes.
const STEP: Duration = Duration::from_millis(1);

/// Stands for no place.
const NOWHERE: i64 = i64::MIN;

/// What stage and world know of each other.
#[derive(Debug, Clone, Default)]
pub(super) struct Between {
    moving: Arc<AtomicBool>,
    shown_steps: Arc<AtomicI64>,
}

impl Between {
    pub(super) fn new() -> Self {
        let between = Self::default();
        between.show(None);
        between
    }

    pub(super) fn moving(&self) -> bool {
        self.moving.load(Ordering::SeqCst)
    }

    /// Which place of the carriage the world shows now; `None` while it shows none.
    pub(super) fn shown(&self) -> Option<i64> {
        Some(self.shown_steps.load(Ordering::SeqCst)).filter(|steps| *steps != NOWHERE)
    }

    pub(super) fn show(&self, steps: Option<i64>) {
        self.shown_steps.store(steps.unwrap_or(NOWHERE), Ordering::SeqCst);
    }
}

/// A stage whose time stands still while it is at rest in a place that the world does not show.
pub struct InStep {
    device: NativeDevice,
    plant: Plant,
    between: Between,
}

impl InStep {
    pub(super) fn new(device: NativeDevice, between: Between) -> Self {
        Self { plant: device.plant(), device, between }
    }

    fn waits(&self) -> bool {
        !self.device.moves() && self.between.shown() != Some(self.plant.carriage_steps())
    }
}

impl SimulatedDevice for InStep {
    fn receive(&mut self, byte: u8) {
        self.device.receive(byte);
    }

    fn advance(&mut self, time: Duration) {
        let mut left = time;
        while !left.is_zero() && !self.waits() {
            let step = STEP.min(left);
            self.device.advance(step);
            left -= step;
            self.between.moving.store(self.device.moves(), Ordering::SeqCst);
        }
    }

    fn take_sent(&mut self) -> Vec<u8> {
        if self.waits() { Vec::new() } else { self.device.take_sent() }
    }

    fn connected(&self) -> bool {
        self.device.connected()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::SimulatedLink;
    use crate::stage::native::NativeOptions;
    use crate::stage::{NativeStage, Stage};

    #[test]
    fn home_is_where_the_device_says_that_it_is() {
        let device = NativeDevice::default();
        let plant = device.plant();
        let mut stage =
            NativeStage::connect(Box::new(SimulatedLink::new(device)), NativeOptions::default()).unwrap();
        stage.home().unwrap();
        assert_eq!(NativeDevice::mm_from_home(plant.carriage_steps()), 0.0);
        stage.move_to(12.5).unwrap();
        assert_eq!(NativeDevice::mm_from_home(plant.carriage_steps()), 12.5);
    }

    #[test]
    fn a_move_is_not_over_before_it_is_shown() {
        let between = Between::new();
        let device = NativeDevice::default();
        let plant = device.plant();
        let mut in_step = InStep::new(device, between.clone());
        // Nothing is shown yet: not a byte, however long it takes.
        in_step.receive(0);
        in_step.advance(Duration::from_secs(10));
        assert!(in_step.waits() && in_step.take_sent().is_empty());
        between.show(Some(plant.carriage_steps()));
        assert!(!in_step.waits());
    }
}
