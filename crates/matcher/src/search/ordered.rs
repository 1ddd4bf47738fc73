//! The search under the ordering constraint: the optimal strictly increasing mapping over the factorised
//! costs.

use super::choice::Choice;
use super::mapping::OrderingLimits;
use super::result::{RowResult, rival_distance};
use crate::aggregation::semi_global::PathAggregation;
use crate::aggregation::sweep::Consumer;
use crate::cost::CostTable;
use crate::cost::factorised::plan::Plan;
use crate::lines::EpiLines;

/// Maps one row after the other.
pub(super) struct Ordered<'a> {
    plan: &'a Plan,
    choice: Choice,
    table: CostTable,
    /// The costs of rows that wait to be aggregated.
    paths: Option<PathAggregation<'a>>,
    /// The rows that are done.
    answers: Vec<RowResult>,
}

impl<'a> Ordered<'a> {
    /// Rows are mapped by their own costs, or by aggregated ones.
    pub(super) fn new(
        plan: &'a Plan,
        lines: &EpiLines,
        resolution: f32,
        paths: Option<PathAggregation<'a>>,
    ) -> Self {
        let disparity_step_px = plan.candidates.disparity_step_px();
        let separation = rival_distance(lines, disparity_step_px);
        Self {
            plan,
            choice: Choice {
                candidates: plan.candidates,
                limits: Some(OrderingLimits::new(lines, disparity_step_px)),
                separation,
                rival_separation: separation,
                resolution,
            },
            // A candidate has a cost in all rows or in none, so the unknown ones stay unknown.
            table: CostTable::from_values(
                plan.columns,
                vec![f32::NAN; plan.columns * plan.candidates.count()],
            ),
            paths,
            answers: Vec::new(),
        }
    }

    /// The answers, when all rows have been swept.
    pub(super) fn into_answers(mut self) -> Vec<RowResult> {
        if let Some(paths) = self.paths.take() {
            let aggregated = paths.aggregated();
            for y in aggregated.rows() {
                for (k, candidate) in self.plan.coverage.iter().enumerate() {
                    for run in &candidate.runs {
                        aggregated.copy(y, k, run.start, &mut self.table.row_mut(k)[run.clone()]);
                    }
                }
                self.answers.push(self.choice.row(&self.table, Some((&aggregated, y))));
            }
        }
        self.answers
    }
}

impl Consumer for Ordered<'_> {
    fn limit(&self, _y: usize) -> Option<&[f32]> {
        None
    }

    fn take(&mut self, _y: usize, k: usize, costs: &mut [f32]) {
        for run in &self.plan.coverage[k].runs {
            let costs = &costs[run.clone()];
            match &mut self.paths {
                Some(paths) => paths.hold(k, run.start, costs),
                None => self.table.row_mut(k)[run.clone()].copy_from_slice(costs),
            }
        }
    }

    fn row_done(&mut self, _y: usize) {
        match &mut self.paths {
            Some(paths) => paths.row_done(),
            None => self.answers.push(self.choice.row(&self.table, None)),
        }
    }
}
