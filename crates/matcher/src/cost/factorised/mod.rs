//! Costs of candidates from groups of neighbouring frames, which serve many candidates.
//!
//! 1. [`groups`]: neighbouring frames form a dozen groups, whose mean and variance are summed up under a few
//!    slopes.
//! 2. [`kernels`]: the variance along a candidate is the variance between the groups' means plus the mean of
//!    the variances within the groups. Where points may be occluded, each group's share in it is truncated
//!    at the [`limits`].

pub(crate) mod groups;
pub(crate) mod kernels;
pub(crate) mod limits;
pub(crate) mod plan;
pub(crate) mod row_costs;
