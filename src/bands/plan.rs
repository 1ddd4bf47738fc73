//! The plan of a match in bands.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::results::MaskFacts;
use epirig_matcher::{Blocks, MatchOptions, Overview};
use epirig_surface::Rectangle;

/// What is matched in bands: what each band must find unchanged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BandTask {
    /// The program with its version: another one may find other bits.
    pub program: String,
    /// Uid of the sequence.
    pub sequence_uid: String,
    /// BLAKE3 over the frames of the sequence.
    pub frames_blake3: String,
    /// Rows of a frame as it is matched.
    pub rows: usize,
    /// Its columns.
    pub columns: usize,
    /// Hash of the calibration by which frames are rectified; `None` for frames as captured.
    pub calibration: Option<String>,
    /// Region of the picture that is asked for, if one was given.
    pub region: Option<Rectangle>,
    /// Mask of the picture, if one was given.
    pub mask: Option<MaskFacts>,
    /// The options of the match.
    pub settings: MatchOptions,
    /// The blocks of each band, which follow each other.
    pub bands: Vec<Range<usize>>,
}

/// Contents of `plan.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BandPlan {
    /// Version of the format.
    pub format: u32,
    /// What is matched.
    pub task: BandTask,
    /// BLAKE3 of `mask.png` beside it, if the match has a mask.
    pub mask_blake3: Option<String>,
    /// Whether a scan that is not closed was accepted.
    pub anyway: bool,
    /// Number of threads of the survey, for which memory and time are stated.
    pub threads: usize,
    /// What holds for the whole picture; `None` if it is one block, which finds it.
    pub overview: Option<Overview>,
    /// Most bytes of memory that a band takes, and that the merge takes.
    pub memory_bytes: Memory,
    /// Seconds that a band takes, as predicted from some rows on the machine of the survey; `None` for one block.
    pub seconds: Option<f64>,
}

/// Most bytes of memory that the steps take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Those of a band.
    pub band: u64,
    /// Those of the merge.
    pub merge: u64,
}

impl BandPlan {
    /// Version of the format of `plan.json`.
    pub const FORMAT: u32 = 1;

    /// What in it contradicts itself, or a match of these `blocks`; `None` if nothing does.
    pub(crate) fn contradiction(&self, blocks: &Blocks) -> Option<&'static str> {
        let bands = &self.task.bands;
        let begins = std::iter::once(0).chain(bands.iter().map(|band| band.end));
        let follow = bands.iter().zip(begins).all(|(band, begin)| band.start == begin && band.end > begin);
        match () {
            () if !follow || bands.last().map(|last| last.end) != Some(blocks.count()) => {
                Some("its bands are not those of its blocks")
            }
            () if self.overview.is_some() != (blocks.count() > 1) => {
                Some("its overview does not fit its blocks")
            }
            () if self.overview.is_some_and(|overview| !blocks.suits(overview.range)) => {
                Some("its range does not fit the frames")
            }
            () => None,
        }
    }
}

/// The blocks of each of `bands` bands, or of one band for each block if there are fewer blocks.
pub(crate) fn bands_of(blocks: &Blocks, bands: usize) -> Vec<Range<usize>> {
    let count = blocks.count();
    let bands = bands.clamp(1, count.max(1));
    (0..bands).map(|band| band * count / bands..(band + 1) * count / bands).collect()
}
