//! The mechanics behind a simulated stage: what truly happened.

use std::sync::{Arc, Mutex, PoisonError};

use firmware_protocol::axis::{Limits, Way};

/// A carriage on a screw with a switch at either end. Clones look at the same one.
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
}

impl Plant {
    /// A carriage at 0 steps, with switches that close at and beyond these places.
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
        })))
    }

    fn with<R>(&self, work: impl FnOnce(&mut Mechanics) -> R) -> R {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Where the carriage is, in steps from where it began.
    pub fn carriage_steps(&self) -> i64 {
        self.with(|plant| plant.carriage)
    }

    /// The lowest and the highest place that the carriage has been at, in steps from where it began.
    pub fn range_steps(&self) -> (i64, i64) {
        self.with(|plant| (plant.lowest, plant.highest))
    }

    /// How many steps the carriage has made, up or down.
    pub fn steps_made(&self) -> u64 {
        self.with(|plant| plant.steps)
    }

    /// Breaks the switches, or mends them.
    pub fn set_switches_work(&self, work: bool) {
        self.with(|plant| plant.switches_work = work);
    }

    /// Holds the carriage fast: the motor turns in vain.
    pub fn set_stalled(&self, stalled: bool) {
        self.with(|plant| plant.stalled = stalled);
    }

    /// Closes both switches by hand, or lets them go.
    pub fn press_switches(&self, pressed: bool) {
        self.with(|plant| plant.pressed = pressed);
    }

    /// The motor makes a step.
    pub fn step(&self, way: Way) {
        self.with(|plant| {
            if !plant.stalled {
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
