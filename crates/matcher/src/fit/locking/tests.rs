use std::f64::consts::{PI, TAU as TURN};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::products::{Products, Regression, Terms, Turns, fraction};
use crate::fit::{Fit, FitResult, Sizes, fit};
use crate::lines::{EpiLines, SeenRule};
use crate::locking::LockingAmplitudes;
use crate::options::Occlusion;
use epirig_core::grid::Grid;
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

const FRAMES: usize = 40;
const ROWS: usize = 48;
const COLUMNS: usize = 320;
/// Fractions of all frames are well spread.
const GENERIC_PX: f64 = 17.3;

/// A row's texture: amplitude, frequency and phase of its waves.
type Waves = Vec<(f64, f64, f64)>;

/// Waves of frequencies from `low` to `high`, as square pixels see them behind a blur of `blur` px; each row
/// has its own phases.
fn waves(blur: f64, low: f64, high: f64, seed: u64) -> Vec<Waves> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut wave = |index: usize| {
        let omega = 3.0 * PI * (index as f64 + 0.5) / 90.0;
        let pixel = (0.5 * omega).sin() / (0.5 * omega);
        (8.0 * pixel * (-0.5 * (blur * omega).powi(2)).exp(), omega, random.random_range(0.0..TURN))
    };
    let mut rows: Vec<Waves> = (0..ROWS).map(|_| (0..90).map(&mut wave).collect()).collect();
    rows.iter_mut().for_each(|waves| waves.retain(|wave| wave.1 > low && wave.1 < high));
    rows
}

/// Fine texture, of periods below 4 px and well beyond what pixels resolve: few points tell its amplitudes.
fn texture(blur: f64, seed: u64) -> Vec<Waves> {
    waves(blur, PI / 2.0, 3.0 * PI, seed)
}

/// Waves whose period is 8 px and more: interpolation takes less than a hundred thousandth of them (1 / 7^6).
fn smooth(seed: u64) -> Vec<Waves> {
    waves(0.0, 0.0, PI / 4.0, seed)
}

/// The rows' texture at rows' disparities, with noise of `sigma` DN and frames beside their positions by
/// `jitter` px.
fn fitted(
    rows: &[Waves],
    disparity: impl Fn(usize) -> f64,
    reference: usize,
    (sigma, jitter): (f64, f64),
) -> FitResult {
    let tau = Tau::equidistant(FRAMES).unwrap();
    let lines = EpiLines::new(&tau, reference, COLUMNS);
    let mut volume = Volume::fine(ROWS, COLUMNS, 8, tau);
    let mut random = ChaCha8Rng::seed_from_u64(rows[0][0].2.to_bits());
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let beside: Vec<f64> = (0..FRAMES).map(|_| jitter * normal()).collect();
    for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
        let (x, t, y) = (index % COLUMNS, index / COLUMNS % FRAMES, index / COLUMNS / FRAMES);
        let place = x as f64 - disparity(y) * lines.offsets()[t] - beside[t];
        let wave = |&(amplitude, omega, phase): &(f64, f64, f64)| amplitude * (omega * place + phase).cos();
        let value = 128.0 + rows[y].iter().map(wave).sum::<f64>() + sigma * normal();
        *count = (128.0 * value).round() as u16;
    }
    let mut guess = Grid::filled(ROWS, COLUMNS, 0.0);
    (0..ROWS).for_each(|y| guess.row_mut(y).fill(disparity(y) as f32 + 0.03));
    let options = Fit {
        sizes: Sizes::Growing { wanted_sigma_px: 0.005 },
        steps: 2,
        rule: SeenRule::new(FRAMES, 0.5, Occlusion::None),
        deviation_share: None,
    };
    fit(&volume, &lines, guess, options, &Silent).unwrap()
}

/// H_0 and H_1: the shares of a wave and of its first alias in the spline through it (Unser 1999: the Fourier
/// transform of the quintic B-spline is sinc^6).
fn shares(omega: f64) -> (f64, f64) {
    let power = |h: i32| (omega - TURN * f64::from(h)).powi(-6);
    let all: f64 = (-20..=20).map(power).sum();
    (power(0) / all, power(1) / all)
}

/// Sum over all waves of a squared amplitude times `term` of frequency and shares.
fn sum(rows: &[Waves], term: impl Fn(f64, f64, f64) -> f64) -> f64 {
    let waves = rows.iter().flatten();
    waves.map(|wave| wave.0 * wave.0 * term(wave.1, shares(wave.1).0, shares(wave.1).1)).sum()
}

