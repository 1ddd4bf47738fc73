//! The frames of a match: all in memory, or packed and read a block of rows at a time.

use std::mem::replace;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use tracing::{info, info_span};

use super::error::PipelineError;
use super::load::{load_packed, load_unpacked};
use super::packed::packed_volume;
use crate::bands::{BandError, Parts};
use crate::calibrate::{Calibration, matched_shape};
use epirig_calibration::photometry::Maps;
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::rows::RowSource;
use epirig_core::volume::{Volume, VolumeShape};
use epirig_data::packed::PackedVolume;
use epirig_data::sequence::Sequence;
use epirig_matcher::inspect::{Candidates, CostTable};
use epirig_matcher::{Blocks, DisparityMaps, MatchError, Matcher, Overview};

/// The frames of a match.
pub(super) struct MatchInput {
    blocks: Blocks,
    frames: MatchFrames,
}

enum MatchFrames {
    /// All frames.
    Memory(Volume),
    /// Rows are read when they are needed.
    Packed(Arc<PackedVolume>),
}

/// Frames that are ready to be matched.
pub(super) struct ReadyInput {
    matcher: Matcher,
    in_memory: bool,
}

impl MatchInput {
    /// The frames of `sequence`. `blocks` makes the blocks of the match of frames of a shape. Packed frames are left on
    /// disk if the match does not need all of them at a time.
    pub(super) fn of(
        sequence: &Sequence,
        calibration: Option<&(Calibration, Maps)>,
        blocks: impl FnOnce(&VolumeShape) -> Result<Blocks, MatchError>,
        progress: &dyn Progress,
    ) -> Result<Self, PipelineError> {
        let _span = info_span!("reading", rectified = calibration.is_some()).entered();
        let shape = matched_shape(sequence, calibration.map(|(calibration, _)| calibration))?;
        let blocks = blocks(&shape)?;
        let frames = match packed_volume(sequence, calibration, progress)? {
            Some(packed) if !blocks.needs_all_rows() => MatchFrames::Packed(Arc::new(packed)),
            Some(packed) => MatchFrames::Memory(load_packed(&packed, progress)?),
            None => MatchFrames::Memory(load_unpacked(sequence, calibration, progress)?),
        };
        let (count, rows, columns) = (shape.tau.frames(), shape.rows, shape.columns);
        let in_memory = matches!(frames, MatchFrames::Memory(_));
        info!(folder = %sequence.folder().display(), frames = count, rows, columns, in_memory, "frames read");
        Ok(Self { blocks, frames })
    }

    pub(super) fn blocks(&self) -> &Blocks {
        &self.blocks
    }

    fn source(&self) -> &dyn RowSource {
        match &self.frames {
            MatchFrames::Memory(volume) => volume,
            MatchFrames::Packed(packed) => packed,
        }
    }

    /// Row `y` of all frames, as a volume of its own.
    pub(super) fn epi(&self, y: usize, progress: &dyn Progress) -> Result<Volume, PipelineError> {
        Ok(self.source().rows_of_all(&[y], progress)?)
    }

    /// Frame `t` in DN.
    pub(super) fn photograph(&self, t: usize) -> Result<Grid<f32>, PipelineError> {
        Ok(self.source().frame(t)?)
    }

    /// The same, ready to be matched.
    pub(super) fn ready(self, progress: &dyn Progress) -> Result<ReadyInput, PipelineError> {
        Ok(match self.frames {
            MatchFrames::Memory(volume) => {
                ReadyInput { matcher: Matcher::of_blocks(volume, self.blocks), in_memory: true }
            }
            MatchFrames::Packed(packed) => {
                ReadyInput { matcher: Matcher::of_source(packed, self.blocks, progress)?, in_memory: false }
            }
        })
    }
}

impl ReadyInput {
    /// The maps. Those of frames that are read block by block are kept in `folder` until all are matched.
    pub(super) fn matched(
        &self,
        folder: &Path,
        progress: &dyn Progress,
    ) -> Result<DisparityMaps, PipelineError> {
        if self.in_memory {
            return Ok(self.matcher.matched(progress)?);
        }
        let (parts, overview) = (Parts::within(folder), self.matcher.overview(progress)?);
        self.match_blocks(0..self.matcher.blocks().count(), overview, &parts, progress)?;
        joined_parts(&parts, self.matcher.blocks(), overview).map(|(maps, _)| maps)
    }

    /// Matches these blocks, whose maps become `parts`. What holds for the whole picture is `known`, unless it is one
    /// block.
    pub(super) fn match_blocks(
        &self,
        wanted: Range<usize>,
        known: Option<Overview>,
        parts: &Parts,
        progress: &dyn Progress,
    ) -> Result<(), PipelineError> {
        let mut begun = Instant::now();
        self.matcher.match_blocks(wanted, known, progress, |block, maps| {
            let seconds = replace(&mut begun, Instant::now()).elapsed().as_secs_f64();
            Ok(parts.put(block, self.matcher.blocks().answered_rows(block), &maps, seconds)?)
        })
    }

    /// Costs of all candidates of row `y` when `maps` were found.
    pub(super) fn row_costs(
        &self,
        y: usize,
        maps: &DisparityMaps,
    ) -> Result<(Candidates, CostTable), PipelineError> {
        Ok(self.matcher.row_costs(y, maps)?)
    }
}

/// The maps of the picture from the parts of all blocks, and the seconds that their match took.
pub(super) fn joined_parts(
    parts: &Parts,
    blocks: &Blocks,
    overview: Option<Overview>,
) -> Result<(DisparityMaps, f64), PipelineError> {
    let mut seconds = 0.0;
    let maps = blocks.joined((0..blocks.count()).map(|block| {
        let (maps, took) =
            parts.take(block, blocks, overview).map_err(|fault| BandError::Part { block, fault })?;
        seconds += took;
        Ok::<_, PipelineError>(maps)
    }))?;
    Ok((maps, seconds))
}
