//! Costs of the single pixels of a row, from sums over groups.

use fearless_simd::{Level, dispatch};

use super::kernels::{self, CHUNK, Rows, Terms};
use super::plan::{DisparityBlock, PAD, Plan};
use epirig_core::volume::Volume;

/// The sums over groups of one row, and the buffers for its costs.
pub(crate) struct RowCosts<'a> {
    volume: &'a Volume,
    plan: &'a Plan,
    pub(crate) level: Level,
    /// Frames x (columns + pads).
    epi: Vec<f32>,
    /// Groups x (columns + pads), for one block.
    means: Vec<f32>,
    spreads: Vec<f32>,
    frames: Vec<f32>,
}

impl<'a> RowCosts<'a> {
    pub(crate) fn new(volume: &'a Volume, plan: &'a Plan) -> Self {
        let stride = plan.columns + 2 * PAD;
        let groups = &plan.groups.groups;
        Self {
            volume,
            plan,
            level: Level::new(),
            epi: vec![0.0; stride * volume.frames() + CHUNK],
            means: vec![0.0; stride * groups.len() + CHUNK],
            spreads: vec![0.0; stride * groups.len() + CHUNK],
            frames: groups.iter().map(|group| group.frames.len() as f32).collect(),
        }
    }

    /// Takes row `y` of all frames.
    pub(crate) fn load_row(&mut self, y: usize) {
        let columns = self.plan.columns;
        for (t, row) in self.epi.chunks_exact_mut(columns + 2 * PAD).enumerate().take(self.volume.frames()) {
            self.volume.copy_row(y, t, &mut row[PAD..PAD + columns]);
            let (first, last) = (row[PAD], row[PAD + columns - 1]);
            row[..PAD].fill(first);
            row[PAD + columns..].fill(last);
        }
    }

    /// Sums up the loaded row under the gradient of `block`.
    pub(crate) fn load_block(&mut self, block: &DisparityBlock) {
        let stride = self.plan.columns + 2 * PAD;
        let epi = Rows { values: &self.epi, stride };
        let rows = self.means.chunks_exact_mut(stride).zip(self.spreads.chunks_exact_mut(stride));
        for ((group, seen), (mean, spread)) in self.plan.groups.groups.iter().zip(&block.seen).zip(rows) {
            let middle = (group.frames.start + group.frames.end) / 2;
            let anchor = &self.epi[middle * stride + PAD..];
            let (frames, shifts) = (group.frames.clone(), block.shifts.as_slice());
            let out = [&mut mean[PAD..], &mut spread[PAD..]];
            dispatch!(self.level, _simd => kernels::group_sums(epi, frames, shifts, anchor, seen.clone(), out));
        }
    }

    /// Variances within group `g` of the loaded block.
    pub(crate) fn spreads(&self, g: usize) -> &[f32] {
        let start = g * (self.plan.columns + 2 * PAD) + PAD;
        &self.spreads[start..start + self.plan.columns]
    }

    /// Costs of single pixels under candidate `k` of the loaded block, at the columns where it has any: plain
    /// variances, or truncated at `limit`.
    pub(crate) fn single(&self, k: usize, limit: Option<&[f32]>, out: &mut [f32]) {
        let stride = self.plan.columns + 2 * PAD;
        let candidate = &self.plan.coverage[k];
        let reference = self.plan.reference * stride + PAD;
        let terms = Terms {
            means: Rows { values: &self.means, stride },
            spreads: Rows { values: &self.spreads, stride },
            frames: &self.frames,
            before: self.plan.groups.before,
            anchor: &self.epi[reference..],
            shifts: &candidate.shifts,
        };
        for segment in &candidate.segments {
            match limit {
                None => dispatch!(self.level, _simd => kernels::variance(terms, segment, out)),
                Some(limit) => {
                    dispatch!(self.level, _simd => kernels::truncated(terms, segment, limit, out));
                }
            }
        }
    }
}
