//! Which values the colours of a map span.

use epirig_core::grid::Grid;

/// The values of the first and the last colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueRange {
    /// Value of the darkest colour.
    pub low: f32,
    /// Value of the brightest colour.
    pub high: f32,
}

impl ValueRange {
    /// From the 1st to the 99th percentile of the known values, at least `least_span` wide; 0 to 1 if no
    /// value is known.
    pub fn of(map: &Grid<f32>, least_span: f32) -> Self {
        let percentiles = |count: usize| [0.01, 0.99].map(|share| ((count - 1) as f64 * share) as usize);
        let Some((low, high)) = of_ranks(map, percentiles) else { return NOTHING_KNOWN };
        let missing = (least_span - (high - low)).max(0.0);
        Self::between(low - 0.5 * missing, high + 0.5 * missing)
    }

    /// Three times the interquartile range of the known values around it, at least `least_span` wide, so that
    /// one near object does not take all colours. 0 to 1 if no value is known.
    pub fn of_most(map: &Grid<f32>, least_span: f32) -> Self {
        let quartiles = |count: usize| [count / 4, count * 3 / 4];
        let Some((lower, upper)) = of_ranks(map, quartiles) else { return NOTHING_KNOWN };
        let reach = (upper - lower).max(least_span / 3.0);
        Self::between(lower - reach, upper + reach)
    }

    /// Both ends finite.
    fn between(low: f32, high: f32) -> Self {
        Self { low: low.max(f32::MIN), high: high.min(f32::MAX) }
    }

    /// The smallest range around zero that holds it.
    #[must_use]
    pub fn around_zero(self) -> Self {
        let reach = self.low.abs().max(self.high.abs());
        Self { low: -reach, high: reach }
    }

    /// Width of the range; `None` if its ends are no two values.
    pub(super) fn width(&self) -> Option<f64> {
        let width = f64::from(self.high) - f64::from(self.low);
        (width.is_finite() && width > 0.0).then_some(width)
    }

    /// Place of `value` in the range: 0 at its low end, 1 at its high end; the middle if it has only one value.
    pub(in crate::report) fn share(&self, value: f32) -> f64 {
        self.width().map_or(0.5, |width| (f64::from(value) - f64::from(self.low)) / width)
    }
}

/// The range of a map without any value.
const NOTHING_KNOWN: ValueRange = ValueRange { low: 0.0, high: 1.0 };

/// The known values of two ranks, which `ranks` chooses for their number, the first not larger than the second;
/// `None` if no value is known.
fn of_ranks(map: &Grid<f32>, ranks: impl Fn(usize) -> [usize; 2]) -> Option<(f32, f32)> {
    let mut known: Vec<f32> = map.values().iter().copied().filter(|value| value.is_finite()).collect();
    if known.is_empty() {
        return None;
    }
    let [low, high] = ranks(known.len());
    let (below, &mut upper, _) = known.select_nth_unstable_by(high, f32::total_cmp);
    let lower = if low < high { *below.select_nth_unstable_by(low, f32::total_cmp).1 } else { upper };
    Some((lower, upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_those_of_the_sorted_values() {
        let values: Vec<f32> = (0..1000).map(|index| ((index * 389) % 1000) as f32).collect();
        let map = Grid::from_values(10, 100, values).unwrap();
        assert_eq!(ValueRange::of(&map, 0.05), ValueRange { low: 9.0, high: 989.0 });
        assert_eq!(ValueRange::of_most(&map, 0.05), ValueRange { low: -250.0, high: 1250.0 });
        let one = Grid::from_values(1, 2, vec![3.0, f32::NAN]).unwrap();
        assert_eq!(ValueRange::of(&one, 1.0), ValueRange { low: 2.5, high: 3.5 });
        assert_eq!(ValueRange::of(&Grid::filled(1, 2, f32::NAN), 1.0), NOTHING_KNOWN);
        let far = Grid::from_values(1, 4, vec![f32::MIN, f32::MAX, f32::INFINITY, 0.0]).unwrap();
        assert_eq!(ValueRange::of_most(&far, 0.05), ValueRange { low: f32::MIN, high: f32::MAX });
        assert_eq!(ValueRange::of_most(&far, 0.05).share(0.0), 0.5);
        let cut = ValueRange { low: -2.0, high: 0.5 };
        assert_eq!(cut.around_zero(), ValueRange { low: -2.0, high: 2.0 });
    }
}
