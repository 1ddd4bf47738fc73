//! Answers of a row from a table of its costs: by the cheapest mapping, or each pixel by itself.

use super::answers::{RowAnswers, bracketed};
use super::mapping::{OrderingLimits, neutral_cost, optimal_mapping};
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
    pub(super) apart: usize,
    /// The same for the rivals of a confidence.
    pub(super) rivals_apart: usize,
    /// Smallest significant difference of costs.
    pub(super) resolution: f32,
}

impl Choice {
    /// Answers of a row: its own costs are in the table, or the aggregated ones of row y.
    pub(super) fn row(&self, costs: &CostTable, aggregated: Option<(&Aggregated<'_>, usize)>) -> RowAnswers {
        let mut row = RowAnswers::unknown(costs.columns());
        let Some(neutral) = neutral_cost(costs) else { return row };
        let chosen = match self.limits {
            Some(limits) => optimal_mapping(costs, limits, neutral),
            None => winners(costs).into_iter().map(|winner| winner.unwrap_or(0)).collect(),
        };
        row.confidence = confidences(costs, &chosen, self.rivals_apart, self.resolution);
        for (x, &k) in chosen.iter().enumerate() {
            let k = usize::from(k);
            let cost = costs.at(k, x);
            row.cost[x] = match aggregated {
                Some((aggregated, y)) if !cost.is_nan() => aggregated.own(y, k, x),
                _ => cost,
            };
            let gone = |k: usize| costs.at(k, x).is_nan();
            row.validity[x] = bracketed(costs.candidates(), k, 2 * self.apart, gone, cost > neutral);
            row.place(x, &self.candidates, k as f64 + parabola_vertex(costs, k, x));
        }
        row
    }
}
