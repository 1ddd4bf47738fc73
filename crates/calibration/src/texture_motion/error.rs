//! Why the motion could not be found.

use thiserror::Error;

use super::frames::Frames;
use epirig_core::progress::Cancelled;

/// Why the texture does not tell how the camera moved. Frames are numbered from 0.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TextureMotionError {
    /// The frames said that nobody waits any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
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
    /// The frame in the middle has hardly a point that could be followed.
    #[error(
        "there is too little texture to follow points from frame to frame: bring more light or contrast, or a pattern onto the object"
    )]
    NoTexture,
    /// Points stay where they are, but for a small part of the picture at most.
    #[error(
        "nothing moves from frame to frame, or too small a part of the picture: take frames from places along a line, crop them to what \
         moves, and look for a pattern that stands still before it, as of a dirty window"
    )]
    Still,
    /// The picture grows or shrinks about a place in it.
    #[error(
        "from frame to frame the picture {} by {:.2} % about column {:.0}, row {:.0}: the camera goes along its view, or zooms; let it move \
         across its view, with one focal length",
        if *share > 0.0 { "grows" } else { "shrinks" }, 100.0 * share.abs(), place[0], place[1]
    )]
    Grows {
        /// Column and row that stay, in px.
        place: [f64; 2],
        /// By how much it grows from frame to frame, as a share.
        share: f64,
    },
    /// The vanishing point of the motion lies inside the picture.
    #[error(
        "all points move to or from column {:.0}, row {:.0} of the picture: the camera goes along its view, or zooms, or turns round the \
         object; let it move across its view, without turning and with one focal length",
        place[0], place[1]
    )]
    Towards {
        /// Its column and row, in px.
        place: [f64; 2],
    },
    /// The picture turns in its plane.
    #[error(
        "from frame to frame the picture turns by {:.2} degrees, and what moves besides is less: let the camera move on a straight line without \
         turning about its view",
        degrees.abs()
    )]
    Turns {
        /// By how much from frame to frame, in degrees.
        degrees: f64,
    },
    /// Some points move and others do not.
    #[error(
        "{:.0} % of the points stand still and the others move: a background that does not move with the object, dirt on the camera, or a mark \
         in the images; crop the images to what moves",
        100.0 * share
    )]
    Stands {
        /// Share of those that stand still, 0 to 1.
        share: f64,
    },
    /// Points move to both sides.
    #[error(
        "points move to both sides, {:.0} % of them against the others: the camera turns round the object, or the object turns; let it move on \
         a straight line without turning",
        100.0 * share
    )]
    BothSides {
        /// Share of those that move to the side to which fewer do, 0 to 0.5.
        share: f64,
    },
    /// The motion is found, but not well enough to straighten rows.
    #[error(
        "rows of points are only known to {rows_px:.1} px: too few points with texture are seen in many frames, or the scene moves"
    )]
    Uncertain {
        /// Standard uncertainty of the row of a typical point from frame to frame, in px.
        rows_px: f64,
    },
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

impl TextureMotionError {
    /// An error if nobody waits for the motion of `frames` any more.
    pub(super) fn if_cancelled(frames: &dyn Frames) -> Result<(), Self> {
        if frames.cancelled() { Err(Cancelled.into()) } else { Ok(()) }
    }

    /// The same, if it says that the camera moved in another way than along a line, in px of frames that are so many
    /// times as large.
    pub fn of_other_motion(self, larger: f64) -> Option<Self> {
        let scaled = |place: [f64; 2]| place.map(|place| larger * place);
        Some(match self {
            Self::Grows { place, share } => Self::Grows { place: scaled(place), share },
            Self::Towards { place } => Self::Towards { place: scaled(place) },
            Self::Turns { .. } | Self::BothSides { .. } | Self::Stands { .. } => self,
            _ => return None,
        })
    }
}

/// Names of frames, the first ones if there are many.
fn words(frames: &[usize]) -> String {
    const MOST: usize = 8;
    let names: Vec<String> = frames.iter().take(MOST).map(usize::to_string).collect();
    names.join(", ") + if frames.len() > MOST { " ..." } else { "" }
}
