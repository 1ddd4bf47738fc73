//! Light that changes slowly over the sequence, and its effect on the observations.
//!
//! A lamp that warms up, a highlight that stands still while the object moves, a black level that
//! drifts: the intensity I along a line then changes by q I + o per unit of tau. So does it along a
//! line of another disparity, by g (d0 - d), and an observation takes the one for the other. The
//! slope of a pixel's regression is
//!
//! ```text
//! b = g (d0 - d) + q I + o + noise
//! ```
//!
//! The gradient g changes its sign from pixel to pixel, and I does not: over some ten pixels the
//! surface and the light are nearly orthogonal. In squares of 8 x 8 px the disparity is taken as a
//! plane and eliminated, with the drift of the blur (`foreshortening`), from the normal equations
//! of q and o (Frisch and Waugh 1933; Lovell 1963). What is left of all squares gives q and o as
//! local-linear fields (Fan and Gijbels 1996). Their effect is taken off the observations.

use nalgebra::{Matrix2, Matrix6, Vector2, Vector6};
use rayon::prelude::*;

use super::foreshortening::drift_row;
use super::padded::PAD;
use super::planes::{Guess, ObservationMaps, SurfacePlanes, Template};
use crate::one_surface::OneSurface;

/// Side of the squares in which the disparity is a plane, in px.
const SIDE: usize = 8;
/// q and o are linear within a Gaussian of this standard deviation, in squares: 10 px. A pattern of
/// light is seldom finer, and the surface's texture seldom coarser.
const REACH: f64 = 10.0 / SIDE as f64;
/// Squares farther away than this many standard deviations do not count.
const FARTHEST: f64 = 3.0;
/// At least so many observations in a square, or the six unknowns are too uncertain.
const LEAST_PIXELS: f32 = 12.0;
/// A regressor of which the others leave less than this share (in squares) is one of them, for
/// single precision.
const LEAST_LEFT: f64 = 1e-5;
/// Light of which nothing is seen is that of the whole image: this counts as much as a
/// thirtieth of a square of mean texture.
const PRIOR_SQUARES: f64 = 0.03;

/// Regressors of a square: those of the plane and of the blur's drift, which are eliminated, and 1
/// and I.
const ELIMINATED: usize = 4;
const REGRESSORS: usize = ELIMINATED + 2;
/// Sums of products of the regressors and of what is observed.
type Products = [[f64; REGRESSORS + 1]; REGRESSORS + 1];

/// What a square tells of o and q: its normal equations over the variance of its residuals.
#[derive(Debug, Clone, Copy)]
struct Evidence {
    normal: Matrix2<f64>,
    right: Vector2<f64>,
}

impl Evidence {
    /// The sum of the squares of both estimates over their variances: 2 on average by chance.
    /// `None` if they cannot be told apart.
    fn squares(&self) -> Option<f64> {
        self.normal.cholesky().map(|normal| self.right.dot(&normal.solve(&self.right)))
    }
}

/// The drift that was taken off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drift {
    /// Per unit of tau, in DN: root mean square over the observations.
    pub(super) dn: f64,
    /// What it moves single observations by, in px: root mean square, by their weights.
    pub(super) effect_px: f64,
    /// Mean square of what squares tell, over that by chance.
    pub(super) significance: f64,
}

/// o in DN, and q, per unit of tau, and their slopes per square along columns and rows; at the
/// middle of a square.
type Field = [f64; 6];

