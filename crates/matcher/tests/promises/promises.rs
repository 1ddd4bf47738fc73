//! Promises in two numbers: what is asked for, which is printed beside what is reached, and what holds, which
//! is asserted.
//!
//! Where what is asked is reached, or was before, it is what is asserted. Where it is missed, that is the
//! figure reached with a margin of 10 to 15 % of the figure or of the miss, and never looser than what the
//! matcher reached before it was asked for more.

#![allow(dead_code, reason = "each test program uses a part of this")]
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::fmt::{Display, Formatter};

/// From a least to a greatest value, both allowed. NaN is never allowed.
#[derive(Clone, Copy)]
pub struct Bounds(f64, f64);

impl Bounds {
    pub const fn at_most(greatest: f64) -> Self {
        Self(f64::NEG_INFINITY, greatest)
    }

    pub const fn at_least(least: f64) -> Self {
        Self(least, f64::INFINITY)
    }

    pub const fn between(least: f64, greatest: f64) -> Self {
        Self(least, greatest)
    }

    fn allow(self, value: f64) -> bool {
        self.0 <= value && value <= self.1
    }
}

impl Display for Bounds {
    fn fmt(&self, out: &mut Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self(f64::NEG_INFINITY, greatest) => write!(out, "<= {greatest}"),
            Self(least, f64::INFINITY) => write!(out, ">= {least}"),
            Self(least, greatest) => write!(out, "{least} .. {greatest}"),
        }
    }
}

#[derive(Clone, Copy)]
pub struct Promise {
    pub asked: Bounds,
    pub holds: Bounds,
}

impl Promise {
    /// What is asked is asserted.
    pub const fn as_asked(asked: Bounds) -> Self {
        Self { asked, holds: asked }
    }

    /// What is asked is missed; `holds` is asserted.
    pub const fn missed(asked: Bounds, holds: Bounds) -> Self {
        Self { asked, holds }
    }
}

/// Figures reached; all are printed before one of them fails.
#[derive(Default)]
pub struct Figures {
    broken: Vec<String>,
}

impl Figures {
    pub fn check(&mut self, what: &str, promise: Promise, reached: f64) {
        let missed = if promise.asked.allow(reached) { "" } else { " (MISSED)" };
        let line = format!(
            "{what}: asked {}, reached {reached:.5}{missed}, paths to {}",
            promise.asked, promise.holds
        );
        println!("{line}");
        if !promise.holds.allow(reached) {
            self.broken.push(line);
        }
    }

    /// Fails if a figure does not hold.
    pub fn finish(self) {
        assert!(self.broken.is_empty(), "does not hold:\n{}", self.broken.join("\n"));
    }
}
