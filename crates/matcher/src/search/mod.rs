//! The search: every pixel's best disparity candidate, or why there is none.
//!
//! The exhaustive search is the paper's: the cost of each candidate from the samples of all frames
//! ([`exhaustive`]). The factorised search, the default, takes its costs from groups of frames:
//!
//! 1. [`sweep`]: windows by running sums, so that any window costs about the same.
//! 2. [`ordered`]: the paper's mapping over these costs; or [`free`]: each pixel's best candidate, over
//!    windows that may lie to one side of it, and where none is significant, the best of its neighbours'
//!    ([`filling`]). How far frames may deviate before they count as occluding a point is measured first
//!    ([`scene_tolerance`]).
//! 3. Where texture is weak, costs may be aggregated across rows before that; this serves both searches.

mod band_groups;
mod best;
mod choice;
pub(crate) mod edge_refinement;
mod exhaustive;
mod filling;
mod free;
mod mapping;
mod ordered;
mod result;
mod scene_tolerance;
pub(super) mod survey;
mod task;
#[cfg(test)]
pub(crate) mod tests;
mod tolerance;
pub(crate) mod winner;

use super::aggregation::semi_global::{Aggregation, PathAggregation, RowBand, typical_cost};
use super::aggregation::sweep;
use super::candidates::Candidates;
use super::cost::factorised::plan::Plan;
use super::maps::OrderingUsed;
use super::options::{MatchError, Occlusion, Search};
use band_groups::{groups_of_bands, penalties, searched_groups};
pub(super) use result::SearchResult;
use scene_tolerance::measured_tolerance;
pub(super) use task::Task;

/// The factorised search has a larger disparity step by this factor: the vertex of a parabola is good to a
/// fraction of it.
const COARSER: f64 = 2.0;

/// Searches all rows, each of which the task's progress counts.
///
/// # Errors
/// [`MatchError::TooManyToAggregate`] if costs are to be aggregated across rows and take too much memory.
pub(super) fn search(task: Task<'_>) -> Result<SearchResult, MatchError> {
    match task.options.search_used() {
        Search::Exhaustive => exhaustive::searched(task),
        Search::Factorised => factorised(task),
    }
}

fn factorised(task: Task<'_>) -> Result<SearchResult, MatchError> {
    let Task { volume, lines, range, ordering, rule, options, .. } = task;
    let disparity_step_px = (COARSER * options.disparity_step_px).min(1.0);
    let plan = Plan::new(lines, Candidates::covering(range, disparity_step_px), rule);
    let half = options.window_px / 2;
    let window = sweep::Window { rows: half, columns: half };
    let groups = groups_of_bands(task, plan.candidates.count())?;
    let occluded = ordering == OrderingUsed::Off && rule.occlusion == Occlusion::OneSide;
    let tolerance = occluded.then(|| measured_tolerance(task, &plan, window));
    let answers = |band: RowBand, aggregation: Option<Aggregation<'_>>| {
        let read = band.searched.start.saturating_sub(half)..band.searched.end + half;
        let own = lines.of_rows(read).map(|lines| Plan::new(&lines, plan.candidates, rule));
        let plan = own.as_ref().unwrap_or(&plan);
        match ordering {
            OrderingUsed::On => {
                let count = plan.candidates.count();
                let paths = aggregation
                    .map(|aggregation| PathAggregation::new(band.clone(), count, plan.columns, aggregation));
                let mut consumer = ordered::Ordered::new(plan, lines, options.method.resolution(), paths);
                sweep::sweep(volume, plan, window, band.searched, &mut consumer);
                consumer.into_answers()
            }
            OrderingUsed::Off => free::Search::new(task, plan, window, tolerance).rows(band, aggregation),
        }
    };
    let penalties = options.semi_global.then(|| {
        let typical = match tolerance {
            Some(tolerance) => tolerance.typical.max(tolerance::LEAST_TYPICAL),
            None => typical_cost(volume.rows(), options.method.resolution(), |y| {
                answers(RowBand::alone(y..y + 1), None).into_iter().flat_map(|row| row.cost).collect()
            }),
        };
        penalties(task, typical)
    });
    let mut searched = searched_groups(task, groups, |band, room| {
        answers(band, penalties.map(|penalties| Aggregation { penalties, room }))
    })?;
    if ordering == OrderingUsed::Off {
        filling::drop_ambiguous(&mut searched, options.min_confidence);
    }
    if let Some(tolerance) = tolerance {
        filling::fill(task, &plan, tolerance, &mut searched);
        searched.deviation_share = Some(tolerance.share);
    }
    Ok(searched)
}
