//! All positions adjusted together: y = c_i + rho_i s_t, for the place y along the motion of every point i in every
//! frame t that shows it.
//!
//! Gauss-Newton steps in s. c and rho of each point are eliminated. The anchor, in which a point has moved by 0, is a
//! frame like others: its noise is common to all displacements of the point, and c takes it up. s is open in its
//! origin and its scale, in which steps are held at zero.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::TextureMotionError;
use super::follow::Track;
use super::point::Sight;
use super::search::Found;
use epirig_core::statistics::median;

/// Least standard deviation of a place, in px, however clear the texture: interpolation, and surfaces within a
/// square that are not flat.
const FLOOR_PX: f64 = 0.005;
/// Rounds of steps and weights.
const ROUNDS: usize = 12;
/// Tukey's biweight leaves out what is so many robust standard deviations off; 95 % as good as least squares for
/// normal noise.
const TUKEY: f64 = 4.685;
/// From the median of absolute values to the standard deviation of normal numbers.
const MAD: f64 = 1.482_602_218_505_602;
/// A frame whose pivot is less than this share of the others' is not connected with them.
const PIVOT: f64 = 1e-9;
/// Fewest points in a frame that agree.
const FEWEST: usize = 4;
/// Bias of a place between pixels by the cubic B-spline, root mean square over all places: its worst for texture
/// blurred by 0.7 px is 0.0016 px, and it goes up and down once a pixel, as a sine does. All points at one depth
/// have it in common, so it does not average out.
const INTERPOLATION_BIAS_PX: f64 = 0.0016 * std::f64::consts::FRAC_1_SQRT_2;

/// The result of an adjustment.
pub(super) struct Adjusted {
    pub(super) found: Found,
    /// Covariances of s by the scatter between cells of the scene, and by the residuals as independent noise.
    covariances: [DMatrix<f64>; 2],
    /// Median of rho over the points, by what they tell.
    pub(super) typical_rho: f64,
    pub(super) angle_sigma: f64,
    pub(super) points: usize,
    /// Root mean square of the residuals, in px.
    pub(super) residual: f64,
}

/// A line through the places of a point.
struct Line {
    rho: f64,
    residuals: Vec<f64>,
}

pub(super) fn adjust(tracks: &[Track], found: &Found) -> Result<Adjusted, TextureMotionError> {
    let mut s = found.position.clone();
    let count = s.len();
    let variances = |sight: &Sight| 1.0 / (sight.along_variance + FLOOR_PX * FLOOR_PX);
    let information: Vec<Vec<f64>> =
        tracks.iter().map(|track| track.sights.iter().map(variances).collect()).collect();
    let mut weights = information.clone();
    let mut round = 0;
    loop {
        let lines = |weights: &[Vec<f64>]| -> Vec<Option<Line>> {
            tracks.iter().zip(weights).map(|(track, weights)| line(&track.sights, weights, &s)).collect()
        };
        let scale = reweight(&lines(&weights), &information, &mut weights);
        let lines = lines(&weights);
        let mut normal = Normal::new(&s);
        for ((track, line), weights) in tracks.iter().zip(&lines).zip(&weights) {
            if let Some(line) = line {
                normal.add(track, line, weights, &s);
            }
        }
        let apart: Vec<usize> = (0..count).filter(|&frame| normal.points[frame] < FEWEST).collect();
        if !apart.is_empty() {
            return Err(TextureMotionError::Apart { frames: apart });
        }
        let (step, inverse) = normal.solved()?;
        if round == ROUNDS {
            return Ok(finish(tracks, &lines, &weights, (s, found), (inverse, scale)));
        }
        s.iter_mut().zip(step.iter()).for_each(|(s, step)| *s += step);
        round += 1;
    }
}

