//! The best candidate of each column, found candidate by candidate: no table of costs is kept.

use std::ops::Range;

use fearless_simd::{Level, dispatch};

use super::winner::{confidence, vertex};
use crate::cost::factorised::kernels::keep_lesser;

/// The best candidates of one row and their rivals; unknown costs are infinite.
pub(super) struct Best {
    level: Level,
    /// Candidates less than this far from the best one are no rivals; at least 2, so that its neighbours are
    /// not.
    separation: usize,
    kept: Kept,
    /// The costs of the last `separation` candidates.
    recent: Vec<Vec<f32>>,
    passed: usize,
}

struct Kept {
    /// Least cost.
    cost: Vec<f32>,
    /// Its candidate; far below zero where unknown.
    candidate: Vec<i32>,
    /// Costs of the candidates before and after it.
    before: Vec<f32>,
    after: Vec<f32>,
    /// Least cost of all candidates that are rivals of it.
    rival: Vec<f32>,
    /// Least cost of all candidates that are rivals of the one passing by.
    earlier: Vec<f32>,
}

/// Marks a column without any candidate.
const NONE: i32 = i32::MIN / 2;

impl Best {
    pub(super) fn new(columns: usize, separation: usize) -> Self {
        let separation = separation.max(2);
        let unknown = || vec![f32::INFINITY; columns];
        let kept = Kept {
            cost: unknown(),
            candidate: vec![NONE; columns],
            before: unknown(),
            after: unknown(),
            rival: unknown(),
            earlier: unknown(),
        };
        Self { level: Level::new(), separation, kept, recent: vec![unknown(); separation], passed: 0 }
    }

    /// Forgets all candidates.
    pub(super) fn restart(&mut self) {
        let Kept { cost, candidate, before, after, rival, earlier } = &mut self.kept;
        candidate.fill(NONE);
        [cost, before, after, rival, earlier]
            .into_iter()
            .chain(&mut self.recent)
            .for_each(|row| row.fill(f32::INFINITY));
        self.passed = 0;
    }

    /// Costs of the next candidate, in `runs` of columns; in other columns it has none.
    pub(super) fn take<'a>(&mut self, runs: impl Iterator<Item = (Range<usize>, &'a [f32])>) {
        let k = self.passed;
        self.passed += 1;
        let slots = self.recent.len();
        let mut row = std::mem::take(&mut self.recent[k % slots]);
        // The costs in this slot are `separation` candidates old, and rivals from now on.
        dispatch!(self.level, _simd => keep_lesser(&row, &mut self.kept.earlier));
        row.fill(f32::INFINITY);
        for (columns, costs) in runs {
            row[columns].copy_from_slice(costs);
        }
        let previous = &self.recent[(k + slots - 1) % slots];
        let (index, separation) = (k as i32, self.separation as i32);
        dispatch!(self.level, _simd => keep_best(&row, previous, index, separation, &mut self.kept));
        self.recent[k % slots] = row;
    }

    /// Candidate of least cost at column `x`, and the cost.
    pub(super) fn winner(&self, x: usize) -> Option<(usize, f32)> {
        let k = self.kept.candidate[x];
        (k >= 0).then(|| (k as usize, self.kept.cost[x]))
    }

    /// [Confidence](confidence) of the winner.
    pub(super) fn confidence(&self, x: usize, resolution: f32) -> f32 {
        confidence(self.kept.cost[x], self.kept.rival[x], resolution)
    }

    /// Where between its neighbours the least cost lies, in candidates from the winner.
    pub(super) fn vertex(&self, x: usize) -> f64 {
        vertex([self.kept.before[x], self.kept.cost[x], self.kept.after[x]])
    }
}

#[inline(always)]
fn keep_best(costs: &[f32], previous: &[f32], k: i32, separation: i32, kept: &mut Kept) {
    let count = costs.len();
    let previous = &previous[..count];
    let (best, candidate) = (&mut kept.cost[..count], &mut kept.candidate[..count]);
    let (before, after) = (&mut kept.before[..count], &mut kept.after[..count]);
    let (rival, earlier) = (&mut kept.rival[..count], &kept.earlier[..count]);
    for i in 0..count {
        let cost = costs[i];
        let better = cost < best[i];
        let away = k - candidate[i];
        let other = if away >= separation && cost < rival[i] { cost } else { rival[i] };
        let next = if away == 1 { cost } else { after[i] };
        rival[i] = if better { earlier[i] } else { other };
        after[i] = if better { f32::INFINITY } else { next };
        before[i] = if better { previous[i] } else { before[i] };
        candidate[i] = if better { k } else { candidate[i] };
        best[i] = if better { cost } else { best[i] };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_best_and_its_rival_are_those_of_the_whole_table(
            costs in prop::collection::vec(prop_oneof![6 => (0_u8..20).prop_map(f32::from), 1 => Just(f32::INFINITY)], 1..40),
            separation in 2_usize..5,
        ) {
            let mut best = Best::new(1, separation);
            for _ in 0..2 {
                best.restart();
                for cost in &costs {
                    best.take(std::iter::once((0..1, std::slice::from_ref(cost))));
                }
                let least = costs.iter().copied().fold(f32::INFINITY, f32::min);
                let Some((k, cost)) = best.winner(0) else {
                    prop_assert_eq!(least, f32::INFINITY);
                    continue;
                };
                prop_assert_eq!(cost, least);
                prop_assert_eq!(k, costs.iter().position(|&cost| cost == least).unwrap());
                let rivals = costs.iter().enumerate().filter(|(other, _)| other.abs_diff(k) >= separation);
                let rival = rivals.map(|(_, &cost)| cost).fold(f32::INFINITY, f32::min);
                let confidence = best.confidence(0, 0.5);
                if rival == f32::INFINITY {
                    prop_assert!(confidence.is_nan());
                } else {
                    prop_assert!((confidence - (1.0 - (cost + 0.5) / (rival + 0.5))).abs() < 1e-6);
                }
                if k > 0 && k + 1 < costs.len() && costs[k - 1].is_finite() && costs[k + 1].is_finite() {
                    let (a, c) = (costs[k - 1], costs[k + 1]);
                    let expected = if a + c > 2.0 * cost { 0.5 * (a - c) / (a - 2.0 * cost + c) } else { 0.0 };
                    prop_assert!((best.vertex(0) - f64::from(expected).clamp(-0.499, 0.499)).abs() < 1e-6);
                } else {
                    prop_assert_eq!(best.vertex(0), 0.0);
                }
            }
        }
    }
}
