//! Where surfaces meet, pixels decide for themselves.
//!
//! Windows of the search that reach across an edge make the surface with more texture wider than it is. There each pixel takes, of the disparities around it, the one that its own
//! samples and those of one side of it agree with clearly better than with what was found (after Kang, Szeliski and Chai 2001, whose windows lie to one side, too).

#[cfg(test)]
pub(super) mod tests;

use rayon::prelude::*;

use super::contrast::contrast;
use super::linear_epi::LinearEpi;
use super::search::Task;
use epirig_core::grid::Grid;

/// Disparities around a pixel that are not farther apart than this, in px, lie on one surface.
const ONE_SURFACE_PX: f32 = 1.0;
/// Sorted disparities that follow each other by more than this, in px, are of two surfaces.
const GAP_PX: f32 = 0.5;
/// At least so many frames are asked, if there are.
const ASKED_FRAMES: usize = 16;
/// A surface is taken if it disagrees by less than this share of what the pixel's guess does: where nothing has texture, all disagree alike, and with 1 some pixels of a featureless ground
/// beside a cube take the cube's disparity (`tests/accuracy.rs`); with 0.9 none does, with less none either, but more pixels of narrow bars stay wrong.
const CLEARLY_LESS: f32 = 0.9;
/// Pixels on a side of the one in question that speak for it.
const SIDE: usize = 2;

/// Gives pixels around which several surfaces lie the disparity of the one that they belong to. `reach` is how far from a surface its disparity may have been found, in px.
pub(super) fn refine_edges(task: Task<'_>, guess: &mut Grid<f32>, reach: usize) {
    let columns = guess.columns();
    let before = guess.clone();
    let around = Around::new(&before, 1.0, reach);
    guess.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, guess)| {
        let open = (0..columns).filter(|&x| !before.at(x, y).is_nan() && around.is_edge((x, y)));
        around.refine_row(task, y, &open.map(|x| (x, (x, y))).collect::<Vec<_>>(), guess);
    });
}

/// Disparities, of which several may lie around a pixel.
pub(super) struct Around<'a> {
    disparities: &'a Grid<f32>,
    /// What they are in px.
    px: f32,
    reach: usize,
    spans: Grid<(f32, f32)>,
}

impl<'a> Around<'a> {
    /// `disparities` of `px` px, found up to `reach` places from their surface.
    pub(super) fn new(disparities: &'a Grid<f32>, px: f32, reach: usize) -> Self {
        Self { disparities, px, reach, spans: spans(disparities, reach) }
    }

    /// Whether several surfaces lie around a place, given by column and row.
    pub(super) fn is_edge(&self, (column, row): (usize, usize)) -> bool {
        let (low, high) = self.spans.at(column, row);
        self.px * (high - low) > ONE_SURFACE_PX
    }

    /// Gives pixels `open` of row `y`, by their column and place among the disparities, that which they agree with best, if clearly better than with their guess.
    pub(super) fn refine_row(
        &self,
        task: Task<'_>,
        y: usize,
        open: &[(usize, (usize, usize))],
        guess: &mut [f32],
    ) {
        // Correlated windows may show other intensities in each frame.
        if open.is_empty() || !task.options.method.compares_intensities() {
            return;
        }
        let asked = Asked::new(task, y);
        for &(x, place) in open {
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

    /// The disparities around a place in px, one for each surface that as many places as are within reach of a line show: fewer are no surface, but chance where nothing has texture.
    fn surfaces(&self, (column, row): (usize, usize)) -> Vec<f32> {
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
        let surfaces = near.chunk_by(|below, above| above - below <= GAP_PX);
        surfaces.filter(|surface| surface.len() >= shown).map(|surface| surface[surface.len() / 2]).collect()
    }
}

/// Least and largest disparity within reach of each pixel; infinite where there is none.
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

/// A row of some frames, which are asked about single pixels.
struct Asked {
    epi: LinearEpi,
    offsets: Vec<f32>,
    reference: usize,
    /// Largest squared deviation of a frame that agrees, for each column, in DN^2: beyond it lies another point.
    limits: Vec<f32>,
}

impl Asked {
    fn new(Task { volume, lines, options, .. }: Task<'_>, y: usize) -> Self {
        let every = (volume.frames() / ASKED_FRAMES).max(1);
        let first = lines.reference() % every;
        let frames = (first..volume.frames()).step_by(every);
        let epi = LinearEpi::of_frames(volume, y, frames.clone());
        let reference = lines.reference() / every;
        let resolution = options.method.resolution();
        let limits = contrast(epi.frame(reference)).map(|contrast| contrast + resolution).collect();
        let offsets = frames.map(|t| lines.offsets()[t] as f32).collect();
        Self { epi, offsets, reference, limits }
    }

    /// How badly the frames agree with the reference frame about pixel `x`, and about the best of the runs of pixels that hold it.
    fn disagreement(&self, x: usize, disparity: f32) -> f32 {
        let first = x.saturating_sub(SIDE);
        let end = (x + SIDE + 1).min(self.limits.len());
        let singles: Vec<f32> = (first..end).map(|x| self.single(x, disparity)).collect();
        let runs = singles.windows(SIDE + 1).map(|run| run.iter().sum::<f32>());
        singles[x - first] + runs.fold(f32::INFINITY, f32::min) / (SIDE + 1) as f32
    }

    /// Mean squared deviation from the reference frame over the limit, at most 1; frames that do not have the point in view deviate.
    fn single(&self, x: usize, disparity: f32) -> f32 {
        let own = self.epi.frame(self.reference)[x];
        let deviations = self.offsets.iter().enumerate().map(|(t, offset)| {
            let value = self.epi.at(t, x as f32 + disparity * offset);
            value.map_or(1.0, |value| ((value - own).powi(2) / self.limits[x]).min(1.0))
        });
        deviations.sum::<f32>() / self.offsets.len() as f32
    }
}