/// The straight line y = c + rho s, by least squares; `None` with less than three places.
fn line(sights: &[Sight], weights: &[f64], s: &[f64]) -> Option<Line> {
    let seen = weights.iter().filter(|weight| **weight > 0.0).count();
    let sum: f64 = weights.iter().sum();
    let mean = |value: &dyn Fn(&Sight) -> f64| {
        sights.iter().zip(weights).map(|(sight, weight)| weight * value(sight)).sum::<f64>() / sum
    };
    if seen < 3 {
        return None;
    }
    let (s_mean, y_mean) = (mean(&|sight| s[sight.frame]), mean(&|sight| sight.along));
    let spread = mean(&|sight| (s[sight.frame] - s_mean).powi(2));
    let rho = mean(&|sight| (s[sight.frame] - s_mean) * (sight.along - y_mean)) / spread;
    let residual = |sight: &Sight| sight.along - y_mean - rho * (s[sight.frame] - s_mean);
    (spread > 0.0).then(|| Line { rho, residuals: sights.iter().map(residual).collect() })
}

/// Weights by the residuals, and their scale: the robust standard deviation against what each place states.
fn reweight(lines: &[Option<Line>], information: &[Vec<f64>], weights: &mut [Vec<f64>]) -> f64 {
    let normalised = |line: &Line, information: &[f64]| -> Vec<f64> {
        line.residuals.iter().zip(information).map(|(e, information)| e * information.sqrt()).collect()
    };
    let mut sizes: Vec<f64> = lines
        .iter()
        .zip(information)
        .filter_map(|(line, information)| Some(normalised(line.as_ref()?, information)))
        .flatten()
        .map(f64::abs)
        .collect();
    // Frames without noise that are whole pixels apart agree better than any place is known.
    let scale = (MAD * median(&mut sizes).unwrap_or(1.0)).max(1.0);
    for ((line, information), weights) in lines.iter().zip(information).zip(weights) {
        match line {
            Some(line) => {
                let share = |e: f64| tukey(e / scale);
                let residuals = normalised(line, information);
                let both = residuals.into_iter().zip(information);
                weights
                    .iter_mut()
                    .zip(both)
                    .for_each(|(weight, (e, information))| *weight = information * share(e));
            }
            None => weights.fill(0.0),
        }
    }
    scale
}

fn tukey(residual: f64) -> f64 {
    let share = residual / TUKEY;
    if share.abs() < 1.0 { (1.0 - share * share).powi(2) } else { 0.0 }
}

/// Normal equations of all s.
struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// Points in each frame that have a weight.
    points: Vec<usize>,
    /// Orthonormal changes of s that c and rho take up.
    open: [DVector<f64>; 2],
}

impl Normal {
    fn new(s: &[f64]) -> Self {
        let count = s.len();
        let constant = DVector::from_element(count, 1.0 / (count as f64).sqrt());
        let linear = DVector::from_column_slice(s);
        let linear = (&linear - &constant * constant.dot(&linear)).normalize();
        Self {
            matrix: DMatrix::zeros(count, count),
            right: DVector::zeros(count),
            points: vec![0; count],
            open: [constant, linear],
        }
    }

    /// Adds rho^2 (W - W X (X' W X)^-1 X' W) and rho W e, where the columns of X are 1 and s.
    fn add(&mut self, track: &Track, line: &Line, weights: &[f64], s: &[f64]) {
        let sights = &track.sights;
        let sum: f64 = weights.iter().sum();
        let mean = sights.iter().zip(weights).map(|(sight, w)| w * s[sight.frame]).sum::<f64>() / sum;
        let from_mean: Vec<f64> = sights.iter().map(|sight| s[sight.frame] - mean).collect();
        let spread: f64 = from_mean.iter().zip(weights).map(|(s, weight)| weight * s * s).sum();
        let rho2 = line.rho * line.rho;
        for (i, sight) in sights.iter().enumerate().filter(|(i, _)| weights[*i] > 0.0) {
            let t = sight.frame;
            self.points[t] += 1;
            self.right[t] += line.rho * weights[i] * line.residuals[i];
            self.matrix[(t, t)] += rho2 * weights[i];
            for (j, other) in sights.iter().enumerate() {
                let taken = weights[i] * weights[j] * (1.0 / sum + from_mean[i] * from_mean[j] / spread);
                self.matrix[(t, other.frame)] -= rho2 * taken;
            }
        }
    }

