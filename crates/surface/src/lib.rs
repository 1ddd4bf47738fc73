#![doc = include_str!("../README.md")]

mod blocks;
pub mod comparison;
pub mod conformity;
mod connected;
mod error;
mod extent;
mod filter;
mod height;
mod normal;
mod outliers;
mod plane;
mod profile;
mod repeats;
mod response;
mod roughness;
mod smooth;
mod start;
mod steps;
mod student;
mod trend;

pub use blocks::Correlation;
pub use error::SurfaceError;
pub use extent::{Extent, Rectangle, find_extent};
pub use filter::Filters;
pub use height::{Geometry, HalfHeights, Heights, ScaleSigma, heights};
pub use outliers::find_outliers;
pub use plane::{Plane, RegionStatistics};
pub use profile::{Profile, ProfileLine, ProfilePoint, profile};
pub use repeats::{MeasurementNoise, NoiseOfPair, Repeatability};
pub use response::{Response, StandardStep, StepResponse};
pub use roughness::{Roughness, roughness};
pub use steps::{
    Budget, Combined, Contribution, Depth, DepthAtMargin, DepthOnPlateaus, Evaluation, Part, Steps,
    StepsOptions, find_steps,
};
pub use student::student_t_95;
pub use trend::{Trend, TrendKind, fit_trend};
