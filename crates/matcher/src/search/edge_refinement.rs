//! Edge refinement: the disparity of pixels near a depth edge is decided by the pixels themselves.
//!
//! A search window that reaches across an edge widens the surface that has more texture. So every pixel near
//! an edge compares the disparities found around it. It takes another one than it was given if its own
//! samples, and those on one side of it, agree with that one clearly better (after Kang, Szeliski and Chai
//! 2001, whose windows lie to one side, too).

#[cfg(test)]
pub(crate) mod tests;

use rayon::prelude::*;

use super::Task;
use crate::cost::contrast::contrast;
use crate::cost::linear_epi::LinearEpi;
use crate::one_surface::OneSurface;
use epirig_core::grid::Grid;

/// Number of frames that are compared, if the sequence has as many.
const COMPARED_FRAMES: usize = 16;
/// A pixel takes another surface if its frames disagree with it by less than this share of what they disagree
/// with the guess. Where nothing has texture, all disagree alike: with 1, some pixels of a featureless ground
/// beside a cube take the cube's disparity (`tests/accuracy.rs`). With 0.9 or less none does, but with less
/// than 0.9 more pixels of narrow bars stay wrong.
const CLEARLY_LESS: f32 = 0.9;
/// Number of pixels on one side of a pixel that are compared with it.
const SIDE: usize = 2;

/// Gives pixels with several surfaces around them the disparity of their own surface. `reach` is how far from
/// a surface its disparity may have been found, in px.
pub(crate) fn refine_edges(task: Task<'_>, guess: &mut Grid<f32>, reach: usize) {
    let columns = guess.columns();
    let before = guess.clone();
    let around = Around::new(&before, 1.0, reach);
    guess.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, guess)| {
        if task.progress.cancelled() {
            return;
        }
        let pixels = (0..columns).map(|x| OpenPixel { x, place: Place { column: x, row: y } });
        let open = pixels.filter(|pixel| !before.at(pixel.x, y).is_nan() && around.is_edge(pixel.place));
        around.refine_row(task, y, &open.collect::<Vec<_>>(), guess);
    });
}

/// A place among disparities.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) column: usize,
    pub(crate) row: usize,
}

/// A pixel of a row that may lie on another surface than its guess says.
pub(crate) struct OpenPixel {
    pub(crate) x: usize,
    /// Where it lies among the disparities.
    pub(crate) place: Place,
}

/// Disparities, of which several may lie around a pixel.
pub(crate) struct Around<'a> {
    disparities: &'a Grid<f32>,
    /// Size of a unit of them, in px.
    px: f32,
    reach: usize,
    spans: Grid<(f32, f32)>,
}

impl<'a> Around<'a> {
    /// `disparities` of `px` px, found up to `reach` places from their surface.
    pub(crate) fn new(disparities: &'a Grid<f32>, px: f32, reach: usize) -> Self {
        Self { disparities, px, reach, spans: spans(disparities, reach) }
    }

    /// Whether several surfaces lie around a place.
    pub(crate) fn is_edge(&self, Place { column, row }: Place) -> bool {
        let (low, high) = self.spans.at(column, row);
        self.px * (high - low) > OneSurface::ROUGH.step_px
    }

    /// Gives pixels `open` of row `y` the disparity that they agree
    /// with best, if clearly better than with their guess.
    pub(crate) fn refine_row(&self, task: Task<'_>, y: usize, open: &[OpenPixel], guess: &mut [f32]) {
        // Correlated windows may show other intensities in each frame.
        if open.is_empty() || !task.options.method.compares_intensities() {
            return;
        }
        let asked = ComparedRow::new(task, y);
        for &OpenPixel { x, place } in open {
            let surfaces = self.surfaces(place);
            // A single one is steep, or beside wrong answers, but no edge.
            if surfaces.len() < 2 {
                continue;
            }
            let tried = surfaces.into_iter().map(|disparity| (disparity, asked.disagreement(x, disparity)));
            if let Some((disparity, least)) = tried.min_by(|a, b| a.1.total_cmp(&b.1))
                && least < CLEARLY_LESS * asked.disagreement(x, guess[x])
            {
                guess[x] = disparity;
            }
        }
    }

