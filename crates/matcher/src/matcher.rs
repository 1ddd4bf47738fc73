//! The matcher of frames, in memory or read block by block.

use std::ops::Range;
use std::sync::Arc;

use super::blocks::{BlockProgress, Blocks, Joined};
use super::candidates::{Candidates, DisparityRange};
use super::cost::CostTable;
use super::fit::{Fit, Sizes, fit};
use super::maps::{DisparityMaps, OrderingUsed};
use super::options::{MatchError, MatchOptions};
use super::stack::Stack;
use super::stations::{Overview, costs_of_row, prepared, seen_rule};
use epirig_core::grid::Grid;
use epirig_core::progress::{Progress, Silent};
use epirig_core::rows::RowSource;
use epirig_core::volume::Volume;

/// Disparity of every pixel of the reference frame, as [`Matcher::matched`] finds it.
///
/// With [`Method::Normalised`](super::Method::Normalised) the frames are copied; a [`Matcher`] that is given the
/// only volume normalises them in their place.
///
/// # Errors
/// [`MatchError`] if the options do not suit the volume, or no range was given and none is to be found.
pub fn match_volume(
    volume: &Volume,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<DisparityMaps, MatchError> {
    Matcher::new(volume.clone(), options.clone())?.matched(progress)
}

/// Disparity of every pixel of the reference frame of `stack`, in px over the whole baseline, with its sigma.
///
/// # Errors
/// [`MatchError`] if the options do not suit the stack, or no range was given and none is to be found.
pub fn disparity(stack: &Stack, options: &MatchOptions) -> Result<DisparityMaps, MatchError> {
    disparity_with(stack, options, &Silent)
}

/// The same, which tells `progress` how far it is, and ends early if that [cancels](Progress::cancelled) it.
///
/// # Errors
/// As [`disparity`], or [`MatchError::Cancelled`].
pub fn disparity_with(
    stack: &Stack,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<DisparityMaps, MatchError> {
    match_volume(stack.volume(), options, progress)
}

/// Frames that are ready to be matched.
#[derive(Debug, Clone)]
pub struct Matcher {
    frames: Frames,
    blocks: Blocks,
}

#[derive(Debug, Clone)]
enum Frames {
    /// The rows of a single block, as they are compared along lines.
    Prepared(Volume),
    /// The rows of a block are read when it is matched.
    Source(Arc<dyn RowSource>),
}

impl Matcher {
    /// Prepares `volume` for a match with `options`. Samples are changed in their place unless they are
    /// shared with another volume.
    ///
    /// # Errors
    /// [`MatchError`] if the options do not suit the volume.
    pub fn new(volume: Volume, options: MatchOptions) -> Result<Self, MatchError> {
        let blocks = Blocks::new(&volume.shape(), options)?;
        Ok(Self::of_blocks(volume, blocks))
    }

    /// Prepares `volume` for the match of these `blocks`, which are of frames of its shape. If there is one, the rows
    /// that it does not need are dropped.
    pub fn of_blocks(mut volume: Volume, blocks: Blocks) -> Self {
        let frames = match blocks.count() {
            1 => {
                volume.keep_rows(blocks.needed_rows(0));
                Frames::Prepared(prepared(volume, blocks.options()))
            }
            _ => Frames::Source(Arc::new(volume)),
        };
        Self { frames, blocks }
    }

    /// The same of frames of which rows are read, block by block.
    ///
    /// # Errors
    /// [`MatchError::Unread`] if the rows of a single block cannot be read; [`MatchError::Cancelled`].
    pub fn of_source(
        source: Arc<dyn RowSource>,
        blocks: Blocks,
        progress: &dyn Progress,
    ) -> Result<Self, MatchError> {
        let frames = match blocks.count() {
            1 => {
                let needed = source.rows_of_all(&blocks.needed_rows(0).collect::<Vec<_>>(), progress)?;
                Frames::Prepared(prepared(needed, blocks.options()))
            }
            _ => Frames::Source(source),
        };
        Ok(Self { frames, blocks })
    }

    /// The blocks of rows that are matched one after the other.
    pub fn blocks(&self) -> &Blocks {
        &self.blocks
    }

    /// The rows that `block` needs, as they are compared.
    fn prepared_rows(&self, block: usize, progress: &dyn Progress) -> Result<Volume, MatchError> {
        match &self.frames {
            Frames::Prepared(volume) => Ok(volume.clone()),
            Frames::Source(source) => {
                let needed =
                    source.rows_of_all(&self.blocks.needed_rows(block).collect::<Vec<_>>(), progress)?;
                Ok(prepared(needed, self.blocks.options()))
            }
        }
    }

    /// What holds for the whole picture; `None` if it is a single block, in which it is found.
    ///
    /// # Errors
    /// [`MatchError`] if no range was given and none is to be found, rows cannot be read, or `progress` has cancelled
    /// it.
    pub fn overview(&self, progress: &dyn Progress) -> Result<Option<Overview>, MatchError> {
        match &self.frames {
            Frames::Prepared(_) => Ok(None),
            Frames::Source(source) => {
                let sample = source.rows_of_all(&self.blocks.overview_rows(), progress)?;
                self.blocks.overview(sample, progress).map(Some)
            }
        }
    }

    /// Matches these blocks one after the other, by the [overview](Self::overview) of all, and gives the maps of the rows
    /// that each answers to `take`.
    ///
    /// # Errors
    /// [`MatchError`] if the options do not suit the frames, rows cannot be read, or `progress` has cancelled the match;
    /// the first error of `take`.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn match_blocks<E: From<MatchError>>(
        &self,
        wanted: Range<usize>,
        overview: Option<Overview>,
        progress: &dyn Progress,
        mut take: impl FnMut(usize, DisparityMaps) -> Result<(), E>,
    ) -> Result<(), E> {
        let blocks = &self.blocks;
        let told = (blocks.count() > 1).then(|| BlockProgress::begin(progress, blocks, wanted.clone()));
        for block in wanted {
            let needed = self.prepared_rows(block, progress)?;
            let progress = told.as_ref().map_or(progress, |told| {
                told.next_block();
                told
            });
            take(block, blocks.of_prepared(block, &needed, overview, progress)?)?;
        }
        if let Some(told) = told {
            told.finish();
        }
        Ok(())
    }

    /// Disparity of every pixel of the reference frame.
    ///
    /// Frames of more than some hundred megabytes are matched in [blocks of rows](Blocks). The result does not
    /// depend on the number of threads.
    ///
    /// # Errors
    /// [`MatchError`] if the options do not suit the volume, no range was given and none is to be found, rows cannot be
    /// read, or `progress` has cancelled the match.
    pub fn matched(&self, progress: &dyn Progress) -> Result<DisparityMaps, MatchError> {
        let overview = self.overview(progress)?;
        let mut joined = Joined::default();
        self.match_blocks(0..self.blocks.count(), overview, progress, |block, maps| {
            joined.put(maps, self.blocks.answered_rows(block), self.blocks.rows());
            Ok::<_, MatchError>(())
        })?;
        Ok(joined.maps())
    }

    /// The pixels that `maps` answers, by planes in discs of one size.
    ///
    /// Discs that grow with the noise see a step edge from as far as they reach, which differs from
    /// pixel to pixel. These see it from 2 px, so a mean over many pixels farther away is right,
    /// although each pixel has more noise.
    ///
    /// # Errors
    /// [`MatchError::Cancelled`] if `progress` has cancelled it; [`MatchError::Unread`] if rows cannot be read.
    pub fn in_equal_discs(
        &self,
        maps: &DisparityMaps,
        progress: &dyn Progress,
    ) -> Result<EqualDiscs, MatchError> {
        let blocks = &self.blocks;
        let nothing = || Grid::filled(blocks.rows(), blocks.columns(), f32::NAN);
        let mut all = EqualDiscs { disparity: nothing(), sigma: nothing(), locking: None };
        let rows_needed = |block| blocks.needed_rows(block).len();
        let rows: usize = (0..blocks.count()).map(rows_needed).sum();
        progress.begin("refining in equal discs", rows as u64);
        for block in 0..blocks.count() {
            let (needed, answered) = (blocks.needed_rows(block), blocks.answered_rows(block));
            let answers = maps.disparity.cropped(0..blocks.columns(), needed.clone());
            let volume = self.prepared_rows(block, progress)?;
            let lines = blocks.lines(&volume, needed.clone());
            let options = blocks.options();
            let equal = Fit {
                sizes: Sizes::Equal,
                // Answers are near enough.
                steps: usize::from(options.fit),
                rule: seen_rule(&volume, options, maps.ordering),
                deviation_share: None,
            };
            let found = fit(&volume, &lines, answers, equal, progress)?;
            let first = answered.start - needed.start;
            let own = |map: &Grid<f32>| map.cropped(0..blocks.columns(), first..first + answered.len());
            all.disparity.put_rows(answered.start, &own(&found.disparity));
            all.sigma.put_rows(answered.start, &own(&found.sigma));
            if let Some(found) = &found.locking_px {
                let none = || Grid::filled(blocks.rows(), blocks.columns(), 0.0);
                all.locking.get_or_insert_with(none).put_rows(answered.start, &own(found));
            }
        }
        progress.end();
        Ok(all)
    }

    /// Costs of all candidates of row `y` as they were when `maps` were found, for pictures of the search:
    /// the row's own, whatever other rows added, and at the whole resolution, whatever a first look took.
    ///
    /// # Errors
    /// [`MatchError::Unread`] if rows cannot be read.
    ///
    /// # Panics
    /// If `y` lies outside the frames, or outside the rows that a single block needs.
    pub fn row_costs(&self, y: usize, maps: &DisparityMaps) -> Result<(Candidates, CostTable), MatchError> {
        self.costs_of_row(y, maps.reference, maps.range, maps.ordering)
    }

    /// The same for a match of which only the reference frame, the range and the ordering are known.
    ///
    /// # Errors
    /// [`MatchError::Unread`] if rows cannot be read.
    ///
    /// # Panics
    /// If `y` or `reference` lies outside the frames, or `y` outside the rows that a single block needs.
    pub fn costs_of_row(
        &self,
        y: usize,
        reference: usize,
        range: DisparityRange,
        ordering: OrderingUsed,
    ) -> Result<(Candidates, CostTable), MatchError> {
        let options = self.blocks.options();
        let found = (reference, range, ordering);
        match &self.frames {
            Frames::Prepared(volume) => {
                Ok(costs_of_row(volume, y - self.blocks.needed_rows(0).start, options, found))
            }
            Frames::Source(source) => {
                let near = self.blocks.rows_of_costs(y);
                let volume =
                    prepared(source.rows_of_all(&near.clone().collect::<Vec<_>>(), &Silent)?, options);
                Ok(costs_of_row(&volume, y - near.start, options, found))
            }
        }
    }
}

/// Maps by discs of one size, in px over the whole baseline; rows x columns.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct EqualDiscs {
    /// Disparity; NaN without an answer.
    pub disparity: Grid<f32>,
    /// Its standard deviation.
    pub sigma: Grid<f32>,
    /// Its bias by pixel locking, as predicted; `None` if it is not significant.
    pub locking: Option<Grid<f32>>,
}

impl EqualDiscs {
    /// The maps that `change` makes of these.
    #[must_use]
    pub fn map(&self, change: impl Fn(&Grid<f32>) -> Grid<f32>) -> Self {
        Self {
            disparity: change(&self.disparity),
            sigma: change(&self.sigma),
            locking: self.locking.as_ref().map(change),
        }
    }
}
