//! The section `stage`: the keys of all drivers, and those of single drivers.

use super::section::{Allowed, Key, Kind, Setting, from_value, measure, section};
use epirig_core::settings::Settings;
use epirig_core::settings::quantity::MM;
use epirig_devices::stage::{Driver, driver_keys, drivers};

section! {
    /// The stage and its connection.
    pub struct StageProfile in "stage" {
        /// The protocol of the stage: epirig's own firmware, GRBL 1.1, Zaber ASCII; sim is a stage in memory.
        "driver" => driver: Driver = Kind::Choice(|| drivers().iter().map(|driver| driver.name()).collect()),
            like "grbl" or "native";
        /// The port: a path, usb:SERIAL, usb:VID:PID, or sim for a simulated device; by default the only USB
        /// serial port.
        "port" => port: Option<String> = Kind::Text, like "/dev/ttyACM0";
        /// Unidirectional approach against backlash: distance below each position from which it is approached.
        "approach" => approach_mm: f64 = measure(MM, Allowed::ZeroOrMore), like "0.5 mm" or "0 mm";
        /// Allowed error of the reported position, beyond half a step.
        "tolerance" => tolerance_mm: f64 = measure(MM, Allowed::ZeroOrMore), like "0.01 mm" or "0 mm";
    } and {
        /// The driver's own settings.
        settings: Settings,
    }
}

impl StageProfile {
    /// The port of a simulated device.
    pub const SIMULATED_PORT: &str = "sim";

    /// Whether the stage is simulated: in memory, or with a line that is.
    pub fn is_simulated(&self) -> bool {
        !self.driver.has_line() || self.port.as_deref() == Some(Self::SIMULATED_PORT)
    }
}

from_value! { Driver: Setting::Text(name) => Self::named(&name); }

/// The keys of all drivers, each name once.
pub(super) fn of_drivers() -> Vec<&'static Key> {
    driver_keys().into_iter().map(|(key, _)| key).collect()
}

/// Whether a key of any section has an effect with `driver`.
pub(in crate::profile) fn belongs_to(key: &Key, driver: Driver) -> bool {
    if key.is("stage.port") {
        return driver.has_line();
    }
    let common = StageProfile::SECTION.keys;
    let is_common = key.section != "stage" || common.iter().any(|common| common.name == key.name);
    is_common || driver.keys().iter().any(|own| own.name == key.name)
}

/// The names of the drivers with which a key has an effect; empty for all.
pub(in crate::profile) fn drivers_with(key: &Key) -> Vec<&'static str> {
    let all = drivers();
    let with: Vec<&str> =
        all.iter().filter(|driver| belongs_to(key, **driver)).map(|driver| driver.name()).collect();
    if with.len() == all.len() { Vec::new() } else { with }
}
