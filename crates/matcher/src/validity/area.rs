//! The part of the picture that is matched: the smallest rectangle around the pixels inside a mask, with a rim.
//!
//! Pixels of the rim are matched for their neighbours' sake: windows reach into it. So a pixel inside finds what
//! it would find without a mask, except for what is estimated from the whole picture: range, gains of frames,
//! noise, and pixel locking.

use std::ops::Range;

use super::Validity;
use crate::fit::largest_disc_px;
use crate::maps::DisparityMaps;
use crate::options::{MatchError, MatchOptions};
use epirig_core::grid::Grid;

/// Side of the largest cells that pixels are joined to, in px: eight pixels of half the resolution. Cells of a part are
/// those of the whole picture, because other cells give other answers, by a fifth of their sigma.
pub(crate) const LARGEST_CELL_PX: usize = 16;

/// `used` rows or columns of so many, with the rim on both sides that their match reads.
pub(crate) fn with_rim(used: Range<usize>, count: usize, options: &MatchOptions) -> Range<usize> {
    let (start, end) = (used.start.saturating_sub(rim_px(options)), used.end + rim_px(options));
    start / LARGEST_CELL_PX * LARGEST_CELL_PX..end.next_multiple_of(LARGEST_CELL_PX).min(count)
}

/// The part of the picture that is matched.
#[derive(Debug, Clone)]
pub(crate) struct Area {
    /// The rows that are matched.
    pub(crate) rows: Range<usize>,
    /// The columns that are searched.
    pub(crate) columns: Range<usize>,
    /// Whether each pixel of the matched rows is inside.
    inside: Grid<bool>,
}

impl Area {
    /// The area for the pixels that are `inside`, of a picture of `rows` x `columns`.
    ///
    /// # Errors
    /// [`MatchError::MaskSize`] if `inside` has another size; [`MatchError::EmptyMask`] if no pixel is inside.
    pub(crate) fn new(
        inside: &Grid<bool>,
        rows: usize,
        columns: usize,
        options: &MatchOptions,
    ) -> Result<Self, MatchError> {
        let (mask_rows, mask_columns) = (inside.rows(), inside.columns());
        if (mask_rows, mask_columns) != (rows, columns) {
            return Err(MatchError::MaskSize { mask_rows, mask_columns, rows, columns });
        }
        let used_rows = span((0..rows).filter(|&y| inside.row(y).contains(&true)));
        let used_columns = span((0..columns).filter(|&x| (0..rows).any(|y| inside.at(x, y))));
        let (Some(used_rows), Some(used_columns)) = (used_rows, used_columns) else {
            return Err(MatchError::EmptyMask);
        };
        let rows_matched = with_rim(used_rows, rows, options);
        let mut part = Grid::filled(rows_matched.len(), columns, false);
        for (y, from) in rows_matched.clone().enumerate() {
            part.row_mut(y).copy_from_slice(inside.row(from));
        }
        Ok(Self { columns: with_rim(used_columns, columns, options), rows: rows_matched, inside: part })
    }

    /// Takes the guesses of columns that are not searched from the fit.
    pub(crate) fn forget_beside(&self, guess: &mut Grid<f32>) {
        for y in 0..guess.rows() {
            let row = guess.row_mut(y);
            row[..self.columns.start].fill(f32::NAN);
            row[self.columns.end..].fill(f32::NAN);
        }
    }

    /// Takes the answers of pixels outside from maps of the matched rows.
    pub(crate) fn forget_outside(&self, maps: &mut DisparityMaps) {
        let DisparityMaps { disparity, sigma, cost, confidence, validity, .. } = maps;
        for (index, _) in self.inside.values().iter().enumerate().filter(|&(_, &inside)| !inside) {
            for map in [&mut *disparity, &mut *sigma, &mut *cost, &mut *confidence] {
                map.values_mut()[index] = f32::NAN;
            }
            validity.values_mut()[index] = Validity::Outside;
        }
    }
}

/// How far beyond a pixel lies what influences its answer, in px: the largest disc around it, and the search's
/// window around the pixels in that disc. Half-widths of the search's window count twice, because windows may lie
/// to one side. What pixels farther away do to the guesses in the disc is not seen: a guess is where the line is
/// linearised, no more.
pub(crate) fn rim_px(options: &MatchOptions) -> usize {
    largest_disc_px() + options.window_px
}

/// From the first to the last of some places; `None` without any.
pub(crate) fn span(mut places: impl DoubleEndedIterator<Item = usize>) -> Option<Range<usize>> {
    let first = places.next()?;
    Some(first..places.next_back().unwrap_or(first) + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inside(rows: usize, columns: usize, is: impl Fn(usize, usize) -> bool) -> Grid<bool> {
        let values = (0..rows * columns).map(|index| is(index % columns, index / columns)).collect();
        Grid::from_values(rows, columns, values).unwrap()
    }

    #[test]
    fn the_area_holds_the_mask_and_its_rim() {
        let options = MatchOptions::default();
        let rim = rim_px(&options);
        let mask = inside(400, 500, |x, y| (x, y) == (201, 190) || (x, y) == (250, 211));
        let area = Area::new(&mask, 400, 500, &options).unwrap();
        let cell = LARGEST_CELL_PX;
        assert!(area.rows.start <= 190 - rim && area.rows.start > 190 - rim - cell, "{:?}", area.rows);
        assert!(area.rows.end > 211 + rim && area.rows.end <= 211 + rim + cell, "{:?}", area.rows);
        assert!(area.columns.start <= 201 - rim && area.columns.end > 250 + rim, "{:?}", area.columns);
        assert_eq!((area.rows.start % cell, area.columns.start % cell), (0, 0));
        // At the borders it ends.
        let all = Area::new(&inside(9, 11, |_, _| true), 9, 11, &options).unwrap();
        assert_eq!((all.rows, all.columns), (0..9, 0..11));
    }

    #[test]
    fn a_mask_of_another_size_or_without_a_pixel_is_refused() {
        let options = MatchOptions::default();
        let refused = Area::new(&inside(9, 11, |_, _| true), 11, 9, &options).unwrap_err();
        assert!(matches!(refused, MatchError::MaskSize { mask_rows: 9, columns: 9, .. }), "{refused}");
        let refused = Area::new(&inside(9, 11, |_, _| false), 9, 11, &options).unwrap_err();
        assert!(matches!(refused, MatchError::EmptyMask), "{refused}");
    }
}
