//! How often what chance decides is repeated.

#![allow(dead_code, reason = "each test program uses a part of this")]

/// The number of repetitions: `full` where EPIRIG_FULL is set, as `.ci/run full` does, and else a part of it.
pub(crate) fn repetitions(full: usize) -> usize {
    /// A quarter: what is counted is known half as well.
    const PART: usize = 4;
    if is_full() { full } else { full.div_ceil(PART) }
}

/// Whether everything is tested in full size.
pub(crate) fn is_full() -> bool {
    std::env::var_os("EPIRIG_FULL").is_some()
}
