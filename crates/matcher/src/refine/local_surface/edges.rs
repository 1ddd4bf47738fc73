//! A plane with one edge through the disc: a wall between two levels, or a crease. Or with two
//! parallel ones: the walls of a groove or of a ridge.
//!
//! ```text
//! v_j = a + p x_j + q y_j + alpha phi(n_j) + noise      alpha ~ N(0, T^2)
//! ```
//!
//! n is the distance from the edge, and phi its shape (`edge_shapes`). The lens and the pixels'
//! aperture have spread the phi that is observed. With the residuals r_j = w_j (v_j - a - p x_j - q
//! y_j) of the plane, for each edge
//!
//! ```text
//! S = phi' W phi - (X' W phi)' A^-1 (X' W phi) + 1/T^2        alpha = phi' r / S
//! log weight = (phi' r)^2 / 2 S - log(S T^2) / 2 + log(odds / number of edges)
//! ```
//!
//! All edges and none are averaged by these weights (`averaged`). phi is taken as constant in
//! strips of 1 px along the edge: so sums over strips serve all edges of a direction.
//!
//! A disc that both walls of a hollow cross has the right model only if they are parallel. Else the
//! plane takes a part of the hollow's depth.

use fearless_simd::{Simd, SimdBase, SimdFloat, f32x16};

use super::approximate::rough_logarithm;
use super::averaged::{Average, Averaged, Fitted};
use super::disc::{Direction, INNER, Point};
use super::edge_shapes::{CREASE, GROOVE, ParallelEdges, WALL};
use super::model::{EdgePrior, EdgePriors};
use super::plane::Plane;

/// Kinds of single edges: steps, walls 1 px and 2 px wide, and creases at the edges and in the
/// middles of strips. (A crease half a pixel off its place is wrong by a quarter of the change of
/// slant.)
const KINDS: usize = 5;
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

/// A wall that may be one of a groove.
#[derive(Clone, Copy)]
struct Wall<S: Simd> {
    shape: Shape<S>,
    /// The sum of weights times the squared shape.
    square: f32x16<S>,
    /// What of a sum of weights beyond a lower wall is lost above this one: the sum of weights
    /// times one less the square of what this wall leaves.
    lost: f32x16<S>,
}

/// One over the prior variance of a kind of edge, and the logarithm of its weight when nothing is
/// observed.
#[derive(Clone, Copy)]
struct Prior {
    precision: f32,
    logarithm: f32,
}

impl Prior {
    /// Of one of so many edges of a family. `rest` is the share of the discs that have none of any.
    fn new(EdgePrior { share, variance }: EdgePrior, rest: f64, edges: usize) -> Self {
        let logarithm = (share / (rest * edges.max(1) as f64)).log2() - 0.5 * variance.log2();
        Self { precision: (1.0 / variance) as f32, logarithm: logarithm as f32 }
    }
}

/// The edges through a disc.
pub(super) struct Edges {
    parallels: Vec<ParallelEdges>,
    wall: Prior,
    crease: Prior,
    groove: Prior,
    /// Share of a strip that the lens and the aperture carry into each neighbour.
    spread: f32,
}

impl Edges {
    /// Edges in these directions, seen through a blur of this variance, in squares of a strip's
    /// width. Walls of grooves also lie `at_edges` of strips.
    pub(super) fn new(directions: Vec<Direction>, priors: EdgePriors, blur: f32, at_edges: bool) -> Self {
        let parallels: Vec<ParallelEdges> =
            directions.into_iter().map(|direction| ParallelEdges::of(direction, at_edges)).collect();
        let mut counts = [0; 3];
        for ParallelEdges { at_inner, grooves, .. } in &parallels {
            for edge in at_inner.iter().chain(grooves.iter().map(|groove| &groove.at_inner)) {
                counts[edge.family] += 1;
            }
        }
        let rest = 1.0 - priors.iter().map(|prior| prior.share).sum::<f64>();
        let prior = |family: usize| Prior::new(priors[family], rest, counts[family]);
        Self {
            parallels,
            wall: prior(WALL),
            crease: prior(CREASE),
            groove: prior(GROOVE),
            spread: 0.5 * blur,
        }
    }

    /// How many directions they have.
    pub(super) fn directions(&self) -> usize {
        self.parallels.len()
    }

