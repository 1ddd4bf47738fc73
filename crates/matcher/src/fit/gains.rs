//! Gain of each frame against the mean along the lines: what is left of varying light after photometry.
//!
//! A frame that is brighter than the others changes the intensities of all its points together, so no window
//! averages that out. In a frame of gain g every point is g times as bright as its mean over all frames.

use epirig_core::statistics::upper_median;
use rayon::prelude::*;

use crate::cost::linear_epi::LinearEpi;
use crate::lines::EpiLines;
use epirig_core::grid::Grid;
use epirig_core::volume::Volume;

/// Rows that are looked at, spread over the image, if they hold enough points: a thousand leave
/// less than a tenth of a percent. Else so many more are.
const SAMPLED_ROWS: usize = 16;
const MORE_ROWS: usize = 64;
const ENOUGH_POINTS: usize = 1000;
/// Only every n-th column is used: nearer ones show the same texture.
const COLUMN_STEP: usize = 4;
/// Points darker than this share of full scale do not count: noise hides their gain.
const LEAST_LIGHT: f32 = 1.0 / 32.0;
/// At least so many points, or the gains are too uncertain.
const LEAST_POINTS: usize = 50;
/// Points count if their intensities vary along their lines by at most this many times the lower quartile (in
/// squares). Background beside the object has no line of its own. A narrower limit would choose points whose
/// noise masks the gains.
const ACCEPTED: f32 = 6.0;
/// Points this many standard deviations away have full weight: of normal ones few lie beyond.
const FAR_SIGMAS: f32 = 2.0;
/// Gains that vary by less than this (RMS) are left as they are: of 100 DN that is a fifth of a DN, less than
/// quantisation leaves of a single pixel.
const LEAST_VARIATION: f32 = 0.002;
/// Gains beyond this factor are not taken for light.
const LARGEST: f32 = 2.0;
/// Gains that are no more than chance have a mean squared deviation of one variance; with some ten frames
/// chance seldom makes it four.
const SIGNIFICANT: f32 = 4.0;

/// One over the gain of each frame; `None` if they are all alike, as far as chance lets tell.
pub(super) fn corrections(volume: &Volume, lines: &EpiLines, guess: &Grid<f32>) -> Option<Vec<f32>> {
    let points_of = |rows: usize| -> Vec<Point> {
        let rows = volume.rows().min(rows);
        let row = |index| row_points(volume, lines, guess, (2 * index + 1) * volume.rows() / (2 * rows));
        (0..rows).into_par_iter().flat_map_iter(row).collect()
    };
    let mut points = points_of(SAMPLED_ROWS);
    if points.len() < ENOUGH_POINTS {
        points = points_of(MORE_ROWS);
    }
    if points.len() < 4 * LEAST_POINTS {
        return None;
    }
    let quartile = points.len() / 4;
    points.select_nth_unstable_by(quartile, |one, other| one.spread.total_cmp(&other.spread));
    let limit = (ACCEPTED * points[quartile].spread).max(f32::MIN_POSITIVE);
    // The weight falls linearly to 0, so that a small change of a point changes the gains by little.
    points.iter_mut().for_each(|point| point.weight = (2.0 - point.spread / limit).clamp(0.0, 1.0));
    points.retain(|point| point.weight > 0.0);
    let gains: Vec<Gain> = (0..volume.frames()).into_par_iter().map(|t| Gain::of(&points, t)).collect();
    let deviation = |gain: &Gain| ((gain.value - 1.0) / gain.sigma).powi(2);
    let significant = gains.iter().map(deviation).sum::<f32>() > SIGNIFICANT * gains.len() as f32;
    let variation = gains.iter().map(|gain| (gain.value - 1.0).powi(2)).sum::<f32>() / gains.len() as f32;
    let credible = gains.iter().all(|gain| (1.0 / LARGEST..=LARGEST).contains(&gain.value));
    (significant && credible && variation > LEAST_VARIATION.powi(2))
        .then(|| gains.iter().map(|gain| 1.0 / gain.value).collect())
}

#[derive(Debug, Clone, Copy)]
struct Gain {
    value: f32,
    sigma: f32,
}

