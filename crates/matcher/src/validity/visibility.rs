//! Visible intervals: the frames that see a point, where nearer surfaces pass before it.
//!
//! A nearer point has the larger |disparity|. A point at x of disparity d and the rim of a nearer surface at
//! x' of d' meet at tau' = (x - x') / (d' - d); from there on the point is occluded.

use std::ops::Range;

use crate::lines::EpiLines;
use crate::one_surface::OneSurface;

/// A neighbour is the rim of a nearer surface if its disparity is larger by more than this, in px.
const RIM_PX: f32 = OneSurface::ROUGH.step_px;
/// Neighbouring points that make a surface.
const RIM_PIXELS: usize = 3;
/// The rim's blur and the reach of the interpolation: so close to it a sample is not the point's alone, in
/// px.
const RIM_REACH_PX: f32 = 2.0;

/// First and last tau' at which the point at column `x` lies in the columns that are `shown` and, if that is
/// known, is `visible`; the first beyond the last if never.
///
/// The spline is mirrored at the borders of the image, so within a pixel of them its gradient is not that of
/// the scene. Beyond columns that are shown the border of a photograph is repeated, which is no scene either.
pub(crate) fn seen_interval(
    x: f64,
    disparity_px: f64,
    shown: &Range<usize>,
    visible: Option<(f32, f32)>,
) -> (f64, f64) {
    let (low, high) = ((shown.start + 1) as f64 - x, shown.end as f64 - 2.0 - x);
    let (mut first, mut last) = if disparity_px == 0.0 {
        if low <= 0.0 && high >= 0.0 { (-1.0, 1.0) } else { (f64::INFINITY, f64::NEG_INFINITY) }
    } else {
        let ends = (low / disparity_px, high / disparity_px);
        (ends.0.min(ends.1), ends.0.max(ends.1))
    };
    if let Some((from, to)) = visible {
        first = first.max(f64::from(from) - 1e-6);
        last = last.min(f64::from(to) + 1e-6);
    }
    (first, last)
}

/// First and last tau' in which each point of a row of `disparities` is seen, as far as the row itself tells.
pub(crate) fn visible_intervals(disparities: &[f32], lines: &EpiLines) -> Vec<(f32, f32)> {
    let whole = (-lines.tau_before() as f32, lines.tau_after() as f32);
    let mut visible = vec![whole; disparities.len()];
    // Rims, each with the side on which it occludes the background: +1 for points to the right of it.
    let mut rims: Vec<(usize, f32, f32)> = Vec::new();
    // A surface that is not known up to its rim may reach as far as the next that is known.
    let known: Vec<(usize, f32)> =
        disparities.iter().copied().enumerate().filter(|(_, disparity)| !disparity.is_nan()).collect();
    // A surface, not a single wrong answer.
    let is_surface = |side: &[(usize, f32)], rim: f32| {
        side.len() == RIM_PIXELS
            && side.iter().all(|point| (point.1 - rim).abs() <= RIM_PX * RIM_PIXELS as f32)
    };
    for (index, pair) in known.windows(2).enumerate() {
        let [(left, here), (right, next)] = [pair[0], pair[1]];
        if here.abs() > next.abs() + RIM_PX {
            let side = &known[(index + 1).saturating_sub(RIM_PIXELS)..=index];
            if is_surface(side, here) {
                rims.push((right - 1, here, 1.0));
            }
        } else if next.abs() > here.abs() + RIM_PX {
            let side = &known[index + 1..(index + 1 + RIM_PIXELS).min(known.len())];
            if is_surface(side, next) {
                rims.push((left + 1, next, -1.0));
            }
        }
    }
    for (x, (interval, &own)) in visible.iter_mut().zip(disparities).enumerate() {
        for &(rim, disparity, side) in &rims {
            let distance = x as f32 - rim as f32;
            let faster = disparity - own;
            if distance * side <= 0.0 || disparity.abs() <= own.abs() + RIM_PX || faster.is_nan() {
                continue;
            }
            let reached = (distance.abs() - RIM_REACH_PX).max(0.0) / faster.abs();
            if distance * faster > 0.0 {
                interval.1 = interval.1.min(reached);
            } else {
                interval.0 = interval.0.max(-reached);
            }
        }
    }
    visible
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::tau::Tau;

    #[test]
    fn a_point_is_seen_until_the_rim_reaches_it() {
        let lines = EpiLines::new(&Tau::equidistant(11).unwrap(), 5, 40);
        // A strip of 30 px before a ground of 10 px, on columns 10 to 19. It gains 20 px on the ground over
        // the baseline.
        let row: Vec<f32> = (0..40).map(|x| if (10..20).contains(&x) { 30.0 } else { 10.0 }).collect();
        let seen = visible_intervals(&row, &lines);
        // Column 25 is 6 px from the rim at 19: reached after (6 - 2) / 20 of the baseline.
        assert!((seen[25].1 - 4.0 / 20.0).abs() < 1e-6 && seen[25].0 == -0.5);
        // On the other side the strip passed before.
        assert!((seen[4].0 + 4.0 / 20.0).abs() < 1e-6 && seen[4].1 == 0.5);
        assert_eq!(seen[35], (-0.5, 0.5), "too far to be reached");
        assert_eq!(seen[15], (-0.5, 0.5), "nothing occludes the strip");
    }
}
