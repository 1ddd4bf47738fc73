//! Tests whether the frames sample a pixel at many sub-pixel positions, or repeat a few.
//!
//! Interpolation has an error that depends only on the sub-pixel position (phase) of a sample. From frame to
//! frame a point moves by s px, so frame t samples it at the phase s t mod 1. If s = p / q exactly, only q
//! phases occur, 1 / q apart. The part of the error that repeats q times within a pixel is then the same in
//! all frames and does not average out. If s differs from p / q by e, the phases drift by |e| (N - 1) over N
//! frames; a drift of 1 / q covers all phases. So s is near p / q if
//!
//! ```text
//! |s - p / q| (N - 1) < 1 / q
//! ```
//!
//! If s is near no p / q with q up to Q, neighbouring phases are at most 1 / (Q + 1) px apart, plus the drift
//! of one frame. By Dirichlet's approximation theorem there is a q up to Q with |s - p / q| <= 1 / (q (Q +
//! 1)), so that each q-th phase follows by no more. Here Q is 4: interpolation errors repeat once or twice
//! within a pixel, hardly more often.
//!
//! All points of an object with little relief move by the same s.

/// Largest number of phases that counts as few.
const FEW: u32 = 4;
/// Resolution of suggested steps, in mm.
const UM: f64 = 1e-3;
/// Largest relative change of a suggested step.
const FARTHEST: f64 = 0.25;

/// A shift per frame that is near a ratio of small integers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RepeatedPhases {
    /// p of p / q.
    pub(super) numerator: u32,
    /// q of p / q: the number of phases that recur.
    pub(super) denominator: u32,
    /// Drift of the phases over all frames, in px; 1 / q would be enough.
    pub(super) drift_px: f64,
}

/// The ratio of small integers that `shift_px` per frame (either sign) is near to, over `frames` frames; the
/// one with the fewest phases, if there are several. `None` if there is none.
pub(super) fn repeated_phases(shift_px: f64, frames: usize) -> Option<RepeatedPhases> {
    let steps = frames.saturating_sub(1) as f64;
    (1..=FEW).find_map(|denominator| {
        let numerator = (shift_px.abs() * f64::from(denominator)).round();
        let drift_px = (shift_px.abs() - numerator / f64::from(denominator)).abs() * steps;
        (drift_px * f64::from(denominator) < 1.0).then_some(RepeatedPhases {
            numerator: numerator as u32,
            denominator,
            drift_px,
        })
    })
}

/// The step in whole um nearest to `step_mm`, in mm, with which `frames` frames repeat no phases, if a mm
/// moves the picture by `px_per_mm`. `None` if there is none within a quarter of the step.
pub(super) fn better_step_mm(step_mm: f64, px_per_mm: f64, frames: usize) -> Option<f64> {
    let nearest = (step_mm / UM).round();
    let reach = (FARTHEST * nearest).floor().max(0.0) as u32;
    let fine = |step_um: f64| step_um > 0.0 && repeated_phases(step_um * UM * px_per_mm, frames).is_none();
    // Of two equally near steps the shorter is used: the plan then stays within the travel.
    let found = (0..=reach)
        .flat_map(|off| [nearest - f64::from(off), nearest + f64::from(off)])
        .find(|um| fine(*um))?;
    Some(found * UM)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The longest distance between two neighbouring phases, around the pixel.
    fn largest_gap(shift_px: f64, frames: usize) -> f64 {
        let mut phases: Vec<f64> = (0..frames).map(|t| (shift_px * t as f64).rem_euclid(1.0)).collect();
        phases.sort_by(f64::total_cmp);
        let around = phases[0] + 1.0 - phases[frames - 1];
        phases.windows(2).map(|pair| pair[1] - pair[0]).fold(around, f64::max)
    }

    #[test]
    fn exact_ratios_are_named_and_their_gaps_are_what_they_are() {
        for (shift_px, numerator, denominator) in
            [(1.0, 1, 1), (-2.0, 2, 1), (1.5, 3, 2), (0.75, 3, 4), (7.0 / 3.0, 7, 3)]
        {
            let found = repeated_phases(shift_px, 60).unwrap();
            assert_eq!((found.numerator, found.denominator), (numerator, denominator));
            assert!((largest_gap(shift_px, 60) - 1.0 / f64::from(denominator)).abs() < 1e-9);
        }
        // 100 frames, each shifted by 1.503 px: the phases drift by 0.297 px, not by half a pixel.
        assert_eq!(repeated_phases(1.503, 100).unwrap().denominator, 2);
        assert_eq!(repeated_phases(1.51, 100), None);
        assert_eq!(repeated_phases(0.4, 60), None, "five phases are enough");
        assert_eq!(repeated_phases(0.0, 60).unwrap().denominator, 1, "what does not move has one phase");
    }

    #[test]
    fn the_suggested_step_is_the_nearest_that_does() {
        // 2 px per mm: 0.5 mm are 1 px. With 101 frames a drift of 1 px needs 1 % more or less.
        assert_eq!(better_step_mm(0.5, 2.0, 101), Some(0.495));
        assert_eq!(better_step_mm(0.62, 2.0, 101), Some(0.62));
        // Of five frames any shift is near a ratio: half-widths 1/4, 1/8, 1/12, 1/16 about p / q leave
        // nothing.
        assert_eq!(better_step_mm(0.5, 2.0, 5), None);
    }

    proptest! {
        #[test]
        fn what_is_near_leaves_a_gap_and_what_is_not_leaves_none(shift_px in 0.0..5.0_f64, frames in 12_usize..200) {
            let gap = largest_gap(shift_px, frames);
            match repeated_phases(shift_px, frames) {
                Some(near) => {
                    prop_assert!(gap >= 1.0 / f64::from(near.denominator) - near.drift_px - 1e-9, "{near:?}: {gap}");
                }
                None => prop_assert!(gap <= 0.2 + 1.0 / (frames - 1) as f64, "{gap}"),
            }
        }
    }
}
