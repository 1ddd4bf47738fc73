//! Cost aggregation: over windows around each pixel, and across rows.

pub(crate) mod rows;
pub(crate) mod semi_global;
pub(crate) mod sweep;
pub(crate) mod window_sums;
