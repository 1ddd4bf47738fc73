//! Costs of all candidates, row after row, averaged over windows by running sums.

use std::ops::Range;

use fearless_simd::dispatch;

use crate::cost::factorised::kernels;
use crate::cost::factorised::plan::Plan;
use crate::cost::factorised::row_costs::RowCosts;
use epirig_core::volume::Volume;

/// Half sides of a window, rounded down, in px.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Window {
    pub(crate) rows: usize,
    pub(crate) columns: usize,
}

/// A consumer of the costs.
pub(crate) trait Consumer {
    /// Where single costs are to be truncated in row `y`; `None` asks for plain variances.
    fn limit(&self, y: usize) -> Option<&[f32]>;

    /// Costs of the single pixels of row `y` under candidate `k`, in the runs of the candidate, before they
    /// are averaged over windows.
    fn enter(&mut self, _y: usize, _k: usize, _single: &[f32]) {}

    /// Mean costs over the windows around the pixels of row `y` under candidate `k`, in the runs of the
    /// candidate; they may be changed. Candidates come in their order, and all of them for a row before the
    /// next row.
    fn take(&mut self, y: usize, k: usize, costs: &mut [f32]);

    /// All costs of row `y` have been taken.
    fn row_done(&mut self, y: usize);
}

/// Hands the costs of the windows around all pixels of rows `centres` to `consumer`.
pub(crate) fn sweep(
    volume: &Volume,
    plan: &Plan,
    window: Window,
    centres: Range<usize>,
    consumer: &mut impl Consumer,
) {
    let columns = plan.columns;
    let count = plan.candidates.count();
    let height = 2 * window.rows + 1;
    let mut costs = RowCosts::new(volume, plan);
    let level = costs.level;
    let (mut single, mut boxed, mut out) = (vec![0.0; columns], vec![0.0; columns], vec![0.0; columns]);
    // Means over columns of the rows in the window, and their sums: candidates x columns each.
    let mut ring = vec![vec![0.0_f32; count * columns]; height];
    let mut totals = vec![0.0_f32; count * columns];
    for entering in centres.start.saturating_sub(window.rows)..centres.end + window.rows {
        let enters = entering < volume.rows();
        let centre = entering.checked_sub(window.rows).filter(|&y| y >= centres.start);
        let first = (entering + 1).saturating_sub(height);
        let scale = 1.0 / ((entering + 1).min(volume.rows()) - first) as f32;
        let leaving = &mut ring[entering % height];
        if enters {
            costs.load_row(entering);
        } else {
            boxed.fill(0.0);
        }
        for block in &plan.blocks {
            if enters {
                costs.load_block(block);
            }
            for k in block.candidates.clone() {
                if enters {
                    costs.single(k, consumer.limit(entering), &mut single);
                    consumer.enter(entering, k, &single);
                }
                for run in &plan.coverage[k].runs {
                    let place = k * columns + run.start..k * columns + run.end;
                    if enters {
                        let (single, boxed) = (&single[run.clone()], &mut boxed[run.clone()]);
                        dispatch!(level, _simd => kernels::box_means(single, window.columns, boxed));
                    }
                    let (leaving, total) = (&mut leaving[place.clone()], &mut totals[place]);
                    let (entering, out) = (&boxed[run.clone()], &mut out[run.clone()]);
                    dispatch!(level, _simd => kernels::slide(entering, leaving, total, scale, out));
                }
                if let Some(y) = centre {
                    consumer.take(y, k, &mut out);
                }
            }
        }
        if let Some(y) = centre {
            consumer.row_done(y);
        }
    }
}
