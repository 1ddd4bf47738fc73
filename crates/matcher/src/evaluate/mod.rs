//! The quality of a disparity map: against truth, against frames left out of the match, or against another
//! match.

mod consistency;
mod leave_out;
mod truth;

pub use consistency::{
    BothWaysReport, Differences, HalfMaps, SplitHalfError, SplitHalfReport, both_ways, match_halves,
    split_half,
};
pub use leave_out::{LeaveOutError, LeaveOutReport, leave_out};
pub use truth::{ErrorStatistics, SizeMismatch, TruthReport, compare_with_truth};
