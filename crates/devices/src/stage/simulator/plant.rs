//! The mechanics of a simulated stage, with the true position.

use std::sync::{Arc, Mutex, PoisonError};

use firmware_protocol::axis::{Limits, Way};

/// A carriage on a screw with a switch at either end. Clones share their state.
#[derive(Debug, Clone)]
pub struct Plant(Arc<Mutex<Mechanics>>);

#[derive(Debug)]
struct Mechanics {
    carriage: i64,
    lowest: i64,
    highest: i64,
    steps: u64,
    low_switch_at: i64,
    high_switch_at: i64,
    switches_work: bool,
    pressed: bool,
    stalled: bool,
    /// Steps of the motor that the carriage will not follow.
    to_lose: u64,
}

impl Plant {
    /// A carriage at 0 steps, with switches that close at and beyond these positions.
    pub fn new(low_switch_at: i64, high_switch_at: i64) -> Self {
        Self(Arc::new(Mutex::new(Mechanics {
            carriage: 0,
            lowest: 0,
            highest: 0,
            steps: 0,
            low_switch_at,
            high_switch_at,
            switches_work: true,
            pressed: false,
            stalled: false,
            to_lose: 0,
        })))
    }

    fn with<R>(&self, work: impl FnOnce(&mut Mechanics) -> R) -> R {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Position of the carriage, in steps from its start.
    pub fn carriage_steps(&self) -> i64 {
        self.with(|plant| plant.carriage)
    }

    /// The lowest and the highest position so far, in steps from the start.
    pub fn range_steps(&self) -> (i64, i64) {
        self.with(|plant| (plant.lowest, plant.highest))
    }

    /// Number of steps made, up or down.
    pub fn steps_made(&self) -> u64 {
        self.with(|plant| plant.steps)
    }

    /// Breaks or repairs the switches.
    pub fn set_switches_work(&self, work: bool) {
        self.with(|plant| plant.switches_work = work);
    }

    /// Blocks the carriage: the motor turns, but the carriage does not move.
    pub fn set_stalled(&self, stalled: bool) {
        self.with(|plant| plant.stalled = stalled);
    }

    /// The carriage does not follow the next steps, as many as these.
    pub fn lose_steps(&self, steps: u64) {
        self.with(|plant| plant.to_lose = steps);
    }

    /// Closes both switches by hand, or releases them.
    pub fn press_switches(&self, pressed: bool) {
        self.with(|plant| plant.pressed = pressed);
    }

    /// The motor makes a step.
    pub fn step(&self, way: Way) {
        self.with(|plant| {
            if plant.to_lose > 0 {
                plant.to_lose -= 1;
            } else if !plant.stalled {
                plant.carriage += if way == Way::Out { 1 } else { -1 };
                plant.steps += 1;
                plant.lowest = plant.lowest.min(plant.carriage);
                plant.highest = plant.highest.max(plant.carriage);
            }
        });
    }

    /// The switches; `home` is the low one.
    pub fn limits(&self) -> Limits {
        self.with(|plant| Limits {
            home: plant.pressed || plant.switches_work && plant.carriage <= plant.low_switch_at,
            far: plant.pressed || plant.switches_work && plant.carriage >= plant.high_switch_at,
        })
    }
}
