//! The twin on real interfaces: it plays the stage on a serial line and the world in front of the camera on a video output.
//!
//! A camera driver that is looped back to the output (the kernel's `vivid` or `v4l2loopback`) then sees what the stage does. Light is
//! faster than that: so that cause and effect keep their order, the stage's time stands still after a move until the picture of where
//! it is now is the one that is shown.

mod in_step;
mod world;

pub use in_step::InStep;
pub use world::World;
