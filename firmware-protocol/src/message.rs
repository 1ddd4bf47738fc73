//! What host and stage say to each other.
//!
//! The order of variants and fields is the wire format: it never changes within a [`PROTOCOL_VERSION`].

use serde::{Deserialize, Serialize};

/// Version of messages and framing. A stage of another version says so in its [`Identity`] and is not driven.
pub const PROTOCOL_VERSION: u16 = 1;

/// Host to stage. Each gets exactly one reply; [`Reply::Finished`] comes on top.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request {
    /// Who are you? Answered by [`Reply::Hello`] whatever the version.
    Hello {
        /// The host's [`PROTOCOL_VERSION`].
        version: u16,
    },
    /// Answered by [`Reply::Status`].
    Status,
    /// Find the home switch and make the place beside it position 0. Answered by [`Reply::Accepted`].
    Home {
        /// Larger than that of every operation before it since the stage's boot.
        id: u32,
    },
    /// Move to an absolute position. Answered by [`Reply::Accepted`]; runs once however often it arrives.
    Move {
        /// Larger than that of every operation before it since the stage's boot.
        id: u32,
        /// Where to go, in nm from home; the stage takes the nearest step.
        position_nm: i64,
    },
    /// Slow down and stop; the position stays known. Answered by [`Reply::Status`].
    Stop,
    /// The host is alive. Answered by [`Reply::Alive`].
    Heartbeat,
    /// Answered by [`Reply::Settings`].
    ReadSettings,
    /// Use these until the next boot. Answered by [`Reply::Settings`], or refused, as a whole.
    WriteSettings(Settings),
}

/// Stage to host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reply {
    /// To [`Request::Hello`].
    Hello(Identity),
    /// To [`Request::Status`] and [`Request::Stop`].
    Status(Status),
    /// The operation runs, or has run: the answer is the same however often the request arrives.
    Accepted {
        /// Of the operation.
        id: u32,
        /// Where it leads, in nm from home, as the stage understood it.
        target_nm: i64,
    },
    /// The second answer to an operation, sent once and of itself when it ends. A host that misses it reads the status.
    Finished {
        /// Of the operation.
        id: u32,
        /// How it ended.
        outcome: Outcome,
        /// Where the stage is, in nm from home.
        position_nm: i64,
    },
    /// The request was understood and not done; nothing has changed.
    Refused(Refusal),
    /// To [`Request::Heartbeat`].
    Alive {
        /// As in [`Identity`].
        boot_id: u32,
        /// Whether an operation runs.
        moving: bool,
    },
    /// To [`Request::ReadSettings`] and [`Request::WriteSettings`]: what is in force.
    Settings(Settings),
}

/// What a stage is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// The stage's [`PROTOCOL_VERSION`]; always the first field.
    pub version: u16,
    /// Number of the firmware's build.
    pub build: u32,
    /// Motor steps (microsteps) to a mm.
    pub steps_per_mm: u32,
    /// Positions go from 0 to this, in nm.
    pub travel_nm: i64,
    /// Another one after each boot: who sees it change knows that the position is lost.
    pub boot_id: u32,
    /// Id of the latest accepted operation, 0 if there is none: the next one must be larger.
    pub last_operation: u32,
}

/// How a stage is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// As in [`Identity`].
    pub boot_id: u32,
    /// Steps made since home, in nm rounded to the nearest; means nothing if not homed.
    pub position_nm: i64,
    /// Whether an operation runs.
    pub moving: bool,
    /// Whether the position is known.
    pub homed: bool,
    /// Closed limit switches: bit 0 at home, bit 1 at the far end.
    pub limits: u8,
    /// Why the latest operation failed.
    pub fault: Fault,
    /// Id of the latest accepted operation, 0 if there is none.
    pub operation: u32,
    /// How that operation stands.
    pub outcome: Outcome,
    /// Where the latest homing found home, in nm by the count kept until then: what was lost or gained since the
    /// homing before. 0 if the position was not known before.
    pub home_shift_nm: i64,
}

/// How an operation stands.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// There is no operation yet.
    #[default]
    None,
    /// It runs.
    Running,
    /// It did what it was asked.
    Done,
    /// [`Request::Stop`] ended it.
    Stopped,
    /// A [`Fault`] ended it.
    Failed,
}

/// Why an operation failed.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Fault {
    /// It did not.
    #[default]
    None,
    /// The host fell silent: the stage slowed down and stopped. The position is known.
    Watchdog,
    /// A limit switch closed during a move: the stage stopped dead. The position is lost.
    HardLimit,
    /// The raw stop byte came: the stage stopped dead. The position is lost.
    EmergencyStop,
    /// Homing went as far as the stage is long and found no switch.
    SwitchNeverClosed,
    /// Homing moved away from the home switch, which stayed closed.
    SwitchNeverOpened,
}

/// Why a request was not done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The frame was sound and its message is none of this version.
    Unknown,
    /// The position is not known: home first.
    NotHomed,
    /// The position lies outside the travel.
    OutsideTravel,
    /// Another operation runs.
    Busy,
    /// An operation with a larger id has been accepted before.
    StaleId,
    /// The settings are out of the range that the stage can keep.
    BadSettings,
}

/// How a stage moves. In force until the next boot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings {
    /// Velocity of a long move, in nm/s.
    pub velocity_nm_s: u32,
    /// Acceleration and deceleration, in nm/s2.
    pub acceleration_nm_s2: u32,
    /// Velocity of the search for the home switch, in nm/s.
    pub seek_velocity_nm_s: u32,
    /// Velocity of the final approach to the home switch, in nm/s.
    pub touch_velocity_nm_s: u32,
    /// From the place where the home switch closes to position 0, in nm.
    pub pull_off_nm: u32,
    /// A moving stage stops if it hears no valid request for this long, in ms; at least 250.
    pub watchdog_ms: u16,
}

impl Default for Settings {
    /// A move of 1.5 mm takes 0.67 s.
    fn default() -> Self {
        Self {
            velocity_nm_s: 5_000_000,
            acceleration_nm_s2: 20_000_000,
            seek_velocity_nm_s: 5_000_000,
            touch_velocity_nm_s: 500_000,
            pull_off_nm: 1_000_000,
            watchdog_ms: 500,
        }
    }
}
