//! The normalised positions of the frames on the baseline.

use thiserror::Error;

/// What is wrong with a list of positions.
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
    /// let tau = epirig::tau::Tau::from_positions(&[10.0, 11.0, 14.0])?;
    /// assert_eq!(tau.values(), [0.0, 0.25, 1.0]);
    /// # Ok::<(), epirig::tau::TauError>(())
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
        if let Some(index) = positions.windows(2).position(|pair| pair[1] <= pair[0]) {
            return Err(TauError::NotIncreasing {
                index: index + 1,
                value: positions[index + 1],
                previous: positions[index],
            });
        }
        Ok(Self(positions.iter().map(|position| (position - first) / (last - first)).collect()))
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
    fn the_middle_is_by_position_not_by_index() {
        let tau = Tau::from_positions(&[0.0, 1.0, 2.0, 3.0, 10.0]).unwrap();
        assert_eq!(tau.middle_frame(), 3);
    }
}
