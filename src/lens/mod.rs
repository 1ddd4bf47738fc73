//! The lens: where a ray meets the sensor.

mod distortion;
mod estimate;
mod model;
pub mod views;

pub use distortion::Distortion;
pub use estimate::LensEstimate;
pub use model::{Lens, Projection};
