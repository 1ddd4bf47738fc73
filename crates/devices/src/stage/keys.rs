//! Keys that several drivers share.

use epirig_core::settings::quantity::{MM_S, MM_S2};
use epirig_core::settings::{Allowed, Key, Kind};

/// Velocity of a long move, in mm/s.
pub static VELOCITY: Key = Key::new(
    "stage",
    "velocity",
    Kind::measure(MM_S, Allowed::Positive),
    "5 mm/s",
    "Velocity of a long move",
);

/// Acceleration and deceleration, in mm/s2.
pub static ACCELERATION: Key = Key::new(
    "stage",
    "acceleration",
    Kind::measure(MM_S2, Allowed::Positive),
    "20 mm/s2",
    "Acceleration and deceleration",
);
