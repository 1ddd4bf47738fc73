#![doc = include_str!("../README.md")]

mod blame;
pub mod camera;
pub mod link;
pub mod stage;
pub mod virtual_rig;

pub use blame::Blame;
