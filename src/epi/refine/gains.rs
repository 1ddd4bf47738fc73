//! What light varied from frame to frame, if photometry has left any: the gain of each frame against the mean along the lines.
//!
//! A frame that is brighter than the others moves the intensities of all its points together, so windows do not average that out. The
//! points tell it: in a frame of gain g every point is g times as bright as its mean over all frames, whatever it shows.

use rayon::prelude::*;

use crate::epi::lines::Lines;
use crate::plane::Plane;
use crate::volume::Volume;

/// Rows that are looked at, spread over the image.
const SAMPLED_ROWS: usize = 24;
/// Every so manieth column is: nearer ones show the same texture.
const COLUMN_STEP: usize = 4;
/// Darker points than this share of full scale say little of a factor.
const LEAST_LIGHT: f32 = 1.0 / 32.0;
/// Frames with fewer points are taken to have the gain of the others.
const LEAST_POINTS: usize = 50;
/// Gains that are no more than chance have a mean squared deviation of one variance; with some ten frames chance seldom makes it four.
const SIGNIFICANT: f32 = 4.0;

/// One over the gain of each frame; `None` if they are all alike, as far as chance lets tell.
pub(super) fn corrections(volume: &Volume, lines: &Lines, guess: &Plane<f32>) -> Option<Vec<f32>> {
    let mut ratios = vec![Vec::new(); volume.frames()];
    let rows = volume.rows().min(SAMPLED_ROWS);
    let sampled: Vec<Vec<(usize, f32)>> = (0..rows)
        .into_par_iter()
        .map(|index| row_ratios(volume, lines, guess, (2 * index + 1) * volume.rows() / (2 * rows)))
        .collect();
    for (t, ratio) in sampled.into_iter().flatten() {
        ratios[t].push(ratio);
    }
    let gains: Vec<Option<Gain>> = ratios.iter_mut().map(|ratios| Gain::of(ratios)).collect();
    let known = gains.iter().flatten();
    let count = known.clone().count().max(1) as f32;
    let deviation = known.map(|gain| ((gain.value - 1.0) / gain.sigma).powi(2)).sum::<f32>() / count;
    (deviation > SIGNIFICANT)
        .then(|| gains.iter().map(|gain| gain.map_or(1.0, |gain| 1.0 / gain.value)).collect())
}

#[derive(Debug, Clone, Copy)]
struct Gain {
    value: f32,
    sigma: f32,
}

impl Gain {
    /// The median of the points' ratios, which points on wrong lines hardly move.
    fn of(ratios: &mut [f32]) -> Option<Self> {
        if ratios.len() < LEAST_POINTS {
            return None;
        }
        let median = |values: &mut [f32]| {
            let middle = values.len() / 2;
            *values.select_nth_unstable_by(middle, f32::total_cmp).1
        };
        let value = median(ratios);
        ratios.iter_mut().for_each(|ratio| *ratio = (*ratio - value).abs());
        // Normal deviations have a median of 0.6745 sigma, and their median scatters by the root of pi/2 as much as their mean.
        let sigma = median(ratios) / 0.6745 * (std::f32::consts::FRAC_PI_2 / ratios.len() as f32).sqrt();
        // Points without any noise still have that of single precision.
        Some(Self { value, sigma: sigma.max(f32::EPSILON) })
    }
}

/// Frame and ratio to the mean along its line, for the points of row `y` that are in view of all frames.
fn row_ratios(volume: &Volume, lines: &Lines, guess: &Plane<f32>, y: usize) -> Vec<(usize, f32)> {
    let columns = volume.columns();
    let mut epi = vec![0.0; columns * volume.frames()];
    for (t, row) in epi.chunks_exact_mut(columns).enumerate() {
        volume.copy_row(y, t, row);
    }
    let full_scale = (1_u32 << volume.bit_depth()) as f32;
    let last = (columns - 1) as f32;
    let mut ratios = Vec::new();
    let mut line = Vec::with_capacity(volume.frames());
    for x in (0..columns).step_by(COLUMN_STEP) {
        let disparity = guess.at(x, y);
        line.clear();
        line.extend(lines.offsets().iter().zip(epi.chunks_exact(columns)).map_while(|(&tau, frame)| {
            let place = x as f32 + disparity * tau as f32;
            (0.0..=last).contains(&place).then(|| {
                let whole = (place as usize).min(columns - 2);
                frame[whole] + (place - whole as f32) * (frame[whole + 1] - frame[whole])
            })
        }));
        let mean = line.iter().sum::<f32>() / volume.frames() as f32;
        if line.len() == volume.frames() && mean > LEAST_LIGHT * full_scale {
            ratios.extend(line.iter().map(|value| value / mean).enumerate());
        }
    }
    ratios
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::tau::Tau;

    const FRAMES: usize = 20;
    const COLUMNS: usize = 200;
    const ROWS: usize = 40;
    const DISPARITY_PX: f64 = 11.4;

    /// A texture of low contrast before noise of 1 DN; frame t has the gain `gain(t)`. A fifth of the points is on a wrong line.
    fn found(gain: impl Fn(usize) -> f64) -> Option<Vec<f32>> {
        let tau = Tau::equidistant(FRAMES).unwrap();
        let lines = Lines::new(&tau, 0, COLUMNS);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut volume = Volume::fine(ROWS, COLUMNS, 8, tau);
        for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
            let (x, t, y) = (index % COLUMNS, index / COLUMNS % FRAMES, index / COLUMNS / FRAMES);
            let place = x as f64 - DISPARITY_PX * lines.offsets()[t];
            let noise: f64 = StandardNormal.sample(&mut random);
            let light = 110.0 + 30.0 * (0.4 * place + y as f64).sin();
            *count = (128.0 * (gain(t) * light + noise)).round() as u16;
        }
        let mut guess = Plane::filled(ROWS, COLUMNS, DISPARITY_PX as f32);
        guess.values_mut().iter_mut().step_by(5).for_each(|value| *value = 2.0);
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
            // 1 % of noise at 1200 points: 0.00036 for a median, four times that; points on wrong lines deviate to both sides.
            assert!(error.abs() < 0.0015, "frame {t}: {error}");
        }
    }

    #[test]
    fn frames_that_are_alike_stay_as_they_are() {
        assert_eq!(found(|_| 1.0), None);
    }
}
