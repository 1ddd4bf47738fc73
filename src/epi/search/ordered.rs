//! Rows whose points keep their order: the optimal strictly increasing mapping over the costs of the sums.

use fearless_simd::Level;

use super::kernels;
use super::plan::Plan;
use super::sweep::Consumer;
use super::{RowAnswers, bracketed, median, rival_distance};
use crate::epi::cost::CostTable;
use crate::epi::lines::Lines;
use crate::epi::mapping::{OrderingLimits, optimal_mapping};
use crate::epi::winner::parabola_vertex;

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
    /// The rows that are done.
    pub(super) answers: Vec<RowAnswers>,
}

impl<'a> Ordered<'a> {
    pub(super) fn new(plan: &'a Plan, lines: &Lines, resolution: f32) -> Self {
        let (columns, raster_px) = (plan.columns, plan.hypotheses.raster_px());
        let mut known = vec![0.0; columns];
        for run in plan.candidates.iter().flat_map(|candidate| &candidate.runs) {
            known[run.clone()].iter_mut().for_each(|count| *count += 1.0);
        }
        Self {
            plan,
            limits: OrderingLimits::new(lines, raster_px),
            apart: rival_distance(lines, raster_px),
            resolution,
            level: Level::new(),
            // A candidate has a cost in all rows or in none, so the unknown ones stay unknown.
            table: CostTable::from_values(columns, vec![f32::NAN; columns * plan.hypotheses.count()]),
            least: vec![f32::INFINITY; columns],
            total: vec![0.0; columns],
            known,
            answers: Vec::new(),
        }
    }

    /// As [`neutral_cost`](crate::epi::mapping::neutral_cost) has it.
    fn neutral(&self) -> Option<f32> {
        let columns = || (0..self.known.len()).filter(|&x| self.known[x] > 0.0);
        let mut least: Vec<f32> = columns().map(|x| self.least[x]).collect();
        let mut typical: Vec<f32> = columns().map(|x| self.total[x] / self.known[x]).collect();
        Some(0.5 * (median(&mut least)? + median(&mut typical)?))
    }

    /// Least cost of the candidates at least `apart` hypotheses from the chosen ones.
    fn rivals(&self, chosen: &[u16]) -> Vec<f32> {
        let chosen: Vec<i32> = chosen.iter().map(|&k| k.into()).collect();
        let mut rivals = vec![f32::INFINITY; chosen.len()];
        for k in 0..self.table.hypotheses() {
            kernels::keep_rivals(self.level, self.table.row(k), &chosen, (k, self.apart), &mut rivals);
        }
        rivals
    }
}

impl Consumer for Ordered<'_> {
    fn limit(&self, _y: usize) -> Option<&[f32]> {
        None
    }

    fn take(&mut self, _y: usize, k: usize, costs: &mut [f32]) {
        for run in &self.plan.candidates[k].runs {
            let costs = &costs[run.clone()];
            self.table.row_mut(k)[run.clone()].copy_from_slice(costs);
            kernels::keep_lesser(self.level, costs, &mut self.least[run.clone()]);
            self.total[run.clone()].iter_mut().zip(costs).for_each(|(total, cost)| *total += cost);
        }
    }

    fn row_done(&mut self, _y: usize) {
        let columns = self.plan.columns;
        let mut row = RowAnswers::unknown(columns);
        let hypotheses = &self.plan.hypotheses;
        if let Some(neutral) = self.neutral() {
            let chosen = optimal_mapping(&self.table, self.limits, neutral);
            let rivals = self.rivals(&chosen);
            for (x, &k) in chosen.iter().enumerate() {
                let k = usize::from(k);
                let cost = self.table.at(k, x);
                row.cost[x] = cost;
                // Without a rival there is nothing that it could be better than.
                let rival = if rivals[x] == f32::INFINITY { f32::NAN } else { rivals[x] };
                row.confidence[x] =
                    (1.0 - (cost + self.resolution) / (rival + self.resolution)).clamp(0.0, 1.0);
                let gone = |k: usize| self.table.at(k, x).is_nan();
                row.answer[x] = bracketed(hypotheses.count(), k, 2 * self.apart, gone, cost > neutral);
                row.place(x, hypotheses, k as f64 + parabola_vertex(&self.table, k, x));
            }
        }
        self.answers.push(row);
        self.least.fill(f32::INFINITY);
        self.total.fill(0.0);
    }
}