#[test]
fn amplitudes_are_those_of_the_spectrum() {
    for (blur, reference) in [(0.8, FRAMES / 2), (0.6, 0), (0.4, FRAMES - 1)] {
        let rows = texture(blur, 3);
        let locking = fitted(&rows, |_| GENERIC_PX, reference, (0.3, 0.0)).locking.unwrap();
        assert!(locking.from_lines);
        let first = locking.harmonics[0];
        // Means of products of sinusoids: alpha and G have halves, kappa has none.
        let square = 0.5 * sum(&rows, |omega, own, _| (omega * own).powi(2));
        let interpolation = -0.5 * sum(&rows, |omega, own, alias| omega * own * alias) / square;
        let aliasing = 0.5 * sum(&rows, |omega, _, alias| (TURN - omega) * alias * alias) / square;
        let pairs = [
            (first.interpolation_px, first.interpolation_sigma_px, interpolation),
            (first.aliasing_px, first.aliasing_sigma_px, aliasing),
        ];
        for (found, sigma, truth) in pairs {
            // Chance exceeds four sigma once in ten thousand; each is as significant.
            assert!((found - truth).abs() < 4.0 * sigma, "blur {blur}: {found} +- {sigma}, not {truth}");
            assert!(truth.abs() > 4.0 * sigma, "blur {blur}: {found} +- {sigma}");
        }
    }
}

fn locking_px(result: &FitResult, x: usize, y: usize) -> f32 {
    result.locking_px.as_ref().map_or(0.0, |biases| biases.at(x, y))
}

/// Mean error of the rows from `first` on that are at `disparity`, its standard error by rows, and the mean
/// predicted bias.
fn errors(result: &FitResult, first: usize, disparity: f64) -> (f64, f64, f64) {
    // Away from the other rows and from the columns that not all frames see.
    let mean = |value: &dyn Fn(usize) -> f32| {
        (25..COLUMNS - 25).map(|x| f64::from(value(x))).sum::<f64>() / (COLUMNS - 50) as f64
    };
    let rows: Vec<(f64, f64)> = (first + 6..ROWS - 6)
        .map(|y| {
            let error = |x: usize| result.disparity.at(x, y) - disparity as f32;
            (mean(&error), mean(&|x| locking_px(result, x, y)))
        })
        .collect();
    let count = rows.len() as f64;
    let error = rows.iter().map(|row| row.0).sum::<f64>() / count;
    let scatter = rows.iter().map(|row| (row.0 - error).powi(2)).sum::<f64>();
    (error, (scatter / count / (count - 1.0)).sqrt(), rows.iter().map(|row| row.1).sum::<f64>() / count)
}

#[test]
fn the_bias_near_repeating_fractions_is_predicted() {
    // The upper half of the rows tells; the lower half moves by a pixel a frame and half a pixel in all.
    let locked_px = FRAMES as f64 - 0.5;
    let rows = texture(0.8, 5);
    let disparity = |y: usize| if y < ROWS / 2 { GENERIC_PX } else { locked_px };
    let result = fitted(&rows, disparity, FRAMES / 2, (0.3, 0.0));
    let first = result.locking.unwrap().harmonics[0];
    let (error, standard_error, predicted) = errors(&result, ROWS / 2, locked_px);
    // Windows share rows, up to eleven of them.
    let own = 11.0_f64.sqrt() * standard_error;
    let relative = first.interpolation_sigma_px / first.interpolation_px.abs();
    assert!(error > 3.0 * own, "{error} +- {own}");
    assert!(
        (predicted - error).abs() < 3.0 * own.hypot(relative * predicted),
        "{predicted}, not {error} +- {own}: {first:?}"
    );
    // It is a part of sigma there, and hardly any at the generic disparity.
    for x in 60..100 {
        let [there, elsewhere] = [ROWS - 8, 8].map(|y| locking_px(&result, x, y));
        assert!(there > 0.5 * error as f32 && result.sigma.at(x, ROWS - 8) > there, "column {x}");
        assert!(elsewhere.abs() < 0.0005, "column {x}: {elsewhere}");
    }
}

