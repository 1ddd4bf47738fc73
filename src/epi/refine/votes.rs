//! What each pixel by itself says of its disparity: the regression of its intensities on tau.

use fearless_simd::Level;

use super::moments::{FrameSample, LANES, Moments, SeenStretch, block_moments};
use super::spline::{FRACTIONS, Spline, SplineEpi};
use crate::epi::lines::Lines;

/// The series around a block's common disparity is used this far, in px of shift in the frame farthest from the reference: the
/// third term that it lacks is then below 0.0007 px for texture of 4 px wavelength (omega^2 shift^3 / 6).
const SERIES_REACH_PX: f32 = 0.125;

/// One pixel's share in the fits of the windows that contain it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vote {
    /// Disparity that the vote is counted from, in px.
    pub(super) base: f32,
    /// g^2 S, the weight in the fit.
    pub(super) weight: f32,
    /// Weight times (voted disparity - base).
    pub(super) moment: f32,
    /// Variance of the residuals of the regression, in DN^2.
    pub(super) variance: f32,
    /// First and second derivative of the template along x, in DN per px and per px^2.
    pub(super) gradient: f32,
    pub(super) bend: f32,
}

pub(super) const NO_VOTE: Vote =
    Vote { base: 0.0, weight: 0.0, moment: 0.0, variance: 0.0, gradient: 0.0, bend: 0.0 };

/// Which frames count.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretches<'a> {
    /// A pixel seen in fewer frames has no vote.
    pub(super) minimum_frames: usize,
    /// Only every so manieth frame from the reference frame on is looked at.
    pub(super) every: usize,
    /// First and last tau' = tau - tau_r in which each pixel is seen; `None`: wherever it is in the image.
    pub(super) stretches: Option<&'a [(f32, f32)]>,
}

/// Fills `votes` for the row in `epi` from the `guesses`; NaN guesses have no vote.
pub(super) fn row_votes(
    (spline, level): (&Spline, Level),
    epi: &SplineEpi,
    lines: &Lines,
    guesses: &[f32],
    frames: Stretches<'_>,
    votes: &mut [Vote],
) {
    let columns = lines.columns();
    votes.fill(NO_VOTE);
    let reach = SERIES_REACH_PX / lines.tau_before().max(lines.tau_after()) as f32;
    let mut samples = Vec::with_capacity(lines.frames());
    let mut start = 0;
    while start < columns {
        let block = start..(start + LANES).min(columns);
        // Lanes beyond the row's end have no guess and are never seen.
        let mut open: [f32; LANES] = [f32::NAN; LANES];
        open[..block.len()].copy_from_slice(&guesses[block.clone()]);
        let mut anchor = [0.0; LANES];
        let own = spline.weights(0);
        let taps = epi.taps(lines.reference(), start as isize);
        for (lane, anchor) in anchor.iter_mut().enumerate() {
            *anchor = own[0].iter().zip(&taps[lane..]).map(|(weight, tap)| weight * tap).sum();
        }
        loop {
            let lowest = open.iter().copied().fold(f32::NAN, f32::min);
            if lowest.is_nan() {
                break;
            }
            let within = |guess: f32| guess <= lowest + 2.0 * reach;
            let highest = open.iter().copied().filter(|&guess| within(guess)).fold(lowest, f32::max);
            let common = 0.5 * (f64::from(lowest) + f64::from(highest));
            let served = open.map(within);
            let seen = in_view(lines, (start, common), &served, frames, &mut samples);
            let moments =
                block_moments(level, epi, &samples, |index| spline.weights(index), &anchor, seen.as_ref());
            for lane in 0..block.len() {
                if served[lane] {
                    votes[start + lane] = vote(&moments, lane, common, open[lane], frames.minimum_frames);
                    open[lane] = f32::NAN;
                }
            }
        }
        start += LANES;
    }
}

/// The frames that see any of the `served` pixels of the block from column `start` on, whose disparity is about `common`; and, unless all see
/// all, each pixel's stretch.
fn in_view(
    lines: &Lines,
    (start, common): (usize, f64),
    served: &[bool; LANES],
    frames: Stretches<'_>,
    samples: &mut Vec<FrameSample>,
) -> Option<SeenStretch> {
    // The spline is mirrored at the borders, so within a pixel of them its slope is not that of the scene.
    let (low, high) = (1.0, (lines.columns() - 2) as f64);
    let mut seen = SeenStretch { first: [f32::INFINITY; LANES], last: [f32::NEG_INFINITY; LANES] };
    let (mut earliest, mut latest) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut everywhere = true;
    for lane in (0..LANES).filter(|&lane| served[lane]) {
        let x = (start + lane) as f64;
        let (mut first, mut last) = if common == 0.0 {
            if x >= low && x <= high { (-1.0, 1.0) } else { (f64::INFINITY, f64::NEG_INFINITY) }
        } else {
            let ends = ((low - x) / common, (high - x) / common);
            (ends.0.min(ends.1), ends.0.max(ends.1))
        };
        if let Some((from, to)) = frames.stretches.map(|stretches| stretches[start + lane]) {
            first = first.max(f64::from(from) - 1e-6);
            last = last.min(f64::from(to) + 1e-6);
        }
        seen.first[lane] = first as f32;
        seen.last[lane] = last as f32;
        earliest = earliest.min(first);
        latest = latest.max(last);
        everywhere &= first <= -lines.tau_before() && last >= lines.tau_after();
    }
    samples.clear();
    for (t, &tau) in lines.offsets().iter().enumerate() {
        if tau >= earliest && tau <= latest && t.abs_diff(lines.reference()) % frames.every == 0 {
            let steps = (common * tau * FRACTIONS as f64).round() as isize;
            let whole = steps.div_euclid(FRACTIONS as isize);
            let fraction = steps.rem_euclid(FRACTIONS as isize) as usize;
            samples.push(FrameSample { frame: t, column: start as isize + whole, tau: tau as f32, fraction });
        }
    }
    (!everywhere).then_some(seen)
}

/// The vote of one pixel of a block around `common`, counted from its guess.
fn vote(moments: &Moments, lane: usize, common: f64, guess: f32, minimum_frames: usize) -> Vote {
    let count = moments.count[lane];
    let spread = moments.tau_tau[lane] - moments.tau[lane] * moments.tau[lane] / count;
    if count < minimum_frames.max(3) as f32 || spread <= 0.0 {
        return NO_VOTE;
    }
    let mean_tau = moments.tau[lane] / count;
    let e = (f64::from(guess) - common) as f32;
    // The regression's numerator and the template's gradient along the pixel's own line.
    let at_common = moments.tau_value[lane] - mean_tau * moments.value[lane];
    let first = moments.tau_tau_slope[lane] - mean_tau * moments.tau_slope[lane];
    let second = moments.tau_tau_tau_bend[lane] - mean_tau * moments.tau_tau_bend[lane];
    let covariance = at_common + e * (first + 0.5 * e * second);
    let gradient = (moments.slope[lane] + e * moments.tau_bend[lane]) / count;
    let energy = moments.value_value[lane] - moments.value[lane] * moments.value[lane] / count;
    Vote {
        base: guess,
        weight: gradient * gradient * spread,
        moment: -gradient * covariance,
        variance: (energy - at_common * at_common / spread).max(0.0) / (count - 2.0),
        gradient,
        bend: moments.bend[lane] / count,
    }
}
