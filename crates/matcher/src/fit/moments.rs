//! Moments of the samples along the lines of sixteen neighbouring pixels, around a common disparity.
//!
//! Sixteen neighbours are sampled along the lines of one disparity d_b near theirs, so all of them share
//! shift and weights. A pixel's own line, e = d - d_b away, follows from the Taylor series of its samples in
//! the small shift e tau': I_t(e) = v + tau' v' e + tau'^2 v'' e^2 / 2. A fit needs only sums over the frames
//! of v, v', v'' times powers of tau', so the frames are read once for each block, whatever the number of
//! fits.

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch, f32x16};

use super::padded::LANES;
use super::spline::{SplineEpi, TAPS, Weights};

/// Sums over the frames that see each pixel of a block; tau' is counted from the reference frame, v from the
/// pixel's own intensity there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments {
    pub(super) count: [f32; LANES],
    pub(super) tau: [f32; LANES],
    pub(super) tau_tau: [f32; LANES],
    pub(super) value: [f32; LANES],
    pub(super) tau_value: [f32; LANES],
    pub(super) value_value: [f32; LANES],
    pub(super) gradient: [f32; LANES],
    pub(super) tau_gradient: [f32; LANES],
    pub(super) tau_tau_gradient: [f32; LANES],
    pub(super) curvature: [f32; LANES],
    pub(super) tau_curvature: [f32; LANES],
    pub(super) tau_tau_curvature: [f32; LANES],
    pub(super) tau_tau_tau_curvature: [f32; LANES],
}

/// One frame's share in the moments of a block.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameSample {
    /// Index of the frame.
    pub(super) frame: usize,
    /// Column that the block's first pixel is shifted to, towards the smaller.
    pub(super) column: isize,
    /// tau of the frame less that of the reference frame.
    pub(super) tau: f32,
    /// Fraction of a pixel of the shift, in steps of the table.
    pub(super) fraction: usize,
    /// Rest of the shift, in px: less than half a step.
    pub(super) remainder: f32,
}

/// The interval of tau' in which each pixel of a block is seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct VisibleInterval {
    pub(super) first: [f32; LANES],
    pub(super) last: [f32; LANES],
}

/// Sums the moments of a block whose pixels have the intensities `anchor` in the reference frame. Frames
/// outside a pixel's interval do not count; `None`: all pixels are seen in all of `samples`.
pub(super) fn block_moments<'w>(
    level: Level,
    epi: &SplineEpi,
    samples: &[FrameSample],
    weights: impl Fn(usize) -> &'w Weights,
    anchor: &[f32; LANES],
    seen: Option<&VisibleInterval>,
) -> Moments {
    match seen {
        None => dispatch!(level, simd => sum_all(simd, epi, samples, &weights, anchor)),
        Some(seen) => dispatch!(level, simd => sum_seen(simd, epi, samples, &weights, anchor, seen)),
    }
}

#[inline(always)]
fn sum_all<'w, S: Simd>(
    simd: S,
    epi: &SplineEpi,
    samples: &[FrameSample],
    weights: &impl Fn(usize) -> &'w Weights,
    anchor: &[f32; LANES],
) -> Moments {
    let zero = f32x16::splat(simd, 0.0);
    let anchor = f32x16::from_slice(simd, anchor);
    let (mut tau, mut tau_tau) = (0.0, 0.0);
    let mut sums = [zero; 10];
    for sample in samples {
        let taps = &epi.taps(sample.frame, sample.column)[..LANES + TAPS - 1];
        let [value, gradient, curvature] = sampled(simd, taps, weights(sample.fraction), sample.remainder);
        add(&mut sums, sample.tau, value - anchor, gradient, curvature);
        tau += sample.tau;
        tau_tau += sample.tau * sample.tau;
    }
    gathered([samples.len() as f32; LANES], [tau; LANES], [tau_tau; LANES], sums)
}

