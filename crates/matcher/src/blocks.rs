//! A large picture in blocks of rows, which are matched one after the other.
//!
//! A match takes memory in proportion to its rows, and the answer at a pixel depends on rows near it alone. So
//! a block of rows is matched like a picture of its own, with a rim of rows on both sides that windows and
//! discs reach into. What holds for the whole picture, such as the range of disparities, is found once, from
//! rows spread over it ([`Overview`]). Where blocks begin follows from the size of the frames and from the
//! options: the maps do not depend on how many blocks are in memory, or on who matches them.

mod block_progress;
mod joined;

use std::ops::Range;

use super::candidates::{Candidates, DisparityRange};
use super::cost::normalise::NORMALISING_WINDOW_PX;
use super::lines::EpiLines;
use super::maps::DisparityMaps;
use super::options::{LARGEST_WINDOW_PX, MatchError, MatchOptions};
use super::stations::{Overview, matched, overview, prepared};
use super::validity::area::{Area, LARGEST_CELL_PX, rim_px, span, with_rim};
pub(super) use block_progress::BlockProgress;
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::volume::{Volume, VolumeShape};
pub(super) use joined::Joined;

/// Bytes that frames and maps of a block take.
const BLOCK_BYTES: usize = 768 << 20;
/// Bytes that the maps of a match take for each pixel, as measured.
const MAP_BYTES: usize = 96;
/// A block has at least so many rows beside its rim, so that most of the work is not done twice.
const LEAST_ROWS: usize = 256;

/// Pieces of the picture that the overview is taken from: the range survey looks at one row in the middle of each.
const STRIPS: usize = 24;

impl MatchOptions {
    /// Most rows that are answered in one go, of `rows` x `columns` whose samples take so many bytes for each pixel.
    fn rows_of_a_block(&self, rows: usize, columns: usize, sample_bytes: usize) -> usize {
        self.block_rows.unwrap_or_else(|| {
            let fit = BLOCK_BYTES / (columns * (sample_bytes + MAP_BYTES)).max(1);
            match rows <= fit {
                true => rows.max(1),
                // Blocks and their rims begin and end with cells.
                false => fit.saturating_sub(2 * (rim_px(self) + LARGEST_CELL_PX)).max(LEAST_ROWS),
            }
        })
    }

    /// Most rows that a match of `rows` x `columns` holds in one go, whose samples take so many bytes for each pixel of
    /// all frames: those of a [block](Blocks) with its rim, or all.
    pub fn rows_at_once(&self, rows: usize, columns: usize, sample_bytes: usize) -> usize {
        let answered = self.rows_of_a_block(rows, columns, sample_bytes);
        if answered >= rows { rows } else { (answered + 2 * (rim_px(self) + LARGEST_CELL_PX)).min(rows) }
    }
}

/// The blocks of a match, without the frames.
///
/// ```
/// use std::sync::Arc;
///
/// use epirig_matcher::{Blocks, MatchError, MatchOptions, Matcher, RowSource, Silent};
/// # use epirig_core::tau::Tau;
/// # use epirig_core::volume::Volume;
/// # let mut volume = Volume::new(48, 64, 8, Tau::equidistant(5)?);
/// # for t in 0..5 {
/// #     let texture = |i: usize| (128.0 + 60.0 * ((i % 64 + t) as f64 * 1.9).sin() + 40.0 * ((i % 64 + t) as f64 * 0.7 + (i / 64) as f64).sin()) as u8;
/// #     let samples = epirig_core::frame::Samples::U8((0..48 * 64).map(texture).collect());
/// #     volume.insert(t, &epirig_core::frame::Frame::new(48, 64, 8, samples)?)?;
/// # }
/// // Rows may come from wherever they are: here from a volume.
/// let source: Arc<dyn RowSource> = Arc::new(volume);
/// let options = MatchOptions { block_rows: Some(16), ..MatchOptions::default() };
/// let blocks = Blocks::new(&source.shape(), options)?;
/// let matcher = Matcher::of_source(source, blocks, &Silent)?;
/// // Blocks may be matched by several processes, in any order.
/// let overview = matcher.overview(&Silent)?;
/// let mut parts = Vec::new();
/// matcher.match_blocks(0..3, overview, &Silent, |_, maps| {
///     parts.push(Ok::<_, MatchError>(maps));
///     Ok::<_, MatchError>(())
/// })?;
/// let maps = matcher.blocks().joined(parts)?;
/// assert_eq!(maps.disparity.rows(), 48);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Blocks {
    rows: usize,
    columns: usize,
    frames: usize,
    /// Bytes of a stored sample.
    sample_bytes: usize,
    reference: usize,
    options: MatchOptions,
    /// The pixels that are asked for; `None`: all.
    inside: Option<Grid<bool>>,
    /// The columns of each row that all frames show; `None`: all.
    shown: Option<Vec<Range<usize>>>,
    /// The rows of each block, without its rim.
    blocks: Vec<Range<usize>>,
}

