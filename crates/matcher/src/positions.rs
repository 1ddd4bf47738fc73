//! tau of every frame from the texture itself: residuals that all lines of a frame share are the frame's
//! error of position.

use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;
use thiserror::Error;

use super::interpolation::{Interpolation, SampledEpi};
use super::lines::Lines;
use super::maps::{Answer, DisparityMaps};
use epirig_core::spline::cubic;
use epirig_core::volume::Volume;

/// A frame whose pivot is less than this share of the others' is not connected with them.
const PIVOT: f64 = 1e-9;

/// Bias of a place between pixels by the cubic B-spline, root mean square over all places: its worst for
/// texture blurred by 0.7 px is 0.0016 px ([`Interpolation`]), and it goes up and down once a pixel, as a
/// sine does. All pixels of a frame whose disparities are alike have it in common, so it does not average
/// out.
const INTERPOLATION_BIAS_PX: f64 = 0.0016 * std::f64::consts::FRAC_1_SQRT_2;

/// The correction of the tau of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TauCorrection {
    /// tau less the volume's; without the part that is linear in tau, which disparities take up.
    pub correction: f64,
    /// Its standard deviation, from the scatter of the pixels and from the bias of interpolation.
    pub sigma: f64,
}

/// The texture does not connect all frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("frame {frame} shares too little texture with the others")]
pub struct FramesApart {
    /// The first frame that is not connected with those before it.
    pub frame: usize,
}

/// Sums over pixels that the same frames see.
#[derive(Clone)]
struct Class {
    first: usize,
    end: usize,
    weight: f64,
    /// Weight times the error of tau that each frame's intensity shows.
    moments: Vec<f64>,
}

/// Sums over all pixels of some rows.
#[derive(Default)]
struct Sums {
    classes: Vec<Class>,
    energy: f64,
    freedom: f64,
    /// Sum of the sizes of the disparities, in px.
    disparity: f64,
    pixels: f64,
}

/// Corrections of all tau, jointly with the disparities of all pixels (one Gauss-Newton step).
///
/// If a frame truly stands at tau + e, a line of disparity d through texture of gradient g meets it e d px
/// too early, and its intensity there is g d e too low. Each pixel's intensity takes up the part that is
/// constant over its frames, and its disparity the part that is linear in tau. Both are eliminated, pixel by
/// pixel, over the frames that see it. Match with the corrected tau and repeat, until corrections are small
/// against their sigma.
///
/// # Errors
/// [`FramesApart`] if a frame is connected with the others by too little texture.
pub fn tau_corrections(volume: &Volume, maps: &DisparityMaps) -> Result<Vec<TauCorrection>, FramesApart> {
    let tau = volume.tau().values();
    let lines = Lines::new(volume.tau(), maps.reference, volume.columns());
    let rows: Vec<Sums> =
        (0..volume.rows()).into_par_iter().map(|y| sums_of_row(volume, maps, &lines, y)).collect();
    let mut sums = Sums::default();
    // In the order of the rows, so that the result does not depend on the threads.
    rows.into_iter().for_each(|row| sums.join(row));

    let frames = tau.len();
    let mut matrix = DMatrix::zeros(frames, frames);
    let mut right = DVector::zeros(frames);
    for class in &sums.classes {
        class.add(tau, &mut matrix, &mut right);
    }
    // Constant and linear corrections are open; they are held at zero.
    let open = gauge(tau);
    let scale = matrix.trace() / frames as f64;
    let mut paths = matrix.clone();
    for direction in &open {
        paths += scale * direction * direction.transpose();
    }
    let apart = (0..frames).find(|&frame| matrix[(frame, frame)] <= PIVOT * scale);
    if let Some(frame) = apart {
        return Err(FramesApart { frame });
    }
    let factor = Cholesky::new(paths).ok_or(FramesApart { frame: 0 })?;
    let lower = factor.l_dirty();
    if let Some(frame) = (0..frames).find(|&frame| lower[(frame, frame)].powi(2) <= PIVOT * scale) {
        return Err(FramesApart { frame });
    }
    let correction = factor.solve(&right);
    let variance =
        ((sums.energy - correction.dot(&right)) / (sums.freedom - (frames as f64 - 2.0)).max(1.0)).max(0.0);
    let mut inverse = factor.inverse();
    for direction in &open {
        inverse -= direction * direction.transpose() / scale;
    }
    let bias = INTERPOLATION_BIAS_PX / (sums.disparity / sums.pixels.max(1.0));
    Ok((0..frames)
        .map(|frame| TauCorrection {
            correction: correction[frame],
            sigma: (variance * inverse[(frame, frame)].max(0.0)).sqrt().hypot(bias),
        })
        .collect())
}

