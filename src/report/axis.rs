//! An axis of a chart, whatever the values: its ends, its ticks, and where a value lies on it.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};

/// Values that differ by less than this share of their size are equal but for rounding: 32 bit numbers tell apart
/// 6e-8 of it.
const RESOLUTION: f64 = 1e-9;
/// Air at both ends, as a share of the span of the values.
const AIR: f64 = 0.04;
/// What lies beyond is drawn at the end, so that no difference overflows.
const FARTHEST: f64 = 1e300;
/// Labels have at most this many decimals and digits before them; else they have an exponent.
const MOST_DECIMALS: f64 = 6.0;
const MOST_DIGITS: f64 = 9.0;

/// A straight axis; its ends are finite and differ by more than rounding. Plotters' own axes never end to look for
/// ticks if one of their ends is infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    first: f64,
    last: f64,
}

impl Axis {
    /// From the least to the greatest of the finite `values` with a margin, at least `least` wide; 0 to 1 without
    /// any.
    pub(super) fn around(values: impl Iterator<Item = f64>, least: f64) -> Self {
        let known = values.filter(|value| value.is_finite()).map(|value| value.clamp(-FARTHEST, FARTHEST));
        let ends = known.fold(None, |ends: Option<(f64, f64)>, value| {
            let (low, high) = ends.unwrap_or((value, value));
            Some((low.min(value), high.max(value)))
        });
        let Some((low, high)) = ends else { return Self { first: 0.0, last: 1.0 } };
        let (width, resolved) = (high - low, resolved(low, high));
        let air = if width > resolved { AIR * width } else { (2.0 * resolved).max(0.5) };
        let missing = 0.5 * (least - width - 2.0 * air).max(0.0);
        Self::between(low - air - missing, high + air + missing)
    }

    /// From `first` to `last`, which may be the lower one; 0 to 1 if they are no two finite values.
    pub(super) fn between(first: f64, last: f64) -> Self {
        let (first, last) = (first.clamp(-FARTHEST, FARTHEST), last.clamp(-FARTHEST, FARTHEST));
        match (last - first).abs() > resolved(first, last) {
            true => Self { first, last },
            false => Self { first: 0.0, last: 1.0 },
        }
    }

    /// The place at this share of the axis, from 0 to 1.
    pub(super) fn at(self, share: f64) -> f64 {
        (1.0 - share) * self.first + share * self.last
    }

    /// Writes a tick with enough digits to tell it from the next.
    pub(super) fn tick_format(self) -> impl Fn(&f64) -> String + use<> {
        let width = (self.last - self.first).abs().log10();
        let digits = self.first.abs().max(self.last.abs()).log10();
        let decimals = (1.0 - width).ceil().max(0.0);
        let plain = decimals <= MOST_DECIMALS && digits < MOST_DIGITS;
        let decimals = if plain { decimals } else { (digits - width + 1.0).ceil().clamp(0.0, MOST_DIGITS) };
        move |tick| {
            let decimals = decimals as usize;
            let text = if plain { format!("{tick:.decimals$}") } else { format!("{tick:.decimals$e}") };
            // A tick that is zero except for rounding has no sign.
            let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
            if zero { text.trim_start_matches('-').to_owned() } else { text }
        }
    }
}

/// The largest difference of two values that is rounding.
fn resolved(one: f64, other: f64) -> f64 {
    RESOLUTION * one.abs().max(other.abs())
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let share = (value.clamp(-FARTHEST, FARTHEST) - self.first) / (self.last - self.first);
        first + (share.clamp(0.0, 1.0) * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let most = hint.max_num_points();
        let (low, high) = (self.first.min(self.last), self.first.max(self.last));
        let apart = (high - low) / most.max(1) as f64;
        let of_step = |factor: f64| round_ticks(low, high, factor * apart).0;
        let fitting = [1.0, 2.0, 4.0].into_iter().map(of_step).find(|ticks| ticks.len() <= most);
        fitting.unwrap_or_default()
    }

    fn range(&self) -> Range<f64> {
        self.first..self.last
    }
}

