//! The generator of photographs along a straight line: what it says is true, its pictures show.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "../support/photographs/mod.rs"]
mod photographs;

mod generator;
mod stored;
