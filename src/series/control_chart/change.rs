//! Where the mean of a process has changed.

use serde::Serialize;

/// A change this seldom by chance is told.
const BY_CHANCE: f64 = 0.01;

/// What the logarithm of the likelihood may lose within the range of places that holds the true one with 95 % coverage.
///
/// Beside the true place the logarithm is a random walk, whose maximum exceeds c with at most the probability exp(-c)
/// on each side: (1 - exp(-c))^2 = 0.95 (Siegmund 1988, without his correction for the overshoot, so on the safe side).
const LOST_95: f64 = 3.676;

/// A change of the mean.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Change {
    /// Number of the first value after it, from 0.
    pub first: usize,
    /// Its earliest place, with 95 % coverage for one change at once.
    pub earliest: usize,
    /// Its latest place.
    pub latest: usize,
    /// Mean of the values before.
    pub before: f64,
    /// Mean of the values from `first` on.
    pub after: f64,
    /// How often a steady process looks like this, or more so (Pettitt 1979).
    pub probability_by_chance: f64,
}

impl Change {
    /// The change of finite values; `None` if a steady process looks like this more often than once in a hundred.
    ///
    /// Whether there is one is decided by ranks, which do not care for outliers: Pettitt's test, p = 2 exp(-6 K^2 /
    /// (n^3 + n^2)). Where it is, by the likelihood of two means with one standard deviation.
    pub(super) fn of(values: &[f64]) -> Option<Self> {
        let n = values.len();
        let probability_by_chance = by_chance(values);
        if probability_by_chance >= BY_CHANCE {
            return None;
        }
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        let means =
            |first: usize| (sum(&values[..first]) / first as f64, sum(&values[first..]) / (n - first) as f64);
        let squares = |first: usize| {
            let (before, after) = means(first);
            let about = |values: &[f64], mean: f64| values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
            about(&values[..first], before) + about(&values[first..], after)
        };
        let rest: Vec<(usize, f64)> = (1..n).map(|first| (first, squares(first))).collect();
        let &(first, least) = rest.iter().min_by(|one, other| one.1.total_cmp(&other.1))?;
        let is_near = |&&(_, squares): &&(usize, f64)| {
            // Where the two means leave nothing, all other places are ruled out.
            squares <= least || 0.5 * n as f64 * (squares / least).ln() <= LOST_95
        };
        let earliest = rest.iter().find(is_near)?.0;
        let latest = rest.iter().rfind(is_near)?.0;
        let (before, after) = means(first);
        Some(Self { first, earliest, latest, before, after, probability_by_chance })
    }
}

/// The probability of Pettitt's test, at most 1.
fn by_chance(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    // U of the first k values is the sum of the signs of all differences between these and the others.
    let mut u = 0.0_f64;
    let mut largest = 0.0_f64;
    for &value in values {
        let sign = |other: &f64| match value.total_cmp(other) {
            std::cmp::Ordering::Less => -1.0,
            std::cmp::Ordering::Equal => 0.0,
            std::cmp::Ordering::Greater => 1.0,
        };
        u += values.iter().map(sign).sum::<f64>();
        largest = largest.max(u.abs());
    }
    (2.0 * (-6.0 * largest.powi(2) / (n.powi(3) + n.powi(2))).exp()).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::super::tests::normal;
    use super::*;

    #[test]
    fn the_test_is_that_of_pettitt() {
        // Of 1 to 20 in their order, K is 10 x 10 at the middle: p = 2 exp(-6 x 10^4 / 8400).
        let rising: Vec<f64> = (1..=20).map(f64::from).collect();
        assert!((by_chance(&rising) - 2.0 * (-60_000.0_f64 / 8400.0).exp()).abs() < 1e-12);
        assert_eq!(by_chance(&[1.0, 1.0, 1.0]), 1.0);
    }

    #[test]
    fn a_clear_step_is_found_where_it_is() {
        let mut values = vec![1.0; 12];
        values.extend([2.0; 20]);
        let change = Change::of(&values).unwrap();
        assert_eq!((change.first, change.earliest, change.latest), (12, 12, 12));
        assert_eq!((change.before, change.after), (1.0, 2.0));
    }

    /// Steps of several sizes and places: the range of places holds the true one as often as stated.
    #[test]
    fn the_range_of_places_holds_the_true_one() {
        for (step, first, count) in [(1.0, 100, 200), (2.0, 30, 200), (1.5, 25, 50), (-3.0, 150, 200)] {
            let runs = 400;
            let (mut told, mut inside) = (0, 0);
            for seed in 0..runs {
                let mut values = normal(5000 + seed, count);
                values[first..].iter_mut().for_each(|value| *value += step);
                let Some(change) = Change::of(&values) else { continue };
                told += 1;
                inside += usize::from((change.earliest..=change.latest).contains(&first));
            }
            // Four standard deviations of a count with 5 % outside.
            let least = 0.95 * f64::from(told) - 4.0 * (0.05 * 0.95 * f64::from(told)).sqrt();
            assert!(told as u64 > runs / 2 && inside as f64 >= least, "{step}: {inside} of {told}");
        }
    }

    #[test]
    fn a_steady_process_with_outliers_has_no_change() {
        let runs = 400;
        let found = |seed: &u64| {
            let mut values = normal(9000 + seed, 200);
            values[5] = 40.0;
            values[190] = -40.0;
            Change::of(&values).is_some()
        };
        let told = (0..runs).filter(found).count() as f64;
        // One in a hundred by chance, and four standard deviations.
        let most = 0.01 * runs as f64 + 4.0 * (0.01 * runs as f64).sqrt();
        assert!(told <= most, "{told} of {runs}");
    }
}
