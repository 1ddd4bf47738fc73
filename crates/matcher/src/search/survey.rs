//! Best candidates of single rows, for the range survey: only the winners are kept.

use fearless_simd::dispatch;

use super::best::Best;
use crate::candidates::Candidates;
use crate::cost::factorised::kernels;
use crate::cost::factorised::plan::Plan;
use crate::cost::factorised::row_costs::RowCosts;
use crate::lines::{EpiLines, SeenRule};
use crate::options::Method;
use epirig_core::volume::Volume;

/// Rows above and below whose costs are added.
const REACH_ROWS: usize = 1;
/// Rivals are at least this many candidates apart.
const RIVAL_SEPARATION: usize = 3;

/// Looks at single rows of a volume.
pub(crate) struct RowSurvey<'a> {
    volume: &'a Volume,
    plan: Plan,
    half_columns: usize,
}

impl<'a> RowSurvey<'a> {
    /// Under `candidates`, with windows of three rows and `2 * half_columns + 1` columns.
    pub(crate) fn new(
        volume: &'a Volume,
        lines: &EpiLines,
        candidates: Candidates,
        rule: SeenRule,
        half_columns: usize,
    ) -> Self {
        Self { volume, plan: Plan::new(lines, candidates, rule), half_columns }
    }

    /// The best disparity of each pixel of row `y`, in px, and how much better it is than its rivals (NaN
    /// without any).
    pub(crate) fn of_row(&self, y: usize) -> Vec<Option<(f64, f32)>> {
        let (plan, columns) = (&self.plan, self.plan.columns);
        let near = y.saturating_sub(REACH_ROWS)..(y + REACH_ROWS + 1).min(self.volume.rows());
        let mut rows: Vec<RowCosts> = near
            .map(|y| {
                let mut row = RowCosts::new(self.volume, plan);
                row.load_row(y);
                row
            })
            .collect();
        let level = rows[0].level;
        let scale = 1.0 / rows.len() as f32;
        let (mut single, mut sum, mut mean) = (vec![0.0; columns], vec![0.0; columns], vec![0.0; columns]);
        let mut best = Best::new(columns, RIVAL_SEPARATION);
        for block in &plan.blocks {
            rows.iter_mut().for_each(|row| row.load_block(block));
            for k in block.candidates.clone() {
                let runs = &plan.coverage[k].runs;
                sum.fill(0.0);
                for row in &rows {
                    row.single(k, None, &mut single);
                    for run in runs {
                        let (single, sum) = (&single[run.clone()], &mut sum[run.clone()]);
                        dispatch!(level, _simd => kernels::add_scaled(single, scale, sum));
                    }
                }
                for run in runs {
                    let (sum, mean) = (&sum[run.clone()], &mut mean[run.clone()]);
                    dispatch!(level, _simd => kernels::box_means(sum, self.half_columns, mean));
                }
                best.take(runs.iter().map(|run| (run.clone(), &mean[run.clone()])));
            }
        }
        let disparity = |k: usize| plan.candidates.disparity_px(k as f64);
        let surveyed = |x: usize| {
            let (k, _) = best.winner(x)?;
            Some((disparity(k), best.confidence(x, Method::Variance.resolution())))
        };
        (0..columns).map(surveyed).collect()
    }
}
