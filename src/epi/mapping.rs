//! The optimal strictly increasing mapping of an EPI, by dynamic programming (paper, section 4).
//!
//! Every column of the reference frame is given one hypothesis so that the sum of the costs is least, under the condition
//! that points keep their order: both the column in the first frame and the column in the last increase strictly from one
//! reference column to the next. With reference position tau_r and disparities d, d' of neighbouring columns this says
//!
//! ```text
//! last frame:   1 + (d' - d) (1 - tau_r) > 0,   so d' - d > -1 / (1 - tau_r)
//! first frame:  1 - (d' - d) tau_r       > 0,   so d' - d <  1 / tau_r
//! ```

use super::cost::CostTable;
use super::lines::Lines;

/// How far the hypothesis may fall and rise from one column to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OrderingLimits {
    /// Largest fall, in hypotheses.
    pub fall: usize,
    /// Largest rise, in hypotheses.
    pub rise: usize,
}

impl OrderingLimits {
    /// The limits that keep the order of points in the first and the last frame, for hypotheses `raster_px` apart.
    pub fn new(lines: &Lines, raster_px: f64) -> Self {
        // The largest whole number strictly below 1 / (share * raster); a share of zero sets no limit.
        let strictly_below = |share: f64| {
            let limit = 1.0 / (share * raster_px);
            if limit.is_finite() { ((limit - 1e-9).ceil() as usize).saturating_sub(1) } else { usize::MAX }
        };
        Self { fall: strictly_below(lines.tau_after()), rise: strictly_below(lines.tau_before()) }
    }
}

/// The hypothesis of each column on the cheapest strictly increasing mapping.
///
/// A candidate without cost (NaN) counts `unknown_cost`, so that a point may leave the image without bending the mapping
/// of those that stay. The time is proportional to columns x hypotheses.
pub fn optimal_mapping(costs: &CostTable, limits: OrderingLimits, unknown_cost: f32) -> Vec<u16> {
    let (count, columns) = (costs.hypotheses(), costs.columns());
    let by_column = transposed(costs);
    let cost = |k: usize, x: usize| {
        let cost = by_column[x * count + k];
        f64::from(if cost.is_nan() { unknown_cost } else { cost })
    };
    let mut best: Vec<f64> = (0..count).map(|k| cost(k, 0)).collect();
    let mut next = vec![0.0; count];
    let mut origins = vec![0_u16; count * columns];
    let mut window = SlidingMinimum::default();
    for x in 1..columns {
        window.restart();
        let mut entered = 0;
        for k in 0..count {
            // Origins k - rise ..= k + fall.
            let end = k.saturating_add(limits.fall).saturating_add(1).min(count);
            while entered < end {
                window.enter(entered, best[entered]);
                entered += 1;
            }
            let origin = window.minimum_from(k.saturating_sub(limits.rise));
            next[k] = best[origin] + cost(k, x);
            origins[x * count + k] = origin as u16;
        }
        std::mem::swap(&mut best, &mut next);
    }
    let mut k = (0..count).min_by(|&a, &b| best[a].total_cmp(&best[b])).unwrap_or(0);
    let mut mapping = vec![0; columns];
    for x in (0..columns).rev() {
        mapping[x] = k as u16;
        k = origins[x * count + k].into();
    }
    mapping
}

/// The costs as columns x hypotheses, copied in blocks that stay in the cache.
fn transposed(costs: &CostTable) -> Vec<f32> {
    const BLOCK: usize = 32;
    let (count, columns) = (costs.hypotheses(), costs.columns());
    let mut by_column = vec![0.0; count * columns];
    for start in (0..columns).step_by(BLOCK) {
        let end = (start + BLOCK).min(columns);
        for k in 0..count {
            for (x, &cost) in (start..end).zip(&costs.row(k)[start..end]) {
                by_column[x * count + k] = cost;
            }
        }
    }
    by_column
}