#[test]
fn where_all_fractions_repeat_texture_tells() {
    let locked_px = FRAMES as f64 - 0.5;
    let rows = texture(0.8, 5);
    let result = fitted(&rows, |_| locked_px, FRAMES / 2, (0.3, 0.0));
    let LockingAmplitudes { harmonics: [first, second], from_lines } = result.locking.unwrap();
    assert!(!from_lines && second.interpolation_px == 0.0 && first.aliasing_px == 0.0);
    // A wave and its alias at one place: omega H_0 + (omega - 2 pi) H_1 is the slope.
    let square = 0.5 * sum(&rows, |omega, own, alias| (omega * own + (omega - TURN) * alias).powi(2));
    let truth = -0.5 * PI * sum(&rows, |_, own, alias| own * alias) / square;
    let (found, sigma) = (first.interpolation_px, first.interpolation_sigma_px);
    assert!((found - truth).abs() < 4.0 * sigma, "{found} +- {sigma}, not {truth}");
    let (error, standard_error, predicted) = errors(&result, 0, locked_px);
    // Finer texture, which is not known, takes from the bias; it has its sign at this blur.
    assert!(error > 3.0 * standard_error && predicted > error, "{predicted}, {error} +- {standard_error}");
}

#[test]
fn neither_noise_nor_misplaced_frames_are_taken_for_locking() {
    let locked_px = FRAMES as f64 - 0.5;
    // Chance makes one scene in a thousand significant, so hardly one of twelve.
    for seed in 0..6 {
        for (sigma, jitter) in [(2.0, 0.0), (0.5, 0.05)] {
            let disparity = |y: usize| if y < ROWS / 2 { GENERIC_PX } else { locked_px };
            let result = fitted(&smooth(seed), disparity, FRAMES / 2, (sigma, jitter));
            assert!(result.locking.is_some());
            let locking = result.locking;
            assert!(result.locking_px.is_none(), "seed {seed}, noise {sigma}, jitter {jitter}: {locking:?}");
        }
    }
}

#[test]
fn the_bias_is_that_of_the_fit_by_its_definition() {
    let turns = Turns::new();
    let columns = 31;
    // Whole periods over the columns, and no two that make 31 together, so that means over the columns are
    // exact; sin and cos of a table of 512 fractions.
    let waves = [(3.0, 5.0), (1.0, 12.0), (0.7, 18.0), (0.4, 25.0)];
    let taus: Vec<f64> = (0..FRAMES).map(|t| t as f64 / (FRAMES - 1) as f64 - 0.3).collect();
    for disparity in [GENERIC_PX, 39.1, 39.5, 40.2] {
        let fractions: Vec<usize> = taus.iter().map(|tau| fraction(disparity * tau)).collect();
        let mut products = Products::default();
        let (mut moment, mut square) = (0.0, 0.0);
        for x in 0..columns {
            let (mut values, mut gradients) = (Terms::zeros(), Terms::zeros());
            for (index, (amplitude, periods)) in waves.into_iter().enumerate() {
                let omega = TURN * periods / f64::from(columns);
                let (own, alias) = shares(omega);
                let phase = omega * f64::from(x) + index as f64;
                gradients[0] -= amplitude * omega * own * phase.sin();
                values[2] += amplitude * alias * phase.cos();
                values[3] += amplitude * alias * phase.sin();
                gradients[2] -= amplitude * (omega - TURN) * alias * phase.sin();
                gradients[3] += amplitude * (omega - TURN) * alias * phase.cos();
            }
            products.add(&Products::of(&values, &gradients, 1.0), 1.0);
            // The fit: the values' slope over tau' and the mean gradient.
            let mean_tau = taus.iter().sum::<f64>() / FRAMES as f64;
            let (mut slope, mut spread, mut gradient) = (0.0, 0.0, 0.0);
            for (&tau, &fraction) in taus.iter().zip(&fractions) {
                let (sin, cos) = (TURN * fraction as f64 / 512.0).sin_cos();
                slope += (tau - mean_tau) * (values[2] * cos + values[3] * sin);
                spread += (tau - mean_tau).powi(2);
                gradient += (gradients[0] + gradients[2] * cos + gradients[3] * sin) / FRAMES as f64;
            }
            moment += gradient * slope / spread;
            square += gradient * gradient;
        }
        let regression = Regression::of(&turns, taus.iter().copied().zip(fractions));
        let (found, truth) = (products.bias(&regression), -moment / square);
        assert!((found - truth).abs() < 1e-12, "{disparity}: {found}, not {truth}");
    }
}
