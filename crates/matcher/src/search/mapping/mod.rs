//! The optimal strictly increasing mapping of an EPI, by dynamic programming (paper, section 4).
//!
//! Every column of the reference frame is given one candidate so that the sum of the costs is least, under
//! the condition that points keep their order: both the column in the first frame and the column in the last
//! increase strictly from one reference column to the next. With reference position tau_r and disparities d,
//! d' of neighbouring columns this says
//!
//! ```text
//! last frame:   1 + (d' - d) (1 - tau_r) > 0,   so d' - d > -1 / (1 - tau_r)
//! first frame:  1 - (d' - d) tau_r       > 0,   so d' - d <  1 / tau_r
//! ```

mod kernels;
mod neutral;

use fearless_simd::{Level, Simd, dispatch};

use crate::cost::CostTable;
use crate::lines::EpiLines;
use kernels::{BLOCK, LANES, least, step, take_columns};

pub(crate) use neutral::neutral_cost;

/// Largest fall and rise of the candidate from one column to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OrderingLimits {
    /// Largest fall, in candidates.
    pub(crate) fall: usize,
    /// Largest rise, in candidates.
    pub(crate) rise: usize,
}

impl OrderingLimits {
    /// The limits that keep the order of points in the first and the last frame, for candidates
    /// `disparity_step_px` apart.
    pub(crate) fn new(lines: &EpiLines, disparity_step_px: f64) -> Self {
        // The largest whole number strictly below 1 / (share * step); a share of zero sets no limit.
        let strictly_below = |share: f64| {
            let limit = 1.0 / (share * disparity_step_px);
            if limit.is_finite() { ((limit - 1e-9).ceil() as usize).saturating_sub(1) } else { usize::MAX }
        };
        Self { fall: strictly_below(lines.tau_after()), rise: strictly_below(lines.tau_before()) }
    }
}

/// The candidate of each column on the cheapest strictly increasing mapping.
///
/// A candidate without cost (NaN) counts `unknown_cost`, a finite number, so that a point may leave the
/// image without distorting the mapping of those that stay. Of equal sums the lower candidate is taken,
/// column by column from the last. The time is proportional to columns x candidates, times the logarithm
/// of the limits.
///
/// Sums are of single precision. Every 32 columns the least sum of the column is subtracted, so they stay
/// as small as what a mapping loses by a detour. The sum of the mapping found exceeds the least one by
/// rounding only: at most 2^-23 of the largest such detour for each column.
pub(crate) fn optimal_mapping(costs: &CostTable, limits: OrderingLimits, unknown_cost: f32) -> Vec<u16> {
    let (count, columns) = (costs.candidates(), costs.columns());
    let [fall, rise] = [limits.fall, limits.rise].map(|limit| limit.min(count - 1));
    // Sums of all columns, candidates rounded up to whole vectors. The predecessor of a candidate is not
    // stored but found again on the way back, at the cost of one window for each column.
    let length = count.next_multiple_of(LANES);
    let mut reached = vec![0.0; length * columns];
    let limits = OrderingLimits { fall, rise };
    dispatch!(Level::new(), simd => reach(simd, costs, limits, unknown_cost, &mut reached));
    let mut window = 0..count;
    let mut mapping = vec![0; columns];
    for (chosen, sums) in mapping.iter_mut().zip(reached.chunks_exact(length)).rev() {
        let sums = &sums[window.clone()];
        let low = least(sums);
        let place = window.start + sums.iter().position(|&sum| sum == low).unwrap_or(0);
        *chosen = place as u16;
        // It was reached from no more than `rise` below and `fall` above.
        window = place.saturating_sub(rise)..(place + fall + 1).min(count);
    }
    mapping
}

