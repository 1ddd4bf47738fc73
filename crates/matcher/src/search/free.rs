//! The search without the ordering constraint: each pixel takes its best candidate.
//!
//! Depth edges keep their place, because the cost of a pixel is the least over all windows that contain it;
//! one of them lies on the pixel's own surface (Kang, Szeliski and Chai 2001). Points that are occluded in
//! part of the sequence are answered, because a frame that disagrees costs a limited amount, whatever it
//! shows. The pixel's own cost counts as much as that of its best window, so a point that is soon occluded
//! does not join the occluding surface.

use std::ops::Range;

use fearless_simd::{Level, dispatch};

use super::best::Best;
use super::result::{RowResult, bracketed, rival_distance};
use super::task::Task;
use super::tolerance::Tolerance;
use crate::aggregation::semi_global::{Aggregated, Aggregation, PathAggregation, RowBand};
use crate::aggregation::sweep::{Consumer, Window, sweep};
use crate::cost::factorised::kernels;
use crate::cost::factorised::limits::{NOISE_OF_GROUPS, limits};
use crate::cost::factorised::plan::Plan;
use crate::validity::Validity;

/// The search of a volume without the ordering constraint.
pub(super) struct Search<'a> {
    task: Task<'a>,
    plan: &'a Plan,
    window: Window,
    /// The deviation allowed to frames, if points may be occluded in some.
    tolerance: Option<Tolerance>,
}

impl<'a> Search<'a> {
    pub(super) fn new(task: Task<'a>, plan: &'a Plan, window: Window, tolerance: Option<Tolerance>) -> Self {
        Self { task, plan, window, tolerance }
    }
}

impl Search<'_> {
    /// Answers of the rows of `asked`, each found by itself or from aggregated costs.
    pub(super) fn rows(&self, asked: RowBand, aggregation: Option<Aggregation<'_>>) -> Vec<RowResult> {
        let Task { volume, lines, options, .. } = self.task;
        let (rows, columns) = (volume.rows(), self.plan.columns);
        let count = self.plan.candidates.count();
        let band = asked.searched.clone();
        let paths = aggregation.map(|aggregation| PathAggregation::new(asked, count, columns, aggregation));
        let shift = self.window.rows;
        let centres = band.start.saturating_sub(shift)..(band.end + shift).min(rows);
        let first = centres.start.saturating_sub(shift);
        let limited = first..(centres.end + shift).min(rows);
        let resolution = options.method.resolution();
        let limits = self.tolerance.map_or_else(Vec::new, |tolerance| {
            limits(volume, self.plan, limited, resolution, tolerance.share, NOISE_OF_GROUPS)
        });
        let separation = rival_distance(lines, self.plan.candidates.disparity_step_px()).max(2);
        let own_size = if self.tolerance.is_some() { columns * self.plan.candidates.count() } else { 0 };
        let mut rows = FreeRows {
            search: self,
            band: band.clone(),
            shift,
            first,
            limits,
            typical: Vec::new(),
            inverse: vec![1.0; columns],
            level: Level::new(),
            minima: vec![f32::INFINITY; columns],
            own: vec![vec![f32::INFINITY; own_size]; self.window.rows + shift + 1],
            recent: vec![vec![f32::INFINITY; columns * self.plan.candidates.count()]; 2 * shift + 1],
            separation,
            best: Best::new(columns, separation),
            done: band.start,
            paths,
            answers: Vec::new(),
        };
        sweep(volume, self.plan, self.window, centres.clone(), &mut rows);
        // At the end of the image no more rows follow.
        for y in rows.done..band.end {
            for k in 0..self.plan.candidates.count() {
                rows.decide(y, k, y.saturating_sub(shift)..centres.end);
            }
            rows.decided(y);
        }
        rows.into_answers()
    }
}

struct FreeRows<'a> {
    search: &'a Search<'a>,
    band: Range<usize>,
    /// How far windows may be shifted.
    shift: usize,
    /// The first row that has limits.
    first: usize,
    /// Limits of single costs, for each row; none if costs are not truncated.
    limits: Vec<Vec<f32>>,
    /// Mean limit of the windows around the pixels of each row of centres, in the order in which they come.
    typical: Vec<Vec<f32>>,
    /// One over the last of these.
    inverse: Vec<f32>,
    level: Level,
    minima: Vec<f32>,
    /// Least costs of windows shifted along the row, for the last rows: candidates x columns each.
    recent: Vec<Vec<f32>>,
    /// Truncated costs of single pixels over their limits, for the last rows: candidates x columns each.
    own: Vec<Vec<f32>>,
    separation: usize,
    best: Best,
    /// The first row that is not decided.
    done: usize,
    /// Costs of rows that wait to be aggregated.
    paths: Option<PathAggregation<'a>>,
    answers: Vec<RowResult>,
}

