//! The tolerance of a scene: how far frames deviate from each other along the lines of right candidates.
//!
//! It is measured in the scene itself, because photographs deviate several times as far as ideal light does.

use epirig_core::statistics::upper_median;
use rayon::prelude::*;

use super::free;
use super::task::Task;
use super::tolerance::Tolerance;
use crate::aggregation::rows::sampled_rows;
use crate::aggregation::semi_global::RowBand;
use crate::aggregation::sweep::Window;
use crate::cost::factorised::plan::Plan;

/// Frames are taken to disagree beyond this many times the mean squared deviation of right candidates: two
/// standard deviations.
const DISAGREES: f32 = 4.0;
/// Least share of the contrast that a frame may deviate by. Two unrelated points of one texture deviate by
/// twice the contrast in the mean of squares; below 0.06 of it come 14 % of them (normal distribution), so
/// that occluded frames seldom agree by chance.
const LEAST_SHARE: f32 = 0.1;

/// Measures the scene: best candidates of a few rows, of which most are right.
pub(super) fn measured_tolerance(task: Task<'_>, plan: &Plan, window: Window) -> Tolerance {
    let typical = |share: f32| {
        let tolerance = Tolerance { share, typical: 0.0 };
        let search = free::Search::new(task, plan, window, Some(tolerance));
        let mut costs: Vec<f32> = sampled_rows(task.volume.rows())
            .into_par_iter()
            .filter(|_| !task.progress.cancelled())
            .flat_map_iter(|y| search.rows(RowBand::alone(y..y + 1), None))
            .flat_map_iter(|row| row.disagreement.into_iter().filter(|cost| !cost.is_nan()))
            .collect();
        upper_median(&mut costs).unwrap_or(0.0)
    };
    let share = (DISAGREES * typical(1.0)).clamp(LEAST_SHARE, 1.0);
    Tolerance { share, typical: typical(share) }
}

#[cfg(test)]
mod tests;
