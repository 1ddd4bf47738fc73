//! A plane with one line through the disc: a wall between two levels, or a crease.
//!
//! ```text
//! v_j = a + p x_j + q y_j + alpha phi(n_j) + noise      alpha ~ N(0, T^2)
//! ```
//!
//! n is the distance from the line. phi rises from 0 to 1 over the width of a wall; beyond a crease it is the
//! distance. The lens and the pixels' aperture have spread the phi that is observed. With the residuals
//! r_j = w_j (v_j - a - p x_j - q y_j) of the plane, for each line
//!
//! ```text
//! S = phi' W phi - (X' W phi)' A^-1 (X' W phi) + 1/T^2        alpha = phi' r / S
//! log weight = (phi' r)^2 / 2 S - log(S T^2) / 2 + log(odds / number of lines)
//! disparity at a pixel e: plane + alpha f, f = phi(e) - e' A^-1 X' W phi, variance e' A^-1 e + f^2 / S
//! ```
//!
//! The average over all lines and none, by their weights, is the posterior's mean (Bayesian model averaging;
//! Hoeting and others 1999). Its variance is the mean of the variances and the variance of the means, so an
//! edge whose place or existence is uncertain widens it. phi is taken as constant in strips of 1 px along the
//! line: so sums over strips serve all lines of a direction.

use fearless_simd::{Simd, SimdBase, SimdFloat, f32x16};

use super::approximate::{power_of_two, rough_logarithm};
use super::disc::{Direction, INNER, Point};
use super::plane::Plane;

/// Prior standard deviation of the height of a wall, in px.
const STEP: f32 = 0.2;
/// The same of the change of slant at a crease, in px/px.
const CREASE: f32 = 0.1;
/// Kinds of lines: steps, walls 1 px and 2 px wide, and creases.
const KINDS: usize = 4;
/// Variance of the place of a wall between those that are tried, in px^2: for each width they are 1 px apart.
const PLACE_VARIANCE: f32 = 1.0 / 12.0;
/// Strips of the widest disc.
const MOST_STRIPS: usize = 17;
const HALF_LOG_E: f32 = 0.5 * std::f32::consts::LOG2_E;

/// Whitened sums of weights times a shape, and the sum of residuals times it.
#[derive(Clone, Copy)]
struct Shape<S: Simd>([f32x16<S>; 4]);

impl<S: Simd> Shape<S> {
    #[inline(always)]
    fn plus(self, Self([e, f, g, h]): Self) -> Self {
        let Self([a, b, c, d]) = self;
        Self([a + e, b + f, c + g, d + h])
    }

    #[inline(always)]
    fn plus_times(self, Self([e, f, g, h]): Self, factor: f32) -> Self {
        let Self([a, b, c, d]) = self;
        Self([e.mul_add(factor, a), f.mul_add(factor, b), g.mul_add(factor, c), h.mul_add(factor, d)])
    }
}

/// A strip's shape and weight.
type Strip<S> = (Shape<S>, f32x16<S>);

/// A line that has been fitted: logarithm of its weight to the base 2, alpha, 1 / S, the whitened sums of its
/// shape, and the part of the sum of squared observations that it explains.
type Fitted<S> = [f32x16<S>; 7];

/// One over the prior variance of a kind of line, and the logarithm of its weight when nothing is observed.
#[derive(Clone, Copy)]
struct Prior {
    precision: f32,
    logarithm: f32,
}

impl Prior {
    fn new(deviation: f32, odds: f32, lines: usize) -> Self {
        let variance = deviation * deviation;
        Self { precision: 1.0 / variance, logarithm: (odds / lines as f32).log2() - 0.5 * variance.log2() }
    }
}

/// A line's shape at the inner pixels, not spread by the lens, and its variance there if it lies between the
/// places that are tried, over alpha^2.
struct AtInner {
    shape: [f32; 4],
    variance: [f32; 4],
}

