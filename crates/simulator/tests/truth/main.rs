//! The simulator against geometry worked out by hand: its truth, and each of its nuisances.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

mod nuisances;
mod truth;