/// Orthonormal vectors of the constant and the linear corrections.
fn gauge(tau: &[f64]) -> [DVector<f64>; 2] {
    let frames = tau.len();
    let constant = DVector::from_element(frames, 1.0 / (frames as f64).sqrt());
    let linear = DVector::from_column_slice(tau);
    let linear = &linear - &constant * constant.dot(&linear);
    [constant, linear.normalize()]
}

fn sums_of_row(volume: &Volume, maps: &DisparityMaps, lines: &Lines, y: usize) -> Sums {
    let epi = SampledEpi::new(volume, y, Interpolation::BSpline, 0);
    let tau = volume.tau().values();
    let last = (volume.columns() - 1) as f64;
    let mut values = vec![0.0; tau.len()];
    let mut sums = Sums::default();
    for x in (0..volume.columns()).filter(|&x| maps.answer.at(x, y) == Answer::Found) {
        let disparity = f64::from(maps.disparity.at(x, y));
        let (mut first, mut end, mut gradient) = (tau.len(), 0, 0.0);
        for (t, offset) in lines.offsets().iter().enumerate() {
            let place = x as f64 + disparity * offset;
            if !(0.0..=last).contains(&place) {
                continue;
            }
            let whole = place.floor();
            let fraction = (place - whole) as f32;
            let taps = epi.taps(t, whole as isize, 1);
            let sum = |weights: [f32; 4]| -> f64 {
                weights.iter().zip(taps).map(|(weight, tap)| f64::from(weight * tap)).sum()
            };
            values[t] = sum(cubic::weights(fraction));
            gradient += sum(cubic::gradient_weights(fraction));
            // A point moves to one side, so the frames that see it follow each other.
            (first, end) = (first.min(t), t + 1);
        }
        if end < first + 4 {
            continue;
        }
        let per_tau = disparity * gradient / (end - first) as f64;
        sums.add(first..end, per_tau, &values, tau);
        sums.disparity += disparity.abs();
        sums.pixels += 1.0;
    }
    sums
}

impl Sums {
    fn class(&mut self, first: usize, end: usize) -> &mut Class {
        let at = self.classes.iter().position(|class| (class.first, class.end) == (first, end));
        let index = at.unwrap_or_else(|| {
            self.classes.push(Class { first, end, weight: 0.0, moments: vec![0.0; end - first] });
            self.classes.len() - 1
        });
        &mut self.classes[index]
    }

    /// A pixel whose intensity changes by `per_tau` DN for an error of tau of 1.
    fn add(&mut self, seen: std::ops::Range<usize>, per_tau: f64, values: &[f64], tau: &[f64]) {
        let (values, tau) = (&values[seen.clone()], &tau[seen.clone()]);
        let count = values.len() as f64;
        let mean = |numbers: &[f64]| numbers.iter().sum::<f64>() / count;
        let (value, middle) = (mean(values), mean(tau));
        let spread: f64 = tau.iter().map(|tau| (tau - middle).powi(2)).sum();
        let slope = values.iter().zip(tau).map(|(v, tau)| (v - value) * (tau - middle)).sum::<f64>() / spread;
        let class = self.class(seen.start, seen.end);
        class.weight += per_tau * per_tau;
        let mut energy = 0.0;
        for ((moment, v), tau) in class.moments.iter_mut().zip(values).zip(tau) {
            let residual = v - value - slope * (tau - middle);
            *moment -= per_tau * residual;
            energy += residual * residual;
        }
        self.energy += energy;
        self.freedom += count - 2.0;
    }

