//! One resampling from raw frames to the volume: distortion, roll, pan and the frame's own pose undone in one
//! map.

mod correction;
mod error;
mod fit;
mod frame_kernels;
mod kernels;
mod mapping;
mod original;
mod pose;
mod region;
mod resample;
mod spline;
#[cfg(test)]
mod tests;
mod view;
mod whole;

pub use error::RectifyError;
pub use mapping::{Mapping, RectifiedCamera};
pub use pose::FramePose;
pub use resample::Rectifier;
pub use spline::BORDER_PX;
