//! Two matches compared: one of the odd frames, one of the even frames.

use serde::Serialize;

use super::halves::{Half, SplitHalfError};
use super::share;
use crate::{MatchOptions, RowSource};
use epirig_core::progress::Progress;
use epirig_core::statistics::quantile_of_sorted;
use epirig_core::volume::VolumeShape;

/// A pixel counts as textured if its sigma is at most this in both halves, in px: a tenth of a pixel is where
/// the search leaves off.
const TEXTURED_SIGMA_PX: f64 = 0.1;
/// This share of a normal variable lies within one standard deviation.
const WITHIN_ONE_SIGMA: f64 = 0.682_689;

/// Differences of two matches over a set of pixels, in px over the whole baseline; zeros for no pixels.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Differences {
    /// Share of all pixels that are in the set, 0 to 1.
    pub pixels: f64,
    /// Median of |difference|.
    pub median_px: f64,
    /// 68 % of |difference| lie below.
    pub percentile_68_px: f64,
    /// 95 % of |difference| lie below.
    pub percentile_95_px: f64,
    /// 68.27 % of |difference| over its sigma lie below: 1 if the sigmas are honest and errors normal.
    pub spread: f64,
    /// Share of the differences within their sigma; 0.68 for honest ones.
    pub within_1_sigma: f64,
    /// Share within twice their sigma; 0.95 for honest ones.
    pub within_2_sigma: f64,
}

/// Agreement of the halves of a sequence.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SplitHalfReport {
    /// Frames of the two halves, the reference frame in both.
    pub frames: [usize; 2],
    /// Correlation of the halves' errors that the shared frame alone brings, -1 to 1; it is allowed for in
    /// the sigma of a difference.
    pub shared_correlation: f64,
    /// Pixels that both halves answer.
    pub answered: Differences,
    /// The part of them whose sigma, as the halves state it, is at most 0.1 px in both.
    pub textured: Differences,
}

