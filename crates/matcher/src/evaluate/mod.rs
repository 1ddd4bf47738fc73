//! The quality of a disparity map: against truth, against frames left out of the match, or against another
//! match.
//!
//! Two matches that should agree need neither truth nor intensities. [`split_half`] measures how large the
//! errors by noise are, [`both_ways`] how many answers are wrong or belong to occluded points. Neither sees
//! an error that both matches share, such as that of a wrong tau.

mod both_ways;
mod halves;
mod leave_out;
mod split_half;
mod truth;

pub use both_ways::{BothWaysReport, both_ways};
pub use halves::{HalfMaps, SplitHalfError, match_halves};
pub use leave_out::{LeaveOutError, LeaveOutReport, leave_out};
pub use split_half::{Differences, SplitHalfReport, split_half};
pub use truth::{ErrorStatistics, SizeMismatch, TruthReport, compare_with_truth};

/// `count` of `of`, 0 to 1.
fn share(count: usize, of: usize) -> f64 {
    count as f64 / of.max(1) as f64
}
