//! Gauss-Newton steps: the observations of all rows around the disparities so far. The steps before the last
//! are done with fewer frames.

use fearless_simd::Level;
use rayon::prelude::*;

use super::gains::corrections;
use super::local_surface::{Sizes, rough_surface};
use super::mixed_pixels::RowSamples;
use super::observations::{
    FramesUsed, Observation, ROUGH_SERIES_REACH_PX, SERIES_REACH_PX, UNOBSERVED, row_observations,
};
use super::padded::PAD;
use super::planes::{Guess, Observations, RawObservations};
use super::spline::{RESAMPLED_NOISE_GAIN, Spline, SplineEpi, VALUE_NOISE_GAIN};
use crate::lines::{EpiLines, SeenRule};
use crate::options::Occlusion;
use crate::validity::visibility::visible_intervals;
use epirig_core::grid::Grid;
use epirig_core::progress::{Cancelled, Progress};
use epirig_core::volume::Volume;

/// Quantisation alone leaves a noise of this variance, in DN^2 (uniform over one DN).
const QUANTISATION_VARIANCE: f64 = 1.0 / 12.0;
/// The noise is averaged over this reach, in px.
const NOISE_REACH: usize = 3;

/// Frames that the steps before the last look at.
const COARSE_FRAMES: usize = 33;

/// Data that all steps share.
pub(super) struct Steps<'a> {
    pub(super) volume: &'a Volume,
    pub(super) lines: &'a EpiLines,
    /// Which frames count.
    pub(super) rule: SeenRule,
    pub(super) spline: Spline,
    pub(super) level: Level,
    /// The discs in which the surface is fitted.
    sizes: Sizes,
    gains: Option<Vec<f32>>,
    series_reach_px: f32,
    /// A disparity in the middle of all, so that sums of differences from it are exact enough in single
    /// precision.
    pub(super) origin: f32,
    /// Counts each row of each step.
    progress: &'a dyn Progress,
}

/// A row whose pixels have observed.
pub(super) struct ObservedRow<'a> {
    pub(super) y: usize,
    /// The disparities around which they have.
    pub(super) guesses: &'a [f32],
    pub(super) epi: &'a SplineEpi,
    pub(super) observations: &'a [Observation],
    /// First and last tau' in which each pixel is seen, where points may be occluded.
    pub(super) visible: Option<&'a [(f32, f32)]>,
}

impl<'a> Steps<'a> {
    /// Steps from `guess`.
    pub(super) fn new(
        volume: &'a Volume,
        lines: &'a EpiLines,
        guess: &Grid<f32>,
        (rule, sizes): (SeenRule, Sizes),
        progress: &'a dyn Progress,
    ) -> Self {
        Self { sizes, series_reach_px: SERIES_REACH_PX, ..Self::rough(volume, lines, guess, rule, progress) }
    }

    /// Finds the gains of frames on the lines of `current`, for the observations from now on. EpiLines
    /// of the search follow the light where it drifts: after a step with light in the model they do
    /// not.
    pub(super) fn find_gains(&mut self, current: &Grid<f32>) {
        self.gains = corrections(self.volume, self.lines, current);
    }

    /// Steps from `guess` before the last one.
    pub(super) fn rough(
        volume: &'a Volume,
        lines: &'a EpiLines,
        guess: &Grid<f32>,
        rule: SeenRule,
        progress: &'a dyn Progress,
    ) -> Self {
        let (low, high) = extremes(guess);
        Self {
            volume,
            lines,
            rule,
            spline: Spline::new(),
            level: Level::new(),
            sizes: Sizes::Two,
            gains: None,
            series_reach_px: ROUGH_SERIES_REACH_PX,
            origin: 0.5 * (low + high),
            progress,
        }
    }

    /// Deviation of the gains of frames from their mean (root mean square); 0 without.
    pub(super) fn variation_of_gains(&self) -> f64 {
        let Some(corrections) = &self.gains else { return 0.0 };
        let gains = corrections.iter().map(|one_over| 1.0 / f64::from(*one_over));
        let count = corrections.len() as f64;
        let mean = gains.clone().sum::<f64>() / count;
        (gains.map(|gain| (gain / mean - 1.0).powi(2)).sum::<f64>() / count).sqrt()
    }

    /// Whether one side of the reference frame may be occluded.
    pub(super) fn points_may_be_occluded(&self) -> bool {
        self.rule.occlusion == Occlusion::OneSide
    }