/// Matches the even and the odd frames of `source` apart and compares the disparities, which are px over the
/// whole baseline for both.
///
/// The halves need one reference frame, or their pixels would not be the same points; so it stays in both,
/// and its noise with it. A frame's noise enters a disparity with the weight tau - mean tau. In the middle of
/// the baseline that is next to nothing, and the halves are independent; at an end it is the largest of all,
/// and the errors of halves of n frames are correlated by about 3 / n. The sigma of a difference is
/// sqrt(a^2 + b^2 - 2 r a b) with that correlation r, which is exact for points that all frames see.
///
/// The errors of half of the frames are sqrt(2) times those of all, and so is their difference again: twice
/// the error of the whole match.
///
/// # Errors
/// [`SplitHalfError`] if there are too few frames or a half cannot be matched.
pub fn split_half(
    source: &(impl RowSource + Clone + 'static),
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<SplitHalfReport, SplitHalfError> {
    let VolumeShape { rows, columns, tau, .. } = source.shape();
    let reference = options.reference_index(&tau)?;
    let half = |parity| Half::matched(source, reference, parity, options, progress);
    let (even, odd) = (half(0)?, half(1)?);
    let correlation = even.reference_weight * odd.reference_weight;
    let pixels = rows * columns;
    let mut pairs = Vec::with_capacity(pixels);
    for index in 0..pixels {
        let ((a, sigma_a), (b, sigma_b)) = (even.at(index), odd.at(index));
        if !(a.is_nan() || b.is_nan()) {
            let variance = sigma_a * sigma_a + sigma_b * sigma_b - 2.0 * correlation * sigma_a * sigma_b;
            pairs.push(Pair {
                difference: a - b,
                sigma: variance.sqrt(),
                larger_sigma: sigma_a.max(sigma_b),
            });
        }
    }
    let answered = differences(&pairs, pixels);
    pairs.retain(|pair| pair.larger_sigma <= TEXTURED_SIGMA_PX);
    Ok(SplitHalfReport {
        frames: [even.frames, odd.frames],
        shared_correlation: correlation,
        answered,
        textured: differences(&pairs, pixels),
    })
}

struct Pair {
    difference: f64,
    sigma: f64,
    larger_sigma: f64,
}

fn differences(pairs: &[Pair], pixels: usize) -> Differences {
    let sorted = |value: fn(&Pair) -> f64| {
        let mut values: Vec<f64> = pairs.iter().map(value).collect();
        values.sort_unstable_by(f64::total_cmp);
        values
    };
    let absolute = sorted(|pair| pair.difference.abs());
    let normalised = sorted(|pair| pair.difference.abs() / pair.sigma);
    let within = |limit: f64| share(normalised.partition_point(|&value| value <= limit), pairs.len());
    Differences {
        pixels: share(pairs.len(), pixels),
        median_px: quantile_of_sorted(&absolute, 0.5).unwrap_or(0.0),
        percentile_68_px: quantile_of_sorted(&absolute, 0.68).unwrap_or(0.0),
        percentile_95_px: quantile_of_sorted(&absolute, 0.95).unwrap_or(0.0),
        spread: quantile_of_sorted(&normalised, WITHIN_ONE_SIGMA).unwrap_or(0.0),
        within_1_sigma: within(1.0),
        within_2_sigma: within(2.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DisparityRange, ReferenceFrame};
    use epirig_core::progress::Silent;
    use epirig_core::tau::Tau;
    use epirig_simulator::{Simulator, SimulatorConfig};

    fn report(frames: usize, reference: ReferenceFrame) -> SplitHalfReport {
        let mut config = SimulatorConfig::textured_plane(160, 64, frames);
        config.sensor.read_noise_dn = 1.0;
        let volume = Simulator::new(config).unwrap().render_volume(&Silent).unwrap();
        // Discs of 164 px reach this; larger ones would leave a single independent answer.
        let options = MatchOptions { reference, wanted_sigma_px: Some(0.02), ..MatchOptions::default() };
        split_half(&volume, &options, &Silent).unwrap()
    }

    #[test]
    fn halves_of_a_noisy_plane_differ_as_their_sigmas_say() {
        for reference in [ReferenceFrame::First, ReferenceFrame::Middle] {
            let report = report(24, reference);
            let Differences { pixels, spread, within_1_sigma, within_2_sigma, .. } = report.textured;
            // Of the 160 columns 8 leave the image; discs of up to 164 px make some 60 independent
            // answers, so a spread is known to 8 %. With twelve frames sigma is some 20 % too
            // large.
            assert!(pixels > 0.9, "{report:?}");
            assert!((0.7..1.15).contains(&spread), "{report:?}");
            assert!(
                (0.6..0.84).contains(&within_1_sigma) && (within_2_sigma - 0.95).abs() < 0.04,
                "{report:?}"
            );
            assert!(report.answered.pixels >= pixels);
        }
    }

    #[test]
    fn the_shared_frame_correlates_halves_at_the_end_of_the_baseline_only() {
        let first = report(24, ReferenceFrame::First);
        assert_eq!(first.frames, [12, 13]);
        // Even frames 0, 2 .. 22 and frame 0 with 1, 3 .. 23: weights about their means 11 and 144 / 13,
        // squared sums 572 and 7304 / 13 ...
        let squares = 2300.0 - 144.0 * 144.0 / 13.0;
        let expected = 11.0 * (144.0 / 13.0) / (572.0_f64 * squares).sqrt();
        assert!((first.shared_correlation - expected).abs() < 1e-12, "{first:?}");
        let middle = report(25, ReferenceFrame::Middle);
        assert_eq!(middle.frames, [13, 13]);
        assert!(middle.shared_correlation.abs() < 1e-12, "{middle:?}");
    }

    #[test]
    fn disparities_of_halves_are_over_the_whole_baseline() {
        // 8 px over frames 0 to 7: the halves see 6/7 of it, and a range that were not scaled would hold
        // neither.
        let volume = Simulator::new(SimulatorConfig::textured_plane(96, 32, 8))
            .unwrap()
            .render_volume(&Silent)
            .unwrap();
        let options = MatchOptions {
            reference: ReferenceFrame::Index(3),
            range: Some(DisparityRange { minimum_px: 7.5, maximum_px: 8.5 }),
            ..MatchOptions::default()
        };
        let report = split_half(&volume, &options, &Silent).unwrap();
        assert!(report.textured.pixels > 0.8 && report.textured.median_px < 0.03, "{report:?}");
        let five: Vec<usize> = (0..5).collect();
        let short = volume.selected(&[0, 1], &five, Tau::equidistant(5).unwrap());
        assert!(matches!(
            split_half(&short, &MatchOptions::default(), &Silent),
            Err(SplitHalfError::TooFewFrames(5))
        ));
    }
}