    /// The average over all edges and none. Families are counted if `COUNTS`.
    #[inline(always)]
    pub(super) fn average<S: Simd, const COUNTS: bool>(
        &self,
        simd: S,
        plane: &Plane<S>,
        points: &[Point],
        observations: (&[f32x16<S>], &[f32x16<S>]),
    ) -> Averaged<S> {
        let zero = f32x16::splat(simd, 0.0);
        let places = INNER.map(|inner| plane.place(simd, inner));
        let mut average = Average::of_none(simd);
        let mut fitted = [[zero; 7]; MOST_STRIPS * KINDS];
        let mut strips = [(Shape([zero; 4]), zero); MOST_STRIPS];
        let none = Wall { shape: Shape([zero; 4]), square: zero, lost: zero };
        let mut walls = [none; 2 * MOST_STRIPS];
        for ParallelEdges { direction, at_inner, grooves } in &self.parallels {
            let mut first = 0;
            for (strip, &end) in strips.iter_mut().zip(&direction.ends) {
                let inside = &direction.points[first..end as usize];
                *strip = strip_sums(simd, plane, inside, points, observations);
                first = end as usize;
            }
            self.fit(simd, &strips[..direction.ends.len()], &mut fitted, &mut walls);
            average.take::<COUNTS>(simd, &places, &fitted[..at_inner.len()], at_inner.iter());
            for grooves in grooves.chunks(fitted.len()) {
                for (groove, fitted) in grooves.iter().zip(&mut fitted) {
                    let (rising, falling) = (&walls[groove.lower], &walls[groove.upper]);
                    let shape = rising.shape.plus_times(falling.shape, -1.0);
                    *fitted = fitted_edge(simd, shape, rising.square - falling.lost, self.groove);
                }
                let at_inner = grooves.iter().map(|groove| &groove.at_inner);
                average.take::<COUNTS>(simd, &places, &fitted[..grooves.len()], at_inner);
            }
        }
        average.averaged(simd)
    }

    /// Fits all single edges of a direction, and takes the sums of the `walls` of grooves.
    #[inline(always)]
    fn fit<S: Simd>(&self, simd: S, strips: &[Strip<S>], fitted: &mut [Fitted<S>], walls: &mut [Wall<S>]) {
        let zero = f32x16::splat(simd, 0.0);
        let b = self.spread;
        // Sums beyond a strip's upper edge: of the level, of the distance, and of weights times 1,
        // the distance and its square.
        let (mut level, mut crease) = (Shape([zero; 4]), Shape([zero; 4]));
        let [mut w0, mut w1, mut w2] = [zero; 3];
        let mut further = (Shape([zero; 4]), zero);
        let places = (1..strips.len() - 1).rev();
        for (place, fitted) in places.zip(fitted.chunks_exact_mut(KINDS)) {
            let (above, own, below) = (strips[place + 1], strips[place], strips[place - 1]);
            // Values of the spread shapes in the strips around the edge, and 1 beyond.
            let narrow = [1.0 - 0.5 * b, 0.5, 0.5 * b];
            let shape = level
                .plus_times(above.0, narrow[0])
                .plus_times(own.0, narrow[1])
                .plus_times(below.0, narrow[2]);
            let square = squares(w0, [above.1, own.1, below.1], narrow);
            fitted[0] = fitted_edge(simd, shape, square, self.wall);
            // A wall that falls leaves of a level of 1 what one that rises has on the other side.
            let left = squares(zero, [below.1, own.1, above.1], narrow);
            walls[2 * place] = Wall { shape, square, lost: w0 + above.1 + own.1 + below.1 - left };
            // The strip above is wholly beyond what follows.
            crease = crease.plus(level).plus_times(above.0, 0.5);
            w2 = w1.mul_add(2.0, above.1.mul_add(0.25, w2 + w0));
            w1 = above.1.mul_add(0.5, w1 + w0);
            w0 += above.1;
            level = level.plus(above.0);
            let shape = crease.plus_times(above.0, 0.5 * b).plus_times(own.0, 0.5 * b);
            let near = [0.5 + 0.5 * b, 0.5 * b];
            let square = squares(above.1.mul_add(-0.25, w2), [above.1, own.1, zero], [near[0], near[1], 0.0]);
            fitted[1] = fitted_edge(simd, shape, square, self.crease);
            let wide = [0.75 - 0.25 * b, 0.25 + 0.25 * b, 0.25 * b];
            let most = 1.0 - 0.25 * b;
            let shape = level.plus_times(further.0, most - 1.0).plus_times(above.0, wide[0] - 1.0);
            let shape = shape.plus_times(own.0, wide[1]).plus_times(below.0, wide[2]);
            let beyond = further.1.mul_add(most * most - 1.0, w0 - above.1);
            let square = squares(beyond, [above.1, own.1, below.1], wide);
            fitted[2] = fitted_edge(simd, shape, square, self.wall);
            let steep = [1.0 - b, b];
            let shape = level.plus_times(above.0, steep[0] - 1.0).plus_times(own.0, steep[1]);
            let square = squares(w0 - above.1, [above.1, own.1, zero], [steep[0], steep[1], 0.0]);
            fitted[3] = fitted_edge(simd, shape, square, self.wall);
            let left = squares(zero, [own.1, above.1, zero], [steep[0], steep[1], 0.0]);
            walls[2 * place + 1] = Wall { shape, square, lost: w0 + own.1 - left };
            let at_middle = 0.125 + b;
            let shape = crease.plus_times(level, 0.5).plus_times(own.0, at_middle);
            let square = squares(w0.mul_add(0.25, w2 + w1), [own.1, zero, zero], [at_middle, 0.0, 0.0]);
            fitted[4] = fitted_edge(simd, shape, square, self.crease);
            further = above;
        }
    }
}

/// An edge of which `square` is the sum of weights times its squared shape.
#[inline(always)]
fn fitted_edge<S: Simd>(
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
