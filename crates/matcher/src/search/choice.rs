//! Answers of a row from a table of its costs: by the cheapest mapping, or each pixel by itself.

use super::mapping::{OrderingLimits, neutral_cost, optimal_mapping};
use super::result::{RowResult, bracketed};
use super::winner::{confidences, parabola_vertex, winners};
use crate::aggregation::semi_global::Aggregated;
use crate::candidates::Candidates;
use crate::cost::CostTable;

/// How candidates are chosen from a table of costs.
pub(super) struct Choice {
    pub(super) candidates: Candidates,
    /// Limits of the ordering constraint; `None`: each pixel takes its best candidate.
    pub(super) limits: Option<OrderingLimits>,
    /// Candidates that end a pixel from each other are at least so many apart.
    pub(super) separation: usize,
    /// The same for the rivals of a confidence.
    pub(super) rival_separation: usize,
    /// Smallest significant difference of costs.
    pub(super) resolution: f32,
}

impl Choice {
    /// Answers of a row: its own costs are in the table, or the aggregated ones of row y.
    pub(super) fn row(&self, costs: &CostTable, aggregated: Option<(&Aggregated<'_>, usize)>) -> RowResult {
        let mut row = RowResult::unknown(costs.columns());
        let Some(neutral) = neutral_cost(costs) else { return row };
        let chosen = match self.limits {
            Some(limits) => optimal_mapping(costs, limits, neutral),
            None => winners(costs).into_iter().map(|winner| winner.unwrap_or(0)).collect(),
        };
        row.confidence = confidences(costs, &chosen, self.rival_separation, self.resolution);
        for (x, &k) in chosen.iter().enumerate() {
            let k = usize::from(k);
            let cost = costs.at(k, x);
            row.cost[x] = match aggregated {
                Some((aggregated, y)) if !cost.is_nan() => aggregated.own(y, k, x),
                _ => cost,
            };
            let gone = |k: usize| costs.at(k, x).is_nan();
            row.validity[x] = bracketed(costs.candidates(), k, 2 * self.separation, gone, cost > neutral);
            row.place(x, &self.candidates, k as f64 + parabola_vertex(costs, k, x));
        }
        row
    }
}
