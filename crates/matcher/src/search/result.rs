//! What the search finds, for a row and for the image.

use crate::candidates::Candidates;
use crate::lines::EpiLines;
use crate::validity::Validity;
use epirig_core::grid::Grid;

/// The result of the search for each pixel of the reference frame; rows x columns.
pub(crate) struct SearchResult {
    /// Disparity in px; NaN where unknown.
    pub(crate) guess: Grid<f32>,
    /// Cost of the chosen candidate, in the method's unit; NaN where it has none.
    pub(crate) cost: Grid<f32>,
    /// Confidence against the best candidate elsewhere, 0 to 1; NaN where it has no cost or no rival.
    pub(crate) confidence: Grid<f32>,
    /// Whether there is a disparity.
    pub(crate) validity: Grid<Validity>,
    /// The largest squared deviation of a frame that agrees, as a share of the contrast around a point;
    /// `None` if points are not occluded.
    pub(crate) deviation_share: Option<f32>,
}

impl SearchResult {
    /// No pixel has a disparity.
    pub(super) fn unknown(rows: usize, columns: usize) -> Self {
        let unknown = || Grid::filled(rows, columns, f32::NAN);
        let validity = Grid::filled(rows, columns, Validity::LeavesImage);
        Self { guess: unknown(), cost: unknown(), confidence: unknown(), validity, deviation_share: None }
    }

    /// Takes the answers of the rows from `first` on.
    pub(super) fn put(&mut self, first: usize, rows: &[RowResult]) {
        for (y, row) in rows.iter().enumerate().map(|(index, row)| (first + index, row)) {
            self.guess.row_mut(y).copy_from_slice(&row.disparity);
            self.cost.row_mut(y).copy_from_slice(&row.cost);
            self.confidence.row_mut(y).copy_from_slice(&row.confidence);
            self.validity.row_mut(y).copy_from_slice(&row.validity);
        }
    }
}

/// The answers of one row.
pub(super) struct RowResult {
    pub(super) disparity: Vec<f32>,
    pub(super) cost: Vec<f32>,
    pub(super) confidence: Vec<f32>,
    /// Mean squared deviation over the largest that agrees, of the chosen candidate; NaN where that is not
    /// measured.
    pub(super) disagreement: Vec<f32>,
    pub(super) validity: Vec<Validity>,
}

impl RowResult {
    pub(super) fn unknown(columns: usize) -> Self {
        let unknown = || vec![f32::NAN; columns];
        let validity = vec![Validity::LeavesImage; columns];
        Self {
            disparity: unknown(),
            cost: unknown(),
            confidence: unknown(),
            disagreement: unknown(),
            validity,
        }
    }

    /// Column `x` has the disparity of a candidate, fractional, if it has an answer.
    pub(super) fn place(&mut self, x: usize, candidates: &Candidates, index: f64) {
        if self.validity[x] == Validity::Found {
            self.disparity[x] = candidates.disparity_px(index) as f32;
        }
    }
}

/// Distance of rivals, in candidates: they end at least a pixel from each other.
pub(super) fn rival_distance(lines: &EpiLines, disparity_step_px: f64) -> usize {
    let separation = (1.0 / (disparity_step_px * lines.tau_before().max(lines.tau_after()))).ceil() as usize;
    separation.max(1)
}

/// Whether the candidates around `k` of `count` show it to be the best, `reach` of them on each side.
///
/// Near a candidate that leaves the image (`gone`) nothing shows that: the right one may have left. Nor is it
/// shown if `k` costs more than a neutral candidate (`costly`) while others have left the image, or if it is an
/// end of the range. A range of one or two candidates has only ends, and is accepted.
pub(super) fn bracketed(
    count: usize,
    k: usize,
    reach: usize,
    gone: impl Fn(usize) -> bool,
    costly: bool,
) -> Validity {
    let last = count - 1;
    let mut near = k.saturating_sub(reach)..=(k + reach).min(last);
    let some_gone = gone(0) || gone(last);
    if near.any(&gone) || (some_gone && costly) {
        Validity::LeavesImage
    } else if last > 1 && (k == 0 || k == last) {
        Validity::BeyondRange
    } else {
        Validity::Found
    }
}
