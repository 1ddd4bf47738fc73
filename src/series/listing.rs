//! All sequences below a folder.

use std::cmp::Ordering;
use std::path::Path;

use rayon::prelude::*;

use super::{SequenceState, SeriesEntry};
use epirig_data::sequence::{SequenceError, sequences_below};
use epirig_surface::conformity::Verdict;

epirig_core::choices! {
    /// The order of a list.
    pub enum SortKey {
        /// When they were begun, the newest last.
        Begun = "begun",
        /// Their names, in alphabetical order.
        Name = "name",
        /// Their depth, the deepest last; those without one come first.
        Depth = "depth",
        /// How far the work has come.
        State = "state",
        /// Their verdict: none, pass, undecided, fail.
        Verdict = "verdict",
    }
}

/// The sequences below a folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The sequences, in the order in which they were begun.
    pub entries: Vec<SeriesEntry>,
    /// Folders that could not be looked into, with the reason.
    pub closed: Vec<String>,
}

impl Series {
    /// Of the folder and all folders below it. Links are not followed.
    ///
    /// # Errors
    /// [`SequenceError`] if the folder itself cannot be read.
    pub fn below(folder: &Path) -> Result<Self, SequenceError> {
        let found = sequences_below(folder)?;
        let name = |path: &Path| {
            let inside = path.strip_prefix(folder).unwrap_or(path).to_string_lossy().into_owned();
            if inside.is_empty() { ".".to_owned() } else { inside }
        };
        let entries = found.folders.par_iter().map(|path| SeriesEntry::of(path, name(path))).collect();
        let closed = found.closed.iter().map(|error| error.to_string()).collect();
        let mut series = Self { entries, closed };
        series.sort(SortKey::Begun);
        Ok(series)
    }

    /// Sorts the entries; those that are equal, by when they were begun, and by name.
    pub fn sort(&mut self, key: SortKey) {
        let verdict = |entry: &SeriesEntry| match entry.verdict {
            None => 0,
            Some(Verdict::Pass) => 1,
            Some(Verdict::Undecided) => 2,
            Some(Verdict::Fail) => 3,
        };
        let state = |entry: &SeriesEntry| entry.state as usize;
        let depth = |entry: &SeriesEntry| entry.depth_mm.unwrap_or(f64::NEG_INFINITY);
        self.entries.sort_by(|one, other| {
            let by_key = match key {
                SortKey::Begun => Ordering::Equal,
                SortKey::Name => one.name.cmp(&other.name),
                SortKey::Depth => depth(one).total_cmp(&depth(other)),
                SortKey::State => state(one).cmp(&state(other)),
                SortKey::Verdict => verdict(one).cmp(&verdict(other)),
            };
            by_key.then_with(|| one.created.cmp(&other.created)).then_with(|| one.name.cmp(&other.name))
        });
    }

    /// Keeps the entries of this state, if one is given, and of this verdict.
    pub fn keep(&mut self, state: Option<SequenceState>, verdict: Option<Verdict>) {
        self.entries.retain(|entry| {
            state.is_none_or(|state| entry.state == state)
                && verdict.is_none_or(|verdict| entry.verdict == Some(verdict))
        });
    }
}
