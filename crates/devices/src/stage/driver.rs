//! Stage drivers as plug-ins.

use std::fmt;
use std::ops::Deref;
use std::sync::{Mutex, PoisonError};

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::axis::Axis;
use super::decode::Decoder;
use super::drivers::BUILT_IN;
use super::simulator::{FaultScript, SimulatedStage};
use super::{StageError, StagePosition};
use crate::link::{Link, LinkError};
use epirig_core::settings::{Key, Settings};

/// A kind of stage: name, settings, connection, decoder and simulator.
///
/// A driver is added by a file of its own and a line in the table of [`drivers`](super::drivers()). A program
/// with its own driver adds it at its start with [`add_drivers`].
pub trait StageDriver: Sync {
    /// Its name in profiles, on the command line, in records and transcripts; in small letters.
    fn name(&self) -> &'static str;

    /// The devices it supports, in a few words without full stop.
    fn summary(&self) -> &'static str;

    /// Its page of the guide, in Markdown.
    fn page(&self) -> &'static str;

    /// Its own keys of section `stage`, besides port, approach and tolerance.
    fn keys(&self) -> Vec<&'static Key>;

    /// Whether it uses a line; else it is simulated in memory.
    fn has_line(&self) -> bool {
        true
    }

    /// Connects to the device and identifies it. `settings` are checked values of its [`keys`](Self::keys).
    ///
    /// # Errors
    /// [`StageError`] if nothing answers, something else answers, or its settings prevent a measurement.
    fn connect(
        &self,
        connection: &mut Connection<'_>,
        settings: &Settings,
    ) -> Result<Box<dyn Axis>, StageError>;

    /// The decoder of its traffic; `None` without a line.
    fn decoder(&self) -> Option<Box<dyn Decoder>>;

    /// A simulated device with its dialect and faults; `None` without a line. `boot` is the boot count, if
    /// the device has one.
    fn simulated(&self, faults: FaultScript, boot: u32) -> Option<SimulatedStage>;
}

/// What a driver needs to connect.
pub struct Connection<'a> {
    /// Opens the line at a speed in baud.
    pub open_line: &'a mut dyn FnMut(u32) -> Result<Box<dyn Link>, LinkError>,
    /// Receives the position of the carriage of a stage in memory.
    pub watch: StagePosition,
    /// Seed of the random numbers of a stage in memory.
    pub seed: u64,
}

impl Connection<'_> {
    /// The line to the device, at `baud`.
    ///
    /// # Errors
    /// [`LinkError`] if it cannot be opened.
    pub fn line(&mut self, baud: u32) -> Result<Box<dyn Link>, LinkError> {
        (self.open_line)(baud)
    }
}

/// One of the [`drivers`](super::drivers()). Records hold its name.
#[derive(Clone, Copy)]
pub struct Driver(&'static dyn StageDriver);

impl Driver {
    /// The driver with a name, if there is one.
    pub fn named(name: &str) -> Option<Self> {
        drivers().into_iter().find(|driver| driver.name() == name)
    }

    /// The default driver: epirig's own firmware.
    pub fn usual() -> Self {
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

impl Serialize for Driver {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Driver {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let name = String::deserialize(from)?;
        Self::named(&name).ok_or_else(|| {
            let known: Vec<&str> = drivers().iter().map(|driver| driver.name()).collect();
            D::Error::custom(format!("unknown stage driver {name:?}; the drivers are {}", known.join(", ")))
        })
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

    #[test]
    fn names_are_unique_and_whoever_has_a_line_can_be_simulated_and_decoded() {
        let names: BTreeSet<&str> = drivers().iter().map(|driver| driver.name()).collect();
        assert_eq!(names.len(), drivers().len());
        for driver in drivers() {
            assert_eq!(Driver::named(driver.name()), Some(driver));
            assert_eq!(driver.decoder().is_some(), driver.has_line(), "{driver}");
            assert_eq!(driver.simulated(FaultScript::default(), 1).is_some(), driver.has_line(), "{driver}");
            assert!(driver.keys().iter().all(|key| key.section == "stage"), "{driver}");
            assert!(driver.page().starts_with("# "), "{driver}: its page has no title");
            let json = serde_json::to_string(&driver).unwrap();
            assert_eq!(serde_json::from_str::<Driver>(&json).unwrap(), driver);
        }
        let error = serde_json::from_str::<Driver>("\"grlb\"").unwrap_err().to_string();
        assert!(error.contains("grlb") && error.contains("native, grbl, zaber"), "{error}");
    }
}