    /// The disparities around a place in px, one for each surface. A surface counts if it has as many places
    /// as a line within reach: fewer are chance where nothing has texture.
    fn surfaces(&self, Place { column, row }: Place) -> Vec<f32> {
        let near = |place: usize, count: usize| {
            place.saturating_sub(self.reach)..(place + self.reach + 1).min(count)
        };
        let columns = near(column, self.disparities.columns());
        let rows = near(row, self.disparities.rows());
        let shown = columns.len().min(rows.len());
        let near =
            rows.flat_map(|v| &self.disparities.row(v)[columns.clone()]).filter(|value| !value.is_nan());
        let mut near: Vec<f32> = near.map(|value| self.px * value).collect();
        near.sort_unstable_by(f32::total_cmp);
        let surfaces = near.chunk_by(|below, above| OneSurface::FINE.holds(above - below, 0.0));
        surfaces.filter(|surface| surface.len() >= shown).map(|surface| surface[surface.len() / 2]).collect()
    }
}

/// Least and largest disparity within reach of each pixel; infinite where no pixel has one.
fn spans(guess: &Grid<f32>, reach: usize) -> Grid<(f32, f32)> {
    let (rows, columns) = (guess.rows(), guess.columns());
    let none = (f32::INFINITY, f32::NEG_INFINITY);
    let near = |place: usize, count: usize| place.saturating_sub(reach)..(place + reach + 1).min(count);
    let mut along = Grid::filled(rows, columns, none);
    along.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
        for (x, out) in out.iter_mut().enumerate() {
            // NaN is neither less nor more.
            let wider = |span: (f32, f32), value: &f32| (span.0.min(*value), span.1.max(*value));
            *out = guess.row(y)[near(x, columns)].iter().fold(none, wider);
        }
    });
    let mut spans = Grid::filled(rows, columns, none);
    spans.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
        for v in near(y, rows) {
            for (out, span) in out.iter_mut().zip(along.row(v)) {
                *out = (out.0.min(span.0), out.1.max(span.1));
            }
        }
    });
    spans
}

/// One row of some frames, for comparing single pixels.
struct ComparedRow {
    epi: LinearEpi,
    offsets: Vec<f32>,
    reference: usize,
    /// Largest squared deviation of a frame that agrees, for each column, in DN^2: beyond it lies another
    /// point.
    limits: Vec<f32>,
}

impl ComparedRow {
    fn new(Task { volume, lines, options, .. }: Task<'_>, y: usize) -> Self {
        let every = (volume.frames() / COMPARED_FRAMES).max(1);
        let first = lines.reference() % every;
        let frames = (first..volume.frames()).step_by(every);
        let epi = LinearEpi::of_frames(volume, y, frames.clone());
        let reference = lines.reference() / every;
        let resolution = options.method.resolution();
        let limits = contrast(epi.frame(reference)).map(|contrast| contrast + resolution).collect();
        let offsets = frames.map(|t| lines.offsets()[t] as f32).collect();
        Self { epi, offsets, reference, limits }
    }

    /// Disagreement of the frames with the reference frame at pixel `x`, together with the best run of pixels
    /// that contains it.
    fn disagreement(&self, x: usize, disparity: f32) -> f32 {
        let first = x.saturating_sub(SIDE);
        let end = (x + SIDE + 1).min(self.limits.len());
        let singles: Vec<f32> = (first..end).map(|x| self.single(x, disparity)).collect();
        let runs = singles.windows(SIDE + 1).map(|run| run.iter().sum::<f32>());
        singles[x - first] + runs.fold(f32::INFINITY, f32::min) / (SIDE + 1) as f32
    }

    /// Mean squared deviation from the reference frame over the limit, at most 1. Frames that do not have the
    /// point in view count 1.
    fn single(&self, x: usize, disparity: f32) -> f32 {
        let own = self.epi.frame(self.reference)[x];
        let deviations = self.offsets.iter().enumerate().map(|(t, offset)| {
            let value = self.epi.at(t, x as f32 + disparity * offset);
            value.map_or(1.0, |value| ((value - own).powi(2) / self.limits[x]).min(1.0))
        });
        deviations.sum::<f32>() / self.offsets.len() as f32
    }
}
