//! The search: every pixel's best disparity candidate, or why there is none.
//!
//! Two ways lead there. The exhaustive one is the paper's: the cost of each candidate from the samples of all frames
//! ([`cost`](super::cost)). The factorised one makes most of the sums once for many candidates:
//!
//! 1. [`groups`]: neighbouring frames form a dozen groups, whose mean and variance are summed up under a few slopes.
//! 2. [`kernels`]: the variance along a candidate is the variance between the groups' means plus the mean of the variances
//!    within the groups. Where points may be occluded, each group's share in it is truncated.
//! 3. [`sweep`]: windows by running sums, so that any window costs about the same.
//! 4. [`ordered`]: the paper's mapping over these costs; or [`free`]: each pixel's best candidate, over windows that may lie to
//!    one side of it, and where none can be believed, the best of its neighbours' ([`filling`]). How far frames may deviate before they count
//!    as hiding a point is measured first ([`tolerance`]).
//! 5. [`semi_global`]: where texture is weak, costs may be aggregated across rows before that; this serves both searches.

mod best;
mod exhaustive;
mod filling;
mod free;
mod groups;
mod kernels;
mod limits;
mod ordered;
mod plan;
mod row_costs;
mod semi_global;
pub(super) mod survey;
mod sweep;
#[cfg(test)]
mod tests;
mod tolerance;

use std::ops::Range;

use rayon::prelude::*;

use super::lines::{Candidates, Lines, SeenRule};
use super::maps::{Answer, OrderingUsed};
use super::options::{DisparityRange, MatchError, MatchOptions, Occlusion, Search};
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::volume::Volume;
use plan::Plan;
use semi_global::{Aggregation, Bands, PathAggregation, Penalties, Span, typical_cost};
use tolerance::Tolerance;

/// Rows that a thread searches in one go; windows reach a little beyond them.
const BAND_ROWS: usize = 32;
/// The factorised search has a larger disparity step by this factor: the vertex of a parabola is good to a fraction of it.
const COARSER: f64 = 2.0;

/// What the search has found for each pixel of the reference frame; rows x columns.
pub(super) struct Searched {
    /// Disparity in px; NaN where there is none.
    pub(super) guess: Grid<f32>,
    /// Cost of the chosen candidate, in the method's unit; NaN where it has none.
    pub(super) cost: Grid<f32>,
    /// How much better it is than the best one elsewhere, 0 to 1; NaN where it has no cost or no rival.
    pub(super) confidence: Grid<f32>,
    /// Whether there is a disparity.
    pub(super) answer: Grid<Answer>,
    /// Where points may be occluded: the largest squared deviation of a frame that agrees, as a share of the contrast around a point.
    pub(super) deviation_share: Option<f32>,
}

/// What is to be searched.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    /// The frames.
    pub(super) volume: &'a Volume,
    /// The lines through the pixels of the reference frame.
    pub(super) lines: &'a Lines,
    /// Disparities.
    pub(super) range: DisparityRange,
    /// The ordering to be applied.
    pub(super) ordering: OrderingUsed,
    /// By which candidates are seen.
    pub(super) rule: SeenRule,
    /// The caller's choices.
    pub(super) options: &'a MatchOptions,
}

/// Searches all rows. `progress` is told each row.
///
/// # Errors
/// [`MatchError::TooManyToAggregate`] if costs are to be aggregated across rows and take too much memory.
pub(super) fn search(task: Task<'_>, progress: &dyn Progress) -> Result<Searched, MatchError> {
    match task.options.search_used() {
        Search::Exhaustive => Ok(Searched::of_rows(task, &exhaustive::rows(task, progress)?)),
        Search::Factorised => factorised(task, progress),
    }
}

fn factorised(task: Task<'_>, progress: &dyn Progress) -> Result<Searched, MatchError> {
    let Task { volume, lines, range, ordering, rule, options } = task;
    let disparity_step_px = (COARSER * options.disparity_step_px).min(1.0);
    let plan = Plan::new(lines, Candidates::covering(range, disparity_step_px), rule);
    let half = options.window_px / 2;
    let window = sweep::Window { rows: half, columns: half };
    let groups = groups_of_bands(task, plan.candidates.count())?;
    let occluded = ordering == OrderingUsed::Off && rule.occlusion == Occlusion::OneSide;
    let tolerance = occluded.then(|| Tolerance::measured(task, &plan, window));
    let answers = |span: Span, aggregation: Option<Aggregation<'_>>| match ordering {
        OrderingUsed::On => {
            let size = (plan.candidates.count(), plan.columns);
            let paths = aggregation.map(|aggregation| PathAggregation::new(span.clone(), size, aggregation));
            let mut consumer = ordered::Ordered::new(&plan, lines, options.method.resolution(), paths);
            sweep::sweep(volume, &plan, window, span.searched, &mut consumer);
            consumer.into_answers()
        }
        OrderingUsed::Off => free::Search::new(task, &plan, window, tolerance).rows(span, aggregation),
    };
    let penalties = options.semi_global.then(|| {
        let typical = match tolerance {
            Some(tolerance) => tolerance.typical.max(tolerance::LEAST_TYPICAL),
            None => typical_cost(volume.rows(), options.method.resolution(), |y| {
                answers(Span::alone(y..y + 1), None).into_iter().flat_map(|row| row.cost).collect()
            }),
        };
        penalties(task, typical)
    });
    let rows = searched_groups(groups, progress, |span, room| {
        answers(span, penalties.map(|penalties| Aggregation { penalties, room }))
    });
    let mut searched = Searched::of_rows(task, &rows);
    if ordering == OrderingUsed::Off {
        filling::drop_ambiguous(&mut searched, options.minimum_confidence);
    }
    if let Some(tolerance) = tolerance {
        filling::fill(task, &plan, tolerance, &mut searched);
        searched.deviation_share = Some(tolerance.share);
    }
    Ok(searched)
}

