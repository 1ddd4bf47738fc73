//! Photographs along a straight line: that the generator's pictures show what it says is true, and what the program
//! measures of them.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "../support/program.rs"]
mod program;
#[path = "../support/size.rs"]
mod size;

mod generator;
mod measured;
mod original;
mod shape;
mod stored;
mod trees;
