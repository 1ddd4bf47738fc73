//! The matcher: every EPI is searched for the straight lines that surface points draw in it.
//!
//! A point seen at column x of the reference frame r lies, in frame t, at x + d (tau_t - tau_r): a straight line whose
//! slope is the disparity d, signed, in pixels over the whole baseline. The method is that of the 2001 paper on
//! epipolar plane images: a cost for every candidate line ([`cost`]), a strictly increasing mapping found by dynamic
//! programming ([`mapping`]), at disparity steps finer than the pixel. Beyond the paper: the range of disparities is found from
//! the data ([`range`]), points need not be seen in all frames, and a fit over all frames ([`refine`]) gives each
//! disparity its last digits and its sigma.
//!
//! The matcher knows no files, stages or cameras: a [`Volume`](epirig_core::volume::Volume) and [`MatchOptions`] in,
//! [`DisparityMaps`] out.

mod contrast;
pub mod cost;
mod edge_refinement;
pub mod evaluate;
pub mod interpolation;
mod linear_epi;
pub mod lines;
mod locking;
pub mod mapping;
mod maps;
mod matcher;
pub mod normalise;
mod options;
mod positions;
mod profile;
mod quick;
pub mod range;
pub mod refine;
mod search;
pub mod surface;
mod winner;

pub use locking::{LOCKING_HARMONICS, LockingAmplitudes, LockingHarmonic, PixelLocking, locking_factor};
pub use maps::{Answer, DisparityMaps, OrderingUsed};
pub use matcher::{Matcher, match_volume};
pub use options::{
    DisparityRange, Effort, LARGEST_GROWN_WINDOW_PX, LARGEST_WINDOW_PX, MatchError, MatchOptions, Method,
    Occlusion, OrderingConstraint, ReferenceFrame, Search,
};
pub use positions::{FramesApart, TauCorrection, tau_corrections};
pub use profile::line_profile;
