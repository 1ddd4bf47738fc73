//! The costs against their definitions, written down in f64: no rows, no running sums, no shared
//! samples.

use super::{Band, band_costs};
use crate::candidates::Candidates;
use crate::cost::interpolation::Interpolation;
use crate::lines::{EpiLines, SeenRule};
use crate::{DisparityRange, MatchOptions, Method, Occlusion};
use epirig_core::frame::{Frame, Samples};
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

const ROWS: usize = 6;
const COLUMNS: usize = 24;

fn volume(positions: &[f64]) -> Volume {
    let mut volume = Volume::new(ROWS, COLUMNS, 16, Tau::from_positions(positions).unwrap());
    let mut state = 12345_u32;
    for t in 0..positions.len() {
        let mut next = || {
            // A linear congruential generator (Numerical Recipes); its upper bits are random enough for
            // texture.
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 20) as u16
        };
        let values = (0..ROWS * COLUMNS).map(|_| next()).collect();
        volume.insert(t, &Frame::new(ROWS, COLUMNS, 16, Samples::U16(values)).unwrap()).unwrap();
    }
    volume
}

fn pixel(volume: &Volume, x: isize, y: usize, t: usize) -> f64 {
    // Mirrored beyond the borders, without repeating the border pixel.
    let last = COLUMNS as isize - 1;
    let x = if x < 0 {
        -x
    } else if x > last {
        2 * last - x
    } else {
        x
    };
    let mut row = [0.0; COLUMNS];
    volume.copy_row(y, t, &mut row);
    f64::from(row[x as usize])
}

fn sample(volume: &Volume, position: f64, y: usize, t: usize, interpolation: Interpolation) -> f64 {
    let whole = position.floor();
    let f = position - whole;
    let p = |offset: isize| pixel(volume, whole as isize + offset, y, t);
    match interpolation {
        Interpolation::Linear => p(0) + f * (p(1) - p(0)),
        // Catmull and Rom's form of Keys' cubic with a = -1/2.
        _ => {
            p(0) + 0.5
                * f
                * (p(1) - p(-1)
                    + f * (2.0 * p(-1) - 5.0 * p(0) + 4.0 * p(1) - p(2)
                        + f * (3.0 * (p(0) - p(1)) + p(2) - p(-1))))
        }
    }
}

struct Case {
    volume: Volume,
    taus: Vec<f64>,
    reference: usize,
    options: MatchOptions,
}

impl Case {
    fn seen(&self, x: usize, d: f64) -> Vec<usize> {
        let inside = |t: &usize| {
            let position = x as f64 + d * (self.taus[*t] - self.taus[self.reference]);
            position >= -1e-9 && position <= COLUMNS as f64 - 1.0 + 1e-9
        };
        (0..self.taus.len()).filter(inside).collect()
    }

    /// Frames over which the cost is taken: all that see the candidate, those up to the reference, those from
    /// it on.
    fn subsets(&self, x: usize, d: f64) -> Vec<Vec<usize>> {
        let seen = self.seen(x, d);
        let mut subsets = vec![seen.clone()];
        if self.options.occlusion == Occlusion::OneSide {
            subsets.push(seen.iter().copied().filter(|&t| t <= self.reference).collect());
            subsets.push(seen.iter().copied().filter(|&t| t >= self.reference).collect());
        }
        let least = (self.options.min_visible * self.taus.len() as f64).ceil().max(3.0) as usize;
        subsets.retain(|subset| subset.len() >= least);
        subsets
    }

    fn at(&self, x: isize, y: usize, t: usize, d: f64) -> f64 {
        let position = x as f64 + d * (self.taus[t] - self.taus[self.reference]);
        let nearest = position.round();
        let position = if (position - nearest).abs() < 1e-9 { nearest } else { position };
        sample(&self.volume, position, y, t, self.options.interpolation)
    }

    fn window_rows(&self, y: usize) -> std::ops::Range<usize> {
        let half = self.options.window_px / 2;
        y.saturating_sub(half)..(y + half + 1).min(ROWS)
    }

    fn variance(&self, x: usize, y: usize, d: f64) -> Option<f64> {
        let half = self.options.window_px / 2;
        let single = |x: usize, y: usize| {
            let of = |subset: &Vec<usize>| {
                let values: Vec<f64> = subset.iter().map(|&t| self.at(x as isize, y, t, d)).collect();
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64
            };
            self.subsets(x, d).iter().map(of).min_by(f64::total_cmp)
        };
        single(x, y)?;
        let columns = x.saturating_sub(half)..(x + half + 1).min(COLUMNS);
        let known: Vec<f64> =
            self.window_rows(y).flat_map(|y| columns.clone().filter_map(move |x| single(x, y))).collect();
        Some(known.iter().sum::<f64>() / known.len() as f64)
    }

    fn window(&self, x: usize, y: usize, t: usize, d: f64) -> Vec<f64> {
        let half = (self.options.window_px / 2) as isize;
        let columns = x as isize - half..=x as isize + half;
        self.window_rows(y).flat_map(|y| columns.clone().map(move |x| self.at(x, y, t, d))).collect()
    }