/// Takes the drift of the light off the observations around `guess`. `slants` are those of the surface, where
/// they are known.
pub(super) fn take_off_light(
    observations: &mut ObservationMaps,
    template: &Template,
    guess: Guess<'_>,
    slants: Option<&SurfacePlanes>,
) -> Option<Drift> {
    let (rows, columns) = (guess.map.rows(), guess.map.columns());
    let (down, across) = (rows.div_ceil(SIDE), columns.div_ceil(SIDE));
    let middle = mean_intensity(observations, template);
    let of_row = |row: usize| {
        let squares = Squares { observations, template, guess, middle, top: SIDE * row };
        let drift: Option<Vec<Vec<f32>>> = slants.map(|slants| {
            let rows = squares.top..(squares.top + SIDE).min(rows);
            rows.map(|y| drift_row(observations, template, slants, y)).collect()
        });
        let evidence = (0..across).map(|square| squares.evidence(SIDE * square, drift.as_deref()));
        evidence.collect::<Vec<_>>()
    };
    let evidence: Vec<Option<Evidence>> = (0..down).into_par_iter().flat_map_iter(of_row).collect();
    let fields = fields(&evidence, across)?;
    let stride = observations.weight.stride;
    let ObservationMaps { moment, weight, .. } = observations;
    let Template { gradient, intensity, .. } = template;
    let of_row = |(y, moment): (usize, &mut [f32])| {
        let mut sums = [0.0; 4];
        let maps = [&*weight, gradient, intensity].map(|map| &map.values[y * stride..(y + 1) * stride]);
        let [weight, gradient, intensity] = maps;
        let fields = &fields[y / SIDE * across..][..across];
        let v = from_middle(y);
        for (x, moment) in moment[PAD..PAD + columns].iter_mut().enumerate() {
            let place = PAD + x;
            if gradient[place] != 0.0 {
                let [o, ox, oy, q, qx, qy] = fields[x / SIDE];
                let u = from_middle(x);
                let light =
                    o + ox * u + oy * v + (q + qx * u + qy * v) * (f64::from(intensity[place]) - middle);
                let per_gradient = weight[place] / gradient[place];
                *moment += per_gradient * light as f32;
                let spread = f64::from(per_gradient / gradient[place]);
                let more = [1.0, light * light, f64::from(weight[place]), spread * light * light];
                sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
            }
        }
        sums
    };
    // Added in the order of the rows.
    let sums: Vec<[f64; 4]> = moment.par_rows().enumerate().map(of_row).collect();
    let add = |sum: [f64; 4], row: [f64; 4]| std::array::from_fn(|index| sum[index] + row[index]);
    let [count, squares, weights, moved] = sums.into_iter().fold([0.0; 4], add);
    let chance: Vec<f64> = evidence.iter().flatten().filter_map(Evidence::squares).collect();
    Some(Drift {
        dn: (squares / f64::max(count, 1.0)).sqrt(),
        effect_px: (moved / f64::max(weights, f64::MIN_POSITIVE)).sqrt(),
        significance: chance.iter().sum::<f64>() / f64::max(2.0 * chance.len() as f64, 1.0),
    })
}

/// How far a row or column lies from the middle of its square, in squares.
fn from_middle(index: usize) -> f64 {
    ((index % SIDE) as f64 + 0.5) / SIDE as f64 - 0.5
}

/// The mean intensity of all observations, in DN. Intensities are counted from it: so they are
/// little correlated with 1.
fn mean_intensity(observations: &ObservationMaps, template: &Template) -> f64 {
    let sums: Vec<[f64; 2]> = (0..observations.rows())
        .into_par_iter()
        .map(|y| {
            let pixels = template.intensity.row(y).iter().zip(observations.weight.row(y));
            let observed = pixels.filter(|(_, weight)| **weight > 0.0);
            observed.fold([0.0; 2], |[sum, count], (value, _)| [sum + f64::from(*value), count + 1.0])
        })
        .collect();
    let [sum, count] = sums.into_iter().fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
    sum / f64::max(count, 1.0)
}

/// The squares of one row of squares.
struct Squares<'a> {
    observations: &'a ObservationMaps,
    template: &'a Template,
    guess: Guess<'a>,
    /// Intensities are counted from this, in DN.
    middle: f64,
    /// The first row of pixels.
    top: usize,
}

impl Squares<'_> {
    /// What the square from column `left` on tells; `None` if that is too little.
    fn evidence(&self, left: usize, drift: Option<&[Vec<f32>]>) -> Option<Evidence> {
        let Self { observations, template, guess: Guess { map: guess, origin }, top, .. } = *self;
        let (rows, columns) = ((top + SIDE).min(guess.rows()), (left + SIDE).min(guess.columns()));
        let surface = guess.at(usize::midpoint(left, columns), usize::midpoint(top, rows));
        if surface.is_nan() {
            return None;
        }
        let is_fitted = drift.is_some();
        let mut sums = [[0.0_f32; REGRESSORS + 1]; REGRESSORS + 1];
        let (mut count, mut noise) = (0.0_f32, 0.0_f32);
        let base = surface - origin;
        for y in top..rows {
            let maps = [
                &observations.weight,
                &observations.moment,
                &observations.inverse,
                &template.gradient,
                &template.intensity,
                &observations.noise,
            ];
            let maps = maps.map(|map| map.row(y));
            for x in left..columns {
                let [weight, moment, inverse, gradient, intensity, noise_here] = maps.map(|map| map[PAD + x]);
                let near = OneSurface::ROUGH.holds(guess.at(x, y) - surface, 0.0);
                if !(near && inverse > 0.0 && gradient != 0.0) {
                    continue;
                }
                let per_gradient = weight / gradient;
                // S, the weight of a slope.
                let spread = per_gradient / gradient;
                let drift = drift.map_or(0.0, |rows| rows[y - top][PAD + x] / per_gradient);
                // A surface that has been fitted brings its step edges with it. Disparities of a search
                // follow the light.
                let base = if is_fitted { guess.at(x, y) - origin } else { base };
                let observed = gradient * inverse * (moment - weight * base);
                let (u, v) = (from_middle(x) as f32, from_middle(y) as f32);
                let brightness = intensity - self.middle as f32;
                let terms = [gradient, gradient * u, gradient * v, drift, -1.0, -brightness, observed];
                for (index, sums) in sums.iter_mut().enumerate() {
                    let term = spread * terms[index];
                    for (sum, other) in sums.iter_mut().zip(&terms).skip(index) {
                        *sum += term * other;
                    }
                }
                count += 1.0;
                noise += noise_here;
            }
        }
        if count < LEAST_PIXELS {
            return None;
        }
        let mut left_over: Products = sums.map(|row| row.map(f64::from));
        eliminate(&mut left_over, 0..ELIMINATED);
        let [one, brightness, observed] = [ELIMINATED, ELIMINATED + 1, REGRESSORS];
        let mut residual = left_over;
        eliminate(&mut residual, ELIMINATED..REGRESSORS);
        let variance = residual[observed][observed] / f64::from(count - REGRESSORS as f32);
        let information = 1.0 / variance.max(f64::from(noise / count));
        let entry = |i: usize, j: usize| information * left_over[i][j];
        Some(Evidence {
            normal: Matrix2::new(
                entry(one, one),
                entry(one, brightness),
                entry(one, brightness),
                entry(brightness, brightness),
            ),
            right: Vector2::new(entry(one, observed), entry(brightness, observed)),
        })
    }
}

