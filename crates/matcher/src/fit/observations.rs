//! Observations: the disparity that each pixel shows by itself, from the regression of its intensities on
//! tau.

use std::ops::Range;

use fearless_simd::Level;

use super::in_view::{Limits, in_view};
use super::moments::{Moments, block_moments};
use super::padded::LANES;
use super::spline::{Spline, SplineEpi};
use crate::lines::EpiLines;

/// The series around a block's common disparity is used this far, in px of shift in the frame farthest from
/// the reference: the third term that it lacks is then 0.0008 px at most for texture of 4 px wavelength
/// (omega^2 shift^3 / 6).
pub(super) const SERIES_REACH_PX: f32 = 0.125;
/// The same for a first look's step at half the resolution, which another follows: 0.0064 px at worst, and a
/// quarter of that on average over the pixels of a block.
pub(super) const ROUGH_SERIES_REACH_PX: f32 = 0.25;

/// One pixel's share in the fits of the windows that contain it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Observation {
    /// Disparity that the observation is counted from, in px.
    pub(super) base: f32,
    /// g^2 S, the weight in the fit.
    pub(super) weight: f32,
    /// Weight times (observed disparity - base).
    pub(super) moment: f32,
    /// Variance of the residuals of the regression, in DN^2.
    pub(super) variance: f32,
    /// First and second derivative of the template along x, in DN per px and per px^2.
    pub(super) gradient: f32,
    pub(super) curvature: f32,
    /// Mean intensity along the line, in DN.
    pub(super) intensity: f32,
}

pub(super) const UNOBSERVED: Observation = Observation {
    base: 0.0,
    weight: 0.0,
    moment: 0.0,
    variance: 0.0,
    gradient: 0.0,
    curvature: 0.0,
    intensity: 0.0,
};

/// Which frames count, and how far they are followed.
#[derive(Debug, Clone)]
pub(super) struct FramesUsed<'a> {
    /// A pixel seen in fewer frames has no observation.
    pub(super) minimum_frames: usize,
    /// Only every n-th frame from the reference frame on is looked at.
    pub(super) every: usize,
    /// How far the series is used, in px of shift in the frame farthest from the reference.
    pub(super) series_reach_px: f32,
    /// The columns that frames show.
    pub(super) columns: Range<usize>,
    /// First and last tau' = tau - tau_r in which each pixel is seen; `None`: wherever it is in these columns.
    pub(super) visible: Option<&'a [(f32, f32)]>,
}

/// Fills `observations` for the row in `epi` from the `guesses`; NaN guesses have no observation.
pub(super) fn row_observations(
    spline: &Spline,
    level: Level,
    epi: &SplineEpi,
    lines: &EpiLines,
    guesses: &[f32],
    frames: FramesUsed<'_>,
    observations: &mut [Observation],
) {
    let columns = lines.columns();
    observations.fill(UNOBSERVED);
    let reach = frames.series_reach_px / lines.tau_before().max(lines.tau_after()) as f32;
    let shown = (0..lines.frames()).filter(|t| t.abs_diff(lines.reference()) % frames.every == 0);
    let shown: Vec<(usize, f64)> = shown.map(|t| (t, lines.offsets()[t])).collect();
    let mut samples = Vec::with_capacity(shown.len());
    let mut start = 0;
    while start < columns {
        let block = start..(start + LANES).min(columns);
        // Lanes beyond the row's end have no guess and are never seen.
        let mut open: [f32; LANES] = [f32::INFINITY; LANES];
        for (open, guess) in open.iter_mut().zip(&guesses[block.clone()]) {
            *open = if guess.is_nan() { f32::INFINITY } else { *guess };
        }
        let mut anchor = [0.0; LANES];
        let own = spline.weights(0);
        let taps = epi.taps(lines.reference(), start as isize);
        for (lane, anchor) in anchor.iter_mut().enumerate() {
            *anchor = own[0].iter().zip(&taps[lane..]).map(|(weight, tap)| weight * tap).sum();
        }
        loop {
            let lowest = least(open);
            if lowest == f32::INFINITY {
                break;
            }
            let within = |guess: f32| guess <= lowest + 2.0 * reach;
            let highest = -least(open.map(|guess| if within(guess) { -guess } else { f32::INFINITY }));
            let common = 0.5 * (f64::from(lowest) + f64::from(highest));
            let served = open.map(within);
            let limits = Limits { columns: &frames.columns, visible: frames.visible };
            let seen = in_view(lines, start, common, &served, &shown, limits, &mut samples);
            let moments =
                block_moments(level, epi, &samples, |index| spline.weights(index), &anchor, seen.as_ref());
            for lane in 0..block.len() {
                if served[lane] {
                    observations[start + lane] =
                        observation(&moments, lane, common, open[lane], anchor[lane], frames.minimum_frames);
                    open[lane] = f32::INFINITY;
                }
            }
        }
        start += LANES;
    }
}