impl AtInner {
    fn wall(inner: [f32; 4], place: f32, width: f32) -> Self {
        let from = inner.map(|along| (along - place) / width);
        let slope = |from: f32| if from.abs() < 0.5 { 1.0 / width } else { 0.0 };
        Self {
            shape: from.map(|from| (from + 0.5).clamp(0.0, 1.0)),
            variance: from.map(|from| PLACE_VARIANCE * slope(from) * slope(from)),
        }
    }

    fn step(inner: [f32; 4], place: f32) -> Self {
        Self { shape: inner.map(|along| if along > place { 1.0 } else { 0.0 }), variance: [0.0; 4] }
    }

    fn crease(inner: [f32; 4], place: f32) -> Self {
        Self { shape: inner.map(|along| (along - place).max(0.0)), variance: [0.0; 4] }
    }
}

/// All lines of a direction.
struct Parallels {
    direction: Direction,
    /// In the order in which they are fitted.
    at_inner: Vec<AtInner>,
}

impl Parallels {
    fn of(direction: Direction) -> Self {
        let count = direction.ends.len();
        let at_inner = (1..count - 1).rev().flat_map(|strip| {
            let middle = direction.first + strip as f32;
            [
                AtInner::wall(direction.inner, middle, 1.0),
                AtInner::crease(direction.inner, middle + 0.5),
                AtInner::wall(direction.inner, middle + 0.5, 2.0),
                AtInner::step(direction.inner, middle + 0.5),
            ]
        });
        Self { at_inner: at_inner.collect(), direction }
    }
}

/// Averages over lines so far, relative to the likeliest.
struct Average<S: Simd> {
    likeliest: f32x16<S>,
    weight: f32x16<S>,
    shifts: [f32x16<S>; 4],
    squares: [f32x16<S>; 4],
    by_place: [f32x16<S>; 4],
    explained: f32x16<S>,
}

/// What lines change at an inner pixel.
#[derive(Clone, Copy)]
pub(super) struct Change<S: Simd> {
    /// Of the plane's disparity, in px.
    pub(super) shift: f32x16<S>,
    /// Added to the variance of the plane's disparity, in px^2.
    pub(super) variance: f32x16<S>,
    /// Variance by the places of walls between those that are tried.
    pub(super) by_place: f32x16<S>,
}

/// The average over all lines and none.
pub(super) struct Averaged<S: Simd> {
    /// At each inner pixel.
    pub(super) changes: [Change<S>; 4],
    /// The part of the sum of squared observations that lines explain.
    pub(super) explained: f32x16<S>,
    /// Probability that there is a line.
    pub(super) share: f32x16<S>,
}

impl<S: Simd> Averaged<S> {
    /// Without lines.
    #[inline(always)]
    pub(super) fn none(simd: S) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        Self {
            changes: [Change { shift: zero, variance: zero, by_place: zero }; 4],
            explained: zero,
            share: zero,
        }
    }
}

/// The lines through a disc.
pub(super) struct Lines {
    parallels: Vec<Parallels>,
    wall: Prior,
    crease: Prior,
    /// Share of a strip that the lens and the aperture carry into each neighbour.
    spread: f32,
}

impl Lines {
    /// Lines in these directions, seen through a blur of this variance, in squares of a strip's width. `odds` are
    /// those that a line crosses a disc, before anything is observed.
    pub(super) fn new(directions: Vec<Direction>, odds: f32, blur: f32) -> Self {
        let parallels: Vec<Parallels> = directions.into_iter().map(Parallels::of).collect();
        let count = parallels.iter().map(|parallels| parallels.at_inner.len()).sum();
        Self {
            parallels,
            wall: Prior::new(STEP, odds, count),
            crease: Prior::new(CREASE, odds, count),
            spread: 0.5 * blur,
        }
    }

