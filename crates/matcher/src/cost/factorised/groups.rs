//! Groups of neighbouring frames, so that most of the sums along a candidate serve many candidates.
//!
//! This is the two-level form of fast factorised back-projection (Ulander, Hellsten and Stenström 2003; Brady
//! 1998). Within a group the shifts of two candidates differ by little. So the frames of a group are summed
//! up under a few slopes only, and each candidate uses the sums under the nearest slope.

use std::ops::Range;

use crate::candidates::Candidates;
use crate::lines::EpiLines;

/// Least number of groups, if there are as many frames: occluded frames are left out by whole groups.
const LEAST_GROUPS: usize = 12;
/// Distance between a sample and the candidate, in px, because its group was summed up under another slope.
pub(crate) const MISALIGNMENT_PX: f64 = 0.2;

/// Frames that follow each other, all before or all after the reference frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group {
    /// The frames.
    pub(crate) frames: Range<usize>,
    /// Middle of their tau, less that of the reference frame.
    pub(crate) offset: f64,
}

/// All frames but the reference frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Groups {
    /// In the order of the frames.
    pub(crate) groups: Vec<Group>,
    /// How many of them lie before the reference frame.
    pub(crate) before: usize,
    /// Largest extent of a group, in tau.
    pub(crate) extent: f64,
}

impl Groups {
    pub(crate) fn new(lines: &EpiLines) -> Self {
        let (frames, reference) = (lines.frames(), lines.reference());
        let wanted = LEAST_GROUPS.max((frames as f64).sqrt().ceil() as usize);
        let extent = (lines.tau_before() + lines.tau_after()) / wanted as f64;
        let mut groups = divided(lines, 0..reference, extent);
        let before = groups.len();
        groups.extend(divided(lines, reference + 1..frames, extent));
        let extent = groups.iter().map(|group| spread(lines, &group.frames)).fold(0.0, f64::max);
        Self { groups, before, extent }
    }

    /// Neighbouring candidates that are made of the same sums.
    pub(crate) fn block(&self, candidates: &Candidates) -> usize {
        // At the ends of a block and of a group the misalignment is largest: half of the one times half of
        // the other.
        let span = 4.0 * MISALIGNMENT_PX / self.extent;
        ((span / candidates.disparity_step_px()).min(candidates.count() as f64) as usize).max(1)
    }
}

fn spread(lines: &EpiLines, frames: &Range<usize>) -> f64 {
    lines.offsets()[frames.end - 1] - lines.offsets()[frames.start]
}

/// The frames of one side in groups of equal extent, as near to `extent` as whole groups allow; no group is
/// empty.
fn divided(lines: &EpiLines, side: Range<usize>, extent: f64) -> Vec<Group> {
    if side.is_empty() {
        return Vec::new();
    }
    let origin = lines.offsets()[side.start];
    // n frames stand for n steps, of which their spread holds n - 1.
    let whole = spread(lines, &side) * side.len() as f64 / (side.len().max(2) - 1) as f64;
    let count = (whole / extent).round().max(1.0);
    let number = |t: usize| ((lines.offsets()[t] - origin) / whole * count) as usize;
    let mut groups: Vec<Group> = Vec::new();
    let mut start = side.start;
    for t in side.clone() {
        if t + 1 == side.end || number(t + 1) != number(t) {
            let offset = 0.5 * (lines.offsets()[start] + lines.offsets()[t]);
            groups.push(Group { frames: start..t + 1, offset });
            start = t + 1;
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::tau::Tau;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_frame_but_the_reference_is_in_one_group(
            steps in prop::collection::vec(0.01_f64..10.0, 2..150), reference in 0.0_f64..1.0,
        ) {
            let positions: Vec<f64> = steps.iter().scan(0.0, |sum, step| { *sum += step; Some(*sum) }).collect();
            let reference = (reference * positions.len() as f64) as usize;
            let lines = EpiLines::new(&Tau::from_positions(&positions).unwrap(), reference, 100);
            let groups = Groups::new(&lines);
            let frames: Vec<usize> = groups.groups.iter().flat_map(|group| group.frames.clone()).collect();
            let expected: Vec<usize> = (0..positions.len()).filter(|&t| t != reference).collect();
            prop_assert_eq!(frames, expected);
            for (index, group) in groups.groups.iter().enumerate() {
                prop_assert_eq!(index < groups.before, group.frames.end <= reference);
                prop_assert!((group.offset < 0.0) == (index < groups.before));
                // A side of few frames may be one group, wider than the wanted extent but not by half.
                prop_assert!(spread(&lines, &group.frames) <= 1.5 / 12.0 + 1e-9);
            }
        }
    }

    #[test]
    fn few_frames_stay_single() {
        let lines = EpiLines::new(&Tau::equidistant(11).unwrap(), 3, 100);
        let groups = Groups::new(&lines);
        assert_eq!((groups.groups.len(), groups.before, groups.extent), (10, 3, 0.0));
        assert_eq!(
            groups.block(&Candidates::covering(
                crate::DisparityRange { minimum_px: 0.0, maximum_px: 9.0 },
                0.5
            )),
            19
        );
    }
}
