//! Variance of the intensities along a candidate (paper, section 4), averaged over a window.

use fearless_simd::{Level, dispatch};

use super::band::Band;
use super::kernels;
use super::sides::best_side;
use crate::cost::interpolation::Interpolation;
use crate::lines::{EpiLines, SeenRule, Sightings};

/// Fills cost rows one disparity after another.
///
/// Samples enter the sums less the reference frame's own pixel: around the right candidate the sums stay
/// small, so single precision suffices there; and the reference frame itself adds nothing.
pub(super) struct Variance<'a> {
    band: &'a Band,
    lines: &'a EpiLines,
    interpolation: Interpolation,
    level: Level,
    anchors: Vec<Vec<f32>>,
    /// Sum and sum of squares, before and after the reference frame.
    sums: [Vec<f32>; 4],
    /// Costs of single pixels for each held row.
    single: Vec<Vec<f32>>,
}

impl<'a> Variance<'a> {
    pub(super) fn new(band: &'a Band, lines: &'a EpiLines, interpolation: Interpolation) -> Self {
        let columns = lines.columns();
        let level = Level::new();
        let anchors = band
            .epis
            .iter()
            .map(|epi| {
                let mut row = vec![0.0; columns];
                let taps = epi.taps(lines.reference(), 0, columns);
                let weights = interpolation.weights(0.0);
                dispatch!(level, _simd => kernels::sample(taps, weights, &mut row));
                row
            })
            .collect();
        Self {
            band,
            lines,
            interpolation,
            level,
            anchors,
            sums: std::array::from_fn(|_| vec![0.0; columns]),
            single: vec![vec![f32::NAN; columns]; band.epis.len()],
        }
    }

    pub(super) fn fill<'r>(
        &mut self,
        disparity_px: f64,
        rule: SeenRule,
        rows: impl Iterator<Item = &'r mut [f32]>,
    ) {
        let sightings = Sightings::count(self.lines, disparity_px);
        for index in 0..self.band.epis.len() {
            self.fill_single(index, disparity_px, rule, &sightings);
        }
        for (index, out) in rows.enumerate() {
            average_window(&self.single[self.band.window_rows(index)], self.band.half, out);
        }
    }

    fn fill_single(&mut self, index: usize, disparity_px: f64, rule: SeenRule, sightings: &Sightings) {
        self.sums.iter_mut().for_each(|sums| sums.fill(0.0));
        let [sum_before, squares_before, sum_after, squares_after] = &mut self.sums;
        for t in (0..self.lines.frames()).filter(|&t| t != self.lines.reference()) {
            let shift = self.lines.shift(disparity_px, t);
            let (first, end) = (shift.first, shift.end);
            if first == end {
                continue;
            }
            let taps = self.band.epis[index].taps(t, first as isize + shift.whole, end - first);
            let weights = self.interpolation.weights(shift.fraction);
            let (sum, squares) = if t < self.lines.reference() {
                (&mut *sum_before, &mut *squares_before)
            } else {
                (&mut *sum_after, &mut *squares_after)
            };
            let anchor = &self.anchors[index][first..end];
            let (sum, squares) = (&mut sum[first..end], &mut squares[first..end]);
            dispatch!(self.level, _simd => kernels::add_deviations(taps, weights, anchor, sum, squares));
        }
        for (x, cost) in self.single[index].iter_mut().enumerate() {
            let frames = [sightings.before[x], sightings.after[x]];
            let before = [sum_before[x], squares_before[x]];
            let after = [sum_after[x], squares_after[x]];
            *cost = best_side(before, after, frames, rule, |[sum, squares], count| {
                ((squares - sum * sum / count) / (count - 1.0)).max(0.0)
            });
        }
    }
}

/// Mean of the finite costs in the window around each pixel; NaN where the pixel's own cost is.
fn average_window(rows: &[Vec<f32>], half: usize, out: &mut [f32]) {
    let columns = out.len();
    // All rows are known at the same columns: visibility depends on column and disparity only.
    let mut known = rows[0].iter().map(|cost| !cost.is_nan());
    let first = known.position(|known| known).unwrap_or(columns);
    let end = rows[0].iter().rposition(|cost| !cost.is_nan()).map_or(first, |last| last + 1);
    out.fill(f32::NAN);
    if rows[0][first..end].iter().any(|cost| cost.is_nan()) {
        for (x, cost) in out.iter_mut().enumerate().filter(|(x, _)| !rows[0][*x].is_nan()) {
            let columns = x.saturating_sub(half)..(x + half + 1).min(columns);
            let values = || rows.iter().flat_map(|row| &row[columns.clone()]).filter(|cost| !cost.is_nan());
            *cost = values().sum::<f32>() / values().count() as f32;
        }
        return;
    }
    let mut sums = rows[0][first..end].to_vec();
    for row in &rows[1..] {
        sums.iter_mut().zip(&row[first..end]).for_each(|(sum, cost)| *sum += cost);
    }
    let count = sums.len();
    let out = &mut out[first..end];
    out.copy_from_slice(&sums);
    for offset in 1..=half.min(count.saturating_sub(1)) {
        out[offset..].iter_mut().zip(&sums[..count - offset]).for_each(|(sum, cost)| *sum += cost);
        out[..count - offset].iter_mut().zip(&sums[offset..]).for_each(|(sum, cost)| *sum += cost);
    }
    for (x, sum) in out.iter_mut().enumerate() {
        let width = (x + half + 1).min(count) - x.saturating_sub(half);
        *sum /= (width * rows.len()) as f32;
    }
}