    /// The average over all lines and none.
    #[inline(always)]
    pub(super) fn average<S: Simd>(
        &self,
        simd: S,
        plane: &Plane<S>,
        points: &[Point],
        observations: (&[f32x16<S>], &[f32x16<S>]),
    ) -> Averaged<S> {
        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, 1.0);
        let places = INNER.map(|inner| plane.place(simd, inner));
        let mut average = Average {
            likeliest: zero,
            weight: one,
            shifts: [zero; 4],
            squares: [zero; 4],
            by_place: [zero; 4],
            explained: zero,
        };
        let mut fitted = [[zero; 7]; MOST_STRIPS * KINDS];
        let mut strips = [(Shape([zero; 4]), zero); MOST_STRIPS];
        for Parallels { direction, at_inner } in &self.parallels {
            let mut first = 0;
            for (strip, &end) in strips.iter_mut().zip(&direction.ends) {
                let inside = &direction.points[first..end as usize];
                *strip = strip_sums(simd, plane, inside, points, observations);
                first = end as usize;
            }
            self.fit(simd, &strips[..direction.ends.len()], &mut fitted);
            average.take(simd, &places, &fitted[..at_inner.len()], at_inner);
        }
        let over = one / average.weight;
        let mut changes = [Change { shift: zero, variance: zero, by_place: zero }; 4];
        for (index, change) in changes.iter_mut().enumerate() {
            change.shift = average.shifts[index] * over;
            change.variance = (average.squares[index] * over - change.shift * change.shift).max(zero);
            change.by_place = average.by_place[index] * over;
        }
        let explained = average.explained * over;
        let share = one - power_of_two(simd, -average.likeliest) * over;
        Averaged { changes, explained, share }
    }

    /// Fits all lines of a direction.
    #[inline(always)]
    fn fit<S: Simd>(&self, simd: S, strips: &[Strip<S>], fitted: &mut [Fitted<S>]) {
        let zero = f32x16::splat(simd, 0.0);
        let b = self.spread;
        // Sums beyond a strip's upper edge: of the level, of the distance, and of weights times 1, the
        // distance and its square.
        let (mut level, mut crease) = (Shape([zero; 4]), Shape([zero; 4]));
        let [mut w0, mut w1, mut w2] = [zero; 3];
        let mut further = (Shape([zero; 4]), zero);
        let places = (1..strips.len() - 1).rev();
        for (place, fitted) in places.zip(fitted.chunks_exact_mut(KINDS)) {
            let (above, own, below) = (strips[place + 1], strips[place], strips[place - 1]);
            // Values of the spread shapes in the strips around the line, and 1 beyond.
            let narrow = [1.0 - 0.5 * b, 0.5, 0.5 * b];
            let shape = level
                .plus_times(above.0, narrow[0])
                .plus_times(own.0, narrow[1])
                .plus_times(below.0, narrow[2]);
            let square = squares(w0, [above.1, own.1, below.1], narrow);
            fitted[0] = fitted_line(simd, shape, square, self.wall);
            // The strip above is wholly beyond what follows.
            crease = crease.plus(level).plus_times(above.0, 0.5);
            w2 = w1.mul_add(2.0, above.1.mul_add(0.25, w2 + w0));
            w1 = above.1.mul_add(0.5, w1 + w0);
            w0 += above.1;
            level = level.plus(above.0);
            let shape = crease.plus_times(above.0, 0.5 * b).plus_times(own.0, 0.5 * b);
            let near = [0.5 + 0.5 * b, 0.5 * b];
            let square = squares(above.1.mul_add(-0.25, w2), [above.1, own.1, zero], [near[0], near[1], 0.0]);
            fitted[1] = fitted_line(simd, shape, square, self.crease);
            let wide = [0.75 - 0.25 * b, 0.25 + 0.25 * b, 0.25 * b];
            let most = 1.0 - 0.25 * b;
            let shape = level.plus_times(further.0, most - 1.0).plus_times(above.0, wide[0] - 1.0);
            let shape = shape.plus_times(own.0, wide[1]).plus_times(below.0, wide[2]);
            let beyond = further.1.mul_add(most * most - 1.0, w0 - above.1);
            let square = squares(beyond, [above.1, own.1, below.1], wide);
            fitted[2] = fitted_line(simd, shape, square, self.wall);
            let steep = [1.0 - b, b];
            let shape = level.plus_times(above.0, steep[0] - 1.0).plus_times(own.0, steep[1]);
            let square = squares(w0 - above.1, [above.1, own.1, zero], [steep[0], steep[1], 0.0]);
            fitted[3] = fitted_line(simd, shape, square, self.wall);
            further = above;
        }
    }
}