/// The least of some numbers.
fn least(mut numbers: [f32; LANES]) -> f32 {
    let mut half = LANES / 2;
    while half > 0 {
        for place in 0..half {
            let (one, other) = (numbers[place], numbers[place + half]);
            numbers[place] = if other < one { other } else { one };
        }
        half /= 2;
    }
    numbers[0]
}

/// The observation of one pixel of a block around `common`, counted from its guess; `anchor` is its
/// intensity in the reference frame.
fn observation(
    moments: &Moments,
    lane: usize,
    common: f64,
    guess: f32,
    anchor: f32,
    minimum_frames: usize,
) -> Observation {
    let count = moments.count[lane];
    let spread = moments.tau_tau[lane] - moments.tau[lane] * moments.tau[lane] / count;
    if count < minimum_frames.max(3) as f32 || spread <= 0.0 {
        return UNOBSERVED;
    }
    let mean_tau = moments.tau[lane] / count;
    let e = (f64::from(guess) - common) as f32;
    // The regression's numerator and the template's gradient along the pixel's own line.
    let at_common = moments.tau_value[lane] - mean_tau * moments.value[lane];
    let first = moments.tau_tau_gradient[lane] - mean_tau * moments.tau_gradient[lane];
    let second = moments.tau_tau_tau_curvature[lane] - mean_tau * moments.tau_tau_curvature[lane];
    let covariance = at_common + e * (first + 0.5 * e * second);
    let gradient = (moments.gradient[lane] + e * moments.tau_curvature[lane]) / count;
    let energy = moments.value_value[lane] - moments.value[lane] * moments.value[lane] / count;
    Observation {
        base: guess,
        weight: gradient * gradient * spread,
        moment: -gradient * covariance,
        variance: (energy - at_common * at_common / spread).max(0.0) / (count - 2.0),
        gradient,
        curvature: moments.curvature[lane] / count,
        intensity: anchor + moments.value[lane] / count,
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::fit::spline::VALUE_NOISE_GAIN;
    use epirig_core::tau::Tau;
    use epirig_core::volume::Volume;

    const FRAMES: usize = 41;
    const COLUMNS: usize = 120;
    const DISPARITY_PX: f64 = 7.313;
    const WHOLE: FramesUsed<'static> = FramesUsed {
        minimum_frames: FRAMES,
        every: 1,
        series_reach_px: SERIES_REACH_PX,
        columns: 0..COLUMNS,
        visible: None,
    };
    /// Five standard deviations of what counts of 1/128 DN (uniform: 0.0023 DN) leave for a gradient of 4
    /// DN/px and more in the regression over 41 frames of a whole baseline, whose S is 3.6.
    const ROUNDING_PX: f64 = 5.0 * (0.0023 / 4.0) / 1.897;

    /// Amplitude, angular frequency and phase of what the template consists of.
    const WAVES: [(f64, f64, f64); 2] = [(60.0, 0.37, 0.3), (40.0, 0.217, 1.1)];

    /// The template's derivative of `order` along x; for order 0 less its mean.
    fn template(x: f64, order: i32) -> f64 {
        let wave = |(amplitude, omega, phase): (f64, f64, f64)| {
            let turned = f64::from(order) * std::f64::consts::FRAC_PI_2;
            amplitude * omega.powi(order) * (omega * x + phase + turned).sin()
        };
        WAVES.into_iter().map(wave).sum()
    }

    /// A scene of one disparity, moved by `moved` columns, with noise of `sigma` DN.
    fn scene(rows: usize, disparity_px: f64, moved: f64, reference: usize, sigma: f64) -> (Volume, EpiLines) {
        let tau = Tau::equidistant(FRAMES).unwrap();
        let lines = EpiLines::new(&tau, reference, COLUMNS);
        let mut volume = Volume::fine(rows, COLUMNS, 8, tau);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
            let x = (index % COLUMNS) as f64 - moved;
            let shift = disparity_px * lines.offsets()[index / COLUMNS % FRAMES];
            let noise: f64 = if sigma > 0.0 { StandardNormal.sample(&mut random) } else { 0.0 };
            *count = (128.0 * (128.0 + template(x - shift, 0) + sigma * noise)).round() as u16;
        }
        (volume, lines)
    }

    fn observations_of(
        (volume, lines): &(Volume, EpiLines),
        y: usize,
        guesses: &[f32],
        frames: FramesUsed<'_>,
    ) -> Vec<Observation> {
        let spline = Spline::new();
        let mut epi = SplineEpi::default();
        epi.take(&spline, volume, None, y, 0..FRAMES);
        let mut observations = vec![UNOBSERVED; COLUMNS];
        row_observations(&spline, Level::new(), &epi, lines, guesses, frames, &mut observations);
        observations
    }

    fn observed(observation: &Observation) -> f64 {
        f64::from(observation.base) + f64::from(observation.moment / observation.weight)
    }

    fn has_observation(observation: &Observation) -> bool {
        observation.weight != 0.0
    }

    /// Columns whose points all frames see well inside, and whose gradient is 4 DN/px and more.
    fn textured() -> impl Iterator<Item = usize> {
        (20..COLUMNS - 20).filter(|&x| template(x as f64, 1).abs() > 4.0)
    }

    #[test]
    fn guesses_off_by_a_tenth_of_a_pixel_give_observations_of_the_truth() {
        for reference in [0, FRAMES / 2] {
            let scene = scene(1, DISPARITY_PX, 0.0, reference, 0.0);
            // Some guesses lie far off, as at an edge; each is served by itself.
            let guess = |x: usize| {
                let side = if x.is_multiple_of(2) { 1.0 } else { -1.0 };
                let far = if x.is_multiple_of(13) { 3.0 } else { 0.0 };
                (DISPARITY_PX + 0.1 * side + far) as f32
            };
            let guesses: Vec<f32> = (0..COLUMNS).map(guess).collect();
            let observations = observations_of(&scene, 0, &guesses, WHOLE);
            for x in textured().filter(|x| x % 13 != 0) {
                // What a step leaves of the guess's error e: third derivative over first, times e^3 (1/6 +
                // 1/2) at most; e is half of it with the reference in the middle.
                let reach = 0.1 * if reference == 0 { 1.0_f64 } else { 0.5 };
                let sharpest: f64 = WAVES.iter().map(|(amplitude, omega, _)| amplitude * omega.powi(3)).sum();
                let bound = ROUNDING_PX + sharpest / 4.0 * reach.powi(3) * 2.0 / 3.0;
                let error = observed(&observations[x]) - DISPARITY_PX;
                assert!(error.abs() < bound, "reference {reference}, column {x}: {error} of {bound}");
            }
        }
    }

    #[test]
    fn weights_are_squared_gradients_times_the_spread_of_tau() {
        let scene = scene(1, DISPARITY_PX, 0.0, FRAMES / 2, 0.0);
        let observations = observations_of(&scene, 0, &[DISPARITY_PX as f32; COLUMNS], WHOLE);
        // Sum of (k/40)^2 for k = -20 to 20.
        let spread = 2870.0 * 2.0 / 1600.0;
        for x in textured() {
            let (gradient, curvature) = (template(x as f64, 1), template(x as f64, 2));
            let observation = observations[x];
            // Five standard deviations of the mean over 41 frames: counts times the root of the noise gain
            // (1.64; for the second derivative below 5), which is taken 0.00056 px (RMS) off its place, where
            // the third derivative is at most 3.5.
            let bound = |gain: f64, next: f64| 5.0 * (0.0023 * gain + 0.00056 * next) / 41.0_f64.sqrt();
            assert!((f64::from(observation.gradient) - gradient).abs() < bound(1.64, 0.0), "column {x}");
            assert!((f64::from(observation.curvature) - curvature).abs() < bound(5.0, 3.5), "column {x}");
            let relative = f64::from(observation.weight) / (gradient * gradient * spread) - 1.0;
            assert!(relative.abs() < 2.1 * bound(1.64, 0.0) / 4.0, "column {x}: {relative}");
        }
    }

    #[test]
    fn residuals_tell_the_noise() {
        let rows = 30;
        let scene = scene(rows, DISPARITY_PX, 0.0, FRAMES / 2, 2.0);
        let mut variances = Vec::new();
        for y in 0..rows {
            let observations = observations_of(&scene, y, &[DISPARITY_PX as f32; COLUMNS], WHOLE);
            variances.extend(
                observations[20..COLUMNS - 20].iter().map(|observation| f64::from(observation.variance)),
            );
        }
        let mean = variances.iter().sum::<f64>() / variances.len() as f64;
        // 30 x 80 x 39 residuals, of which neighbours share some: 1 % is five standard deviations.
        assert!((mean / (4.0 * VALUE_NOISE_GAIN) - 1.0).abs() < 0.01, "{mean}");
    }

    #[test]
    fn where_there_is_no_guess_there_is_no_observation() {
        let scene = scene(1, DISPARITY_PX, 0.0, FRAMES / 2, 0.0);
        let guesses: Vec<f32> =
            (0..COLUMNS).map(|x| if x % 3 == 0 { f32::NAN } else { DISPARITY_PX as f32 }).collect();
        let observations = observations_of(&scene, 0, &guesses, WHOLE);
        for (x, observation) in observations.iter().enumerate().take(COLUMNS - 20).skip(20) {
            assert_eq!(has_observation(observation), x % 3 != 0, "column {x}");
        }
        let none = observations_of(&scene, 0, &[f32::NAN; COLUMNS], WHOLE);
        assert!(!none.iter().any(has_observation));
    }

    #[test]
    fn points_give_observations_if_enough_frames_see_them() {
        // Points near the borders leave the image; half the frames see some of them.
        let disparity_px = 41.7;
        for (reference, minimum_frames) in [(0, 3), (FRAMES / 2, 30), (FRAMES - 1, 12)] {
            let scene = scene(1, disparity_px, 0.0, reference, 0.0);
            let frames = FramesUsed { minimum_frames, ..WHOLE };
            let observations = observations_of(&scene, 0, &[disparity_px as f32; COLUMNS], frames);
            for (x, observation) in observations.iter().enumerate() {
                let seen: Vec<f64> = scene
                    .1
                    .offsets()
                    .iter()
                    .copied()
                    .filter(|tau| (1.0..=(COLUMNS - 2) as f64).contains(&(x as f64 + disparity_px * tau)))
                    .collect();
                assert_eq!(
                    has_observation(observation),
                    seen.len() >= minimum_frames,
                    "reference {reference}, column {x}"
                );
                let gradient = template(x as f64, 1).abs();
                if has_observation(observation) && gradient > 4.0 && (20..100).contains(&x) {
                    let mean = seen.iter().sum::<f64>() / seen.len() as f64;
                    let spread: f64 = seen.iter().map(|tau| (tau - mean).powi(2)).sum();
                    let weight = gradient * gradient * spread;
                    assert!((f64::from(observation.weight) / weight - 1.0).abs() < 0.01, "column {x}");
                    // The turned continuation has second derivatives up to 10 DN/px^2 off, by which samples
                    // between the border's pixels err by an eighth; inwards it decays by the filter's pole.
                    let border = |tau: f64| {
                        let place = x as f64 + disparity_px * tau;
                        1.25 * 0.431_f64.powf(place.min((COLUMNS - 1) as f64 - place)) * (tau - mean).abs()
                    };
                    let from_border = seen.iter().map(|&tau| border(tau)).sum::<f64>() / (gradient * spread);
                    let bound = ROUNDING_PX * 1.897 / spread.sqrt() + from_border;
                    let error = observed(observation) - disparity_px;
                    assert!(error.abs() < bound, "column {x}: {error} of {bound}");
                }
            }
        }
    }

    #[test]
    fn frames_outside_an_interval_do_not_count() {
        let mut scene = scene(1, DISPARITY_PX, 0.0, FRAMES / 2, 0.0);
        // Something else passes in the last quarter of the frames.
        scene.0.fine_counts_mut().unwrap()[31 * COLUMNS..].fill(128 * 30);
        let visible = [(-0.5, 0.25); COLUMNS];
        let frames = FramesUsed { minimum_frames: 31, visible: Some(&visible), ..WHOLE };
        let observations = observations_of(&scene, 0, &[DISPARITY_PX as f32; COLUMNS], frames);
        // 31 equidistant frames.
        let spread = 31.0 * (31.0 * 31.0 - 1.0) / 12.0 / 1600.0_f64;
        for x in textured() {
            let error = observed(&observations[x]) - DISPARITY_PX;
            assert!(error.abs() < ROUNDING_PX * 1.897 / spread.sqrt(), "column {x}: {error}");
        }
    }

    #[test]
    fn observations_do_not_depend_on_the_blocks_that_pixels_share() {
        let plain = scene(1, DISPARITY_PX, 0.0, FRAMES / 2, 0.0);
        let moved = scene(1, DISPARITY_PX, 5.0, FRAMES / 2, 0.0);
        // Where guesses are alike nothing differs at all.
        let alike = [DISPARITY_PX as f32; COLUMNS];
        let (a, b) = (observations_of(&plain, 0, &alike, WHOLE), observations_of(&moved, 0, &alike, WHOLE));
        // The border is 20 px away, farther than splines and shifts reach.
        for x in 20..COLUMNS - 25 {
            let exact = |observation: &Observation| {
                [
                    observation.weight,
                    observation.moment,
                    observation.variance,
                    observation.gradient,
                    observation.curvature,
                ]
            };
            assert_eq!(exact(&a[x]), exact(&b[x + 5]), "column {x}");
        }
        let guess = |x: f64| (DISPARITY_PX + 0.3 * (0.9 * x).sin()) as f32;
        let guesses: Vec<f32> = (0..COLUMNS).map(|x| guess(x as f64)).collect();
        let moved_guesses: Vec<f32> = (0..COLUMNS).map(|x| guess(x as f64 - 5.0)).collect();
        let (a, b) =
            (observations_of(&plain, 0, &guesses, WHOLE), observations_of(&moved, 0, &moved_guesses, WHOLE));
        for x in textured().filter(|&x| x < COLUMNS - 25) {
            let difference = observed(&a[x]) - observed(&b[x + 5]);
            // The series adds its third term of sixteen times a shift of 0.125 px.
            let series = 3.4 / 4.0 * f64::from(SERIES_REACH_PX).powi(3);
            assert!(difference.abs() < 2.0 * (ROUNDING_PX + series), "column {x}: {difference}");
        }
    }
}