    /// The observations of all pixels around `current` by every n-th frame, and the results of `look` for
    /// each row, in their order.
    pub(super) fn observations<T: Send>(
        &self,
        current: &Grid<f32>,
        every: usize,
        look: impl Fn(ObservedRow<'_>) -> T + Sync,
    ) -> Result<(Observations, Vec<T>), Cancelled> {
        let (rows, columns) = (current.rows(), current.columns());
        let mut raw = RawObservations::empty(rows, columns);
        let looked = raw.par_rows().enumerate().map_init(
            || (SplineEpi::default(), vec![UNOBSERVED; columns]),
            |(epi, observations), (y, out)| {
                if self.progress.cancelled() {
                    return None;
                }
                self.progress.advance(1);
                let reference = self.lines.reference();
                let frames = (0..self.volume.frames()).filter(|t| t.abs_diff(reference) % every == 0);
                epi.take(&self.spline, self.volume, self.gains.as_deref(), y, frames);
                let guesses = current.row(y);
                let visible = self.points_may_be_occluded().then(|| visible_intervals(guesses, self.lines));
                let frames_asked = FramesUsed {
                    // Near an occluder frames are given away, so as not to take its blur for the point.
                    minimum_frames: self.rule.minimum_frames
                        / (every * if visible.is_some() { 2 } else { 1 }),
                    every,
                    series_reach_px: self.series_reach_px,
                    columns: self.lines.shown(y),
                    visible: visible.as_deref(),
                };
                row_observations(
                    &self.spline,
                    self.level,
                    epi,
                    self.lines,
                    guesses,
                    frames_asked,
                    observations,
                );
                out.put(observations, self.origin);
                Some(look(ObservedRow { y, guesses, epi, observations, visible: visible.as_deref() }))
            },
        );
        let looked = looked.flatten().collect();
        self.progress.unless_cancelled()?;
        let freedom = (self.volume.frames() / every).saturating_sub(2).max(1) as f32;
        let least = QUANTISATION_VARIANCE as f32;
        Ok((raw.estimate_noise(NOISE_REACH, self.noise_gain(), least, freedom), looked))
    }

    /// Variance of the residuals along the lines over that of the noise at the frequencies of the texture.
    fn noise_gain(&self) -> f32 {
        // Frames that were rectified have been resampled before, and their noise is no longer white.
        (if self.volume.is_fine() { RESAMPLED_NOISE_GAIN } else { VALUE_NOISE_GAIN }) as f32
    }

    /// Takes a step from `current` by some of the frames; NaN stays NaN.
    ///
    /// # Errors
    /// [`Cancelled`], and `current` is then what it was.
    pub(super) fn take(&self, current: &mut Grid<f32>) -> Result<(), Cancelled> {
        let every = (self.volume.frames() / COARSE_FRAMES).max(1);
        let look = |row: ObservedRow<'_>| {
            // Columns to the surface that a pixel belongs to; 0 if that is its own.
            row.visible.map(|_| {
                let mut misplaced = vec![0; row.observations.len()];
                let samples = RowSamples {
                    spline: &self.spline,
                    epi: row.epi,
                    lines: self.lines,
                    columns: &self.lines.shown(row.y),
                    every,
                };
                samples.find_misplaced(row.guesses, row.observations, &mut misplaced);
                misplaced
            })
        };
        let (Observations { mut maps, template, .. }, misplaced) = self.observations(current, every, look)?;
        let guess = Guess { map: current, origin: self.origin };
        let disparity = rough_surface((self.level, self.progress), &mut maps, &template, guess, self.sizes)?;
        let columns = current.columns();
        for (y, misplaced) in misplaced.into_iter().enumerate() {
            let found = &disparity.row(y)[PAD..PAD + columns];
            for (value, found) in current.row_mut(y).iter_mut().zip(found) {
                // A step beyond a pixel is no step of a linearisation.
                *value += (found + self.origin - *value).clamp(-1.0, 1.0);
            }
            let Some(misplaced) = misplaced else { continue };
            let stepped = current.row(y).to_vec();
            for (x, away) in misplaced.into_iter().enumerate().filter(|(_, away)| *away != 0) {
                current.row_mut(y)[x] = stepped[x.wrapping_add_signed(isize::from(away))];
            }
        }
        Ok(())
    }
}

/// Smallest and largest disparity; zeros for no disparities.
pub(super) fn extremes(guess: &Grid<f32>) -> (f32, f32) {
    const LANES: usize = 16;
    // No number is less or greater than NaN, and lanes of their own let a processor compare sixteen at once.
    let widened = |(mut low, mut high): ([f32; LANES], [f32; LANES]), values: &[f32]| {
        for (value, (low, high)) in values.iter().zip(low.iter_mut().zip(&mut high)) {
            *low = if *value < *low { *value } else { *low };
            *high = if *value > *high { *value } else { *high };
        }
        (low, high)
    };
    let none = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let of_row = |row: &[f32]| {
        let (low, high) = row.chunks(LANES).fold(none, widened);
        (low.into_iter().fold(f32::INFINITY, f32::min), high.into_iter().fold(f32::NEG_INFINITY, f32::max))
    };
    let rows = guess.values().par_chunks(guess.columns().max(1)).map(of_row);
    let both = |one: (f32, f32), other: (f32, f32)| (one.0.min(other.0), one.1.max(other.1));
    let (low, high) = rows.reduce(|| (f32::INFINITY, f32::NEG_INFINITY), both);
    if low <= high { (low, high) } else { (0.0, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_pass_over_pixels_without_a_number() {
        let mut plane = Grid::filled(3, 37, f32::NAN);
        assert_eq!(extremes(&plane), (0.0, 0.0));
        plane.row_mut(1)[36] = -2.5;
        assert_eq!(extremes(&plane), (-2.5, -2.5));
        plane.row_mut(0)[0] = 1.0;
        plane.row_mut(2)[20] = 7.25;
        assert_eq!(extremes(&plane), (-2.5, 7.25));
    }
}
