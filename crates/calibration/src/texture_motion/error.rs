//! Why the motion could not be found.

use thiserror::Error;

/// Why the texture does not tell how the camera moved. Frames are numbered from 0.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TextureMotionError {
    /// Too few frames to compare displacements.
    #[error("{frames} frame(s) do not tell steps; at least 3 are needed")]
    TooFew {
        /// Their number.
        frames: usize,
    },
    /// No two frames show points that can be followed.
    #[error(
        "no points can be followed from frame to frame: there is too little texture, it repeats, nothing moves, or it moves by more than a quarter \
         of the picture at once"
    )]
    NothingFollowed,
    /// Some frames share too little with the others.
    #[error(
        "frame(s) {} cannot be connected with the others: they share too little texture, or it repeats",
        words(frames)
    )]
    Apart {
        /// Those frames.
        frames: Vec<usize>,
    },
}

/// Names of frames, the first ones if there are many.
fn words(frames: &[usize]) -> String {
    const MOST: usize = 8;
    let names: Vec<String> = frames.iter().take(MOST).map(usize::to_string).collect();
    names.join(", ") + if frames.len() > MOST { " ..." } else { "" }
}
