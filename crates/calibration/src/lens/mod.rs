//! Lenses: where a ray meets the sensor, how a lens is calibrated, and the files of other programs.

mod distortion;
mod estimate;
mod model;
pub mod opencv_yaml;
pub mod ros_camera_info;
pub mod views;
mod yaml;

pub use distortion::Distortion;
pub use estimate::LensEstimate;
pub use model::{Lens, Projection};
pub use yaml::{LensFile, LensFileError};