    /// The step, and the inverse of the matrix without the open changes.
    fn solved(&self) -> Result<(DVector<f64>, DMatrix<f64>), TextureMotionError> {
        let count = self.right.len();
        let scale = self.matrix.trace() / count as f64;
        let mut held = self.matrix.clone();
        for open in &self.open {
            held += scale * open * open.transpose();
        }
        let all = || TextureMotionError::Apart { frames: (0..count).collect() };
        let factor = Cholesky::new(held).ok_or_else(all)?;
        let lower = factor.l_dirty();
        let apart: Vec<usize> =
            (0..count).filter(|&frame| lower[(frame, frame)].powi(2) <= PIVOT * scale).collect();
        if !apart.is_empty() {
            return Err(TextureMotionError::Apart { frames: apart });
        }
        let step = factor.solve(&self.right);
        let mut inverse = factor.inverse();
        for open in &self.open {
            inverse -= open * open.transpose() / scale;
        }
        Ok((step, inverse))
    }
}

/// Covariances, the direction, and what the next size starts from.
fn finish(
    tracks: &[Track],
    lines: &[Option<Line>],
    weights: &[Vec<f64>],
    (s, found): (Vec<f64>, &Found),
    (inverse, scale): (DMatrix<f64>, f64),
) -> Adjusted {
    let count = s.len();
    let used: Vec<(&Track, &Line, &Vec<f64>)> = tracks
        .iter()
        .zip(lines)
        .zip(weights)
        .filter_map(|((track, line), weights)| Some((track, line.as_ref()?, weights)))
        .collect();
    // Scores of a cell: errors of points that lie together are not independent.
    let mut scores: BTreeMap<(i64, i64), DVector<f64>> = BTreeMap::new();
    let (mut squares, mut sights) = (0.0, 0.0);
    for (track, line, weights) in &used {
        let score = scores.entry(track.cell).or_insert_with(|| DVector::zeros(count));
        for ((sight, e), weight) in track.sights.iter().zip(&line.residuals).zip(*weights) {
            score[sight.frame] += line.rho * weight * e;
            if *weight > 0.0 {
                squares += e * e;
                sights += 1.0;
            }
        }
    }
    let mut middle = DMatrix::zeros(count, count);
    for score in scores.values() {
        middle.ger(1.0, score, score, 1.0);
    }
    let cells = scores.len() as f64;
    middle *= cells / (cells - 1.0).max(1.0);
    let by_cells = &inverse * middle * &inverse;
    let direction = direction(&used, &s);
    let rho_at = quantiles(
        used.iter().map(|(_, line, weights)| (line.rho, line.rho * line.rho * weights.iter().sum::<f64>())),
    );
    let typical_rho = rho_at(0.5);
    let turned = [
        found.direction[0] - direction.slope * found.direction[1],
        found.direction[1] + direction.slope * found.direction[0],
    ];
    let length = turned[0].hypot(turned[1]);
    Adjusted {
        found: Found {
            position: s,
            across: direction.across,
            direction: turned.map(|part| part / length),
            rho: (rho_at(0.005), rho_at(0.995)),
            anchors: found.anchors.clone(),
        },
        covariances: [by_cells, scale * scale * inverse],
        typical_rho,
        angle_sigma: direction.sigma,
        points: used.iter().filter(|(_, _, weights)| weights.iter().any(|weight| *weight > 0.0)).count(),
        residual: f64::sqrt(squares / f64::max(sights, 1.0)),
    }
}

/// How places across the motion grow with those along it.
struct Slope {
    slope: f64,
    sigma: f64,
    /// What is left of each frame.
    across: Vec<f64>,
}

