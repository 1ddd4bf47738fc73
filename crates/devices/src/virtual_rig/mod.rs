//! The simulator on real interfaces: the stage on a serial line, and the scene of the camera on a video
//! output.
//!
//! A camera driver that is looped back to the output (the kernel's `vivid` or `v4l2loopback`) then sees the
//! moves of the stage. A picture takes time to render, but light does not. To keep the order of cause and
//! effect, the stage makes the last step of a move only when the picture of its final position is shown.

mod pictures;
mod world;

pub use world::World;