impl Blocks {
    /// The blocks of a match of frames of this `shape`.
    ///
    /// # Errors
    /// [`MatchError`] if the options do not suit the frames.
    pub fn new(shape: &VolumeShape, options: MatchOptions) -> Result<Self, MatchError> {
        let (rows, columns, frames) = (shape.rows, shape.columns, shape.tau.frames());
        options.check(rows, columns, frames)?;
        let reference = options.reference_index(&shape.tau)?;
        let sample_bytes = if shape.stored_bit_depth() > 8 { 2 } else { 1 };
        let new = Self {
            rows,
            columns,
            frames,
            sample_bytes,
            reference,
            options,
            inside: None,
            shown: None,
            blocks: Vec::new(),
        };
        Ok(Self { blocks: new.divided(0..rows), ..new })
    }

    /// The same of which only the pixels `inside` are asked for; rows x columns of the picture. The others become
    /// [`Validity::Outside`](super::Validity::Outside).
    ///
    /// # Errors
    /// [`MatchError::MaskSize`] if `inside` has another size; [`MatchError::EmptyMask`] if no pixel is inside.
    pub fn within(self, inside: &Grid<bool>) -> Result<Self, MatchError> {
        Area::new(inside, self.rows, self.columns, &self.options)?;
        let used = span((0..self.rows).filter(|&y| inside.row(y).contains(&true))).unwrap_or(0..0);
        let mut blocks = self.divided(used);
        blocks.retain(|rows| rows.clone().any(|y| inside.row(y).contains(&true)));
        Ok(Self { inside: Some(inside.clone()), blocks, ..self })
    }

    /// The same of frames that all show only some columns, a range for each row of the picture: beyond them
    /// there is nothing of the scene, as beyond the image. The interpolation along lines reads 3 px beyond.
    ///
    /// # Errors
    /// [`MatchError::ShownRows`] if there is not a range for each row, or one leads beyond the image.
    pub fn showing(self, shown: Vec<Range<usize>>) -> Result<Self, MatchError> {
        let (rows, columns) = (self.rows, self.columns);
        if shown.len() != rows || shown.iter().any(|range| range.end > columns) {
            return Err(MatchError::ShownRows { ranges: shown.len(), rows, columns });
        }
        Ok(Self { shown: Some(shown), ..self })
    }

    /// `used` rows in blocks: one, unless they take more memory than a block should.
    fn divided(&self, used: Range<usize>) -> Vec<Range<usize>> {
        let of_frame = self.frames * self.sample_bytes;
        let most = self.options.rows_of_a_block(used.len(), self.columns, of_frame);
        let aligned =
            if self.options.block_rows.is_some() || used.len() <= most { 1 } else { LARGEST_CELL_PX };
        let count = used.len().div_ceil(most).max(1);
        let height = used.len().div_ceil(count).next_multiple_of(aligned).max(1);
        let first = used.start / aligned * aligned;
        let begins = (first..used.end).step_by(height);
        begins.map(|begin| begin.max(used.start)..(begin + height).min(used.end)).collect()
    }

    /// Number of blocks.
    pub fn count(&self) -> usize {
        self.blocks.len()
    }

    /// Rows of the picture.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Columns of the picture.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Index of the reference frame.
    pub fn reference(&self) -> usize {
        self.reference
    }

    /// The options of the match.
    pub fn options(&self) -> &MatchOptions {
        &self.options
    }

    /// Whether each pixel of the picture is asked for; `None`: all are.
    pub fn inside(&self) -> Option<&Grid<bool>> {
        self.inside.as_ref()
    }

