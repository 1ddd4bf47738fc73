//! Stage drivers as plug-ins.

use super::axis::Axis;
use super::decode::Decoder;
use super::simulator::{FaultScript, SimulatedStage};
use super::{StageError, StagePosition};
use crate::link::{Link, LinkError};
use epirig_core::settings::{Key, Settings};

/// A kind of stage: name, settings, connection, decoder and simulator.
///
/// A driver is added by a file of its own and a line in the table of [`drivers`](super::drivers()). A program
/// with its own driver adds it at its start with [`add_drivers`](super::add_drivers).
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

    /// How a device of this dialect is recognised; `None` if it cannot be.
    fn greeting(&self) -> Option<Greeting> {
        None
    }

    /// How a person may send lines by hand; `None` if its dialect has no lines.
    fn console(&self) -> Option<Console> {
        None
    }

    /// The decoder of its traffic; `None` without a line.
    fn decoder(&self) -> Option<Box<dyn Decoder>> {
        None
    }

    /// A simulated device with its dialect and faults; `None` without a line. `boot` is the boot count, if
    /// the device has one.
    fn simulated(&self, _faults: FaultScript, _boot: u32) -> Option<SimulatedStage> {
        None
    }
}

/// What a driver needs to connect.
pub struct Connection<'a> {
    /// Opens the line to the device at a speed in baud.
    pub open_line: &'a mut dyn FnMut(u32) -> Result<Box<dyn Link>, LinkError>,
    /// Receives the position of the carriage of a stage in memory.
    pub watch: StagePosition,
    /// Seed of the random numbers of a stage in memory.
    pub seed: u64,
    /// Whether moves of a stage in memory take real time.
    pub in_real_time: bool,
    /// What to do with a stage that moves when it is connected.
    pub when_moving: WhenMoving,
}

/// How a device of a dialect is met without moving or changing anything.
#[derive(Clone, Copy)]
pub struct Greeting {
    /// Baud rate of the line.
    pub baud: u32,
    /// The bytes that are sent. For devices of the other dialects they are noise, or a question.
    pub question: fn() -> Vec<u8>,
    /// Whether bytes are the answer of such a device.
    pub is_answer: fn(&[u8]) -> bool,
}

/// Lines sent by hand.
#[derive(Clone, Copy)]
pub struct Console {
    /// Baud rate of the line.
    pub baud: u32,
    /// Bytes that act at once, in any position of a line: a line with such a byte alone is sent without its
    /// end.
    pub real_time: &'static [u8],
    /// Invalidates the position in the device, for the next program that connects, because what is sent by hand
    /// may move the stage or change its settings. `None` for a device that follows its own position.
    pub distrust: Option<Distrust>,
}

/// Invalidates the position in the device on a line, and returns the line.
pub type Distrust = fn(Box<dyn Link>) -> Result<Box<dyn Link>, StageError>;

/// What to do with a stage that moves when it is connected. The port is locked, so no other epirig moves it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WhenMoving {
    /// Wait until it is at rest.
    #[default]
    Wait,
    /// Stop it.
    Stop,
}