/// A line of which `square` is the sum of weights times its squared shape.
#[inline(always)]
fn fitted_line<S: Simd>(
    simd: S,
    Shape([a, b, c, residual]): Shape<S>,
    square: f32x16<S>,
    prior: Prior,
) -> Fitted<S> {
    let spare = square - c.mul_add(c, b.mul_add(b, a * a));
    let spare = spare.max(f32x16::splat(simd, 0.0)) + prior.precision;
    let over = spare.approximate_recip();
    let alpha = residual * over;
    let gain = (residual * alpha).mul_add(HALF_LOG_E, f32x16::splat(simd, prior.logarithm));
    [rough_logarithm(simd, spare).mul_add(-0.5, gain), alpha, over, a, b, c, residual * alpha]
}

impl<S: Simd> Average<S> {
    #[inline(always)]
    fn take(&mut self, simd: S, places: &[[f32x16<S>; 3]; 4], fitted: &[Fitted<S>], at_inner: &[AtInner]) {
        let before = self.likeliest;
        for [logarithm, ..] in fitted {
            self.likeliest = self.likeliest.max(*logarithm);
        }
        let fade = power_of_two(simd, before - self.likeliest);
        self.weight *= fade;
        self.explained *= fade;
        for index in 0..INNER.len() {
            self.shifts[index] *= fade;
            self.squares[index] *= fade;
            self.by_place[index] *= fade;
        }
        for (&[logarithm, alpha, over, a, b, c, explained], at_inner) in fitted.iter().zip(at_inner) {
            let weight = power_of_two(simd, logarithm - self.likeliest);
            self.weight += weight;
            self.explained = weight.mul_add(explained, self.explained);
            let first = weight * alpha;
            let second = first.mul_add(alpha, weight * over);
            for (index, [y, x, one]) in places.iter().enumerate() {
                let plane = a.mul_add(*y, b.mul_add(*x, c * *one));
                let follows = f32x16::splat(simd, at_inner.shape[index]) - plane;
                self.shifts[index] = first.mul_add(follows, self.shifts[index]);
                self.squares[index] = (second * follows).mul_add(follows, self.squares[index]);
                if at_inner.variance[index] > 0.0 {
                    let place = first * alpha;
                    self.by_place[index] = place.mul_add(at_inner.variance[index], self.by_place[index]);
                }
            }
        }
    }
}

/// A sum of weights, and some more times squares.
#[inline(always)]
fn squares<S: Simd>(beyond: f32x16<S>, [a, b, c]: [f32x16<S>; 3], [x, y, z]: [f32; 3]) -> f32x16<S> {
    a.mul_add(x * x, b.mul_add(y * y, c.mul_add(z * z, beyond)))
}

/// The shape and the weight of a strip.
#[inline(always)]
fn strip_sums<S: Simd>(
    simd: S,
    plane: &Plane<S>,
    strip: &[u16],
    points: &[Point],
    (weights, moments): (&[f32x16<S>], &[f32x16<S>]),
) -> Strip<S> {
    let [mut w, mut wx, mut wy, mut m] = [f32x16::splat(simd, 0.0); 4];
    for &index in strip {
        let index = index as usize;
        let (point, weight) = (points[index], weights[index]);
        w += weight;
        wx = weight.mul_add(point.x, wx);
        wy = weight.mul_add(point.y, wy);
        m += moments[index];
    }
    let whitened = plane.whitened([w, wx, wy]);
    let [a, b, c] = whitened;
    (Shape([a, b, c, m - plane.explained(whitened)]), w)
}
