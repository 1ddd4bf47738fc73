//! The range and the histogram of a map.

use serde::Serialize;

use epirig_core::grid::Grid;

/// Bars of a histogram.
const BARS: usize = 256;
/// Share of the values below and above the usual range.
const TAIL: f64 = 0.005;
/// Connected pixels beyond the usual range that are a feature and not noise.
const FEATURE_PX: usize = 64;
/// The same of a coarser map, at least: two or three pixels are connected by chance.
const LEAST_FEATURE: usize = 4;
/// Values that tell the range and the histogram of a map: of more, every second, third, ... is looked at. They
/// tell a share of 0.5 % to 1 % of it.
const MOST_PX: usize = 2 << 20;

/// How the values of a map are spread.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Statistics {
    /// Pixels with a value.
    pub(super) valid: usize,
    /// Their share.
    pub(super) share_valid: f64,
    /// Range that is shown at first: from 0.5 % to 99.5 % of the values, widened to take in connected pixels
    /// beyond it. Small hollows are the result and must not be cut off.
    pub(super) low: f32,
    pub(super) high: f32,
    /// Whether it was widened.
    pub(super) widened: bool,
    /// The range of all values.
    pub(super) minimum: f32,
    pub(super) maximum: f32,
    pub(super) histogram: Histogram,
}

/// Numbers of values in bars of equal width.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Histogram {
    pub(super) low: f32,
    pub(super) high: f32,
    pub(super) counts: Vec<usize>,
}

impl Statistics {
    /// Of the known values of `map`.
    pub(super) fn of(map: &Grid<f32>) -> Self {
        let all = || map.values().iter().copied().filter(|value| value.is_finite());
        let valid = all().count();
        let share_valid = valid as f64 / map.values().len().max(1) as f64;
        let mut known: Vec<f32> = all().step_by(valid.div_ceil(MOST_PX).max(1)).collect();
        if known.is_empty() {
            let histogram = Histogram { low: 0.0, high: 1.0, counts: vec![0; BARS] };
            return Self {
                valid,
                share_valid,
                low: 0.0,
                high: 1.0,
                widened: false,
                minimum: 0.0,
                maximum: 1.0,
                histogram,
            };
        }
        let last = known.len() - 1;
        let mut at = |share: f64| {
            let index = (last as f64 * share).round() as usize;
            *known.select_nth_unstable_by(index, f32::total_cmp).1
        };
        let usual = (at(TAIL), at(1.0 - TAIL));
        let (low, high) = usual;
        let step = (1..).find(|step| map.values().len() / (step * step) <= MOST_PX).unwrap_or(1);
        let coarse = (step > 1).then(|| every(map, step));
        let told = coarse.as_ref().unwrap_or(map);
        let feature = (FEATURE_PX / (step * step)).max(LEAST_FEATURE);
        let low = features(told, feature, |value| value < low).min(low);
        let high = -features(&told.map(|value| -value), feature, |value| value < -high).min(-high);
        let (minimum, maximum) =
            (all().fold(f32::INFINITY, f32::min), all().fold(f32::NEG_INFINITY, f32::max));
        let histogram = Histogram::of(&known, low, high, (minimum, maximum));
        let widened = (low, high) != usual;
        Self { valid, share_valid, low, high, widened, minimum, maximum, histogram }
    }
}

impl Histogram {
    /// Of `values`, whose ends are `ends`, from half the range below `low` to half above `high`, as far as there
    /// are any; values beyond are in the end bars.
    fn of(values: &[f32], low: f32, high: f32, ends: (f32, f32)) -> Self {
        let reach = 0.5 * (high - low);
        let (low, high) = ((low - reach).max(ends.0), (high + reach).min(ends.1));
        let mut counts = vec![0; BARS];
        let scale = BARS as f32 / (high - low);
        for value in values {
            counts[(((value - low) * scale) as usize).min(BARS - 1)] += 1;
        }
        Self { low, high, counts }
    }
}

/// Every `step`th pixel of every `step`th row.
pub(super) fn every(map: &Grid<f32>, step: usize) -> Grid<f32> {
    let (rows, columns) = (map.rows().div_ceil(step), map.columns().div_ceil(step));
    let mut coarse = Grid::filled(rows, columns, f32::NAN);
    for y in 0..rows {
        let from = map.row(y * step).iter().step_by(step);
        coarse.row_mut(y).iter_mut().zip(from).for_each(|(value, from)| *value = *from);
    }
    coarse
}

