//! The geometry of lines: where the line of a disparity meets each frame.

use std::ops::Range;
use std::sync::Arc;

use super::options::Occlusion;
use epirig_core::grid::Grid;
use epirig_core::tau::Tau;

/// Where the samples of one frame lie for all pixels of the reference frame under one disparity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shift {
    /// Whole pixels of the shift, towards the smaller.
    pub(crate) whole: isize,
    /// Rest of the shift, in [0, 1) px.
    pub(crate) fraction: f64,
    /// First column of the reference frame whose sample lies inside the frame.
    pub(crate) first: usize,
    /// One past the last such column; equal to `first` if no column is.
    pub(crate) end: usize,
}

impl Shift {
    /// The shift by `exact` px in images that show these columns.
    pub(super) fn by(exact: f64, shown: &Range<usize>) -> Self {
        // Sums of products such as 12 * (1/3) miss whole numbers by rounding; a sample must not leave the
        // image by that.
        let nearest = exact.round();
        let shift = if (exact - nearest).abs() < 1e-6 { nearest } else { exact };
        let whole = shift.floor();
        let (start, end) = (shown.start as f64, shown.end as f64);
        let first = (start - shift).ceil().clamp(start, end);
        let end = (end - shift).floor().clamp(first, end);
        Self { whole: whole as isize, fraction: shift - whole, first: first as usize, end: end as usize }
    }
}

/// The lines through the pixels of one reference frame.
#[derive(Debug, Clone, PartialEq)]
pub struct EpiLines {
    columns: usize,
    asked: Range<usize>,
    reference: usize,
    offsets: Vec<f64>,
    /// Columns in which samples count.
    seen: Range<usize>,
    /// The columns of each row that all frames show.
    shown: Option<Arc<[Range<usize>]>>,
}

impl EpiLines {
    /// Lines through the pixels of frame `reference` in images `columns` wide.
    ///
    /// # Panics
    /// If there is no such frame.
    pub fn new(tau: &Tau, reference: usize, columns: usize) -> Self {
        let origin = tau.values()[reference];
        let offsets = tau.values().iter().map(|value| value - origin).collect();
        Self { columns, asked: 0..columns, reference, offsets, seen: 0..columns, shown: None }
    }

    /// The same of which only those through these `columns` of the reference frame are searched.
    ///
    /// # Panics
    /// If a column lies outside the image.
    pub(crate) fn asking(self, columns: Range<usize>) -> Self {
        assert!(columns.start <= columns.end && columns.end <= self.columns);
        Self { asked: columns, ..self }
    }

    /// The same in images of which all frames show only some columns, a range for each row.
    pub(crate) fn showing(self, shown: Option<Arc<[Range<usize>]>>) -> Self {
        Self { shown, ..self }
    }

    /// The columns of row `y` that all frames show: all there are, unless others were given.
    pub(crate) fn shown(&self, y: usize) -> Range<usize> {
        self.shown.as_ref().and_then(|rows| rows.get(y)).cloned().unwrap_or(0..self.columns)
    }

    /// Takes the guesses of pixels that some frame does not show.
    pub(crate) fn forget_unshown(&self, guess: &mut Grid<f32>) {
        for y in 0..guess.rows() {
            let shown = self.shown(y);
            let row = guess.row_mut(y);
            row[..shown.start].fill(f32::NAN);
            row[shown.end..].fill(f32::NAN);
        }
    }

    /// The same lines in rows that are searched together: only columns that are shown in all of them are seen. `None` if
    /// that makes no difference.
    pub(crate) fn of_rows(&self, rows: Range<usize>) -> Option<Self> {
        let shown = self.shown.as_ref()?;
        let rows = &shown[rows.start.min(shown.len())..rows.end.min(shown.len())];
        let common =
            |one: Range<usize>, other: Range<usize>| one.start.max(other.start)..one.end.min(other.end);
        let seen = rows.iter().filter(|range| !range.is_empty()).cloned().reduce(common).unwrap_or(0..0);
        Some(Self { seen: seen.start..seen.end.max(seen.start), ..self.clone() })
    }

    /// Up to `most` rows that may be searched together: in them the columns that are shown change by a few px.
    pub(crate) fn rows_together(&self, most: usize) -> usize {
        const FEW_PX: usize = 8;
        let Some(shown) = &self.shown else { return most };
        let changes = shown
            .iter()
            .zip(shown.iter().skip(most))
            .filter(|(one, other)| !one.is_empty() && !other.is_empty());
        let change = changes
            .map(|(one, other)| one.start.abs_diff(other.start).max(one.end.abs_diff(other.end)))
            .max();
        (most * FEW_PX / change.unwrap_or(0).max(FEW_PX)).max(1)
    }

