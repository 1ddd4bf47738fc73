//! How far frames deviate from each other along the lines of right candidates: what real light does, measured in the scene itself.

use epirig_core::statistics::upper_median;
use rayon::prelude::*;

use super::Task;
use super::free;
use super::plan::Plan;
use super::sampled_rows;
use super::semi_global::Span;
use super::sweep::Window;

/// Frames are taken to disagree beyond this many times the mean squared deviation of right candidates: two standard deviations.
const DISAGREES: f32 = 4.0;
/// Least share of the contrast that a frame may deviate by. Two unrelated points of one texture deviate by twice the contrast in the mean of
/// squares; below 0.06 of it come 14 % of them (normal distribution), so that occluded frames seldom agree by chance.
const LEAST_SHARE: f32 = 0.1;

/// A right candidate costs at most this many times the median of them: texture and the contrast around it are not alike everywhere.
const COSTS_VARY: f32 = 2.0;

/// Where frames deviate by half of what they may, a quarter in squares, a candidate is right whatever others cost.
const BELIEVED: f32 = 0.25;

/// Differences below this mean nothing: half the square of a tenth of what a frame may deviate by.
pub(super) const LEAST_TYPICAL: f32 = 0.005;

/// What a frame may deviate by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tolerance {
    /// Largest squared deviation of a frame that agrees, as a share of the contrast around the point.
    pub(super) share: f32,
    /// Cost of a right candidate that all frames see: mean squared deviation over the largest, the median of the image.
    pub(super) typical: f32,
}

impl Tolerance {
    /// Measures the scene: best candidates of a few rows, of which most are right.
    pub(super) fn measured(task: Task<'_>, plan: &Plan, window: Window) -> Self {
        let typical = |share: f32| {
            let tolerance = Self { share, typical: 0.0 };
            let search = free::Search::new(task, plan, window, Some(tolerance));
            let mut costs: Vec<f32> = sampled_rows(task.volume.rows())
                .into_par_iter()
                .flat_map_iter(|y| search.rows(Span::alone(y..y + 1), None))
                .flat_map_iter(|row| row.disagreement.into_iter().filter(|cost| !cost.is_nan()))
                .collect();
            upper_median(&mut costs).unwrap_or(0.0)
        };
        let share = (DISAGREES * typical(1.0)).clamp(LEAST_SHARE, 1.0);
        Self { share, typical: typical(share) }
    }

    /// Cost of a right candidate that only the share `minimum_visible` of the frames sees, but no less than those may cost that all frames see:
    /// what costs more is wrong.
    pub(super) fn dearest(&self, minimum_visible: f64) -> f32 {
        let partly_occluded = 1.0 - minimum_visible as f32 * (1.0 - self.typical);
        let varying = (COSTS_VARY * self.typical).max(BELIEVED);
        partly_occluded.max(varying).min(1.0)
    }
}

#[cfg(test)]
mod tests;