#[inline(always)]
fn sum_seen<'w, S: Simd>(
    simd: S,
    epi: &SplineEpi,
    samples: &[FrameSample],
    weights: &impl Fn(usize) -> &'w Weights,
    anchor: &[f32; LANES],
    seen: &VisibleInterval,
) -> Moments {
    let zero = f32x16::splat(simd, 0.0);
    let anchor = f32x16::from_slice(simd, anchor);
    let (mut count, mut tau, mut tau_tau) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let mut sums = [zero; 10];
    for sample in samples {
        let mut mask = [0.0; LANES];
        for (mask, (first, last)) in mask.iter_mut().zip(seen.first.iter().zip(&seen.last)) {
            let is_seen = sample.tau >= *first && sample.tau <= *last;
            *mask = f32::from(u8::from(is_seen));
        }
        if mask == [0.0; LANES] {
            continue;
        }
        for lane in 0..LANES {
            count[lane] += mask[lane];
            tau[lane] += mask[lane] * sample.tau;
            tau_tau[lane] += mask[lane] * sample.tau * sample.tau;
        }
        let taps = &epi.taps(sample.frame, sample.column)[..LANES + TAPS - 1];
        let mask = f32x16::from_slice(simd, &mask);
        let [value, gradient, curvature] = sampled(simd, taps, weights(sample.fraction), sample.remainder);
        add(&mut sums, sample.tau, (value - anchor) * mask, gradient * mask, curvature * mask);
    }
    gathered(count, tau, tau_tau, sums)
}

/// Value, first and second derivative of sixteen neighbouring samples, `remainder` px beyond the fraction of
/// the `weights`.
#[inline(always)]
fn sampled<S: Simd>(simd: S, taps: &[f32], weights: &Weights, remainder: f32) -> [f32x16<S>; 3] {
    let first = f32x16::from_slice(simd, &taps[..LANES]);
    let mut out = [first * weights[0][0], first * weights[1][0], first * weights[2][0]];
    for tap in 1..TAPS {
        let neighbour = f32x16::from_slice(simd, &taps[tap..tap + LANES]);
        for (out, weights) in out.iter_mut().zip(weights) {
            *out = neighbour.mul_add(weights[tap], *out);
        }
    }
    let [value, gradient, curvature] = out;
    let remainder = f32x16::splat(simd, remainder);
    [gradient.mul_add(remainder, value), curvature.mul_add(remainder, gradient), curvature]
}

#[inline(always)]
fn add<S: Simd>(
    sums: &mut [f32x16<S>; 10],
    tau: f32,
    value: f32x16<S>,
    gradient: f32x16<S>,
    curvature: f32x16<S>,
) {
    let (tau_gradient, tau_curvature) = (gradient * tau, curvature * tau);
    sums[0] += value;
    sums[1] = value.mul_add(tau, sums[1]);
    sums[2] = value.mul_add(value, sums[2]);
    sums[3] += gradient;
    sums[4] += tau_gradient;
    sums[5] = tau_gradient.mul_add(tau, sums[5]);
    sums[9] += curvature;
    sums[6] += tau_curvature;
    sums[7] = tau_curvature.mul_add(tau, sums[7]);
    sums[8] = tau_curvature.mul_add(tau * tau, sums[8]);
}

