//! Limits of deviation: a frame that deviates further counts as occluding the point.

use epirig_core::statistics::upper_median;
use std::ops::Range;

use super::kernels::CHUNK;
use super::plan::Plan;
use super::row_costs::RowCosts;
use crate::cost::contrast::{contrast, squared_gradients};
use epirig_core::volume::Volume;

/// Times the variance of the noise that is allowed for: four standard deviations of a group's mean of some
/// ten frames, the reference frame's own noise and that within the group.
pub(crate) const NOISE_OF_GROUPS: f32 = 4.0;
/// The same for single frames: two standard deviations of the difference of two frames.
pub(crate) const NOISE_OF_FRAMES: f32 = 8.0;

/// The limit of squared deviations in DN^2 for each pixel of the rows `held` of the reference frame.
///
/// It is `share` of the contrast around the pixel in its row, plus the effect of the disparity step and of
/// noise (`noise_factor` times its variance), and at least `least`. Each row is followed by the values that a
/// last chunk reads beyond it.
pub(crate) fn limits(
    volume: &Volume,
    plan: &Plan,
    rows: Range<usize>,
    least: f32,
    share: f32,
    noise_factor: f32,
) -> Vec<Vec<f32>> {
    let mut row = vec![0.0; volume.columns()];
    let step = half_step(plan).powi(2);
    let noise = noise_variance(volume, plan, (rows.start + rows.end) / 2);
    rows.map(|y| {
        volume.copy_row(y, plan.reference, &mut row);
        let limit = |(contrast, gradient): (f32, f32)| match noise {
            Some(noise) => share * contrast + step * gradient + noise_factor * noise + least,
            // For single frames noise cannot be separated from contrast, so the whole contrast is allowed.
            None => contrast + least,
        };
        contrast(&row)
            .zip(squared_gradients(&row))
            .map(limit)
            .chain(std::iter::repeat_n(least, CHUNK))
            .collect()
    })
    .collect()
}

/// The farthest shift by which the nearest candidate misses a point, in px.
fn half_step(plan: &Plan) -> f32 {
    (0.5 * plan.candidates.disparity_step_px() * plan.farthest) as f32
}

/// Variance of the noise in row `y`: within the group next to the reference frame, under the gradient that
/// suits each column best; the median of the columns. `None` if that group is a single frame.
fn noise_variance(volume: &Volume, plan: &Plan, y: usize) -> Option<f32> {
    let groups = &plan.groups;
    let near = [groups.before.checked_sub(1), Some(groups.before)].into_iter().flatten();
    let group = near.filter(|&g| g < groups.groups.len()).max_by_key(|&g| groups.groups[g].frames.len())?;
    let frames = groups.groups[group].frames.len() as f32;
    if frames < 2.0 {
        return None;
    }
    let mut costs = RowCosts::new(volume, plan);
    costs.load_row(y);
    let mut least = vec![f32::INFINITY; plan.columns];
    for block in &plan.blocks {
        costs.load_block(block);
        let seen = block.seen[group].start..block.seen[group].end.min(plan.columns);
        let spreads = &costs.spreads(group)[seen.clone()];
        least[seen].iter_mut().zip(spreads).for_each(|(least, &spread)| *least = least.min(spread));
    }
    let mut known: Vec<f32> = least.into_iter().filter(|spread| spread.is_finite()).collect();
    upper_median(&mut known).map(|spread| spread * frames / (frames - 1.0))
}

#[cfg(test)]
mod tests;