/// The smallest value in connected pixels that fulfil `beyond`, of which there are more than `feature`;
/// infinite if there are none.
fn features(map: &Grid<f32>, feature: usize, beyond: impl Fn(f32) -> bool) -> f32 {
    let (rows, columns) = (map.rows(), map.columns());
    let mut open = map.map(|value| value.is_finite() && beyond(value));
    let mut least = f32::INFINITY;
    let mut waiting = Vec::new();
    for start in 0..rows * columns {
        if !open.values()[start] {
            continue;
        }
        let (mut count, mut values) = (0, Vec::new());
        waiting.push(start);
        open.values_mut()[start] = false;
        while let Some(index) = waiting.pop() {
            count += 1;
            values.push(map.values()[index]);
            let (x, y) = (index % columns, index / columns);
            let neighbours = [
                (x > 0).then(|| index - 1),
                (x + 1 < columns).then_some(index + 1),
                (y > 0).then(|| index - columns),
                (y + 1 < rows).then_some(index + columns),
            ];
            for next in neighbours.into_iter().flatten() {
                if std::mem::take(&mut open.values_mut()[next]) {
                    waiting.push(next);
                }
            }
        }
        if count > feature {
            // One wild value in a feature is none of it.
            let index = values.len() / 100;
            least = least.min(*values.select_nth_unstable_by(index, f32::total_cmp).1);
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_hollow_is_in_the_range_and_wild_pixels_are_not() {
        // 200 x 200 px of a ramp from 0 to 1, a hollow of 10 x 10 px at -3, three wild pixels.
        let mut map =
            Grid::from_values(200, 200, (0..40_000).map(|i| (i % 200) as f32 / 199.0).collect()).unwrap();
        for y in 50..60 {
            map.row_mut(y)[70..80].fill(-3.0);
        }
        for (y, value) in [(3, 900.0), (90, -700.0), (150, f32::NAN)] {
            map.row_mut(y)[20] = value;
        }
        let found = Statistics::of(&map);
        assert_eq!(found.valid, 39_999);
        assert_eq!((found.low, found.minimum, found.maximum), (-3.0, -700.0, 900.0));
        assert!(found.widened);
        assert!((0.99..=1.0).contains(&found.high), "{found:?}");
        assert_eq!(found.histogram.counts.iter().sum::<usize>(), 39_999);
    }

    #[test]
    fn of_a_large_map_some_pixels_tell_the_range_and_all_tell_the_ends() {
        let (rows, columns) = (1500, 5000);
        let values = (0..rows * columns).map(|index| (index % columns) as f32 / 4999.0).collect();
        let mut map = Grid::from_values(rows, columns, values).unwrap();
        map.row_mut(701)[20] = -700.0;
        map.row_mut(701)[21] = f32::NAN;
        for y in 50..100 {
            map.row_mut(y)[70..120].fill(-3.0);
        }
        let found = Statistics::of(&map);
        assert_eq!((found.valid, found.minimum, found.maximum), (rows * columns - 1, -700.0, 1.0));
        assert_eq!(found.low, -3.0);
        assert!((0.99..=1.0).contains(&found.high), "{found:?}");
    }

    #[test]
    fn values_at_the_end_of_a_map_are_not_beyond_its_range() {
        // Three quarters are 0, as of a map of confidences, and the rest goes up to 1.
        let values = (0..40_000).map(|index| (index % 200 - 150).max(0) as f32 / 49.0).collect();
        let found = Statistics::of(&Grid::from_values(200, 200, values).unwrap());
        assert_eq!(found.low, 0.0);
        assert_eq!((found.histogram.low, found.histogram.high), (0.0, 1.0));
        assert!(found.histogram.counts[0] >= 30_000);
    }

    #[test]
    fn no_values_and_equal_values_have_a_range() {
        let none = Statistics::of(&Grid::filled(3, 3, f32::NAN));
        assert_eq!((none.valid, none.low, none.high), (0, 0.0, 1.0));
        let equal = Statistics::of(&Grid::filled(30, 30, 2.5));
        assert_eq!((equal.low, equal.high), (2.5, 2.5));
        assert_eq!(equal.histogram.counts.iter().sum::<usize>(), 900);
    }
}
