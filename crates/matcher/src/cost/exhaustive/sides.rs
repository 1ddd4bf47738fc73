//! Which side of the reference frame counts.

use crate::lines::SeenRule;
use crate::options::Occlusion;

/// Cost from the sums of the frames before and after the reference frame: the mean over all frames that see
/// the candidate, or over one side alone if that is better and may be. `cost` turns (sums, number of frames)
/// into a cost.
#[inline(always)]
pub(super) fn best_side<const N: usize>(
    before: [f32; N],
    after: [f32; N],
    frames: [u16; 2],
    rule: SeenRule,
    cost: impl Fn([f32; N], f32) -> f32,
) -> f32 {
    let [seen_before, seen_after] = frames.map(usize::from);
    // The reference frame, counted on both sides, adds nothing to the sums of either.
    let seen = (seen_before + seen_after).saturating_sub(1);
    let mut best = f32::NAN;
    if rule.suffices(seen) {
        let both = std::array::from_fn(|index| before[index] + after[index]);
        best = cost(both, seen as f32);
    }
    if rule.occlusion == Occlusion::OneSide {
        if rule.suffices(seen_before) {
            best = best.min(cost(before, seen_before as f32));
        }
        if rule.suffices(seen_after) {
            best = best.min(cost(after, seen_after as f32));
        }
    }
    best
}
