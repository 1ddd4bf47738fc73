//! How good a disparity map is: against truth, or against frames that the matcher was not shown.

mod leave_out;
mod truth;

pub use leave_out::{LeaveOutError, LeaveOutReport, leave_out};
pub use truth::{ErrorStatistics, SizeMismatch, TruthReport, compare_with_truth, median_step};
