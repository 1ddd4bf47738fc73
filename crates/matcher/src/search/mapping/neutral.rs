//! The cost of a candidate that has none, because it leaves the image.

use epirig_core::statistics::upper_median;
use fearless_simd::{Level, Simd, dispatch};

use crate::cost::CostTable;

/// The neutral cost, for candidates without a cost: halfway between the cost of a right candidate in this EPI
/// and that of any candidate (medians over columns).
///
/// So a right candidate in view is preferred to an unknown one, and an unknown one to a wrong one. `None` if
/// no candidate has a cost.
pub(crate) fn neutral_cost(costs: &CostTable) -> Option<f32> {
    let columns = costs.columns();
    let mut least = vec![f32::INFINITY; columns];
    let mut sums = vec![0.0; columns];
    let mut known = vec![0.0; columns];
    let level = Level::new();
    for k in 0..costs.candidates() {
        dispatch!(level, simd => add_row(simd, costs.row(k), &mut least, &mut sums, &mut known));
    }
    let mut typical: Vec<f32> =
        sums.iter().zip(&known).filter(|&(_, &known)| known > 0.0).map(|(sum, known)| sum / known).collect();
    least.retain(|least| least.is_finite());
    Some(0.5 * (upper_median(&mut least)? + upper_median(&mut typical)?))
}

/// Adds one candidate to each column's least cost, sum of costs and number of costs.
#[inline(always)]
fn add_row<S: Simd>(_simd: S, costs: &[f32], least: &mut [f32], sums: &mut [f32], known: &mut [f32]) {
    let columns = costs.len();
    let (least, sums, known) = (&mut least[..columns], &mut sums[..columns], &mut known[..columns]);
    for x in 0..columns {
        let cost = costs[x];
        // A comparison with NaN is false.
        least[x] = if cost < least[x] { cost } else { least[x] };
        sums[x] += if cost.is_nan() { 0.0 } else { cost };
        known[x] += if cost.is_nan() { 0.0 } else { 1.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lies_between_right_candidates_and_any() {
        let nan = f32::NAN;
        // Least costs by column 1, 2, 3 and none; means 2, 4, 5 and none.
        let costs =
            CostTable::from_values(4, vec![1.0, nan, 3.0, nan, 2.0, 6.0, 7.0, nan, 3.0, 2.0, nan, nan]);
        assert_eq!(neutral_cost(&costs), Some(3.0));
        assert_eq!(neutral_cost(&CostTable::from_values(2, vec![nan; 6])), None);
    }
}
