//! The matcher of a volume in memory.

use std::ops::Range;

use super::blocks::{BlockProgress, Blocks};
use super::candidates::{Candidates, DisparityRange};
use super::cost::CostTable;
use super::fit::{Fit, Sizes, fit};
use super::maps::{DisparityMaps, OrderingUsed};
use super::options::{MatchError, MatchOptions};
use super::stack::Stack;
use super::stations::{costs_of_row, prepared, seen_rule};
use epirig_core::grid::Grid;
use epirig_core::progress::{Progress, Silent};
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

/// A volume that is ready to be matched.
#[derive(Debug, Clone)]
pub struct Matcher {
    volume: Volume,
    /// The rows of the picture that `volume` has.
    kept: Range<usize>,
    /// Whether its samples are those that are compared along lines, because one block is all.
    is_prepared: bool,
    blocks: Blocks,
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

    /// Prepares `volume` for the match of these `blocks`, which are of frames of its shape. Rows that no block needs are
    /// dropped.
    pub fn of_blocks(volume: Volume, blocks: Blocks) -> Self {
        let is_prepared = blocks.count() == 1;
        let volume = if is_prepared { prepared(volume, blocks.options()) } else { volume };
        let all = 0..volume.rows();
        Self { volume, kept: all, is_prepared, blocks }.keeping_what_is_needed()
    }

    fn keeping_what_is_needed(self) -> Self {
        let Self { mut volume, kept, is_prepared, blocks } = self;
        let needed = (0..blocks.count()).map(|block| blocks.needed_rows(block));
        let needed = needed.reduce(|first, last| first.start..last.end).unwrap_or(kept.clone());
        volume.keep_rows(needed.start - kept.start..needed.end - kept.start);
        Self { volume, kept: needed, is_prepared, blocks }
    }

    /// The same of which only the pixels `inside` are asked for; rows x columns of the volume.
    ///
    /// The smallest rectangle that holds them is matched, with a rim that windows around them reach. The
    /// other rows are dropped, and the other columns are left out of the factorised search. Pixels that are
    /// not inside become [`Validity::Outside`](super::Validity::Outside). Answers inside are those without a mask,
    /// up to the influence of what is estimated from all pixels: the range, gains of frames, noise, and pixel
    /// locking.
    ///
    /// # Errors
    /// [`MatchError::MaskSize`] if `inside` has another size; [`MatchError::EmptyMask`] if no pixel is inside.
    pub fn within(self, inside: &Grid<bool>) -> Result<Self, MatchError> {
        let blocks = self.blocks.within(inside)?;
        Ok(Self { blocks, ..self }.keeping_what_is_needed())
    }

    /// The same of frames that all show only some columns, a range for each row of the picture: beyond them
    /// there is nothing of the scene, as beyond the image. The interpolation along lines reads 3 px beyond.
    ///
    /// # Errors
    /// [`MatchError::ShownRows`] if there is not a range for each row, or one leads beyond the image.
    pub fn showing(self, shown: Vec<Range<usize>>) -> Result<Self, MatchError> {
        Ok(Self { blocks: self.blocks.showing(shown)?, ..self })
    }

    /// The blocks of rows that are matched one after the other.
    pub fn blocks(&self) -> &Blocks {
        &self.blocks
    }

    /// A copy of these rows of the picture.
    fn rows(&self, rows: impl Iterator<Item = usize>) -> Volume {
        let rows: Vec<usize> = rows.map(|y| y - self.kept.start).collect();
        let frames: Vec<usize> = (0..self.volume.frames()).collect();
        self.volume.selected(&rows, &frames, self.volume.tau().clone())
    }

    /// The rows that `block` needs, as they are compared.
    fn prepared_rows(&self, block: usize) -> Volume {
        match self.is_prepared {
            true => self.volume.clone(),
            false => prepared(self.rows(self.blocks.needed_rows(block)), self.blocks.options()),
        }
    }

    /// Disparity of every pixel of the reference frame.
    ///
    /// Frames of more than some hundred megabytes are matched in [blocks of rows](Blocks). The result does not
    /// depend on the number of threads.
    ///
    /// # Errors
    /// [`MatchError`] if the options do not suit the volume, no range was given and none is to be found, or
    /// `progress` has cancelled the match.
    pub fn matched(&self, progress: &dyn Progress) -> Result<DisparityMaps, MatchError> {
        let blocks = &self.blocks;
        if blocks.count() == 1 {
            let rows = self.prepared_rows(0);
            return blocks.joined([blocks.of_prepared(0, &rows, None, progress)]);
        }
        let overview = blocks.overview(&self.rows(blocks.overview_rows().into_iter()), progress)?;
        let told = BlockProgress::begin(progress, blocks, 0..blocks.count());
        let maps = blocks.joined((0..blocks.count()).map(|block| {
            told.next_block();
            blocks.of_prepared(block, &self.prepared_rows(block), Some(overview), &told)
        }))?;
        told.finish();
        Ok(maps)
    }

    /// The pixels that `maps` answers, by planes in discs of one size.
    ///
    /// Discs that grow with the noise see a step edge from as far as they reach, which differs from
    /// pixel to pixel. These see it from 2 px, so a mean over many pixels farther away is right,
    /// although each pixel has more noise.
    ///
    /// # Errors
    /// [`MatchError::Cancelled`] if `progress` has cancelled it.
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
            let volume = self.prepared_rows(block);
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
    /// # Panics
    /// If `y` lies outside the volume, or outside the rows that a mask left of it.
    pub fn row_costs(&self, y: usize, maps: &DisparityMaps) -> (Candidates, CostTable) {
        self.costs_of_row(y, maps.reference, maps.range, maps.ordering)
    }

    /// The same for a match of which only the reference frame, the range and the ordering are known.
    ///
    /// # Panics
    /// If `y` or `reference` lies outside the volume, or `y` outside the rows that a mask left of it.
    pub fn costs_of_row(
        &self,
        y: usize,
        reference: usize,
        range: DisparityRange,
        ordering: OrderingUsed,
    ) -> (Candidates, CostTable) {
        let options = self.blocks.options();
        if self.is_prepared {
            return costs_of_row(&self.volume, y - self.kept.start, options, (reference, range, ordering));
        }
        let near = self.blocks.rows_of_costs(y);
        let near = near.start.max(self.kept.start)..near.end.min(self.kept.end);
        let volume = prepared(self.rows(near.clone()), options);
        costs_of_row(&volume, y - near.start, options, (reference, range, ordering))
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
