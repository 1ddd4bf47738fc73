//! What was seen in frames.

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
    /// What moves goes along neither rows nor columns: at so many degrees to the rows.
    Oblique(f64),
    /// The frames are not in the order of the motion; this order of them is.
    Disorder(Vec<usize>),
    /// The motion turns round at this frame.
    TurnsRound(usize),
}
