//! The native part of the Python package `epirig`: arrays in and out, and the verbs of the command line.
//!
//! What a person sees of the package is in `epirig/*.py`; here nothing has a default or a text of its own.

mod arrays;
mod errors;
mod matching;
mod results;
mod rig;
mod truth;
mod verbs;
mod work;

use pyo3::prelude::*;

/// The native part of epirig.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::arrays::{read_frames, sequence_facts, sequence_tau};
    #[pymodule_export]
    use super::matching::{match_array, validity_classes};
    #[pymodule_export]
    use super::results::{map_names, result_map};
    #[pymodule_export]
    use super::rig::{Connection, Scan};
    #[pymodule_export]
    use super::truth::sequence_truth;
    #[pymodule_export]
    use super::verbs::{call, run, verbs};
    #[pymodule_export]
    use super::work::end_all_calls;
}