    fn join(&mut self, other: Self) {
        for from in other.classes {
            let class = self.class(from.first, from.end);
            class.weight += from.weight;
            class.moments.iter_mut().zip(&from.moments).for_each(|(sum, moment)| *sum += moment);
        }
        self.disparity += other.disparity;
        self.pixels += other.pixels;
        self.energy += other.energy;
        self.freedom += other.freedom;
    }
}

impl Class {
    /// Adds weight (I - Q) to `matrix` and the moments to `right`, where Q projects on constant and linear
    /// functions over these frames.
    fn add(&self, tau: &[f64], matrix: &mut DMatrix<f64>, right: &mut DVector<f64>) {
        let taken = gauge(&tau[self.first..self.end]);
        let count = self.end - self.first;
        for i in 0..count {
            right[self.first + i] += self.moments[i];
            for j in 0..count {
                let projected: f64 = taken.iter().map(|direction| direction[i] * direction[j]).sum();
                let identity = if i == j { 1.0 } else { 0.0 };
                matrix[(self.first + i, self.first + j)] += self.weight * (identity - projected);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::{DisparityRange, MatchOptions, ReferenceFrame, match_volume};
    use epirig_core::progress::Silent;
    use epirig_core::tau::Tau;
    use epirig_simulator::{Sensor, Simulator, SimulatorConfig};

    const FRAMES: usize = 15;
    /// In px of the last frame's shift.
    const STEP_SIGMA_PX: f64 = 0.05;

    /// What is left of tau's errors after two rounds, normalised by the stated sigma.
    fn normalised_errors(seed: u64) -> Vec<f64> {
        let mut config = SimulatorConfig::textured_plane(160, 64, FRAMES);
        config.sensor = Sensor { read_noise_dn: 1.0, seed, ..Sensor::ideal(8) };
        config.texture.seed = seed;
        let scan = config.scan;
        let simulator = Simulator::new(config).unwrap();
        let travel_mm = scan.step_mm * (FRAMES - 1) as f64;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let true_mm: Vec<f64> = scan
            .positions_mm()
            .iter()
            .map(|position| {
                let unit: f64 = StandardNormal.sample(&mut random);
                position + STEP_SIGMA_PX / 8.0 * travel_mm * unit
            })
            .collect();
        let mut volume = Volume::new(64, 160, 8, Tau::equidistant(FRAMES).unwrap());
        for (index, position) in true_mm.iter().enumerate() {
            volume.insert(index, &simulator.expose(*position, index as u32)).unwrap();
        }
        let options = MatchOptions {
            reference: ReferenceFrame::Middle,
            range: Some(DisparityRange { minimum_px: 5.0, maximum_px: 11.0 }),
            ..MatchOptions::default()
        };
        let all: Vec<usize> = (0..64).collect();
        let frames: Vec<usize> = (0..FRAMES).collect();
        let mut sigma = Vec::new();
        for _ in 0..2 {
            let maps = match_volume(&volume, &options, &Silent).unwrap();
            let found = tau_corrections(&volume, &maps).unwrap();
            let corrected: Vec<f64> =
                volume.tau().values().iter().zip(&found).map(|(tau, found)| tau + found.correction).collect();
            sigma = found.iter().map(|found| found.sigma).collect();
            volume = volume.selected(&all, &frames, Tau::from_positions(&corrected).unwrap());
        }
        let errors: Vec<f64> = volume
            .tau()
            .values()
            .iter()
            .zip(&true_mm)
            .map(|(tau, position)| tau - (position - scan.start_mm) / travel_mm)
            .collect();
        let mut errors = DVector::from_vec(errors);
        let equidistant = Tau::equidistant(FRAMES).unwrap();
        for direction in gauge(equidistant.values()) {
            errors -= &direction * direction.dot(&errors);
        }
        errors.iter().zip(sigma).map(|(error, sigma)| error / sigma).collect()
    }

    #[test]
    fn tau_is_found_from_texture_within_its_sigma() {
        let errors: Vec<f64> = (0..12).flat_map(normalised_errors).collect();
        let spread = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
        // 156 independent numbers: their spread is known to 6 %.
        assert!((0.8..1.2).contains(&spread), "{spread}");
    }
}
