#![doc = include_str!("../README.md")]

mod bands;
mod chess;
mod corners;
mod distortion;
mod error;
mod hand_board;
mod lamp;
mod optics;
mod pinhole;
mod presets;
mod rays;
mod render;
mod scene;
mod sensor;
mod sight;
mod simulator;
mod step_error;
mod texture;
mod truth;

pub use bands::Bands;
pub use corners::Corner;
pub use distortion::Distortion;
pub use error::SimulatorError;
pub use hand_board::{BoardPose, HandBoard};
pub use optics::Optics;
pub use pinhole::Pinhole;
pub use scene::{Hit, Scene};
pub use sensor::Sensor;
pub use simulator::{Carried, SimulatedScan, Simulator, SimulatorConfig};
pub use step_error::StepError;
pub use texture::Texture;
pub use truth::Truth;