/// Eliminates the regressors `which` from the upper triangle of these products, as Gauss does.
fn eliminate(products: &mut Products, which: std::ops::Range<usize>) {
    let whole: [f64; REGRESSORS + 1] = std::array::from_fn(|index| products[index][index]);
    for pivot in which {
        let row = products[pivot];
        if row[pivot] <= LEAST_LEFT * whole[pivot] {
            continue;
        }
        for i in pivot + 1..=REGRESSORS {
            for j in i..=REGRESSORS {
                products[i][j] -= row[i] / row[pivot] * row[j];
            }
        }
    }
}

/// The fields of the squares, of which `across` lie in a row; `None` if no square tells anything.
fn fields(evidence: &[Option<Evidence>], across: usize) -> Option<Vec<Field>> {
    let mut all = (Matrix2::zeros(), Vector2::zeros());
    let mut count = 0.0;
    for Evidence { normal, right } in evidence.iter().flatten() {
        all.0 += normal;
        all.1 += right;
        count += 1.0;
    }
    let ridge = Matrix2::identity() * (LEAST_LEFT * all.0.trace());
    let everywhere = (all.0 + ridge).cholesky()?.solve(&all.1);
    let prior = all.0 * (PRIOR_SQUARES / count);
    let reach = (FARTHEST * REACH).ceil() as usize;
    let down = evidence.len() / across;
    let field = |index: usize| {
        let (y, x) = (index / across, index % across);
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        // Constants tend to those of the whole image, slopes over the reach to zero.
        for (term, scale) in [1.0, REACH * REACH, REACH * REACH].into_iter().enumerate() {
            add(&mut normal, &(prior * scale), (term, term));
        }
        put(&mut right, &(prior * everywhere), 0);
        for other_y in y.saturating_sub(reach)..(y + reach + 1).min(down) {
            for other_x in x.saturating_sub(reach)..(x + reach + 1).min(across) {
                let Some(evidence) = &evidence[other_y * across + other_x] else { continue };
                let (u, v) = (other_x as f64 - x as f64, other_y as f64 - y as f64);
                let weight = (-0.5 * (u * u + v * v) / (REACH * REACH)).exp();
                let terms = [1.0, u, v];
                for i in 0..3 {
                    for j in 0..3 {
                        add(&mut normal, &(evidence.normal * (weight * terms[i] * terms[j])), (i, j));
                    }
                    put(&mut right, &(evidence.right * (weight * terms[i])), i);
                }
            }
        }
        let found = normal.cholesky().map_or_else(Vector6::zeros, |normal| normal.solve(&right));
        std::array::from_fn(|term| found[term])
    };
    Some((0..evidence.len()).into_par_iter().map(field).collect())
}

/// Adds the products of the terms i and j of o and of q.
fn add(normal: &mut Matrix6<f64>, products: &Matrix2<f64>, (i, j): (usize, usize)) {
    for (row, at_row) in [i, 3 + i].into_iter().enumerate() {
        for (column, at_column) in [j, 3 + j].into_iter().enumerate() {
            normal[(at_row, at_column)] += products[(row, column)];
        }
    }
}

/// Adds to the right side of the term i of o and of q.
fn put(right: &mut Vector6<f64>, more: &Vector2<f64>, i: usize) {
    right[i] += more[0];
    right[3 + i] += more[1];
}

#[cfg(test)]
mod tests;
