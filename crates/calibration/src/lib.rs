#![doc = include_str!("../README.md")]

mod block;
pub mod lens;
pub mod motion;
pub mod photometry;
pub mod rectification;
pub mod registration;
pub mod stage_axis;
pub mod target;
pub mod texture_motion;
