//! Groups of bands that are searched at once: as many as memory holds.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::result::{RowResult, SearchResult};
use super::task::Task;
use crate::aggregation::rows::{BAND_ROWS, bands};
use crate::aggregation::semi_global::{Bands, Penalties, RowBand};
use crate::options::MatchError;
use epirig_core::progress::Cancelled;

/// Penalties of aggregation across rows, where right candidates cost `typical`.
pub(super) fn penalties(Task { volume, options, .. }: Task<'_>, typical: f32) -> Penalties {
    Penalties::of_typical(typical, (volume.frames() - 1) * options.window_px.pow(2))
}

/// Bands that are searched one group after the other.
pub(super) struct Groups {
    pub(super) groups: Vec<Vec<RowBand>>,
    /// Counts that each band of a group holds.
    pub(super) band_counts: usize,
}

/// Bands in groups that may be searched at once: all of them, unless costs are aggregated across rows.
pub(super) fn groups_of_bands(task: Task<'_>, candidates: usize) -> Result<Groups, MatchError> {
    if task.options.semi_global {
        let bands = Bands::of(task.volume, candidates)?;
        Ok(Groups { groups: bands.groups(), band_counts: bands.band_counts })
    } else {
        let all =
            bands(task.volume.rows(), task.lines.rows_together(BAND_ROWS)).map(RowBand::alone).collect();
        Ok(Groups { groups: vec![all], band_counts: 0 })
    }
}

/// Answers of all rows, found by `answers` with room for the counts of a band. The task's progress counts each row.
///
/// A band's answers go into the maps at once: held until the end, those of all bands would keep as much memory
/// again from the fit.
///
/// # Errors
/// [`Cancelled`], without a search of the bands that were not begun.
pub(super) fn searched_groups(
    Task { volume, progress, .. }: Task<'_>,
    Groups { groups, band_counts }: Groups,
    answers: impl Fn(RowBand, &mut [u16]) -> Vec<RowResult> + Sync,
) -> Result<SearchResult, Cancelled> {
    let found = Mutex::new(SearchResult::unknown(volume.rows(), volume.columns()));
    // All room is one piece, so that it goes back to the system as a whole before the fit needs memory.
    let mut room = vec![0; band_counts * groups.iter().map(Vec::len).max().unwrap_or(0)];
    for group in groups {
        let mut rest = room.as_mut_slice();
        let mut part = || rest.split_off_mut(..band_counts).unwrap_or_default();
        let bands: Vec<_> = group.into_iter().map(|band| (band, part())).collect();
        bands.into_par_iter().for_each(|(band, room)| {
            if progress.cancelled() {
                return;
            }
            let (first, count) = (band.answered.start, band.answered.len() as u64);
            let rows = answers(band, room);
            found.lock().unwrap_or_else(PoisonError::into_inner).put(first, &rows);
            progress.advance(count);
        });
    }
    progress.unless_cancelled()?;
    Ok(found.into_inner().unwrap_or_else(PoisonError::into_inner))
}
