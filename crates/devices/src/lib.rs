#![doc = include_str!("../README.md")]

pub mod camera;
pub mod faults;
pub mod link;
pub mod stage;
pub mod virtual_rig;
