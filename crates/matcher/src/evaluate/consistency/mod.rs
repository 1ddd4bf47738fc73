//! Checks by comparing two matches that should agree; neither truth nor intensities are needed.
//!
//! [`split_half`] measures how large the errors by noise are, [`both_ways`] how many answers are wrong or
//! belong to occluded points. Neither sees an error that both matches share, such as that of a wrong tau.

mod both_ways;
mod halves;
mod split_half;

pub use both_ways::{BothWaysReport, both_ways};
pub use halves::{HalfMaps, SplitHalfError, match_halves};
pub use split_half::{Differences, SplitHalfReport, split_half};

/// `count` of `of`, 0 to 1.
fn share(count: usize, of: usize) -> f64 {
    count as f64 / of.max(1) as f64
}
