//! The search under the ordering constraint: the optimal strictly increasing mapping over the factorised
//! costs.

use epirig_core::statistics::upper_median;
use std::ops::Range;

use fearless_simd::Level;

use super::answers::{RowAnswers, bracketed, rival_distance};
use super::mapping::{OrderingLimits, optimal_mapping};
use super::winner::parabola_vertex;
use crate::aggregation::semi_global::{Aggregated, PathAggregation};
use crate::aggregation::sweep::Consumer;
use crate::cost::CostTable;
use crate::cost::factorised::kernels;
use crate::cost::factorised::plan::Plan;
use crate::lines::EpiLines;

/// Maps one row after the other.
pub(super) struct Ordered<'a> {
    plan: &'a Plan,
    limits: OrderingLimits,
    apart: usize,
    resolution: f32,
    level: Level,
    table: CostTable,
    /// Least cost of each column, and the sum of its costs.
    least: Vec<f32>,
    total: Vec<f32>,
    /// Candidates that have a cost, for each column.
    known: Vec<f32>,
    /// The costs of rows that wait for others to help them.
    paths: Option<PathAggregation<'a>>,
    /// The rows that are done.
    answers: Vec<RowAnswers>,
}

impl<'a> Ordered<'a> {
    /// Rows are mapped by themselves, or with the help of those of `held`.
    pub(super) fn new(
        plan: &'a Plan,
        lines: &EpiLines,
        resolution: f32,
        paths: Option<PathAggregation<'a>>,
    ) -> Self {
        let (columns, disparity_step_px) = (plan.columns, plan.candidates.disparity_step_px());
        let mut known = vec![0.0; columns];
        for run in plan.coverage.iter().flat_map(|candidate| &candidate.runs) {
            known[run.clone()].iter_mut().for_each(|count| *count += 1.0);
        }
        Self {
            plan,
            limits: OrderingLimits::new(lines, disparity_step_px),
            apart: rival_distance(lines, disparity_step_px),
            resolution,
            level: Level::new(),
            // A candidate has a cost in all rows or in none, so the unknown ones stay unknown.
            table: CostTable::from_values(columns, vec![f32::NAN; columns * plan.candidates.count()]),
            least: vec![f32::INFINITY; columns],
            total: vec![0.0; columns],
            known,
            paths,
            answers: Vec::new(),
        }
    }

    /// As [`neutral_cost`](super::mapping::neutral_cost) has it.
    fn neutral(&self) -> Option<f32> {
        let columns = || (0..self.known.len()).filter(|&x| self.known[x] > 0.0);
        let mut least: Vec<f32> = columns().map(|x| self.least[x]).collect();
        let mut typical: Vec<f32> = columns().map(|x| self.total[x] / self.known[x]).collect();
        Some(0.5 * (upper_median(&mut least)? + upper_median(&mut typical)?))
    }

    /// Least cost of the candidates at least `apart` candidates from the chosen ones.
    fn rivals(&self, chosen: &[u16]) -> Vec<f32> {
        let chosen: Vec<i32> = chosen.iter().map(|&k| k.into()).collect();
        let mut rivals = vec![f32::INFINITY; chosen.len()];
        for k in 0..self.table.candidates() {
            kernels::keep_rivals(self.level, self.table.row(k), &chosen, (k, self.apart), &mut rivals);
        }
        rivals
    }

    /// The answers, when all rows have been swept.
    pub(super) fn into_answers(mut self) -> Vec<RowAnswers> {
        if let Some(paths) = self.paths.take() {
            let aggregated = paths.aggregated();
            let plan = self.plan;
            for y in aggregated.rows() {
                for (k, candidate) in plan.coverage.iter().enumerate() {
                    for run in &candidate.runs {
                        aggregated.copy(y, k, run.start, &mut self.table.row_mut(k)[run.clone()]);
                        self.sum_up(k, run.clone());
                    }
                }
                self.map_row(Some((&aggregated, y)));
            }
        }
        self.answers
    }

    /// Tells least costs and sums of the costs of candidate `k` in the table.
    fn sum_up(&mut self, k: usize, run: Range<usize>) {
        let costs = &self.table.row(k)[run.clone()];
        kernels::keep_lesser(self.level, costs, &mut self.least[run.clone()]);
        self.total[run].iter_mut().zip(costs).for_each(|(total, cost)| *total += cost);
    }

    /// Maps the row whose costs are in the table: its own, or aggregated ones of row y.
    fn map_row(&mut self, aggregated: Option<(&Aggregated<'_>, usize)>) {
        let columns = self.plan.columns;
        let mut row = RowAnswers::unknown(columns);
        let candidates = &self.plan.candidates;
        if let Some(neutral) = self.neutral() {
            let chosen = optimal_mapping(&self.table, self.limits, neutral);
            let rivals = self.rivals(&chosen);
            for (x, &k) in chosen.iter().enumerate() {
                let k = usize::from(k);
                let cost = self.table.at(k, x);
                let own = |(aggregated, y): (&Aggregated<'_>, usize)| aggregated.own(y, k, x);
                row.cost[x] = if cost.is_nan() { cost } else { aggregated.map_or(cost, own) };
                // Without a rival there is nothing that it could be better than.
                let rival = if rivals[x] == f32::INFINITY { f32::NAN } else { rivals[x] };
                row.confidence[x] =
                    (1.0 - (cost + self.resolution) / (rival + self.resolution)).clamp(0.0, 1.0);
                let gone = |k: usize| self.table.at(k, x).is_nan();
                row.validity[x] = bracketed(candidates.count(), k, 2 * self.apart, gone, cost > neutral);
                row.place(x, candidates, k as f64 + parabola_vertex(&self.table, k, x));
            }
        }
        self.answers.push(row);
        self.least.fill(f32::INFINITY);
        self.total.fill(0.0);
    }
}

impl Consumer for Ordered<'_> {
    fn limit(&self, _y: usize) -> Option<&[f32]> {
        None
    }

    fn take(&mut self, _y: usize, k: usize, costs: &mut [f32]) {
        for run in &self.plan.coverage[k].runs {
            let costs = &costs[run.clone()];
            if let Some(paths) = &mut self.paths {
                paths.hold(k, run.start, costs);
                continue;
            }
            self.table.row_mut(k)[run.clone()].copy_from_slice(costs);
            self.sum_up(k, run.clone());
        }
    }

    fn row_done(&mut self, _y: usize) {
        match &mut self.paths {
            Some(paths) => paths.row_done(),
            None => self.map_row(None),
        }
    }
}
