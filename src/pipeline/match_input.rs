//! The frames of a match: all in memory, or packed and read a block of rows at a time.

use std::ops::Range;
use std::path::Path;
use std::time::Instant;

use tracing::{info, info_span};

use super::error::PipelineError;
use super::load::{load_packed, load_unpacked};
use super::packed::packed_volume;
use super::photograph::volume_frame;
use crate::bands::{BandError, Parts};
use crate::calibrate::{Calibration, matched_shape};
use epirig_calibration::photometry::Maps;
use epirig_core::grid::Grid;
use epirig_core::progress::{Progress, Uncounted};
use epirig_core::volume::{Volume, VolumeShape};
use epirig_data::packed::PackedVolume;
use epirig_data::sequence::Sequence;
use epirig_matcher::inspect::{Candidates, CostTable};
use epirig_matcher::{BlockProgress, Blocks, DisparityMaps, MatchError, Matcher, Overview};

/// The frames of a match.
pub(super) struct MatchInput {
    blocks: Blocks,
    source: Source,
}

enum Source {
    /// All frames.
    Memory(Volume),
    /// Rows are read when they are needed.
    Packed(PackedVolume),
}

/// Frames that are ready to be matched.
pub(super) enum ReadyInput {
    Memory(Matcher),
    Packed(PackedVolume, Blocks),
}

impl MatchInput {
    /// The frames of `sequence`. `blocks` makes the blocks of the match of frames of a shape. Packed frames are left on
    /// disk if there are several blocks.
    pub(super) fn of(
        sequence: &Sequence,
        calibration: Option<&(Calibration, Maps)>,
        blocks: impl FnOnce(&VolumeShape) -> Result<Blocks, MatchError>,
        progress: &dyn Progress,
    ) -> Result<Self, PipelineError> {
        let _span = info_span!("reading", rectified = calibration.is_some()).entered();
        let shape = matched_shape(sequence, calibration.map(|(calibration, _)| calibration))?;
        let blocks = blocks(&shape)?;
        let source = match packed_volume(sequence, calibration, progress)? {
            Some(packed) if blocks.count() > 1 => Source::Packed(packed),
            Some(packed) => Source::Memory(load_packed(&packed, progress)?),
            None => Source::Memory(load_unpacked(sequence, calibration, progress)?),
        };
        let (frames, rows, columns) = (shape.tau.frames(), shape.rows, shape.columns);
        let in_memory = matches!(source, Source::Memory(_));
        info!(folder = %sequence.folder().display(), frames, rows, columns, in_memory, "frames read");
        Ok(Self { blocks, source })
    }

    pub(super) fn blocks(&self) -> &Blocks {
        &self.blocks
    }

    /// Row `y` of all frames, as a volume of its own.
    pub(super) fn epi(&self, y: usize, progress: &dyn Progress) -> Result<Volume, PipelineError> {
        match &self.source {
            Source::Memory(volume) => {
                let frames: Vec<usize> = (0..volume.frames()).collect();
                Ok(volume.selected(&[y], &frames, volume.tau().clone()))
            }
            Source::Packed(packed) => Ok(packed.rows(y..y + 1, &Uncounted(progress))?),
        }
    }

    /// Frame `t` in DN.
    pub(super) fn photograph(&self, t: usize) -> Result<Grid<f32>, PipelineError> {
        match &self.source {
            Source::Memory(volume) => Ok(volume_frame(volume, t)),
            Source::Packed(packed) => Ok(volume_frame(&packed.one_frame(t)?, 0)),
        }
    }

    /// The same, ready to be matched.
    pub(super) fn ready(self) -> ReadyInput {
        match self.source {
            Source::Memory(volume) => ReadyInput::Memory(Matcher::of_blocks(volume, self.blocks)),
            Source::Packed(packed) => ReadyInput::Packed(packed, self.blocks),
        }
    }
}

impl ReadyInput {
    /// The maps. Those of blocks are kept in `folder` until all are matched.
    pub(super) fn matched(
        &self,
        folder: &Path,
        progress: &dyn Progress,
    ) -> Result<DisparityMaps, PipelineError> {
        let (packed, blocks) = match self {
            Self::Memory(matcher) => return Ok(matcher.matched(progress)?),
            Self::Packed(packed, blocks) => (packed, blocks),
        };
        let parts = Parts::within(folder);
        let overview = blocks.overview(&packed.some_rows(&blocks.overview_rows(), progress)?, progress)?;
        self.match_blocks(0..blocks.count(), Some(overview), &parts, progress)?;
        joined_parts(&parts, blocks).map(|(maps, _)| maps)
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
        let begun = Instant::now();
        let (packed, blocks) = match self {
            Self::Memory(matcher) => {
                let (maps, rows) = (matcher.matched(progress)?, matcher.blocks().answered_rows(0));
                let maps = maps.of_rows(rows.clone());
                return Ok(parts.put(0, rows, &maps, begun.elapsed().as_secs_f64())?);
            }
            Self::Packed(packed, blocks) => (packed, blocks),
        };
        let told = BlockProgress::begin(progress, blocks, wanted.clone());
        for block in wanted {
            let begun = Instant::now();
            let needed = packed.rows(blocks.needed_rows(block), &Uncounted(progress))?;
            told.next_block();
            let maps = blocks.matched(block, needed, known, &told)?;
            parts.put(block, blocks.answered_rows(block), &maps, begun.elapsed().as_secs_f64())?;
        }
        told.finish();
        Ok(())
    }

    /// Costs of all candidates of row `y` when `maps` were found.
    pub(super) fn row_costs(
        &self,
        y: usize,
        maps: &DisparityMaps,
        progress: &dyn Progress,
    ) -> Result<(Candidates, CostTable), PipelineError> {
        match self {
            Self::Memory(matcher) => Ok(matcher.row_costs(y, maps)),
            Self::Packed(packed, blocks) => {
                let near = packed.rows(blocks.rows_of_costs(y), &Uncounted(progress))?;
                Ok(blocks.row_costs(y, near, maps))
            }
        }
    }
}

/// The maps of the picture from the parts of all blocks, and the seconds that their match took.
pub(super) fn joined_parts(parts: &Parts, blocks: &Blocks) -> Result<(DisparityMaps, f64), PipelineError> {
    let mut seconds = 0.0;
    let maps = blocks.joined((0..blocks.count()).map(|block| {
        let (maps, took) = parts.take(block, blocks).map_err(|fault| BandError::Part { block, fault })?;
        seconds += took;
        Ok::<_, PipelineError>(maps)
    }))?;
    Ok((maps, seconds))
}