impl Gain {
    /// The mean of the points' ratios, of which those farther than [`FAR_SIGMAS`] from the median count as no
    /// farther (Huber 1964): points on wrong lines hardly move it.
    fn of(points: &[Point], t: usize) -> Self {
        let mut ratios: Vec<f32> = points.iter().map(|point| point.ratios[t]).collect();
        let middle = upper_median(&mut ratios).unwrap_or(f32::NAN);
        let mut deviations: Vec<f32> = ratios.iter().map(|ratio| (ratio - middle).abs()).collect();
        // Normal deviations have a median of 0.6745 sigma.
        let scatter = upper_median(&mut deviations).unwrap_or(f32::NAN) / 0.6745;
        let far = FAR_SIGMAS * scatter;
        let weights = points.iter().map(|point| point.weight).sum::<f32>().max(f32::EPSILON);
        let beyond = |point: &Point| point.weight * (point.ratios[t] - middle).clamp(-far, far);
        let mean = points.iter().map(beyond).sum::<f32>() / weights;
        // Points without any noise still have that of single precision.
        Self { value: middle + mean, sigma: (scatter / weights.sqrt()).max(f32::EPSILON) }
    }
}

/// A point that all frames have in view.
struct Point {
    /// Intensity in each frame over the mean of all.
    ratios: Vec<f32>,
    /// Mean squared deviation of the ratios from 1.
    spread: f32,
    /// Weight of the point, 0 to 1.
    weight: f32,
}

fn row_points(volume: &Volume, lines: &EpiLines, guess: &Grid<f32>, y: usize) -> Vec<Point> {
    let epi = LinearEpi::new(volume, y);
    let full_scale = (1_u32 << volume.bit_depth()) as f32;
    let frames = volume.frames();
    let shown = lines.shown(y);
    let point = |x: usize| {
        let disparity = guess.at(x, y);
        let ends = [-lines.tau_before(), lines.tau_after()].map(|tau| x as f64 + f64::from(disparity) * tau);
        if !ends.iter().all(|&end| end >= shown.start as f64 && end + 1.0 <= shown.end as f64) {
            return None;
        }
        let sample = |(t, tau): (usize, &f64)| epi.at(t, x as f32 + disparity * *tau as f32);
        let mut ratios: Vec<f32> = lines.offsets().iter().enumerate().map(sample).collect::<Option<_>>()?;
        let mean = ratios.iter().sum::<f32>() / frames as f32;
        if mean <= LEAST_LIGHT * full_scale {
            return None;
        }
        ratios.iter_mut().for_each(|ratio| *ratio /= mean);
        let spread = ratios.iter().map(|ratio| (ratio - 1.0).powi(2)).sum::<f32>() / frames as f32;
        Some(Point { ratios, spread, weight: 1.0 })
    };
    (0..volume.columns()).step_by(COLUMN_STEP).filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use epirig_core::tau::Tau;

    const FRAMES: usize = 20;
    const COLUMNS: usize = 200;
    const ROWS: usize = 40;
    const DISPARITY_PX: f64 = 11.4;

    /// A texture with noise of 1 DN; frame t has the gain `gain(t)`. Two of three points are on wrong lines.
    fn found(gain: impl Fn(usize) -> f64) -> Option<Vec<f32>> {
        let tau = Tau::equidistant(FRAMES).unwrap();
        let lines = EpiLines::new(&tau, 0, COLUMNS);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut volume = Volume::fine(ROWS, COLUMNS, 8, tau);
        for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
            let (x, t, y) = (index % COLUMNS, index / COLUMNS % FRAMES, index / COLUMNS / FRAMES);
            let place = x as f64 - DISPARITY_PX * lines.offsets()[t];
            let noise: f64 = StandardNormal.sample(&mut random);
            let light = 110.0 + 30.0 * (0.4 * place + y as f64).sin();
            *count = (128.0 * (gain(t) * light + noise)).round() as u16;
        }
        let mut guess = Grid::filled(ROWS, COLUMNS, DISPARITY_PX as f32);
        for (index, value) in guess
            .values_mut()
            .iter_mut()
            .enumerate()
            .filter(|(index, _)| !(index / COLUMNS).is_multiple_of(3))
        {
            *value = (index % 7) as f32;
        }
        corrections(&volume, &lines, &guess)
    }

    #[test]
    fn gains_of_frames_are_found() {
        let gain = |t: usize| 1.0 + 0.02 * (1.7 * t as f64).sin() + 0.001 * t as f64;
        let found = found(gain).unwrap();
        // What all frames have in common is no matter.
        let common =
            found.iter().enumerate().map(|(t, one_over)| f64::from(*one_over) * gain(t)).sum::<f64>()
                / FRAMES as f64;
        for (t, one_over) in found.iter().enumerate() {
            let error = f64::from(*one_over) * gain(t) / common - 1.0;
            // 1 % of noise at 600 points: 0.0004 for a mean, five times that.
            assert!(error.abs() < 0.002, "frame {t}: {error}");
        }
    }

    #[test]
    fn frames_that_are_alike_stay_as_they_are() {
        assert_eq!(found(|_| 1.0), None);
    }
}
