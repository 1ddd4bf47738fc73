//! Time on the clock of a camera's driver.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// A point in time on a camera's clock, in ns: `CLOCK_MONOTONIC` of this machine for real cameras, a
/// simulated clock for simulated ones.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Moment(u64);

impl Moment {
    /// The moment `ns` after the clock's zero.
    pub const fn from_ns(ns: u64) -> Self {
        Self(ns)
    }

    /// Time since the clock's zero, in ns.
    pub const fn as_ns(self) -> u64 {
        self.0
    }

    /// The moment `time` later.
    pub fn after(self, time: Duration) -> Self {
        Self(self.0.saturating_add(nanoseconds(time)))
    }

    /// The moment `time` earlier, at least the clock's zero.
    pub fn before(self, time: Duration) -> Self {
        Self(self.0.saturating_sub(nanoseconds(time)))
    }

    /// Time since `earlier`; zero if that is later.
    pub fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}