    fn correlation(&self, x: usize, y: usize, d: f64) -> Option<f64> {
        let half = (self.options.window_px / 2) as isize;
        let model = match self.options.method {
            Method::NccFirst => self.window(x, y, self.reference, d),
            // Each pixel of the model is the mean over the frames whose windows cover it: those that see the
            // candidate of a pixel whose window contains it. In the middle of the image that is all of them.
            Method::Variance | Method::Normalised => panic!("no correlation"),
            Method::NccMean => {
                let frames = self.seen(x, d);
                assert!(
                    frames.len() == self.taus.len() && half == 1,
                    "the mean model is compared in the middle only"
                );
                let mut mean = vec![0.0; self.window(x, y, 0, d).len()];
                for &t in &frames {
                    let window = self.window(x, y, t, d);
                    mean.iter_mut().zip(window).for_each(|(sum, value)| *sum += value / frames.len() as f64);
                }
                mean
            }
        };
        let of = |subset: &Vec<usize>| {
            let others: Vec<usize> = subset.iter().copied().filter(|&t| t != self.reference).collect();
            let sum: f64 = others.iter().map(|&t| pearson(&self.window(x, y, t, d), &model)).sum();
            1.0 - sum / others.len() as f64
        };
        self.subsets(x, d).iter().map(of).min_by(f64::total_cmp)
    }
}

fn pearson(a: &[f64], b: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let product = |p: &[f64], mean_p: f64, q: &[f64], mean_q: f64| {
        p.iter().zip(q).map(|(x, y)| (x - mean_p) * (y - mean_q)).sum::<f64>()
    };
    product(a, mean_a, b, mean_b) / (product(a, mean_a, a, mean_a) * product(b, mean_b, b, mean_b)).sqrt()
}

/// Compares all candidates of all rows whose column is in `columns`, to a relative precision of f32 sums.
fn compare(
    case: &Case,
    columns: std::ops::Range<usize>,
    expected: impl Fn(usize, usize, f64) -> Option<f64>,
) {
    let lines = EpiLines::new(case.volume.tau(), case.reference, COLUMNS);
    let range = DisparityRange { minimum_px: -3.0, maximum_px: 4.0 };
    let candidates = Candidates::covering(range, 0.5);
    let options = &case.options;
    let rule = SeenRule::new(case.taus.len(), options.min_visible, options.occlusion);
    let mut known = 0;
    // Two bands, so that windows reach across their seam.
    for band in [0..3, 3..ROWS] {
        let tables =
            band_costs(&Band::new(&case.volume, band.clone(), options), &lines, &candidates, rule, options);
        for (y, table) in band.zip(&tables) {
            for k in 0..candidates.count() {
                for x in columns.clone() {
                    let d = candidates.disparity_px(k as f64);
                    match expected(x, y, d) {
                        Some(expected) => {
                            let found = f64::from(table.at(k, x));
                            let precision = 1e-4 * expected.abs().max(0.1);
                            assert!(
                                (found - expected).abs() < precision,
                                "({x}, {y}), d {d}: {found} {expected}"
                            );
                            known += 1;
                        }
                        None => assert!(table.at(k, x).is_nan(), "({x}, {y}), d {d}: invented"),
                    }
                }
            }
        }
    }
    assert!(known > 300);
}

fn case(method: Method, window_px: usize, reference: usize, occlusion: Occlusion, visible: f64) -> Case {
    let positions = [0.0, 1.0, 1.5, 3.5, 5.0, 5.5, 7.0];
    let volume = volume(&positions);
    let options = MatchOptions {
        window_px,
        occlusion,
        interpolation: Interpolation::Cubic,
        min_visible: visible,
        ..MatchOptions::for_method(method)
    };
    Case { taus: volume.tau().values().to_vec(), volume, reference, options }
}

#[test]
fn variance_is_that_of_its_definition() {
    for (window, reference, occluded, visible) in [
        (1, 0, Occlusion::None, 1.0),
        (1, 3, Occlusion::OneSide, 0.5),
        (3, 0, Occlusion::None, 0.5),
        (5, 6, Occlusion::None, 0.7),
        (3, 2, Occlusion::OneSide, 0.4),
    ] {
        let mut case = case(Method::Variance, window, reference, occluded, visible);
        compare(&case, 0..COLUMNS, |x, y, d| case.variance(x, y, d));
        case.options.interpolation = Interpolation::Linear;
        compare(&case, 0..COLUMNS, |x, y, d| case.variance(x, y, d));
    }
}

#[test]
fn correlation_with_the_reference_is_that_of_its_definition() {
    for (window, reference, occluded, visible) in
        [(3, 0, Occlusion::None, 1.0), (5, 3, Occlusion::OneSide, 0.5), (3, 6, Occlusion::None, 0.5)]
    {
        let case = case(Method::NccFirst, window, reference, occluded, visible);
        // Beyond the mirrored border a sample between pixels mirrors too, so only whole windows are compared.
        let margin = window / 2 + 5;
        compare(&case, margin..COLUMNS - margin, |x, y, d| case.correlation(x, y, d));
    }
}

#[test]
fn correlation_with_the_mean_is_that_of_its_definition() {
    let case = case(Method::NccMean, 3, 0, Occlusion::None, 1.0);
    compare(&case, 6..COLUMNS - 6, |x, y, d| case.correlation(x, y, d));
}
