//! Which unknowns the cameras have.

use serde::{Deserialize, Serialize};

/// What is adjusted besides the direction of motion in the picture and the position of every frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionModel {
    /// The angle between motion and picture.
    pub pan: bool,
    /// The focal length, within what is known of it before.
    #[serde(default)]
    pub focal_length: bool,
    /// A small rotation of every frame.
    pub rotations: bool,
    /// A displacement of every frame across the line.
    pub offsets: bool,
    /// The first radial term of the distortion.
    pub k1: bool,
}

/// Unknowns of all frames: the direction's two, k1, and the logarithm of the focal length.
pub(super) const COMMON: usize = 4;
/// Index of the direction's angle to the picture: of the two vectors across a motion in the picture, the first leads out of
/// it.
pub(super) const PAN: usize = 0;
/// Index of k1.
pub(super) const K1: usize = 2;
/// Index of the focal length's logarithm.
pub(super) const FOCAL_LENGTH: usize = 3;

impl MotionModel {
    /// What of this `may` be adjusted.
    pub(super) fn of_these(self, may: Self) -> Self {
        Self {
            pan: self.pan && may.pan,
            focal_length: self.focal_length && may.focal_length,
            rotations: self.rotations && may.rotations,
            offsets: self.offsets && may.offsets,
            k1: self.k1 && may.k1,
        }
    }

    /// Unknowns of a frame.
    pub(super) fn of_frame(self) -> usize {
        1 + if self.rotations { 3 } else { 0 } + if self.offsets { 2 } else { 0 }
    }

    pub(super) fn unknowns(self, frames: usize) -> usize {
        COMMON + frames * self.of_frame()
    }

    /// Index of the position of a frame; its rotation and its offset follow.
    pub(super) fn position(self, frame: usize) -> usize {
        COMMON + frame * self.of_frame()
    }

    pub(super) fn offset(self, frame: usize) -> usize {
        self.position(frame) + if self.rotations { 4 } else { 1 }
    }
}