/// Round values from `low` to `high` at least `apart` from each other, with the decimals that tell them apart; none
/// if the ends are not finite or not in this order.
pub(super) fn round_ticks(low: f64, high: f64, apart: f64) -> (Vec<f64>, usize) {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return (Vec::new(), 0);
    }
    let (step, decimals) = round_step(apart);
    let first = (low / step - 1e-9).ceil();
    // Not from one tick to the next: a step that is small beside its place may not change it.
    let count = ((high + 1e-9 * span) / step - first).floor() + 1.0;
    let ticks = (0..count.max(0.0) as usize).map(|index| {
        let place = first + index as f64;
        // Zero has no sign.
        if place == 0.0 { 0.0 } else { place * step }
    });
    (ticks.collect(), decimals)
}

/// The round number at or above `least`: 1, 2 or 5 times a power of ten, with its decimals.
fn round_step(least: f64) -> (f64, usize) {
    let least = least.max(f64::MIN_POSITIVE);
    let decade = 10.0_f64.powf(least.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * decade).find(|&step| step >= least * 0.999);
    let step = step.unwrap_or(10.0 * decade);
    (step, (-(step * 1.001).log10().floor()).clamp(0.0, 9.0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_apart() {
        assert_eq!(round_step(1.0), (1.0, 0));
        assert_eq!(round_step(0.015).1, 2);
        assert!((round_step(0.015).0 - 0.02).abs() < 1e-12);
        assert_eq!(round_step(30.0), (50.0, 0));
        assert_eq!(round_ticks(-0.1, 0.1, 0.06), (vec![-0.1, 0.0, 0.1], 1));
        assert_eq!(round_ticks(1.0, 1.0, 0.1).0, Vec::<f64>::new());
        assert_eq!(round_ticks(0.0, f64::NAN, 0.1).0, Vec::<f64>::new());
        assert_eq!(
            Axis::between(-0.5, 99.5).key_points(11),
            vec![0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0]
        );
    }

    #[test]
    fn ticks_have_no_negative_zero() {
        let format = Axis::between(-0.05, 0.05).tick_format();
        assert_eq!((format(&-1e-18), format(&-0.02)), ("0.00".to_owned(), "-0.02".to_owned()));
    }

    #[test]
    fn ticks_of_very_small_and_very_large_values_differ() {
        for (low, high) in [(0.0, 3e-12), (1e12, 1.000_001e12), (-1e300, 1e300), (5e8, 5e8 + 4.0)] {
            let axis = Axis::between(low, high);
            let labels: Vec<String> = axis.key_points(11).iter().map(axis.tick_format()).collect();
            let different: std::collections::HashSet<&String> = labels.iter().collect();
            assert!(labels.len() > 3 && different.len() == labels.len(), "{labels:?}");
        }
    }

    #[test]
    fn an_axis_around_values_holds_them_all_and_is_as_wide_as_asked() {
        assert_eq!(Axis::around([0.0, f64::NAN, 100.0].into_iter(), 0.0), Axis { first: -4.0, last: 104.0 });
        assert_eq!(Axis::around([10.0, 10.0].into_iter(), 0.0), Axis { first: 9.5, last: 10.5 });
        assert_eq!(Axis::around([10.0].into_iter(), 4.0), Axis { first: 8.0, last: 12.0 });
        assert_eq!(Axis::around([f64::INFINITY].into_iter(), 4.0), Axis { first: 0.0, last: 1.0 });
        let far = Axis::around([1e16, 1e16 + 2.0].into_iter(), 0.0);
        assert!(far.first < 1e16 && far.last > 1e16 + 2.0);
        let all = Axis::around([f64::MIN, f64::MAX].into_iter(), 0.0);
        assert_eq!(
            (all.map(&f64::MIN, (0, 100)), all.map(&0.0, (0, 100)), all.map(&f64::MAX, (0, 100))),
            (0, 50, 100)
        );
    }
}
