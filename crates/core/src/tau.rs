//! The normalised positions of the frames on the baseline.

use thiserror::Error;

/// Why positions make no baseline.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TauError {
    /// Fewer than two positions: there is no baseline.
    #[error("{0} position(s) span no baseline; at least two frames are needed")]
    TooFew(usize),
    /// A position that is not a finite number.
    #[error("position {index} is {value}; give a finite number in mm")]
    NotFinite {
        /// Index of the position, from 0.
        index: usize,
        /// The value found.
        value: f64,
    },
    /// A position so large that rounding would lose the differences of others.
    #[error("position {index} is {value} mm; no stage goes farther than {FARTHEST_MM} mm: check the unit")]
    TooFar {
        /// Index of the position, from 0.
        index: usize,
        /// The value found.
        value: f64,
    },
    /// A position that does not lie beyond the one before it.
    #[error(
        "positions must increase strictly, but position {index} ({value} mm) does not exceed the one before it \
         ({previous} mm); sort the frames by position and remove doubles"
    )]
    NotIncreasing {
        /// Index of the offending position, from 0.
        index: usize,
        /// The value found.
        value: f64,
        /// The value before it.
        previous: f64,
    },
}

/// Farthest position, in mm: 1000 km, and nanometres still count there.
const FARTHEST_MM: f64 = 1e9;

/// tau of every frame: 0 for the first, 1 for the last, strictly increasing, not necessarily equidistant.
#[derive(Debug, Clone, PartialEq)]
pub struct Tau(Vec<f64>);

impl Tau {
    /// `frames` equidistant frames.
    ///
    /// # Errors
    /// [`TauError::TooFew`] for fewer than two frames.
    pub fn equidistant(frames: usize) -> Result<Self, TauError> {
        Self::from_positions(&(0..frames).map(|index| index as f64).collect::<Vec<_>>())
    }

    /// From stage positions in any unit, first frame first.
    ///
    /// # Errors
    /// [`TauError`] if there are fewer than two, or one is not finite or not beyond the one before it.
    ///
    /// ```
    /// let tau = epirig_core::tau::Tau::from_positions(&[10.0, 11.0, 14.0])?;
    /// assert_eq!(tau.values(), [0.0, 0.25, 1.0]);
    /// # Ok::<(), epirig_core::tau::TauError>(())
    /// ```
    pub fn from_positions(positions: &[f64]) -> Result<Self, TauError> {
        let (Some(&first), Some(&last)) = (positions.first(), positions.last()) else {
            return Err(TauError::TooFew(0));
        };
        if positions.len() < 2 {
            return Err(TauError::TooFew(1));
        }
        if let Some(index) = positions.iter().position(|value| !value.is_finite()) {
            return Err(TauError::NotFinite { index, value: positions[index] });
        }
        if let Some(index) = positions.iter().position(|value| value.abs() > FARTHEST_MM) {
            return Err(TauError::TooFar { index, value: positions[index] });
        }
        let not_increasing = |values: &[f64]| values.windows(2).position(|pair| pair[1] <= pair[0]);
        let tau: Vec<f64> = positions.iter().map(|position| (position - first) / (last - first)).collect();
        // Positions may differ by so little that their shares of the baseline do not.
        if let Some(index) = not_increasing(positions).or_else(|| not_increasing(&tau)) {
            return Err(TauError::NotIncreasing {
                index: index + 1,
                value: positions[index + 1],
                previous: positions[index],
            });
        }
        Ok(Self(tau))
    }

    /// tau of every frame, in [0, 1].
    pub fn values(&self) -> &[f64] {
        &self.0
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.0.len()
    }

    /// The frame whose tau is nearest to the middle of the baseline.
    pub fn middle_frame(&self) -> usize {
        (0..self.0.len())
            .min_by(|&a, &b| (self.0[a] - 0.5).abs().total_cmp(&(self.0[b] - 0.5).abs()))
            .unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_is_no_baseline() {
        assert_eq!(Tau::from_positions(&[]), Err(TauError::TooFew(0)));
        assert_eq!(Tau::from_positions(&[3.0]), Err(TauError::TooFew(1)));
        assert!(matches!(
            Tau::from_positions(&[0.0, 2.0, 2.0]),
            Err(TauError::NotIncreasing { index: 2, .. })
        ));
        assert!(matches!(
            Tau::from_positions(&[0.0, f64::NAN, 2.0]),
            Err(TauError::NotFinite { index: 1, .. })
        ));
    }

    #[test]
    fn positions_that_no_stage_has_are_refused() {
        for positions in [[-1e308, 0.0, 1e308], [0.0, 1e308, 2e307], [0.0, 1.0, 2e9]] {
            assert!(matches!(Tau::from_positions(&positions), Err(TauError::TooFar { .. })));
        }
        // The smallest steps that there are: their shares of the baseline are still numbers that rise.
        let smallest = [0.0, f64::from_bits(1), f64::from_bits(2)];
        assert_eq!(Tau::from_positions(&smallest).unwrap().values(), [0.0, 0.5, 1.0]);
        // A step that is lost in the share of a longer baseline.
        let lost = [0.0, f64::from_bits(1), 1e9];
        assert!(matches!(Tau::from_positions(&lost), Err(TauError::NotIncreasing { index: 1, .. })));
    }

    #[test]
    fn the_middle_is_by_position_not_by_index() {
        let tau = Tau::from_positions(&[0.0, 1.0, 2.0, 3.0, 10.0]).unwrap();
        assert_eq!(tau.middle_frame(), 3);
    }
}