/// Cost that a candidate without cost is taken to have: halfway between what a right candidate costs in this EPI and what
/// any candidate costs (medians over columns).
///
/// A right candidate in view is then preferred to an unknown one, and an unknown one to a wrong one. `None` if no candidate
/// has a cost.
pub fn neutral_cost(costs: &CostTable) -> Option<f32> {
    let (count, columns) = (costs.hypotheses(), costs.columns());
    let mut least = Vec::with_capacity(columns);
    let mut typical = Vec::with_capacity(columns);
    for x in 0..columns {
        let known = (0..count).map(|k| costs.at(k, x)).filter(|cost| !cost.is_nan());
        let (sum, number, minimum) = known.fold((0.0_f64, 0_u32, f32::INFINITY), |(sum, n, low), cost| {
            (sum + f64::from(cost), n + 1, low.min(cost))
        });
        if number > 0 {
            least.push(minimum);
            typical.push((sum / f64::from(number)) as f32);
        }
    }
    Some(0.5 * (median(&mut least)? + median(&mut typical)?))
}

fn median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// Index of the least value in a window that slides over increasing indices (Lemire 2006).
#[derive(Debug, Default)]
struct SlidingMinimum {
    candidates: std::collections::VecDeque<(usize, f64)>,
}

impl SlidingMinimum {
    fn restart(&mut self) {
        self.candidates.clear();
    }

    fn enter(&mut self, index: usize, value: f64) {
        while self.candidates.back().is_some_and(|&(_, other)| other > value) {
            self.candidates.pop_back();
        }
        self.candidates.push_back((index, value));
    }

    /// Drops indices below `first`; the window is never empty, since the column's own hypothesis has entered.
    fn minimum_from(&mut self, first: usize) -> usize {
        while self.candidates.len() > 1 && self.candidates[0].0 < first {
            self.candidates.pop_front();
        }
        self.candidates[0].0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tau::Tau;
    use proptest::prelude::*;

    /// The least sum over all strictly increasing mappings, by trying every one: the definition, not the method.
    fn exhaustive(costs: &CostTable, lines: &Lines, raster: f64, unknown: f32) -> f64 {
        fn extend(
            costs: &CostTable,
            lines: &Lines,
            raster: f64,
            unknown: f32,
            path: &mut Vec<usize>,
            sum: f64,
        ) -> f64 {
            let x = path.len();
            if x == costs.columns() {
                return sum;
            }
            let mut best = f64::INFINITY;
            for k in 0..costs.hypotheses() {
                if let Some(&previous) = path.last() {
                    let end = |x: usize, k: usize, tau: f64| x as f64 + k as f64 * raster * tau;
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
                best = best.min(extend(costs, lines, raster, unknown, path, sum + cost));
                path.pop();
            }
            best
        }
        extend(costs, lines, raster, unknown, &mut Vec::new(), 0.0)
    }

    proptest! {
        #[test]
        fn the_mapping_is_the_optimum_of_exhaustive_search_and_increases(
            values in prop::collection::vec(prop_oneof![9 => 0.0_f32..100.0, 1 => Just(f32::NAN)], 7 * 5),
            reference in 0_usize..5,
            raster in prop::sample::select(vec![0.25, 0.5, 1.0, 0.4]),
        ) {
            let lines = Lines::new(&Tau::equidistant(5).unwrap(), reference, 5);
            let costs = CostTable::from_values(5, values);
            let limits = OrderingLimits::new(&lines, raster);
            let mapping = optimal_mapping(&costs, limits, 40.0);
            let sum: f64 = mapping.iter().enumerate().map(|(x, &k)| {
                let cost = costs.at(k.into(), x);
                f64::from(if cost.is_nan() { 40.0 } else { cost })
            }).sum();
            prop_assert!((sum - exhaustive(&costs, &lines, raster, 40.0)).abs() < 1e-6);
            for (x, pair) in mapping.windows(2).enumerate() {
                for tau in [-lines.tau_before(), lines.tau_after()] {
                    let end = |x: usize, k: u16| x as f64 + f64::from(k) * raster * tau;
                    prop_assert!(end(x + 1, pair[1]) > end(x, pair[0]) + 1e-9);
                }
            }
        }
    }

    #[test]
    fn limits_follow_the_reference() {
        let tau = Tau::equidistant(3).unwrap();
        let first = OrderingLimits::new(&Lines::new(&tau, 0, 9), 0.25);
        assert_eq!(first, OrderingLimits { fall: 3, rise: usize::MAX });
        let middle = OrderingLimits::new(&Lines::new(&tau, 1, 9), 0.25);
        assert_eq!(middle, OrderingLimits { fall: 7, rise: 7 });
        let last = OrderingLimits::new(&Lines::new(&tau, 2, 9), 1.0);
        assert_eq!(last, OrderingLimits { fall: usize::MAX, rise: 0 });
    }
}
