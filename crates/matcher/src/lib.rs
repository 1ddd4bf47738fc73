#![doc = include_str!("../README.md")]

mod area;
pub mod candidates;
mod changing_light;
mod contrast;
pub mod cost;
mod edge_refinement;
pub mod evaluate;
pub mod interpolation;
mod light_change;
mod linear_epi;
pub mod lines;
mod locking;
pub mod mapping;
mod maps;
mod matcher;
pub mod normalise;
mod one_surface;
mod options;
mod outline;
mod profile;
mod quick;
pub mod range;
pub mod refine;
mod search;
mod window_sums;
mod winner;

pub use candidates::DisparityRange;
pub use light_change::LightChange;
pub use locking::{LOCKING_HARMONICS, LockingAmplitudes, LockingHarmonic, PixelLocking, locking_factor};
pub use maps::{DisparityMaps, OrderingUsed, Validity};
pub use matcher::{EqualDiscs, Matcher, match_volume};
pub use options::{
    EQUAL_DISCS_PX, GROWN_DISCS_PX, LARGEST_WINDOW_PX, MatchError, MatchOptions, Method, Occlusion,
    OrderingConstraint, ReferenceFrame, Search,
};
pub use profile::line_profile;
