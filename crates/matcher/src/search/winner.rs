//! Each pixel's best candidate by itself, and its confidence.

use crate::cost::CostTable;

/// The candidate of least cost at each column; `None` where no candidate has a cost.
pub(crate) fn winners(costs: &CostTable) -> Vec<Option<u16>> {
    let mut best = vec![f32::NAN; costs.columns()];
    let mut winners = vec![None; costs.columns()];
    for k in 0..costs.candidates() {
        for (x, &cost) in costs.row(k).iter().enumerate() {
            // A comparison with NaN is false, so the first known cost must be let in by itself.
            if cost < best[x] || (best[x].is_nan() && !cost.is_nan()) {
                best[x] = cost;
                winners[x] = Some(k as u16);
            }
        }
    }
    winners
}

/// Confidence of the chosen candidate of each column against the best one at least `apart` candidates away:
/// 1 - cost / other cost, clamped to [0, 1]. NaN where either is unknown. `resolution` is the smallest
/// significant difference of costs. It is added to both, so that rounding errors of a featureless surface
/// make no winner.
pub(crate) fn confidences(costs: &CostTable, chosen: &[u16], apart: usize, resolution: f32) -> Vec<f32> {
    let mut others = vec![f32::NAN; costs.columns()];
    for k in 0..costs.candidates() {
        for (x, &cost) in costs.row(k).iter().enumerate() {
            if k.abs_diff(chosen[x].into()) >= apart {
                others[x] = others[x].min(cost);
            }
        }
    }
    let confidence = |(x, &other): (usize, &f32)| {
        let own = costs.at(chosen[x].into(), x);
        (1.0 - (own + resolution) / (other + resolution)).clamp(0.0, 1.0)
    };
    others.iter().enumerate().map(confidence).collect()
}

/// Place of the least cost around candidate `k`, in candidates from it: the vertex of the parabola through
/// three costs, less than half a candidate away, so that the order of a mapping survives. Zero at the ends of
/// the range, beside unknown costs and off minima.
pub(crate) fn parabola_vertex(costs: &CostTable, k: usize, x: usize) -> f64 {
    if k == 0 || k + 1 >= costs.candidates() {
        return 0.0;
    }
    let [before, here, after] = [costs.at(k - 1, x), costs.at(k, x), costs.at(k + 1, x)].map(f64::from);
    let curvature = before - 2.0 * here + after;
    if curvature > 0.0 { (0.5 * (before - after) / curvature).clamp(-0.499, 0.499) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_costs_never_win() {
        let nan = f32::NAN;
        let costs = CostTable::from_values(3, vec![nan, 4.0, nan, 2.0, 1.0, nan, 3.0, 9.0, nan]);
        assert_eq!(winners(&costs), [Some(1), Some(1), None]);
        let confidence = confidences(&costs, &[1, 1, 0], 1, 0.0);
        assert!((confidence[0] - (1.0 - 2.0 / 3.0)).abs() < 1e-6);
        assert!((confidence[1] - 0.75).abs() < 1e-6);
        assert!(confidence[2].is_nan());
    }

    #[test]
    fn the_vertex_of_a_parabola_is_exact() {
        let costs: Vec<f32> = (0..5).map(|k| (k as f32 - 2.2).powi(2) + 1.0).collect();
        let costs = CostTable::from_values(1, costs);
        assert!((parabola_vertex(&costs, 2, 0) - 0.2).abs() < 1e-5);
        assert_eq!(parabola_vertex(&costs, 0, 0), 0.0);
    }
}
