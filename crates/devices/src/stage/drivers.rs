//! The table of stage drivers, and those that a program adds. A driver of this crate adds one line.

use std::fmt;
use std::ops::Deref;
use std::sync::{Mutex, PoisonError};

use super::driver::StageDriver;
use super::grbl::Grbl;
use super::native::Native;
use super::sim::Simulated;
use super::zaber::Zaber;
use epirig_core::settings::Key;

/// The first is the default.
static BUILT_IN: [&dyn StageDriver; 4] = [&Native, &Grbl, &Zaber, &Simulated];

/// One of the [`drivers`](super::drivers()).
#[derive(Clone, Copy)]
pub struct Driver(&'static dyn StageDriver);

impl Driver {
    /// The driver with a name, if there is one.
    pub fn named(name: &str) -> Option<Self> {
        drivers().into_iter().find(|driver| driver.name() == name)
    }
}

impl Default for Driver {
    /// That of epirig's own firmware.
    fn default() -> Self {
        Self(BUILT_IN[0])
    }
}

impl Deref for Driver {
    type Target = dyn StageDriver;

    fn deref(&self) -> &Self::Target {
        self.0
    }
}

impl PartialEq for Driver {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for Driver {}

impl fmt::Debug for Driver {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "Driver({})", self.name())
    }
}

impl fmt::Display for Driver {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.pad(self.name())
    }
}

/// Drivers added by the program.
static ADDED: Mutex<Vec<Driver>> = Mutex::new(Vec::new());

/// All stage drivers: those of this crate, then the added ones.
pub fn drivers() -> Vec<Driver> {
    let added = ADDED.lock().unwrap_or_else(PoisonError::into_inner);
    BUILT_IN.iter().map(|driver| Driver(*driver)).chain(added.iter().copied()).collect()
}

/// The keys of all drivers, each name once, with the names of the drivers that have it.
pub fn driver_keys() -> Vec<(&'static Key, Vec<&'static str>)> {
    let mut all: Vec<(&'static Key, Vec<&'static str>)> = Vec::new();
    for driver in drivers() {
        for key in driver.keys() {
            match all.iter_mut().find(|(known, _)| known.name == key.name) {
                Some((_, names)) => names.push(driver.name()),
                None => all.push((key, vec![driver.name()])),
            }
        }
    }
    all
}

/// Adds drivers for the rest of the program. A driver with a known name is ignored.
pub fn add_drivers(more: &[&'static dyn StageDriver]) {
    for driver in more {
        if Driver::named(driver.name()).is_none() {
            ADDED.lock().unwrap_or_else(PoisonError::into_inner).push(Driver(*driver));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::stage::simulator::FaultScript;

    #[test]
    fn names_are_unique_and_whoever_has_a_line_can_be_simulated_and_decoded() {
        let names: BTreeSet<&str> = drivers().iter().map(|driver| driver.name()).collect();
        assert_eq!(names.len(), drivers().len());
        for driver in drivers() {
            assert_eq!(Driver::named(driver.name()), Some(driver));
            assert_eq!(driver.simulated(FaultScript::default(), 1).is_some(), driver.has_line(), "{driver}");
            assert_eq!(driver.decoder().is_some(), driver.has_line(), "{driver}");
            assert!(driver.keys().iter().all(|key| key.section == "stage"), "{driver}");
            assert!(driver.page().starts_with("# "), "{driver}: its page has no title");
        }
        assert_eq!(Driver::named("grlb"), None);
    }
}
