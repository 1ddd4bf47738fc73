//! Registration of the stage in memory.

use super::{NAME, SimAxis, SimStageConfig};
use crate::stage::keys::{ACCELERATION, VELOCITY};
use crate::stage::{Axis, Connection, StageDriver, StageError};
use epirig_core::settings::quantity::{MM, UM};
use epirig_core::settings::{Allowed, Key, Kind, Settings};

/// Default length of the travel, in mm.
const TRAVEL_MM: f64 = 200.0;

static TRAVEL: Key = Key::new(
    "stage",
    "travel",
    Kind::measure(MM, Allowed::Positive),
    "150 mm",
    "Length of the travel; positions go from 0 to this",
)
.or("200 mm");

static POSITION_NOISE: Key = Key::new(
    "stage",
    "position_noise",
    Kind::measure(UM, Allowed::ZeroOrMore),
    "2 um",
    "Standard deviation of the position at rest",
)
.or("0 um");

static BACKLASH: Key = Key::new(
    "stage",
    "backlash",
    Kind::measure(UM, Allowed::ZeroOrMore),
    "10 um",
    "Backlash: play between screw and nut",
)
.or("0 um");

/// A stage in memory, new with each command.
pub struct Simulated;

impl SimStageConfig {
    /// The configuration in a profile's settings; `seed` is that of all random numbers.
    pub fn of_settings(settings: &Settings, seed: u64) -> Self {
        let ideal = Self::ideal(settings.number(&TRAVEL).unwrap_or(TRAVEL_MM));
        Self {
            velocity_mm_s: settings.number(&VELOCITY).unwrap_or(ideal.velocity_mm_s),
            acceleration_mm_s2: settings.number(&ACCELERATION).unwrap_or(ideal.acceleration_mm_s2),
            backlash_um: settings.number(&BACKLASH).unwrap_or(0.0),
            position_noise_um: settings.number(&POSITION_NOISE).unwrap_or(0.0),
            seed,
            ..ideal
        }
    }
}

impl StageDriver for Simulated {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> &'static str {
        "No hardware: a stage in memory, new with each command"
    }

    fn page(&self) -> &'static str {
        include_str!("README.md")
    }

    fn keys(&self) -> Vec<&'static Key> {
        vec![&TRAVEL, &VELOCITY, &ACCELERATION, &POSITION_NOISE, &BACKLASH]
    }

    fn has_line(&self) -> bool {
        false
    }

    fn connect(
        &self,
        connection: &mut Connection<'_>,
        settings: &Settings,
    ) -> Result<Box<dyn Axis>, StageError> {
        let config = SimStageConfig::of_settings(settings, connection.seed);
        let mut axis = SimAxis::seen_through(config, connection.watch.clone()).found_again();
        axis.in_real_time = connection.in_real_time;
        Ok(Box::new(axis))
    }
}