/// The least sum of costs that leads to each candidate, from the first column to the last: columns x length.
#[inline(always)]
fn reach<S: Simd>(
    simd: S,
    costs: &CostTable,
    OrderingLimits { fall, rise }: OrderingLimits,
    unknown_cost: f32,
    reached: &mut [f32],
) {
    let length = costs.candidates().next_multiple_of(LANES);
    // The sums of a column between infinite values that windows reach.
    let own = rise..rise + length;
    let [mut column, mut windows, mut scratch] = [(); 3].map(|()| vec![f32::INFINITY; rise + length + fall]);
    // The first column is reached from nowhere, at no cost.
    column[rise..rise + costs.candidates()].fill(0.0);
    let mut block_costs = vec![0.0; length * BLOCK];
    for (index, block) in reached.chunks_mut(BLOCK * length).enumerate() {
        take_columns(simd, costs, index * BLOCK, unknown_cost, &mut block_costs);
        let low = least(&column[own.clone()]);
        column[own.clone()].iter_mut().for_each(|sum| *sum -= low);
        for (next, costs) in block.chunks_exact_mut(length).zip(block_costs.chunks_exact(length)) {
            step(&column, rise + fall + 1, costs, [&mut windows, &mut scratch], next);
            column[own.clone()].copy_from_slice(next);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::tau::Tau;
    use proptest::prelude::*;

    /// The least sum over all strictly increasing mappings, by trying every one: the definition, not the
    /// method.
    fn exhaustive(costs: &CostTable, lines: &EpiLines, step: f64, unknown: f32) -> f64 {
        fn extend(
            costs: &CostTable,
            lines: &EpiLines,
            step: f64,
            unknown: f32,
            path: &mut Vec<usize>,
            sum: f64,
        ) -> f64 {
            let x = path.len();
            if x == costs.columns() {
                return sum;
            }
            let mut best = f64::INFINITY;
            for k in 0..costs.candidates() {
                if let Some(&previous) = path.last() {
                    let end = |x: usize, k: usize, tau: f64| x as f64 + k as f64 * step * tau;
                    let first_grows =
                        end(x, k, -lines.tau_before()) > end(x - 1, previous, -lines.tau_before()) + 1e-9;
                    let last_grows =
                        end(x, k, lines.tau_after()) > end(x - 1, previous, lines.tau_after()) + 1e-9;
                    if !(first_grows && last_grows) {
                        continue;
                    }
                }
                let cost = costs.at(k, x);
                let cost = f64::from(if cost.is_nan() { unknown } else { cost });
                path.push(k);
                best = best.min(extend(costs, lines, step, unknown, path, sum + cost));
                path.pop();
            }
            best
        }
        extend(costs, lines, step, unknown, &mut Vec::new(), 0.0)
    }

    proptest! {
        #[test]
        fn the_mapping_is_the_optimum_of_exhaustive_search_and_increases(
            values in prop::collection::vec(prop_oneof![9 => 0.0_f32..100.0, 1 => Just(f32::NAN)], 7 * 5),
            reference in 0_usize..5,
            step in prop::sample::select(vec![0.25, 0.5, 1.0, 0.4]),
        ) {
            let lines = EpiLines::new(&Tau::equidistant(5).unwrap(), reference, 5);
            let costs = CostTable::from_values(5, values);
            let limits = OrderingLimits::new(&lines, step);
            let mapping = optimal_mapping(&costs, limits, 40.0);
            let sum: f64 = mapping.iter().enumerate().map(|(x, &k)| {
                let cost = costs.at(k.into(), x);
                f64::from(if cost.is_nan() { 40.0 } else { cost })
            }).sum();
            // Five sums below 500, each rounded to 24 bits, on either way.
            let rounding = 2.0 * 5.0 * 500.0 / f64::from(1 << 24);
            prop_assert!((sum - exhaustive(&costs, &lines, step, 40.0)).abs() < rounding);
            for (x, pair) in mapping.windows(2).enumerate() {
                for tau in [-lines.tau_before(), lines.tau_after()] {
                    let end = |x: usize, k: u16| x as f64 + f64::from(k) * step * tau;
                    prop_assert!(end(x + 1, pair[1]) > end(x, pair[0]) + 1e-9);
                }
            }
        }
    }

    /// The recursion as it is written down: every origin of every candidate, in double precision.
    fn plain(costs: &CostTable, limits: OrderingLimits, unknown: f32) -> Vec<u16> {
        let (count, columns) = (costs.candidates(), costs.columns());
        let origins = |k: usize| {
            k.saturating_sub(limits.rise)..k.saturating_add(limits.fall).saturating_add(1).min(count)
        };
        let least = |sums: &[f64], window: std::ops::Range<usize>| {
            window.min_by(|&a, &b| sums[a].total_cmp(&sums[b])).unwrap()
        };
        let mut reached = vec![vec![0.0; count]];
        for x in 0..columns {
            let before = &reached[x];
            let sum = |k: usize| {
                let cost = costs.at(k, x);
                let cost = f64::from(if cost.is_nan() { unknown } else { cost });
                cost + if x == 0 { 0.0 } else { before[least(before, origins(k))] }
            };
            let sums = (0..count).map(sum).collect();
            reached.push(sums);
        }
        let mut window = 0..count;
        let mut mapping = vec![0; columns];
        for x in (0..columns).rev() {
            let k = least(&reached[x + 1], window);
            mapping[x] = k as u16;
            window = origins(k);
        }
        mapping
    }

    fn limit() -> impl Strategy<Value = usize> {
        prop_oneof![2 => 0_usize..4, 2 => 4_usize..40, 1 => Just(usize::MAX)]
    }

    proptest! {
        // Whole numbers have no rounding, so even which of equal mappings is taken must be the same.
        #[test]
        fn long_mappings_are_those_of_the_plain_recursion(
            (columns, values) in (1_usize..40, 1_usize..70).prop_flat_map(|(columns, count)| {
                let cost = prop_oneof![9 => (0_u8..30).prop_map(f32::from), 1 => Just(f32::NAN)];
                (Just(columns), prop::collection::vec(cost, columns * count))
            }),
            (fall, rise) in (limit(), limit()),
        ) {
            let costs = CostTable::from_values(columns, values);
            let limits = OrderingLimits { fall, rise };
            prop_assert_eq!(optimal_mapping(&costs, limits, 12.0), plain(&costs, limits, 12.0));
        }
    }

    #[test]
    fn limits_follow_the_reference() {
        let tau = Tau::equidistant(3).unwrap();
        let first = OrderingLimits::new(&EpiLines::new(&tau, 0, 9), 0.25);
        assert_eq!(first, OrderingLimits { fall: 3, rise: usize::MAX });
        let middle = OrderingLimits::new(&EpiLines::new(&tau, 1, 9), 0.25);
        assert_eq!(middle, OrderingLimits { fall: 7, rise: 7 });
        let last = OrderingLimits::new(&EpiLines::new(&tau, 2, 9), 1.0);
        assert_eq!(last, OrderingLimits { fall: usize::MAX, rise: 0 });
    }
}
