//! How far away the nearest pixel of a kind is.

use epirig_core::grid::Grid;

/// Finds the nearest one of marked pixels.
pub(super) struct Nearest {
    /// The row of the nearest one in the same column.
    rows: Grid<Option<usize>>,
}

impl Nearest {
    pub(super) fn new(marked: &Grid<bool>) -> Self {
        let mut rows = marked.map(|_| None);
        for x in 0..marked.columns() {
            let mut before: Option<usize> = None;
            for y in 0..marked.rows() {
                before = if marked.at(x, y) { Some(y) } else { before };
                rows.row_mut(y)[x] = before;
            }
            let mut after: Option<usize> = None;
            for y in (0..marked.rows()).rev() {
                after = if marked.at(x, y) { Some(y) } else { after };
                let nearer =
                    |row: usize| after.filter(|after| after.abs_diff(y) < row.abs_diff(y)).unwrap_or(row);
                rows.row_mut(y)[x] = rows.at(x, y).map(nearer).or(after);
            }
        }
        Self { rows }
    }

    /// The distance to the edge of the nearest one, in px, and its column and row; `None` if there is none. Edges lie
    /// half a pixel before the middle.
    pub(super) fn of(&self, x: usize, y: usize) -> Option<(f64, (usize, usize))> {
        let row = self.rows.row(y);
        let mut best: Option<(usize, (usize, usize))> = None;
        for away in 0..row.len() {
            // Columns farther away than the best one cannot be nearer.
            if best.is_some_and(|(squared, _)| away * away >= squared) {
                break;
            }
            for column in [x.checked_sub(away), x.checked_add(away)].into_iter().flatten() {
                if let Some(found) = row.get(column).copied().flatten() {
                    let squared = away * away + found.abs_diff(y).pow(2);
                    if best.is_none_or(|(before, _)| squared < before) {
                        best = Some((squared, (column, found)));
                    }
                }
            }
        }
        best.map(|(squared, place)| ((squared as f64).sqrt() - 0.5, place))
    }
}
