//! Matches of the even and of the odd frames, whose noise is independent.

use std::sync::Arc;

use thiserror::Error;

use crate::some_frames::SomeFrames;
use crate::{
    Blocks, DisparityMaps, EqualDiscs, MatchError, MatchOptions, Matcher, ReferenceFrame, RowSource,
};
use epirig_core::fault::{Blame, Fault};
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::tau::{Tau, TauError};

/// Why a sequence cannot be split.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SplitHalfError {
    /// A half would show no lines.
    #[error("half of {0} frames shows no lines; at least 6 frames are needed")]
    TooFewFrames(usize),
    /// The positions of a half are no baseline.
    #[error(transparent)]
    Tau(#[from] TauError),
    /// A half cannot be matched.
    #[error(transparent)]
    Match(#[from] MatchError),
}

impl Fault for SplitHalfError {
    fn blame(&self) -> Blame {
        match self {
            Self::TooFewFrames(_) | Self::Tau(_) => Blame::Request,
            Self::Match(error) => error.blame(),
        }
    }
}

/// Maps of half of the frames, in px over the whole baseline; rows x columns, NaN without answer.
#[derive(Debug, Clone, PartialEq)]
pub struct HalfMaps {
    /// Disparity and sigma as the options say: with the least noise, and with windows of many sizes.
    pub best: [Grid<f32>; 2],
    /// Of the same pixels [in equal discs](Matcher::in_equal_discs), which see step edges only from
    /// near.
    pub in_equal_discs: EqualDiscs,
}

impl HalfMaps {
    /// The maps that `change` makes of these.
    #[must_use]
    pub fn map(&self, change: impl Fn(&Grid<f32>) -> Grid<f32>) -> Self {
        Self { best: self.best.each_ref().map(&change), in_equal_discs: self.in_equal_discs.map(&change) }
    }
}

/// Matches the even and the odd frames of `source` apart, both in the view of frame `reference`, which both
/// contain, with the other `options`.
///
/// # Errors
/// [`SplitHalfError`] if there are too few frames or a half cannot be matched.
pub fn match_halves(
    source: &(impl RowSource + Clone + 'static),
    reference: usize,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<[HalfMaps; 2], SplitHalfError> {
    let maps = |parity| -> Result<HalfMaps, SplitHalfError> {
        let Task { matcher, span, .. } = Task::new(source, (reference, parity), options, progress)?;
        let maps = matcher.matched(progress)?;
        let in_equal_discs = matcher.in_equal_discs(&maps, progress)?;
        let found = HalfMaps { best: [maps.disparity, maps.sigma], in_equal_discs };
        Ok(found.map(|map| map.map(|px| (f64::from(px) / span) as f32)))
    };
    Ok([maps(0)?, maps(1)?])
}

/// A half that is ready to be matched.
struct Task {
    matcher: Matcher,
    frames: usize,
    /// Part of the whole baseline between its first and its last frame.
    span: f64,
    /// Weight of the reference frame in the regression on tau, over the root of the sum of all squared
    /// weights.
    reference_weight: f64,
}

impl Task {
    fn new(
        source: &(impl RowSource + Clone + 'static),
        (reference, parity): (usize, usize),
        options: &MatchOptions,
        progress: &dyn Progress,
    ) -> Result<Self, SplitHalfError> {
        let all = source.shape().tau;
        if all.frames() < 6 {
            return Err(SplitHalfError::TooFewFrames(all.frames()));
        }
        let frames: Vec<usize> = (0..all.frames()).filter(|&t| t % 2 == parity || t == reference).collect();
        let positions: Vec<f64> = frames.iter().map(|&t| all.values()[t]).collect();
        let span = positions[positions.len() - 1] - positions[0];
        let tau = Tau::from_positions(&positions)?;
        let mean = positions.iter().sum::<f64>() / positions.len() as f64;
        let norm = positions.iter().map(|position| (position - mean).powi(2)).sum::<f64>().sqrt();
        let index = frames.iter().position(|&t| t == reference).unwrap_or(0);
        // A half has its own baseline, over which its disparities are stated.
        let options = MatchOptions {
            reference: ReferenceFrame::Index(index),
            range: options.range.map(|range| range.scaled(span)),
            max_sigma_px: options.max_sigma_px * span,
            ..options.clone()
        };
        let count = frames.len();
        let half = SomeFrames { of: source.clone(), frames, tau };
        let blocks = Blocks::new(&half.shape(), options)?;
        let matcher = Matcher::of_source(Arc::new(half), blocks, progress)?;
        let reference_weight = (all.values()[reference] - mean) / norm;
        Ok(Self { matcher, frames: count, span, reference_weight })
    }
}

/// The match of every other frame.
#[derive(Debug, Clone)]
pub(super) struct Half {
    maps: DisparityMaps,
    pub(super) frames: usize,
    span: f64,
    /// See [`Task::reference_weight`].
    pub(super) reference_weight: f64,
}

impl Half {
    pub(super) fn matched(
        source: &(impl RowSource + Clone + 'static),
        reference: usize,
        parity: usize,
        options: &MatchOptions,
        progress: &dyn Progress,
    ) -> Result<Self, SplitHalfError> {
        let Task { matcher, frames, span, reference_weight } =
            Task::new(source, (reference, parity), options, progress)?;
        Ok(Self { maps: matcher.matched(progress)?, frames, span, reference_weight })
    }

    /// Disparity and sigma over the whole baseline of pixel `index`, row after row; NaN without answer.
    pub(super) fn at(&self, index: usize) -> (f64, f64) {
        let [disparity, sigma] = [&self.maps.disparity, &self.maps.sigma].map(|plane| plane.values()[index]);
        (f64::from(disparity) / self.span, f64::from(sigma) / self.span)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DisparityRange;
    use epirig_core::progress::Silent;
    use epirig_core::volume::Volume;
    use epirig_simulator::{Simulator, SimulatorConfig};

    fn noisy_plane() -> Volume {
        let mut config = SimulatorConfig::textured_plane(160, 96, 24);
        config.sensor.read_noise_dn = 2.0;
        Simulator::new(config).unwrap().render_volume(&Silent).unwrap()
    }

    #[test]
    fn equal_windows_answer_the_same_pixels_with_more_noise_and_the_same_mean() {
        let volume = noisy_plane();
        let reference = volume.frames() / 2;
        for half in match_halves(&volume, reference, &MatchOptions::default(), &Silent).unwrap() {
            let [best, equal] = [&half.best[0], &half.in_equal_discs.disparity];
            let pairs: Vec<[f64; 2]> = best
                .values()
                .iter()
                .zip(equal.values())
                .filter(|(best, _)| !best.is_nan())
                .map(|(&best, &equal)| [f64::from(best), f64::from(equal)])
                .collect();
            assert_eq!(pairs.len(), equal.values().iter().filter(|value| !value.is_nan()).count());
            let count = pairs.len() as f64;
            let mean = |of: usize| pairs.iter().map(|pair| pair[of]).sum::<f64>() / count;
            let spread = |of: usize| {
                (pairs.iter().map(|pair| (pair[of] - mean(of)).powi(2)).sum::<f64>() / count).sqrt()
            };
            // Windows that grow from 7 to 11 px divide sigma by 11 / 7 = 1.57; not all of them have to grow.
            assert!(spread(1) > 1.2 * spread(0), "{} {}", spread(0), spread(1));
            // Of 7 x 7 px, which are one window, one answer is independent; four sigmas of the mean.
            let sigma = 7.0 * spread(1) / count.sqrt();
            assert!((mean(1) - mean(0)).abs() < 4.0 * sigma, "{} {}", mean(0), mean(1));
        }
    }

    #[test]
    fn equal_windows_of_a_part_lie_where_they_lie_in_the_whole() {
        let volume = noisy_plane();
        let options = MatchOptions {
            range: Some(DisparityRange { minimum_px: -30.0, maximum_px: 30.0 }),
            ..MatchOptions::default()
        };
        let values = (0..96 * 160).map(|index| (60..70).contains(&(index / 160)));
        let inside = Grid::from_values(96, 160, values.collect()).unwrap();
        let blocks = Blocks::new(&volume.shape(), options.clone()).unwrap().within(&inside).unwrap();
        let part = Matcher::of_blocks(volume.clone(), blocks);
        let whole = Matcher::new(volume, options).unwrap();
        let maps = part.matched(&Silent).unwrap();
        let found = part.in_equal_discs(&maps, &Silent).unwrap().disparity;
        let EqualDiscs { disparity: expected, sigma, .. } = whole.in_equal_discs(&maps, &Silent).unwrap();
        let answered = (0..160).filter(|&x| !maps.disparity.at(x, 65).is_nan()).count();
        assert!(answered > 140, "{answered}");
        for y in 60..70 {
            for x in (0..160).filter(|&x| !maps.disparity.at(x, y).is_nan()) {
                let apart = (found.at(x, y) - expected.at(x, y)).abs();
                assert!(apart < 0.2 * sigma.at(x, y), "{x} {y}: {apart}");
            }
        }
    }
}