    /// The same lines in some of the frames, of which `reference` is the reference.
    pub(crate) fn in_frames(&self, tau: &Tau, reference: usize) -> Self {
        let Self { asked, shown, .. } = self.clone();
        Self::new(tau, reference, self.columns).asking(asked).showing(shown)
    }

    /// The same lines in images of half the size, `columns` wide.
    pub(crate) fn halved(&self, tau: &Tau, columns: usize) -> Self {
        let asked = self.asked.start / 2..self.asked.end.div_ceil(2).min(columns);
        // A pixel of these is the mean of four.
        let shown = self.shown.as_ref().map(|rows| {
            let of_two = |two: &[Range<usize>]| {
                let start = two.iter().map(|range| range.start.div_ceil(2)).max().unwrap_or(0);
                let end = two.iter().map(|range| range.end / 2).min().unwrap_or(0);
                start..end.max(start)
            };
            rows.chunks_exact(2).map(of_two).collect()
        });
        Self::new(tau, self.reference, columns).asking(asked).showing(shown)
    }

    /// Columns of the reference frame that are searched: all of them, unless others were asked for.
    pub(crate) fn asked(&self) -> Range<usize> {
        self.asked.clone()
    }

    /// tau of each frame less that of the reference frame; in [-1, 1].
    pub fn offsets(&self) -> &[f64] {
        &self.offsets
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.offsets.len()
    }

    /// Width of the images, in px.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Index of the reference frame.
    pub fn reference(&self) -> usize {
        self.reference
    }

    /// Part of the baseline before the reference frame, in [0, 1].
    pub fn tau_before(&self) -> f64 {
        // Not the negation, which would make a zero of negative sign.
        0.0 - self.offsets[0]
    }

    /// Part of the baseline after the reference frame, in [0, 1].
    pub fn tau_after(&self) -> f64 {
        self.offsets[self.offsets.len() - 1]
    }

    /// Shift of frame `t` under disparity `disparity_px`.
    pub(crate) fn shift(&self, disparity_px: f64, t: usize) -> Shift {
        Shift::by(disparity_px * self.offsets[t], &self.seen)
    }
}

/// Number of frames that see each pixel's candidate under one disparity; the reference frame counts on both
/// sides.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Sightings {
    /// Frames up to and with the reference frame, for each column.
    pub(crate) before: Vec<u16>,
    /// Frames from the reference frame on, for each column.
    pub(crate) after: Vec<u16>,
}

impl Sightings {
    /// Counts the frames under `disparity_px`.
    pub(crate) fn count(lines: &EpiLines, disparity_px: f64) -> Self {
        let mut before = vec![0; lines.columns()];
        let mut after = vec![0; lines.columns()];
        for t in 0..lines.frames() {
            let Shift { first, end, .. } = lines.shift(disparity_px, t);
            if t <= lines.reference() {
                before[first..end].iter_mut().for_each(|count| *count += 1);
            }
            if t >= lines.reference() {
                after[first..end].iter_mut().for_each(|count| *count += 1);
            }
        }
        Self { before, after }
    }
}

/// The rule that a candidate is seen by enough frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SeenRule {
    /// Frames that must see the candidate; at least 3, for two always lie on a line.
    pub(crate) minimum_frames: usize,
    /// Whether one side of the reference frame may serve alone.
    pub(crate) occlusion: Occlusion,
}

impl SeenRule {
    /// The rule for `frames` frames of which the share `min_visible` must see a point.
    pub(crate) fn new(frames: usize, min_visible: f64, occlusion: Occlusion) -> Self {
        let minimum_frames = (min_visible * frames as f64 - 1e-9).ceil() as usize;
        Self { minimum_frames: minimum_frames.max(3), occlusion }
    }

    /// Whether `count` sightings suffice.
    pub(crate) fn suffices(&self, count: usize) -> bool {
        count >= self.minimum_frames
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_keeps_samples_inside_the_image() {
        let tau = Tau::equidistant(4).unwrap();
        let lines = EpiLines::new(&tau, 0, 10);
        // 2 px over the baseline: frame 1 shifts by 2/3, the last by exactly 2.
        assert_eq!(lines.shift(2.0, 3), Shift { whole: 2, fraction: 0.0, first: 0, end: 8 });
        let shift = lines.shift(2.0, 1);
        assert_eq!((shift.whole, shift.first, shift.end), (0, 0, 9));
        let shift = lines.shift(-2.0, 1);
        assert_eq!((shift.whole, shift.first, shift.end), (-1, 1, 10));
        // Beyond the image altogether.
        let shift = lines.shift(30.0, 3);
        assert_eq!(shift.first, shift.end);
        let lines = EpiLines::new(&tau, 3, 10);
        assert_eq!(lines.shift(3.0, 0), Shift { whole: -3, fraction: 0.0, first: 3, end: 10 });
    }
}
