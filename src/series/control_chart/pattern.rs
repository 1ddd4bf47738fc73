//! What a steady process seldom shows.

use epirig_core::choice::Choice as _;

/// What values are compared with, in their unit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Levels {
    pub(super) centre: f64,
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) upper_range: f64,
}

epirig_core::choices! {
    /// A pattern of values that has a special cause rather than chance.
    ///
    /// The first four are the tests 1 to 4 of Nelson (1984), whom ISO 7870-2 follows; the fifth is the limit of the moving
    /// range. Of a steady process about two values in a hundred end one of them. Nelson's other four tests make twice as
    /// many false alarms, or concern means of groups.
    pub enum Pattern {
        /// A value beyond the limits of three standard deviations.
        BeyondLimits = "beyond-limits",
        /// Nine values in a row on one side of the mean.
        OneSide = "one-side",
        /// Six values in a row that all rise, or all fall.
        Trend = "trend",
        /// Fourteen values in a row that rise and fall by turns.
        Alternating = "alternating",
        /// A difference from the value before that is beyond the limit of the moving range.
        Jump = "jump",
    }
}

impl Pattern {
    /// What it is, in a few words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::BeyondLimits => "beyond three standard deviations",
            Self::OneSide => "nine in a row on one side of the mean",
            Self::Trend => "six in a row that rise or fall",
            Self::Alternating => "fourteen in a row that rise and fall by turns",
            Self::Jump => "too far from the one before",
        }
    }

    /// Those that the last of `values` ends.
    pub(super) fn all_that_end(values: &[f64], levels: Levels) -> Vec<Self> {
        Self::ALL.iter().copied().filter(|pattern| pattern.ends(values, levels)).collect()
    }

    /// Whether the last of `values` ends such a pattern.
    fn ends(self, values: &[f64], levels: Levels) -> bool {
        let last = |count: usize| values.len().checked_sub(count).map(|first| &values[first..]);
        let differences = |count: usize| {
            last(count).map(|run| run.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>())
        };
        let one_sign = |values: &[f64]| values.iter().all(|v| *v > 0.0) || values.iter().all(|v| *v < 0.0);
        match self {
            Self::BeyondLimits => {
                values.last().is_some_and(|&value| value < levels.lower || value > levels.upper)
            }
            Self::OneSide => last(9).is_some_and(|run| {
                one_sign(&run.iter().map(|value| value - levels.centre).collect::<Vec<f64>>())
            }),
            Self::Trend => differences(6).is_some_and(|run| one_sign(&run)),
            Self::Alternating => {
                differences(14).is_some_and(|run| run.windows(2).all(|pair| pair[0] * pair[1] < 0.0))
            }
            Self::Jump => differences(2).is_some_and(|run| run[0].abs() > levels.upper_range),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Patterns that each value ends, on a chart with mean 0 and standard deviation 1.
    fn patterns(values: &[f64]) -> Vec<Vec<Pattern>> {
        let levels = Levels { centre: 0.0, lower: -3.0, upper: 3.0, upper_range: 3.685 };
        let ended = |count: usize| Pattern::all_that_end(&values[..count], levels);
        (1..=values.len()).map(ended).collect()
    }

    /// The first value that ends the pattern, and how many do.
    fn ends(pattern: Pattern, values: &[f64]) -> (Option<usize>, usize) {
        let found = patterns(values);
        let at = |list: &Vec<Pattern>| list.contains(&pattern);
        (found.iter().position(at), found.iter().filter(|list| at(list)).count())
    }

    #[test]
    fn a_value_beyond_the_limits_is_told_and_one_at_them_is_not() {
        let values = [0.0, 3.0, -3.0, 3.1, 0.0];
        assert_eq!(ends(Pattern::BeyondLimits, &values), (Some(3), 1));
        // From 0 to 3 is within the range's limit; from 3 to -3, and on to 3.1, is not.
        assert_eq!(ends(Pattern::Jump, &values), (Some(2), 2));
    }

    #[test]
    fn the_ninth_on_one_side_is_told() {
        let mut values = vec![0.5; 8];
        assert_eq!(ends(Pattern::OneSide, &values), (None, 0));
        values.extend([0.1, 0.1]);
        assert_eq!(ends(Pattern::OneSide, &values), (Some(8), 2));
        values[4] = 0.0;
        assert_eq!(ends(Pattern::OneSide, &values), (None, 0));
        let low: Vec<f64> = values.iter().map(|_| -0.5).collect();
        assert_eq!(ends(Pattern::OneSide, &low), (Some(8), 2));
    }

    #[test]
    fn the_sixth_that_rises_or_falls_is_told() {
        let rising: Vec<f64> = (0..7).map(|n| 0.1 * f64::from(n)).collect();
        assert_eq!(ends(Pattern::Trend, &rising), (Some(5), 2));
        let falling: Vec<f64> = rising.iter().map(|value| -value).collect();
        assert_eq!(ends(Pattern::Trend, &falling), (Some(5), 2));
        let mut halted = rising;
        halted[3] = halted[2];
        assert_eq!(ends(Pattern::Trend, &halted), (None, 0));
    }

    #[test]
    fn the_fourteenth_of_those_that_alternate_is_told() {
        let mut values: Vec<f64> = (0..14).map(|n| if n % 2 == 0 { 0.2 } else { -0.2 }).collect();
        assert_eq!(ends(Pattern::Alternating, &values), (Some(13), 1));
        values[7] = 0.3;
        assert_eq!(ends(Pattern::Alternating, &values), (None, 0));
    }
}
