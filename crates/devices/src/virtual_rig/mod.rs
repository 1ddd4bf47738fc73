//! The simulator on real interfaces: it plays the stage on a serial line and the world in front of the camera on a video output.
//!
//! A camera driver that is looped back to the output (the kernel's `vivid` or `v4l2loopback`) then sees what the stage does. A picture
//! takes its time to be rendered and shown, light does not: so that cause and effect keep their order, the stage takes the last step
//! of a move when the picture of where it will come to rest is the one that is shown.

mod pictures;
mod world;

pub use world::World;
