//! The terms of the distortion.

use serde::{Deserialize, Serialize};

use crate::lens::model::Lens;

/// Which terms of the distortion are estimated; the others are 0. Ordered from the simplest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Terms {
    /// None: a straight projection.
    None,
    /// Radial of second order.
    K1,
    /// Radial of second and fourth order.
    K1K2,
    /// These, and the two tangential ones.
    K1K2P1P2,
    /// All five, the default of OpenCV.
    All5,
}

impl Terms {
    /// All sets, from the simplest.
    pub const ALL: [Self; 5] = [Self::None, Self::K1, Self::K1K2, Self::K1K2P1P2, Self::All5];

    /// The parameters of the lens that are estimated, by their index in [`Lens::to_array`]: focal lengths and
    /// principal point always.
    pub fn estimated(self) -> std::ops::Range<usize> {
        0..4 + match self {
            Self::None => 0,
            Self::K1 => 1,
            Self::K1K2 => 2,
            Self::K1K2P1P2 => 4,
            Self::All5 => 5,
        }
    }

    /// The lens without the terms that are not estimated.
    pub(super) fn keep(self, lens: &Lens) -> Lens {
        let mut parameters = lens.to_array();
        parameters[self.estimated().end..].fill(0.0);
        Lens::from_array(parameters)
    }
}
