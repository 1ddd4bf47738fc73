#![doc = include_str!("../README.md")]
#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

pub mod camera;
pub mod exif;
pub mod files;
pub mod motion;
mod photographs;
mod random;
pub mod relief;
pub mod render;
pub mod resample;
mod seen;
mod series;
pub mod texture;
pub mod truth;

pub use camera::Camera;
pub use exif::Orientation;
pub use motion::Motion;
pub use photographs::Photographs;
pub use relief::{Relief, Surface};
pub use resample::Region;
pub use series::Series;
pub use texture::{Painting, Texture};