/// The slope of all places across the motion against rho s, each point from its own mean, and what a frame's points
/// have in common besides.
fn direction(used: &[(&Track, &Line, &Vec<f64>)], s: &[f64]) -> Slope {
    struct Place {
        frame: usize,
        cell: (i64, i64),
        x: f64,
        y: f64,
        information: f64,
    }
    let mut places = Vec::new();
    for (track, line, weights) in used {
        let information = |sight: &Sight| 1.0 / (sight.across_variance + FLOOR_PX * FLOOR_PX);
        let kept: Vec<&Sight> = track
            .sights
            .iter()
            .zip(*weights)
            .filter(|(_, weight)| **weight > 0.0)
            .map(|(sight, _)| sight)
            .collect();
        let sum: f64 = kept.iter().map(|sight| information(sight)).sum();
        let mean = |value: &dyn Fn(&Sight) -> f64| {
            kept.iter().map(|sight| information(sight) * value(sight)).sum::<f64>() / sum
        };
        let (s_mean, y_mean) = (mean(&|sight| s[sight.frame]), mean(&|sight| sight.across));
        places.extend(kept.iter().map(|sight| Place {
            frame: sight.frame,
            cell: track.cell,
            x: line.rho * (s[sight.frame] - s_mean),
            y: sight.across - y_mean,
            information: information(sight),
        }));
    }
    let mut slope = 0.0;
    let mut weights: Vec<f64> = places.iter().map(|place| place.information).collect();
    let mut energy = 1.0;
    for _ in 0..ROUNDS {
        energy = places.iter().zip(&weights).map(|(place, w)| w * place.x * place.x).sum::<f64>();
        slope = places.iter().zip(&weights).map(|(place, w)| w * place.x * place.y).sum::<f64>() / energy;
        let residual = |place: &Place| (place.y - slope * place.x) * place.information.sqrt();
        let scale = MAD
            * median(&mut places.iter().map(|place| residual(place).abs()).collect::<Vec<_>>())
                .unwrap_or(1.0);
        for (weight, place) in weights.iter_mut().zip(&places) {
            *weight = place.information * tukey(residual(place) / scale.max(f64::MIN_POSITIVE));
        }
    }
    // Points that lie together, and points of one frame, may err together.
    let mut cells: BTreeMap<(i64, i64), f64> = BTreeMap::new();
    let mut frames = vec![0.0; s.len()];
    let mut left: Vec<Vec<f64>> = vec![Vec::new(); s.len()];
    for (place, weight) in places.iter().zip(&weights) {
        let score = weight * place.x * (place.y - slope * place.x);
        *cells.entry(place.cell).or_default() += score;
        frames[place.frame] += score;
        left[place.frame].push(place.y - slope * place.x);
    }
    let squares: f64 = cells.values().chain(&frames).map(|score| score * score).sum();
    Slope {
        slope,
        sigma: squares.sqrt() / energy,
        across: left.iter_mut().map(|left| median(left).unwrap_or(0.0)).collect(),
    }
}

/// Quantiles of values, each with its weight.
fn quantiles(values: impl Iterator<Item = (f64, f64)>) -> impl Fn(f64) -> f64 {
    let mut values: Vec<(f64, f64)> = values.collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut all = 0.0;
    // The weight of all up to each.
    values.iter_mut().for_each(|value| {
        all += value.1;
        value.1 = all;
    });
    move |share| values.iter().find(|value| value.1 >= share * all).map_or(0.0, |value| value.0)
}

impl Adjusted {
    /// Standard uncertainties of tau, and of each step of tau, by the larger of both covariances.
    pub(super) fn sigmas(&self, tau: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let last = tau.len() - 1;
        let span = (self.found.position[last] - self.found.position[0]).abs();
        // Linear in s; origin and scale of s cancel.
        let sigma = |terms: &[(usize, f64)]| {
            let variance = |covariance: &DMatrix<f64>| {
                let products = terms.iter().flat_map(|a| terms.iter().map(move |b| (a, b)));
                products.map(|(a, b)| a.1 * b.1 * covariance[(a.0, b.0)]).sum::<f64>()
            };
            let scatter = self.covariances.iter().map(variance).fold(0.0, f64::max).sqrt();
            scatter.hypot(INTERPOLATION_BIAS_PX / self.typical_rho.abs()) / span
        };
        let inner = |t: usize| sigma(&[(t, 1.0), (0, tau[t] - 1.0), (last, -tau[t])]);
        let of = |t: usize| if t == 0 || t == last { 0.0 } else { inner(t) };
        let step = |t: usize| {
            let part = tau[t + 1] - tau[t];
            sigma(&[(t + 1, 1.0), (t, -1.0), (0, part), (last, -part)])
        };
        ((0..=last).map(of).collect(), (0..last).map(step).collect())
    }
}
