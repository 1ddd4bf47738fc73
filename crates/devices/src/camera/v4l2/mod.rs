//! Cameras on Linux: Video4Linux2, single-planar, memory-mapped streaming.

mod device;
mod discover;
mod failure;
mod kernel;
mod output;

pub use device::V4l2Device;
pub use discover::cameras;
pub use output::VideoOutput;
