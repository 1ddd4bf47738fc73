//! The paper's search: costs of all candidates from the samples of all frames.

use std::ops::Range;

use super::band_groups::{Groups, groups_of_bands, penalties, searched_groups};
use super::choice::Choice;
use super::mapping::OrderingLimits;
use super::result::{RowResult, SearchResult, rival_distance};
use super::task::Task;
use crate::aggregation::semi_global::{Aggregation, PathAggregation, RowBand, typical_cost};
use crate::candidates::Candidates;
use crate::cost::CostTable;
use crate::cost::exhaustive::{Band, band_costs};
use crate::maps::OrderingUsed;
use crate::options::MatchError;

/// Rows searched together, if their costs are few enough: they share the samples of their windows.
const BAND_ROWS: usize = 8;
/// Costs that a band holds at most, unless one row has more; 64 MiB.
const BAND_COSTS: usize = 1 << 24;

/// Answers of all rows, each of which the task's progress counts.
///
/// # Errors
/// [`MatchError::TooManyToAggregate`] if costs are to be aggregated across rows and take too much memory.
pub(super) fn searched(task: Task<'_>) -> Result<SearchResult, MatchError> {
    let Task { volume, lines, range, ordering, options, .. } = task;
    let step_px = options.disparity_step_px;
    let separation = rival_distance(lines, step_px);
    let choice = Choice {
        candidates: Candidates::covering(range, step_px),
        limits: (ordering == OrderingUsed::On).then(|| OrderingLimits::new(lines, step_px)),
        separation,
        rival_separation: separation.max(2),
        resolution: options.method.resolution(),
    };
    let search = Exhaustive { task, choice };
    if !options.semi_global {
        let bands = search.pieces(0..volume.rows()).map(RowBand::alone).collect();
        let groups = Groups { groups: vec![bands], band_counts: 0 };
        return Ok(searched_groups(task, groups, |band, _| search.single_rows(band.answered))?);
    }
    let groups = groups_of_bands(task, search.choice.candidates.count())?;
    let typical = typical_cost(volume.rows(), options.method.resolution(), |y| {
        search.single_rows(y..y + 1).into_iter().flat_map(|row| row.cost).collect()
    });
    let penalties = penalties(task, typical);
    Ok(searched_groups(task, groups, |band, room| {
        search.rows_together(band, Aggregation { penalties, room })
    })?)
}

struct Exhaustive<'a> {
    task: Task<'a>,
    choice: Choice,
}

impl Exhaustive<'_> {
    /// `rows` in pieces whose costs may be held as numbers of 32 bit.
    fn pieces(&self, rows: Range<usize>) -> impl Iterator<Item = Range<usize>> {
        let row = self.task.volume.columns() * self.choice.candidates.count();
        let count = (BAND_COSTS / row).clamp(1, BAND_ROWS);
        rows.clone().step_by(count).map(move |y| y..(y + count).min(rows.end))
    }

    fn tables(&self, rows: Range<usize>) -> Vec<CostTable> {
        let Task { volume, lines, rule, options, .. } = self.task;
        let half = options.window_px / 2;
        let own = lines.of_rows(rows.start.saturating_sub(half)..rows.end + half);
        let lines = own.as_ref().unwrap_or(lines);
        band_costs(&Band::new(volume, rows, options), lines, &self.choice.candidates, rule, options)
    }

    /// Answers of rows that are searched each by itself.
    fn single_rows(&self, rows: Range<usize>) -> Vec<RowResult> {
        self.tables(rows).iter().map(|costs| self.choice.row(costs, None)).collect()
    }

    /// Answers from costs aggregated across rows.
    fn rows_together(&self, band: RowBand, aggregation: Aggregation<'_>) -> Vec<RowResult> {
        let (count, columns) = (self.choice.candidates.count(), self.task.volume.columns());
        let mut paths = PathAggregation::new(band.clone(), count, columns, aggregation);
        for piece in self.pieces(band.searched) {
            for table in self.tables(piece) {
                (0..count).for_each(|k| paths.hold(k, 0, table.row(k)));
                paths.row_done();
            }
        }
        let aggregated = paths.aggregated();
        let mut table = CostTable::from_values(columns, vec![f32::NAN; count * columns]);
        aggregated
            .rows()
            .map(|y| {
                (0..count).for_each(|k| aggregated.copy(y, k, 0, table.row_mut(k)));
                self.choice.row(&table, Some((&aggregated, y)))
            })
            .collect()
    }
}