    /// The rows that `block` answers.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn answered_rows(&self, block: usize) -> Range<usize> {
        self.blocks[block].clone()
    }

    /// The rows that the match of `block` reads.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn needed_rows(&self, block: usize) -> Range<usize> {
        let own = &self.blocks[block];
        let used = match &self.inside {
            None if *own == (0..self.rows) => return own.clone(),
            None => own.clone(),
            // A block has a pixel that is asked for.
            Some(inside) => {
                span(own.clone().filter(|&y| inside.row(y).contains(&true))).unwrap_or(own.clone())
            }
        };
        with_rim(used, self.rows, &self.options)
    }

    /// Whether this range of disparities may be searched in these frames.
    pub fn suits(&self, range: DisparityRange) -> bool {
        let options = MatchOptions { range: Some(range), ..self.options.clone() };
        let candidates = || Candidates::covering(range, options.disparity_step_px);
        options.check(self.rows, self.columns, self.frames).is_ok()
            && options.check_search(&candidates()).is_ok()
    }

    /// Whether the match reads all rows at a time: a single block that needs them.
    pub fn needs_all_rows(&self) -> bool {
        self.count() == 1 && self.needed_rows(0) == (0..self.rows)
    }

    /// The part of the picture that is matched for `block`; `None`: all of it.
    pub(super) fn area(&self, block: usize) -> Option<Area> {
        let rows = &self.blocks[block];
        if self.inside.is_none() && *rows == (0..self.rows) {
            return None;
        }
        let mut inside = Grid::filled(self.rows, self.columns, false);
        for y in rows.clone() {
            match &self.inside {
                Some(all) => inside.row_mut(y).copy_from_slice(all.row(y)),
                None => inside.row_mut(y).fill(true),
            }
        }
        // A block has a pixel that is asked for, in a picture of this size.
        Area::new(&inside, self.rows, self.columns, &self.options).ok()
    }

    /// The lines of the reference frame of `volume`, which holds these rows of the picture.
    pub(super) fn lines(&self, volume: &Volume, rows: impl Iterator<Item = usize>) -> EpiLines {
        let shown = self.shown.as_ref().map(|shown| rows.map(|y| shown[y].clone()).collect());
        EpiLines::new(volume.tau(), self.reference, self.columns).showing(shown)
    }

    /// The rows that tell what holds for the whole picture, in their order: strips that are spread over it.
    pub(super) fn overview_rows(&self) -> Vec<usize> {
        let (first, end) = match (self.blocks.first(), self.blocks.last()) {
            (Some(first), Some(last)) => (first.start, last.end),
            _ => return Vec::new(),
        };
        // Windows around the row in the middle, of costs and of normalised frames, do not reach the next strip.
        // A strip is one chunk of a packed volume, or few, and rows are joined in pairs.
        let height = (self.options.window_px.max(3) + 12).next_multiple_of(LARGEST_CELL_PX);
        if end - first <= STRIPS * (height + LARGEST_CELL_PX) {
            return (first..end).collect();
        }
        let begin = |strip: usize| {
            let even = first + strip * (end - first - height) / (STRIPS - 1);
            (even / LARGEST_CELL_PX * LARGEST_CELL_PX).max(first)
        };
        (0..STRIPS).flat_map(|strip| begin(strip)..begin(strip) + height).collect()
    }

    /// What holds for the whole picture, from the [rows](Self::overview_rows) of all frames that tell it.
    pub(super) fn overview(&self, sample: Volume, progress: &dyn Progress) -> Result<Overview, MatchError> {
        let sample = prepared(sample, &self.options);
        let lines = self.lines(&sample, self.overview_rows().into_iter());
        overview(&sample, &lines, &self.options, progress)
    }

    /// The maps of the rows that `block` answers, from the [rows](Self::needed_rows) of all frames that it needs, which
    /// are [prepared]. What holds for the whole picture is found in these rows if no `overview` is given, as is right for
    /// a single block.
    pub(super) fn of_prepared(
        &self,
        block: usize,
        needed: &Volume,
        overview: Option<Overview>,
        progress: &dyn Progress,
    ) -> Result<DisparityMaps, MatchError> {
        let area = self.area(block);
        let rows = area.as_ref().map_or(0..self.rows, |area| area.rows.clone());
        let lines = self.lines(needed, rows.clone());
        let maps = matched(needed, &lines, area.as_ref(), &self.options, overview, progress)?;
        let own = &self.blocks[block];
        Ok(maps.of_rows(own.start - rows.start..own.end - rows.start))
    }

    /// The rows that the costs of row `y` come from.
    pub(super) fn rows_of_costs(&self, y: usize) -> Range<usize> {
        let reach = LARGEST_WINDOW_PX + NORMALISING_WINDOW_PX;
        y.saturating_sub(reach)..(y + reach + 1).min(self.rows)
    }

    /// The maps of the picture from those of its blocks, in their order, which are asked for one after the other.
    ///
    /// # Errors
    /// The first of `parts` that is one.
    ///
    /// # Panics
    /// If there is a part too few or too many, or one has other rows than its block.
    pub fn joined<E>(
        &self,
        parts: impl IntoIterator<Item = Result<DisparityMaps, E>>,
    ) -> Result<DisparityMaps, E> {
        let mut joined = Joined::default();
        let mut blocks = self.blocks.iter();
        for part in parts {
            let rows = blocks.next().expect("a part for each block").clone();
            joined.put(part?, rows, self.rows);
        }
        assert!(blocks.next().is_none(), "a part for each block");
        Ok(joined.maps())
    }
}

#[cfg(test)]
mod tests;
