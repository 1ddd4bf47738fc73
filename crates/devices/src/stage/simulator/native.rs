//! A simulated stage with the real code of the firmware.

use std::time::Duration;

use firmware_protocol::axis::{Axis, Way};
use firmware_protocol::device::{Build, Device};

use super::{Body, FaultScript, Mishap, Plant, TICK_HZ};
use crate::link::SimulatedDevice;

/// A stage with 250 steps/mm and a travel of 200 mm, like the build for the Uno.
const BUILD: Build = Build { number: 1, steps_per_mm: 250, travel_nm: 200_000_000, tick_hz: TICK_HZ };

/// 3.6 mm below the start position of the carriage.
const LOW_SWITCH_AT: i64 = -900;
/// 2 mm beyond the end of the travel, which begins 1 mm (pull-off) above the low switch.
const HIGH_SWITCH_AT: i64 = LOW_SWITCH_AT + PULL_OFF_STEPS + 200 * 250 + 500;

/// Distance of home above the low switch: 1 mm.
const PULL_OFF_STEPS: i64 = 250;

const FIRST_BOOT: u32 = 1;

/// The firmware's state machine with a simulated carriage.
pub struct NativeDevice {
    build: Build,
    device: Device,
    axis: Axis,
    boot_id: u32,
    body: Body,
    operating: bool,
    may_rest: Option<Gate>,
}

/// Called with the final position, in steps, before the last step of a motion.
pub type Gate = Box<dyn FnMut(i64) -> bool + Send>;

impl Default for NativeDevice {
    fn default() -> Self {
        Self::new(FaultScript::default())
    }
}

impl NativeDevice {
    /// Length of a step, in mm.
    pub const STEP_MM: f64 = 1.0 / BUILD.steps_per_mm as f64;

    /// A stage that has just booted, with scripted faults.
    pub fn new(script: FaultScript) -> Self {
        Self {
            build: BUILD,
            device: Device::new(BUILD, FIRST_BOOT),
            axis: Axis::new(),
            boot_id: FIRST_BOOT,
            body: Body::new(script, Self::STEP_MM, LOW_SWITCH_AT, HIGH_SWITCH_AT),
            operating: false,
            may_rest: None,
        }
    }

    /// The same stage with another boot number, for hosts that know it.
    pub fn at_boot(mut self, boot_id: u32) -> Self {
        self.boot_id = boot_id.wrapping_sub(1);
        self.reset();
        self
    }

    /// The carriage and its switches.
    pub fn plant(&self) -> Plant {
        self.body.plant.clone()
    }

    /// From now on the motor waits before the last step of a motion until `gate` returns `true`. The device
    /// answers meanwhile.
    pub fn rest_when(&mut self, gate: Gate) {
        self.may_rest = Some(gate);
    }

    /// Position of a carriage at `steps` of its [`Plant`], in mm from home.
    pub fn mm_from_home(steps: i64) -> f64 {
        (steps - LOW_SWITCH_AT - PULL_OFF_STEPS) as f64 / f64::from(BUILD.steps_per_mm)
    }

    /// Switches the power off and on.
    pub fn reset(&mut self) {
        self.boot_id = self.boot_id.wrapping_add(1);
        self.device = Device::new(self.build, self.boot_id);
        self.axis = Axis::new();
        self.operating = false;
    }

    /// Counts moves: operations that begin while the axis is homed. Homing is not counted.
    fn mind_the_operation(&mut self) {
        let snapshot = self.axis.snapshot();
        if snapshot.moving && !self.operating && snapshot.homed {
            self.body.move_begins();
        }
        if !snapshot.moving && self.operating {
            self.body.move_ends();
        }
        self.operating = snapshot.moving;
    }

    fn tick(&mut self) {
        let mut next = self.axis.clone();
        let step = next.tick(self.body.plant.limits());
        let ends = self.axis.snapshot().moving && !next.snapshot().moving;
        if let Some(may_rest) = self.may_rest.as_mut().filter(|_| ends) {
            let ahead = match step {
                Some(Way::Out) => 1,
                Some(Way::Home) => -1,
                None => 0,
            };
            if !may_rest(self.body.plant.carriage_steps() + ahead) {
                return;
            }
        }
        self.axis = next;
        if let Some(way) = step {
            self.body.plant.step(way);
        }
    }
}

impl SimulatedDevice for NativeDevice {
    fn receive(&mut self, byte: u8) {
        for byte in self.body.heard(byte) {
            let reply = self.device.receive(byte, &mut self.axis);
            self.mind_the_operation();
            if let Some(frame) = reply {
                self.body.say(frame.bytes());
            }
        }
    }

    fn advance(&mut self, time: Duration) {
        match self.body.troubles.advance(time) {
            Some(Mishap::Reset) => self.reset(),
            Some(Mishap::OtherSettings) => {
                self.build.steps_per_mm += 1;
                self.reset();
            }
            Some(Mishap::LimitCloses) => self.body.plant.press_switches(true),
            Some(Mishap::LimitOpens) => self.body.plant.press_switches(false),
            None => {}
        }
        for _ in 0..self.body.ticks(time) {
            self.tick();
        }
        self.mind_the_operation();
        if let Some(frame) = self.device.poll(&mut self.axis) {
            self.body.say(frame.bytes());
        }
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.body.take_sent()
    }

    fn connected(&self) -> bool {
        self.body.troubles.connected()
    }
}
