//! Control charts of single values (Shewhart): whether a process is steady, and where it is not.

mod change;
mod pattern;

pub use change::Change;
pub use pattern::Pattern;

use pattern::Levels;
use serde::Serialize;

/// Mean range of two values of a normal distribution, in standard deviations (ISO 7870-2:2013, d2 for two values).
const D2: f64 = 1.128;
/// Upper limit of the moving range, in mean ranges (ISO 7870-2:2013, D4 for two values).
const D4: f64 = 3.267;

/// A chart of single values and of their moving ranges (ISO 7870-2:2013).
///
/// Limits stand three standard deviations beside the mean. The standard deviation comes from the differences of
/// neighbours, so that a drift does not widen its own limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ControlChart {
    /// Number of values, from the first, that the limits are made of.
    pub baseline: usize,
    /// Mean of these, in the unit of the values.
    pub centre: f64,
    /// Standard deviation of a value by the differences of neighbours.
    pub sigma: f64,
    /// Lower limit: `centre` - 3 `sigma`.
    pub lower: f64,
    /// Upper limit: `centre` + 3 `sigma`.
    pub upper: f64,
    /// Mean of the moving ranges.
    pub mean_range: f64,
    /// Upper limit of the moving ranges.
    pub upper_range: f64,
    /// Every value, in its order.
    pub points: Vec<ChartPoint>,
    /// Where the mean has changed; `None` if that may be chance.
    pub change: Option<Change>,
}

/// A value of a control chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChartPoint {
    /// The value.
    pub value: f64,
    /// Its difference from the one before, without sign; `None` for the first.
    pub moving_range: Option<f64>,
    /// What a steady process seldom shows, and ends with this value.
    pub patterns: Vec<Pattern>,
}

impl ControlChart {
    /// Of finite values in their order; the first `baseline` of them, or all, make the limits. `None` for fewer than
    /// two.
    pub fn of(values: &[f64], baseline: Option<usize>) -> Option<Self> {
        let baseline = baseline.unwrap_or(values.len()).min(values.len());
        if baseline < 2 || !values.iter().all(|value| value.is_finite()) {
            return None;
        }
        let ranges: Vec<f64> = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (centre, mean_range) = (mean(&values[..baseline]), mean(&ranges[..baseline - 1]));
        let sigma = mean_range / D2;
        let (lower, upper, upper_range) = (centre - 3.0 * sigma, centre + 3.0 * sigma, D4 * mean_range);
        let levels = Levels { centre, lower, upper, upper_range };
        let is_constant = ranges.iter().all(|range| *range == 0.0);
        let point = |(index, &value): (usize, &f64)| ChartPoint {
            value,
            moving_range: index.checked_sub(1).map(|before| ranges[before]),
            // The mean of equal values differs from them by rounding.
            patterns: match is_constant {
                true => Vec::new(),
                false => Pattern::all_that_end(&values[..=index], levels),
            },
        };
        let points = values.iter().enumerate().map(point).collect();
        let change = Change::of(values);
        Some(Self { baseline, centre, sigma, lower, upper, mean_range, upper_range, points, change })
    }

    /// Numbers of the values that end a pattern.
    pub fn conspicuous(&self) -> impl Iterator<Item = usize> {
        self.points.iter().enumerate().filter(|(_, point)| !point.patterns.is_empty()).map(|(index, _)| index)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    pub(super) fn normal(seed: u64, count: usize) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    #[test]
    fn limits_are_those_of_the_standard_s_constants() {
        // Differences 2, 1 and 3: their mean is 2, and the limits stand 2.66 of it beside the mean of 2.5 (E2 of the
        // standard is 3 / d2).
        let chart = ControlChart::of(&[1.0, 3.0, 4.0, 1.0], None).unwrap();
        assert_eq!((chart.centre, chart.mean_range, chart.upper_range), (2.25, 2.0, 6.534));
        assert!((chart.upper - (2.25 + 2.66 * 2.0)).abs() < 2e-3 && (chart.lower + 3.07).abs() < 2e-3);
        assert_eq!(chart.points[0].moving_range, None);
        assert_eq!(chart.points[3].moving_range, Some(3.0));
    }

    #[test]
    fn limits_of_the_first_values_know_nothing_of_the_others() {
        let mut values = normal(1, 40);
        let before = ControlChart::of(&values[..20], None).unwrap();
        values[20..].iter_mut().for_each(|value| *value += 10.0);
        let chart = ControlChart::of(&values, Some(20)).unwrap();
        assert_eq!((chart.centre, chart.sigma, chart.baseline), (before.centre, before.sigma, 20));
        assert!(chart.points[20..].iter().all(|point| point.patterns.contains(&Pattern::BeyondLimits)));
    }

    #[test]
    fn a_drift_does_not_widen_its_own_limits() {
        let steady = normal(2, 200);
        let drifting: Vec<f64> =
            steady.iter().enumerate().map(|(n, value)| value + 0.02 * n as f64).collect();
        let sigma = |values: &[f64]| ControlChart::of(values, None).unwrap().sigma;
        assert!((sigma(&drifting) / sigma(&steady) - 1.0).abs() < 0.02);
    }

    #[test]
    fn too_few_values_have_no_chart_and_equal_ones_are_steady() {
        assert_eq!(ControlChart::of(&[], None), None);
        assert_eq!(ControlChart::of(&[1.0], None), None);
        assert_eq!(ControlChart::of(&[1.0, f64::NAN], None), None);
        assert_eq!(ControlChart::of(&[1.0, 2.0, 3.0], Some(1)), None);
        let equal = ControlChart::of(&[0.1; 30], None).unwrap();
        assert_eq!((equal.conspicuous().count(), equal.change.as_ref()), (0, None));
    }

    /// Nelson (1984) has one value in 100 for his tests 1 to 4; the limit of the moving range adds 0.9 % (three standard
    /// deviations of a half-normal distribution, as limits stand there by D4), and estimated limits a little.
    #[test]
    fn a_steady_process_seldom_shows_a_pattern() {
        let runs = 300;
        let count = |seed: u64| ControlChart::of(&normal(seed, 200), None).unwrap().conspicuous().count();
        let found: usize = (0..runs).map(count).sum();
        let share = found as f64 / (200 * runs) as f64;
        assert!((0.01..0.03).contains(&share), "{share}");
    }

    #[test]
    fn a_step_of_one_sigma_amid_200_values_is_told_with_its_place() {
        let runs = 200;
        let (mut told, mut inside, mut marked) = (0, 0, 0);
        for seed in 0..runs {
            let mut values = normal(1000 + seed, 200);
            values[100..].iter_mut().for_each(|value| *value += 1.0);
            let chart = ControlChart::of(&values, None).unwrap();
            marked += usize::from(chart.conspicuous().any(|index| index >= 100));
            if let Some(change) = chart.change {
                told += 1;
                inside += usize::from((change.earliest..=change.latest).contains(&100));
                assert!((change.after - change.before - 1.0).abs() < 0.8, "{change:?}");
            }
        }
        assert_eq!(told, runs, "told");
        // 95 % wanted, less three standard deviations of a count of 200.
        assert!(inside >= 180, "{inside} of {runs}");
        assert!(marked > 190, "{marked} of {runs}");
    }
}
