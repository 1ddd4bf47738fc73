//! Many sequences: what is below a folder, and what was measured of each.

mod entry;
mod listing;

pub use entry::{SequenceState, SeriesEntry};
pub use listing::{Series, SortKey};
