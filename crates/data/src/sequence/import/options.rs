//! What a person says about the images.

use std::path::{Path, PathBuf};

use super::super::nominal_lens::NominalLens;
use super::super::record::FrameKind;
use super::rotation::Rotation;
use super::selection::Span;

/// Facts about the images from a person.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImportOptions {
    /// First and last index of the images to use, in natural order from 0, both included; `None` for all.
    pub frames: Option<(usize, usize)>,
    /// Images to leave out, by the same numbers.
    pub exclude: Vec<Span>,
    /// How all images are turned.
    pub rotate: Rotation,
    /// A table of positions in mm, one for each frame that is used.
    pub positions: Option<PathBuf>,
    /// Distance between frames in mm, if they are equidistant and it is known.
    pub step_mm: Option<f64>,
    /// Bits that the camera gave, where fewer than the files hold (for example 12 in 16-bit files).
    pub bit_depth: Option<u8>,
    /// The lens, if known.
    pub lens: Option<NominalLens>,
    /// A folder of images without light.
    pub dark: Option<PathBuf>,
    /// A folder of images of a uniform target.
    pub flat: Option<PathBuf>,
    /// A folder of images of a chess-board in a hand.
    pub board: Option<PathBuf>,
    /// The rig's lens and targets, for [`Origin::Imported`](crate::sequence::Origin::Imported).
    pub rig: Option<serde_json::Value>,
    /// Whether grey PNG files are linked instead of copied.
    pub link: bool,
}

impl ImportOptions {
    /// The folders of calibration images.
    pub(super) fn calibration(&self) -> impl Iterator<Item = (FrameKind, &Path)> {
        FrameKind::CALIBRATION.into_iter().filter_map(|kind| {
            let folder = match kind {
                FrameKind::Scan => None,
                FrameKind::Dark => self.dark.as_deref(),
                FrameKind::Flat => self.flat.as_deref(),
                FrameKind::Board => self.board.as_deref(),
            };
            Some((kind, folder?))
        })
    }
}