/// Penalties of aggregation across rows, where right candidates cost `typical`.
fn penalties(Task { volume, options, .. }: Task<'_>, typical: f32) -> Penalties {
    Penalties::of_typical(typical, (volume.frames() - 1) * options.window_px.pow(2))
}

/// Bands that are searched one group after the other.
struct Groups {
    groups: Vec<Vec<Span>>,
    /// Counts that each band of a group holds.
    band_counts: usize,
}

/// Bands in groups that may be searched at once: all of them, unless costs are aggregated across rows.
fn groups_of_bands(task: Task<'_>, candidates: usize) -> Result<Groups, MatchError> {
    if task.options.semi_global {
        let bands = Bands::of(task.volume, candidates)?;
        Ok(Groups { groups: bands.groups(), band_counts: bands.band_counts })
    } else {
        let all = bands(task.volume.rows()).map(Span::alone).collect();
        Ok(Groups { groups: vec![all], band_counts: 0 })
    }
}

/// Answers of all rows in their order, found by `answers` with room for the counts of a band. `progress` is told each row.
fn searched_groups(
    Groups { groups, band_counts }: Groups,
    progress: &dyn Progress,
    answers: impl Fn(Span, &mut [u16]) -> Vec<RowAnswers> + Sync,
) -> Vec<RowAnswers> {
    let mut rows = Vec::new();
    // All room is one piece, so that it goes back to the system as a whole before the fit needs memory.
    let mut room = vec![0; band_counts * groups.iter().map(Vec::len).max().unwrap_or(0)];
    for group in groups {
        let mut rest = room.as_mut_slice();
        let mut part = || rest.split_off_mut(..band_counts).unwrap_or_default();
        let bands: Vec<_> = group.into_iter().map(|span| (span, part())).collect();
        rows.par_extend(bands.into_par_iter().flat_map_iter(|(span, room)| {
            let count = span.answered.len() as u64;
            let answers = answers(span, room);
            progress.advance(count);
            answers
        }));
    }
    rows
}

/// The rows of an image in pieces for one thread each.
fn bands(rows: usize) -> impl Iterator<Item = Range<usize>> {
    (0..rows).step_by(BAND_ROWS).map(move |y| y..(y + BAND_ROWS).min(rows))
}

impl Searched {
    fn of_rows(task: Task<'_>, rows: &[RowAnswers]) -> Self {
        let (count, columns) = (task.volume.rows(), task.volume.columns());
        let mut planes: [Grid<f32>; 3] = std::array::from_fn(|_| Grid::filled(count, columns, f32::NAN));
        let mut answer = Grid::filled(count, columns, Answer::LeavesImage);
        for (y, row) in rows.iter().enumerate() {
            for (plane, values) in planes.iter_mut().zip([&row.disparity, &row.cost, &row.confidence]) {
                plane.row_mut(y).copy_from_slice(values);
            }
            answer.row_mut(y).copy_from_slice(&row.answer);
        }
        let [guess, cost, confidence] = planes;
        Self { guess, cost, confidence, answer, deviation_share: None }
    }
}

/// The answers of one row.
struct RowAnswers {
    disparity: Vec<f32>,
    cost: Vec<f32>,
    confidence: Vec<f32>,
    /// Mean squared deviation over the largest that agrees, of the chosen candidate; NaN where that is not measured.
    disagreement: Vec<f32>,
    answer: Vec<Answer>,
}

impl RowAnswers {
    fn unknown(columns: usize) -> Self {
        let unknown = || vec![f32::NAN; columns];
        let answer = vec![Answer::LeavesImage; columns];
        Self { disparity: unknown(), cost: unknown(), confidence: unknown(), disagreement: unknown(), answer }
    }

    /// Column `x` has the disparity of a candidate, fractional, if it has an answer.
    fn place(&mut self, x: usize, candidates: &Candidates, index: f64) {
        if self.answer[x] == Answer::Found {
            self.disparity[x] = candidates.disparity_px(index) as f32;
        }
    }
}

/// How many candidates apart rivals are: they end at least a pixel from each other.
fn rival_distance(lines: &Lines, disparity_step_px: f64) -> usize {
    let apart = (1.0 / (disparity_step_px * lines.tau_before().max(lines.tau_after()))).ceil() as usize;
    apart.max(1)
}

/// Whether the candidates around `k` of `count` show it to be the best, `reach` of them on each side.
///
/// Near a candidate that leaves the image (`gone`) nothing shows that: the right one may have left. Nor is it shown if `k` is `dear`, costs
/// more than an unknown candidate is taken to cost, while others have left the image, or if it is an end of the
/// range; a range of one or two candidates has only ends, and is believed.
fn bracketed(count: usize, k: usize, reach: usize, gone: impl Fn(usize) -> bool, dear: bool) -> Answer {
    let last = count - 1;
    let mut near = k.saturating_sub(reach)..=(k + reach).min(last);
    let some_gone = gone(0) || gone(last);
    if near.any(&gone) || (some_gone && dear) {
        Answer::LeavesImage
    } else if last > 1 && (k == 0 || k == last) {
        Answer::BeyondRange
    } else {
        Answer::Found
    }
}

/// Rows that are looked at first, to see what right candidates cost.
const SAMPLED_ROWS: usize = 8;

/// A few rows, spread over an image of `rows`.
fn sampled_rows(rows: usize) -> Vec<usize> {
    let count = SAMPLED_ROWS.min(rows);
    (0..count).map(|index| (2 * index + 1) * rows / (2 * count)).collect()
}
