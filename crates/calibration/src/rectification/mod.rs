//! One resampling from raw frames to the volume: distortion, roll and pan undone in one map.

mod correction;
mod error;
mod fit;
mod kernels;
mod mapping;
mod resample;
mod spline;
#[cfg(test)]
mod tests;

pub use error::RectifyError;
pub use mapping::{Mapping, RectifiedCamera};
pub use resample::Rectifier;
pub use spline::BORDER_PX;
