#![doc = include_str!("../README.md")]

mod aggregation;
mod blocks;
mod candidates;
mod cost;
pub mod evaluate;
mod fit;
mod light_change;
mod lines;
mod locking;
mod maps;
mod matcher;
mod one_surface;
mod options;
mod profile;
mod quick;
mod range;
mod search;
mod some_frames;
mod stack;
mod stations;
mod validity;

pub use blocks::Blocks;
pub use candidates::DisparityRange;
pub use cost::interpolation::Interpolation;
pub use light_change::LightChange;
pub use locking::{LockingAmplitudes, LockingHarmonic, PixelLocking};
pub use maps::{DisparityMaps, OrderingUsed};
pub use matcher::{EqualDiscs, Matcher, disparity, disparity_with, match_volume};
pub use options::{
    EQUAL_DISCS_PX, GROWN_DISCS_PX, LARGEST_WINDOW_PX, MatchError, MatchOptions, Method, Occlusion,
    OrderingConstraint, ReferenceFrame, Search,
};
#[cfg(feature = "ndarray")]
pub use stack::Sample;
pub use stack::{FloatLevels, Stack, StackError};
pub use stations::Overview;
pub use validity::Validity;

// What the functions here take and give.
pub use epirig_core::frame::{Frame, Samples};
pub use epirig_core::grid::Grid;
pub use epirig_core::progress::{Cancel, Progress, Silent};
pub use epirig_core::rows::{RowSource, RowsError};
pub use epirig_core::tau::{Tau, TauError};
pub use epirig_core::volume::{Volume, VolumeShape};

/// What the search saw at a pixel: for figures that explain a match, and not needed for one.
pub mod inspect {
    pub use super::candidates::Candidates;
    pub use super::cost::CostTable;
    pub use super::lines::EpiLines;
    pub use super::profile::line_profile;
}
