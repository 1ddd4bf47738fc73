//! The paper's search: costs of all candidates from the samples of all frames.

use rayon::prelude::*;

use super::{RowAnswers, Task, bracketed, rival_distance};
use crate::epi::cost::{Band, CostTable, band_costs};
use crate::epi::lines::Hypotheses;
use crate::epi::mapping::{OrderingLimits, neutral_cost, optimal_mapping};
use crate::epi::maps::OrderingUsed;
use crate::epi::winner::{confidences, parabola_vertex, winners};
use crate::progress::Progress;

/// Rows searched together, if their costs are few enough: they share the samples of their windows.
const BAND_ROWS: usize = 8;
/// Costs that a band holds at most, unless one row has more; 64 MiB.
const BAND_COSTS: usize = 1 << 24;

pub(super) fn rows(task: Task<'_>, progress: &dyn Progress) -> Vec<RowAnswers> {
    let Task { volume, lines, range, rule, options, .. } = task;
    let hypotheses = Hypotheses::covering(range, options.raster_px);
    let (rows, columns) = (volume.rows(), volume.columns());
    let band_rows = (BAND_COSTS / (columns * hypotheses.count())).clamp(1, BAND_ROWS);
    let bands: Vec<_> = (0..rows).step_by(band_rows).map(|y| y..(y + band_rows).min(rows)).collect();
    bands
        .into_par_iter()
        .flat_map_iter(|answered| {
            let count = answered.len();
            let band = Band::new(volume, answered, options);
            let tables = band_costs(&band, lines, &hypotheses, rule, options);
            let rows: Vec<_> = tables.iter().map(|costs| row_answers(costs, &hypotheses, task)).collect();
            progress.advance(count as u64);
            rows
        })
        .collect()
}

fn row_answers(costs: &CostTable, hypotheses: &Hypotheses, task: Task<'_>) -> RowAnswers {
    let Task { lines, ordering, options, .. } = task;
    let columns = costs.columns();
    let neutral = neutral_cost(costs);
    let chosen: Vec<u16> = match (ordering, neutral) {
        (_, None) => vec![0; columns],
        (OrderingUsed::Strict, Some(neutral)) => {
            optimal_mapping(costs, OrderingLimits::new(lines, options.raster_px), neutral)
        }
        (OrderingUsed::Free, _) => winners(costs).into_iter().map(|winner| winner.unwrap_or(0)).collect(),
    };
    let apart = rival_distance(lines, options.raster_px);
    let mut row = RowAnswers::unknown(columns);
    row.confidence = confidences(costs, &chosen, apart.max(2), options.method.resolution());
    for (x, &k) in chosen.iter().enumerate() {
        let k = usize::from(k);
        row.cost[x] = costs.at(k, x);
        let dear = row.cost[x] > neutral.unwrap_or(f32::INFINITY);
        row.answer[x] = bracketed(costs.hypotheses(), k, 2 * apart, |k| costs.at(k, x).is_nan(), dear);
        row.place(x, hypotheses, k as f64 + parabola_vertex(costs, k, x));
    }
    row
}