impl FreeRows<'_> {
    fn first_centre(&self) -> usize {
        self.band.start.saturating_sub(self.shift)
    }

    /// Mean limits around the pixels of row `y`.
    fn begin_centre(&mut self, y: usize) {
        let columns = self.inverse.len();
        let mut typical = vec![1.0; columns];
        if !self.limits.is_empty() {
            let window = self.search.window;
            let first = y.saturating_sub(window.rows) - self.first;
            let end = (y + window.rows + 1 - self.first).min(self.limits.len());
            let mut sums = vec![0.0; columns];
            for limits in &self.limits[first..end] {
                sums.iter_mut().zip(limits).for_each(|(sum, limit)| *sum += limit);
            }
            dispatch!(self.level, _simd => kernels::box_means(&sums, window.columns, &mut typical));
            typical.iter_mut().for_each(|limit| *limit /= (end - first) as f32);
        }
        self.inverse.iter_mut().zip(&typical).for_each(|(inverse, limit)| *inverse = 1.0 / limit);
        self.typical.push(typical);
    }

    /// Takes candidate `k` of row `y` from the windows around the rows `centres`.
    fn decide(&mut self, y: usize, k: usize, centres: Range<usize>) {
        let columns = self.inverse.len();
        let height = self.recent.len();
        debug_assert!(centres.contains(&y));
        let runs = &self.search.plan.coverage[k].runs;
        for run in runs {
            let place = k * columns + run.start..k * columns + run.end;
            let minima = &mut self.minima[run.clone()];
            minima.copy_from_slice(&self.recent[centres.start % height][place.clone()]);
            for centre in centres.start + 1..centres.end {
                let recent = &self.recent[centre % height][place.clone()];
                dispatch!(self.level, _simd => kernels::keep_lesser(recent, minima));
            }
            if !self.limits.is_empty() {
                let own = &self.own[y % self.own.len()][place];
                minima.iter_mut().zip(own).for_each(|(cost, own)| *cost = 0.5 * (*cost + own));
            }
        }
        match &mut self.paths {
            None => self.best.take(runs.iter().map(|run| (run.clone(), &self.minima[run.clone()]))),
            Some(paths) => runs.iter().for_each(|run| paths.hold(k, run.start, &self.minima[run.clone()])),
        }
    }

    /// All candidates of row `y` have been decided.
    fn decided(&mut self, y: usize) {
        self.done = y + 1;
        match &mut self.paths {
            None => self.validity(y, None),
            Some(paths) => paths.row_done(),
        }
    }

    fn into_answers(mut self) -> Vec<RowResult> {
        if let Some(paths) = self.paths.take() {
            let aggregated = paths.aggregated();
            let coverage = &self.search.plan.coverage;
            for y in aggregated.rows() {
                for (k, candidate) in coverage.iter().enumerate() {
                    let runs = &candidate.runs;
                    for run in runs {
                        aggregated.copy(y, k, run.start, &mut self.minima[run.clone()]);
                    }
                    self.best.take(runs.iter().map(|run| (run.clone(), &self.minima[run.clone()])));
                }
                self.validity(y, Some(&aggregated));
            }
        }
        self.answers
    }

    /// Answers row `y` by the best of its own costs, or of aggregated ones.
    fn validity(&mut self, y: usize, aggregated: Option<&Aggregated<'_>>) {
        let Search { plan, task: Task { options, .. }, tolerance, .. } = *self.search;
        let dearest =
            tolerance.map_or(f32::INFINITY, |tolerance| tolerance.largest_cost(options.min_visible));
        let columns = self.inverse.len();
        let count = plan.candidates.count();
        let typical = &self.typical[y - self.first_centre()];
        let mut row = RowResult::unknown(columns);
        for (x, &limit) in typical.iter().enumerate() {
            let Some((k, cost)) = self.best.winner(x) else { continue };
            let cost = aggregated.map_or(cost, |aggregated| aggregated.own(y, k, x));
            row.cost[x] = cost * limit;
            row.disagreement[x] = cost;
            row.confidence[x] = self.best.confidence(x, options.method.resolution() / limit);
            let costly = cost > dearest;
            row.validity[x] = bracketed(count, k, 2 * self.separation, |k| !plan.knows(k, x), costly);
            if row.validity[x] == Validity::Found && costly {
                row.validity[x] = Validity::Occluded;
            }
            row.place(x, &plan.candidates, k as f64 + self.best.vertex(x));
        }
        self.answers.push(row);
        self.best.restart();
    }

    /// The row whose windows are complete with those around row `centre`.
    fn completed(&self, centre: usize) -> Option<usize> {
        centre.checked_sub(self.shift).filter(|y| self.band.contains(y))
    }
}

impl Consumer for FreeRows<'_> {
    fn limit(&self, y: usize) -> Option<&[f32]> {
        self.limits.get(y - self.first).map(Vec::as_slice)
    }

    fn enter(&mut self, y: usize, k: usize, single: &[f32]) {
        let Some(limits) = self.limits.get(y - self.first) else { return };
        let columns = self.inverse.len();
        let slot = y % self.own.len();
        for run in &self.search.plan.coverage[k].runs {
            let out = &mut self.own[slot][k * columns + run.start..k * columns + run.end];
            let values = single[run.clone()].iter().zip(&limits[run.clone()]);
            out.iter_mut().zip(values).for_each(|(out, (cost, limit))| *out = cost / limit);
        }
    }

    fn take(&mut self, y: usize, k: usize, costs: &mut [f32]) {
        let columns = self.inverse.len();
        let height = self.recent.len();
        if k == 0 {
            self.begin_centre(y);
        }
        for run in &self.search.plan.coverage[k].runs {
            let costs = &mut costs[run.clone()];
            dispatch!(self.level, _simd => kernels::multiply(&self.inverse[run.clone()], costs));
            let out = &mut self.recent[y % height][k * columns + run.start..k * columns + run.end];
            dispatch!(self.level, _simd => kernels::box_minima(costs, self.shift, out));
        }
        if let Some(done) = self.completed(y) {
            self.decide(done, k, done.saturating_sub(self.shift)..y + 1);
        }
    }

    fn row_done(&mut self, y: usize) {
        if let Some(done) = self.completed(y) {
            self.decided(done);
        }
    }
}