#[inline(always)]
fn gathered<S: Simd>(
    count: [f32; LANES],
    tau: [f32; LANES],
    tau_tau: [f32; LANES],
    sums: [f32x16<S>; 10],
) -> Moments {
    let [
        value,
        tau_value,
        value_value,
        gradient,
        tau_gradient,
        tau_tau_gradient,
        tau_curvature,
        tau_tau_curvature,
        cubed,
        curvature,
    ] = sums.map(<[f32; LANES]>::from);
    Moments {
        count,
        tau,
        tau_tau,
        value,
        tau_value,
        value_value,
        gradient,
        tau_gradient,
        tau_tau_gradient,
        curvature,
        tau_curvature,
        tau_tau_curvature,
        tau_tau_tau_curvature: cubed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::spline::{FRACTIONS, Spline};
    use epirig_core::tau::Tau;
    use epirig_core::volume::Volume;

    const FRAMES: usize = 9;
    const COLUMNS: usize = 64;

    fn epi_without_order(spline: &Spline) -> SplineEpi {
        let mut volume = Volume::fine(1, COLUMNS, 8, Tau::equidistant(FRAMES).unwrap());
        let counts = volume.fine_counts_mut().unwrap().iter_mut().enumerate();
        counts.for_each(|(index, count)| *count = (index * index * 7919 % 32768) as u16);
        let mut epi = SplineEpi::default();
        epi.take(spline, &volume, None, 0, 0..FRAMES);
        epi
    }

    /// Nine frames whose shifts are generic.
    fn samples() -> Vec<FrameSample> {
        let sample = |frame: usize| FrameSample {
            frame,
            column: 20 + 2 * frame as isize,
            tau: frame as f32 / 8.0 - 0.5,
            fraction: frame * 211 % FRACTIONS,
            remainder: (frame as f32 - 4.0) / 9.0 / FRACTIONS as f32,
        };
        (0..FRAMES).map(sample).collect()
    }

    /// All moments in the order of their fields.
    fn of_lane(moments: &Moments, lane: usize) -> [f32; 13] {
        let Moments { count, tau, tau_tau, value, tau_value, value_value, .. } = moments;
        let Moments {
            gradient,
            tau_gradient,
            tau_tau_gradient,
            curvature,
            tau_curvature,
            tau_tau_curvature,
            ..
        } = moments;
        let first =
            [count, tau, tau_tau, value, tau_value, value_value, gradient, tau_gradient, tau_tau_gradient];
        let last = [curvature, tau_curvature, tau_tau_curvature, &moments.tau_tau_tau_curvature];
        std::array::from_fn(|index| if index < 9 { first[index][lane] } else { last[index - 9][lane] })
    }

    #[test]
    fn moments_are_what_their_definition_says() {
        let spline = Spline::new();
        let (epi, samples) = (epi_without_order(&spline), samples());
        let anchor: [f32; LANES] = std::array::from_fn(|lane| 100.0 + 3.0 * lane as f32);
        let moments =
            block_moments(Level::new(), &epi, &samples, |index| spline.weights(index), &anchor, None);
        for (lane, anchor) in anchor.iter().enumerate() {
            let (mut sums, mut sizes) = ([0.0_f64; 13], [0.0_f64; 13]);
            for sample in &samples {
                let taps = epi.taps(sample.frame, sample.column + lane as isize);
                let [v, gradient, curvature] = spline
                    .weights(sample.fraction)
                    .map(|weights| (0..TAPS).map(|tap| f64::from(weights[tap]) * f64::from(taps[tap])).sum());
                // The series from the tabulated fraction to the place itself.
                let beyond = f64::from(sample.remainder);
                let (v, gradient) = (v + beyond * gradient, gradient + beyond * curvature);
                let (v, t): (f64, f64) = (v - f64::from(*anchor), sample.tau.into());
                let terms = [1.0, t, t * t, v, t * v, v * v, gradient, t * gradient, t * t * gradient];
                let curvatures = [curvature, t * curvature, t * t * curvature, t * t * t * curvature];
                for (index, term) in terms.into_iter().chain(curvatures).enumerate() {
                    sums[index] += term;
                    // Values are differences of weighted neighbours of some 2000 DN.
                    sizes[index] += term.abs() + 2000.0;
                }
            }
            for (index, found) in of_lane(&moments, lane).into_iter().enumerate() {
                // Some twenty roundings of 6e-8; squares double what values err by, of some 500 DN.
                let bound = 1.2e-6 * sizes[index] * if index == 5 { 1000.0 } else { 1.0 };
                assert!((f64::from(found) - sums[index]).abs() < bound, "lane {lane}, moment {index}");
            }
        }
    }

    #[test]
    fn lanes_that_some_frames_do_not_see_are_as_if_those_frames_were_not_there() {
        let spline = Spline::new();
        let (epi, samples) = (epi_without_order(&spline), samples());
        let anchor = [120.0; LANES];
        let moments = |samples: &[FrameSample], seen: Option<&VisibleInterval>| {
            block_moments(Level::new(), &epi, samples, |index| spline.weights(index), &anchor, seen)
        };
        // Lane by lane less is seen, at last nothing.
        let first: [f32; LANES] = std::array::from_fn(|lane| -0.5 + 0.04 * lane as f32);
        let last: [f32; LANES] = std::array::from_fn(|lane| 0.5 - 0.04 * lane as f32);
        let masked = moments(&samples, Some(&VisibleInterval { first, last }));
        for lane in 0..LANES {
            let is_seen = |sample: &&FrameSample| (first[lane]..=last[lane]).contains(&sample.tau);
            let seen: Vec<FrameSample> = samples.iter().filter(is_seen).copied().collect();
            assert_eq!(of_lane(&masked, lane), of_lane(&moments(&seen, None), lane), "lane {lane}");
        }
        assert_eq!(of_lane(&masked, 0)[0], 9.0);
        assert_eq!(of_lane(&masked, LANES - 1), [0.0; 13]);
    }
}
