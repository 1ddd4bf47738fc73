//! Each pixel's best candidate by itself, and its confidence.

use fearless_simd::{Level, dispatch};

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

/// Confidence of the chosen candidate of each column against its rivals: the candidates at least `separation`
/// away.
pub(crate) fn confidences(costs: &CostTable, chosen: &[u16], separation: usize, resolution: f32) -> Vec<f32> {
    let mut rivals = vec![f32::INFINITY; costs.columns()];
    let (level, separation) = (Level::new(), separation as i32);
    for k in 0..costs.candidates() {
        dispatch!(level, _simd => keep_rivals(costs.row(k), chosen, k as i32, separation, &mut rivals));
    }
    let of_column = |(x, &rival): (usize, &f32)| confidence(costs.at(chosen[x].into(), x), rival, resolution);
    rivals.iter().enumerate().map(of_column).collect()
}

/// `least = min(least, values)` where candidate `k` lies at least `separation` from the chosen one; unknown
/// values are no rivals.
#[inline(always)]
fn keep_rivals(values: &[f32], chosen: &[u16], k: i32, separation: i32, least: &mut [f32]) {
    let count = values.len();
    let (chosen, least) = (&chosen[..count], &mut least[..count]);
    for i in 0..count {
        let rival = (k - i32::from(chosen[i])).abs() >= separation && values[i] < least[i];
        least[i] = if rival { values[i] } else { least[i] };
    }
}

/// How much better a candidate of this cost is than its best rival: 1 - cost / rival, clamped to [0, 1]; NaN
/// without a cost or a rival (infinite). `resolution` is the smallest significant difference of costs. It is
/// added to both, so that rounding errors of a featureless surface make no winner.
pub(super) fn confidence(cost: f32, rival: f32, resolution: f32) -> f32 {
    if rival == f32::INFINITY {
        return f32::NAN;
    }
    (1.0 - (cost + resolution) / (rival + resolution)).clamp(0.0, 1.0)
}

/// Place of the least cost around candidate `k`, in candidates from it; zero at the ends of the range.
pub(crate) fn parabola_vertex(costs: &CostTable, k: usize, x: usize) -> f64 {
    if k == 0 || k + 1 >= costs.candidates() {
        return 0.0;
    }
    vertex([costs.at(k - 1, x), costs.at(k, x), costs.at(k + 1, x)])
}

/// The vertex of the parabola through three costs: less than half a candidate from the middle one, so that
/// the order of a mapping survives. Zero beside unknown costs and off minima.
pub(super) fn vertex(costs: [f32; 3]) -> f64 {
    let [before, here, after] = costs.map(f64::from);
    let curvature = before - 2.0 * here + after;
    if curvature > 0.0 && curvature.is_finite() {
        (0.5 * (before - after) / curvature).clamp(-0.499, 0.499)
    } else {
        0.0
    }
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
