//! What was seen in frames.

use crate::texture_motion::{Return, Step, TextureMotionError};

/// What was seen in the frames. Frames are numbered from 0, in the order in which they came.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Motion {
    /// How far what moves goes from one frame to the next, in px: x to higher columns, y to higher rows.
    pub step_px: Option<(f64, f64)>,
    /// What is wrong, the most certain first.
    pub doubts: Vec<Doubt>,
}

/// What is wrong in frames.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Doubt {
    /// These frames do not show what the others show.
    Foreign(Vec<usize>),
    /// Nothing moves, though there is texture that would show it.
    Still,
    /// What moves goes along the columns.
    Vertical,
    /// What moves goes not along the rows.
    Oblique {
        /// Its angle to the rows, in degrees: positive if what goes to the right goes down, too.
        degrees: f64,
        /// How far it goes across the rows from the first frame to the last, in px; `None` if it could only be
        /// measured roughly.
        drift_px: Option<f64>,
    },
    /// Frames do not stand where they are taken to stand.
    Uneven {
        /// Root mean square of how far they stand from there, in px of a typical point.
        displacement_px: f64,
        /// Root mean square by which steps differ from those that are taken, as a share of the usual step, but for
        /// gaps; 0 if that is not significant.
        share: f64,
        /// Steps that are longer than the one that is taken by half a usual step and more.
        gaps: Vec<Step>,
    },
    /// What moves does not move along a line, and no measurement makes up for it.
    Other(TextureMotionError),
    /// These frames do not stand beyond the ones before them.
    Returns(Vec<(usize, Return)>),
    /// The frames are not in the order of the motion; this order of them is.
    Disorder(Vec<usize>),
    /// The motion turns round at this frame.
    TurnsRound(usize),
}
