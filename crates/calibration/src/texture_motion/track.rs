//! Points in all frames that show them.

/// A point in all frames that show it.
#[derive(Debug, Clone)]
pub(super) struct Track {
    /// Where it is in the scene, in steps of two squares: points in one cell may see the same noise.
    pub(super) cell: (i64, i64),
    /// The direction in which it moves through the picture, a unit vector: columns, rows.
    pub(super) direction: [f64; 2],
    /// In the order of the frames.
    pub(super) sights: Vec<Sight>,
}

/// A point in a frame, in px of the frames.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    pub(super) frame: usize,
    /// Column and row of the middle of its square.
    pub(super) place: [f64; 2],
    /// Variances along and across the motion, by what is left unexplained.
    pub(super) along_variance: f64,
    pub(super) across_variance: f64,
}
