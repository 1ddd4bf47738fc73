//! The keys of section `stage`: those of all drivers, and those of single drivers.

use epirig_core::settings::quantity::MM;
use epirig_devices::stage::{Driver, driver_keys, drivers};

use super::key::{Allowed, Key, Kind, key, keys, measure};

keys!(
    "stage",
    DRIVER = key(
        "driver",
        Kind::Choice(|| drivers().iter().map(|driver| driver.name()).collect()),
        "grbl",
        "The protocol of the stage: epirig's own firmware, GRBL 1.1, Zaber ASCII; sim is a stage in memory",
    )
    .or("native"),
    PORT = key(
        "port",
        Kind::Text,
        "/dev/ttyACM0",
        "The port: a path, usb:SERIAL or usb:VID:PID; by default the only USB serial port"
    ),
    APPROACH = key(
        "approach",
        measure(MM, Allowed::ZeroOrMore),
        "0.5 mm",
        "Unidirectional approach against backlash: distance below each position from which it is approached",
    )
    .or("0 mm"),
    TOLERANCE = key(
        "tolerance",
        measure(MM, Allowed::ZeroOrMore),
        "0.01 mm",
        "Allowed error of the reported position, beyond half a step",
    )
    .or("0 mm"),
);

/// The keys of all drivers, each name once.
pub(super) fn of_drivers() -> Vec<&'static Key> {
    driver_keys().into_iter().map(|(key, _)| key).collect()
}

/// Whether a key of any section has an effect with `driver`.
pub(in crate::profile) fn belongs_to(key: &Key, driver: Driver) -> bool {
    if key.path() == PORT.path() {
        return driver.has_line();
    }
    let is_common = key.section != "stage" || KEYS.iter().any(|common| common.name == key.name);
    is_common || driver.keys().iter().any(|own| own.name == key.name)
}

/// The names of the drivers with which a key has an effect; empty for all.
pub(in crate::profile) fn drivers_with(key: &Key) -> Vec<&'static str> {
    let all = drivers();
    let with: Vec<&str> =
        all.iter().filter(|driver| belongs_to(key, **driver)).map(|driver| driver.name()).collect();
    if with.len() == all.len() { Vec::new() } else { with }
}
