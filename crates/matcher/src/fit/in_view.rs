//! Which frames see a block of pixels, and where.

use std::ops::Range;

use super::moments::{FrameSample, VisibleInterval};
use super::padded::LANES;
use super::spline::FRACTIONS;
use crate::lines::EpiLines;
use crate::validity::visibility::seen_interval;

// Whole pixels and fractions of a shift are separated by bits.
const _: () = assert!(FRACTIONS.is_power_of_two());

/// Which samples count.
pub(super) struct Limits<'a> {
    /// The columns that frames show.
    pub(super) columns: &'a Range<usize>,
    /// First and last tau' in which each pixel of the row is visible, where they are known.
    pub(super) visible: Option<&'a [(f32, f32)]>,
}

/// Of the `shown` frames, with their tau', those that see any of the `served` pixels of the block from column
/// `start` on, whose disparity is about `common`; and, unless all see all, each pixel's interval, within the
/// limits.
pub(super) fn in_view(
    lines: &EpiLines,
    start: usize,
    common: f64,
    served: &[bool; LANES],
    shown: &[(usize, f64)],
    Limits { columns, visible }: Limits<'_>,
    samples: &mut Vec<FrameSample>,
) -> Option<VisibleInterval> {
    let (low, high) = ((columns.start + 1) as f64, columns.end as f64 - 2.0);
    let moved = [-lines.tau_before(), lines.tau_after()].map(|tau| common * tau);
    let leftmost = start as f64 + moved[0].min(moved[1]);
    let rightmost = (start + LANES - 1) as f64 + moved[0].max(moved[1]);
    // Far from the borders all frames see the whole block. A pixel is more than rounding could move a line
    // by.
    let inside = leftmost >= low + 1.0 && rightmost <= high - 1.0 && visible.is_none();
    samples.clear();
    if inside {
        samples.extend(shown.iter().map(|&(t, tau)| sample(start, common, t, tau)));
        return None;
    }
    let mut seen = VisibleInterval { first: [f32::INFINITY; LANES], last: [f32::NEG_INFINITY; LANES] };
    let (mut earliest, mut latest) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut everywhere = true;
    for lane in (0..LANES).filter(|&lane| served[lane]) {
        let x = (start + lane) as f64;
        let of_lane = visible.map(|visible| visible[start + lane]);
        let (first, last) = seen_interval(x, common, columns, of_lane);
        seen.first[lane] = first as f32;
        seen.last[lane] = last as f32;
        earliest = earliest.min(first);
        latest = latest.max(last);
        everywhere &= first <= -lines.tau_before() && last >= lines.tau_after();
    }
    let shown = shown.iter().filter(|(_, tau)| *tau >= earliest && *tau <= latest);
    samples.extend(shown.map(|&(t, tau)| sample(start, common, t, tau)));
    (!everywhere).then_some(seen)
}

/// Where frame `t` shows the block from column `start` on under the disparity `common`.
fn sample(start: usize, common: f64, t: usize, tau: f64) -> FrameSample {
    let exact = common * tau * FRACTIONS as f64;
    // Rounded by a cast, which takes no call.
    let steps = (exact + 0.5_f64.copysign(exact)) as isize;
    FrameSample {
        frame: t,
        column: start as isize + (steps >> FRACTIONS.trailing_zeros()),
        tau: tau as f32,
        fraction: steps as usize % FRACTIONS,
        remainder: ((exact - steps as f64) / FRACTIONS as f64) as f32,
    }
}
