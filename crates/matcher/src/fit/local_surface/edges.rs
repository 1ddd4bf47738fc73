//! A plane with one edge through the disc: a step edge between two levels, or a crease. Or with two
//! parallel ones: the step edges of a groove or of a ridge.
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
//! log weight = (phi' r)^2 / 2 S - log(S T^2) / 2 + log(odds / edges of the direction / directions)
//! ```
//!
//! All edges and none are averaged by these weights (`averaged`). phi is taken as constant in
//! strips of 1 px along the edge: so sums over strips serve all edges of a direction.
//!
//! A disc that both step edges of a groove cross has the right model only if they are parallel. Else the
//! plane takes a part of the groove's depth.

use fearless_simd::{Simd, SimdBase, SimdFloat, f32x16};

use super::approximate::rough_logarithm;
use super::averaged::{Average, Fitted};
use super::disc::{Direction, Point};
use super::edge_shapes::{CREASE, GROOVE, ParallelEdges, STEP_EDGE};
use super::model::{EdgePrior, EdgePriors};
use super::plane::Plane;

/// Kinds of single edges: step edges 1/2, 1 and 2 px wide, and creases at the edges and in the
/// middles of strips. (A crease half a pixel off its place is wrong by a quarter of the change of
/// slant.)
const KINDS: usize = 5;
/// Grooves that are averaged together.
const TOGETHER: usize = 8;
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

/// A step edge that may be one of a groove.
#[derive(Clone, Copy)]
struct StepEdge<S: Simd> {
    shape: Shape<S>,
    /// The sum of weights times the squared shape.
    square: f32x16<S>,
    /// What of a sum of weights beyond a lower step edge is lost above this one: the sum of weights
    /// times one less the square of what this step edge leaves.
    lost: f32x16<S>,
}

/// One over the prior variance of a family of edges, and the logarithm of the weight of one of them
/// in a disc of one direction, when nothing is observed.
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

/// The edges of one direction.
pub(super) struct Parallels {
    edges: ParallelEdges,
    /// Of each family.
    priors: [Prior; 3],
    /// Share of a strip that the lens and the aperture carry into each neighbour.
    spread: f32,
}

impl Parallels {
    /// Those of this direction, seen through a blur of this variance, in squares of a strip's width.
    /// Step edges of grooves also lie `at_edges` of strips.
    pub(super) fn new(direction: Direction, priors: &EdgePriors, blur: f32, at_edges: bool) -> Self {
        let edges = ParallelEdges::of(direction, at_edges);
        let rest = 1.0 - priors.iter().map(|prior| prior.share).sum::<f64>();
        let count = |family: usize| edges.all().filter(|at_inner| at_inner.family == family).count();
        let priors =
            [STEP_EDGE, CREASE, GROOVE].map(|family| Prior::new(priors[family], rest, count(family)));
        Self { edges, priors, spread: 0.5 * blur }
    }

    /// Takes them all into an `average`. `places` are the whitened places of the inner pixels.
    #[inline(always)]
    pub(super) fn take<S: Simd, const COUNTS: bool>(
        &self,
        simd: S,
        plane: &Plane<S>,
        places: &[[f32x16<S>; 3]; 4],
        points: &[Point],
        observations: (&[f32x16<S>], &[f32x16<S>]),
        average: &mut Average<S>,
    ) {
        let zero = f32x16::splat(simd, 0.0);
        let ParallelEdges { direction, at_inner, grooves } = &self.edges;
        let mut strips = [(Shape([zero; 4]), zero); MOST_STRIPS];
        let mut first = 0;
        for (strip, &end) in strips.iter_mut().zip(&direction.ends) {
            let inside = &direction.points[first..end as usize];
            *strip = strip_sums(simd, plane, inside, points, observations);
            first = end as usize;
        }
        let strips = &strips[..direction.ends.len()];
        let none = StepEdge { shape: Shape([zero; 4]), square: zero, lost: zero };
        let mut step_edges = [none; 2 * MOST_STRIPS];
        let mut beyond = Beyond::none(simd, self.spread);
        for (place, at_inner) in (1..strips.len() - 1).rev().zip(at_inner.chunks_exact(KINDS)) {
            let fitted = beyond.fit(simd, strips, &self.priors, place, &mut step_edges);
            average.take::<COUNTS>(simd, places, &fitted, at_inner.iter());
        }
        let mut fitted = [[zero; 7]; TOGETHER];
        for grooves in grooves.chunks(TOGETHER) {
            for (groove, fitted) in grooves.iter().zip(&mut fitted) {
                let (rising, falling) = (&step_edges[groove.lower], &step_edges[groove.upper]);
                let shape = rising.shape.plus_times(falling.shape, -1.0);
                *fitted = fitted_edge(simd, shape, rising.square - falling.lost, self.priors[GROOVE]);
            }
            let at_inner = grooves.iter().map(|groove| &groove.at_inner);
            average.take::<COUNTS>(simd, places, &fitted[..grooves.len()], at_inner);
        }
    }
}

/// Sums beyond a strip's upper edge.
struct Beyond<S: Simd> {
    /// Share of a strip that the lens and the aperture carry into each neighbour.
    spread: f32,
    level: Shape<S>,
    /// Of the distance.
    crease: Shape<S>,
    /// Of weights times 1, the distance and its square.
    squares: [f32x16<S>; 3],
    /// The strip beyond the next one.
    further: Strip<S>,
}

impl<S: Simd> Beyond<S> {
    #[inline(always)]
    fn none(simd: S, spread: f32) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        let none = Shape([zero; 4]);
        Self { spread, level: none, crease: none, squares: [zero; 3], further: (none, zero) }
    }

    /// Fits all single edges of a strip, and takes the sums of the `step_edges` of grooves. The strips
    /// above it have been taken, from the last one on.
    #[inline(always)]
    fn fit(
        &mut self,
        simd: S,
        strips: &[Strip<S>],
        priors: &[Prior; 3],
        place: usize,
        step_edges: &mut [StepEdge<S>],
    ) -> [Fitted<S>; KINDS] {
        let zero = f32x16::splat(simd, 0.0);
        let b = self.spread;
        let Self { level, crease, squares: [w0, w1, w2], further, .. } = self;
        let (above, own, below) = (strips[place + 1], strips[place], strips[place - 1]);
        // Values of the spread shapes in the strips around the edge, and 1 beyond.
        let narrow = [1.0 - 0.5 * b, 0.5, 0.5 * b];
        let shape =
            level.plus_times(above.0, narrow[0]).plus_times(own.0, narrow[1]).plus_times(below.0, narrow[2]);
        let square = squares(*w0, [above.1, own.1, below.1], narrow);
        let step_edge = fitted_edge(simd, shape, square, priors[STEP_EDGE]);
        // A step edge that falls leaves of a level of 1 what one that rises has on the other side.
        let left = squares(zero, [below.1, own.1, above.1], narrow);
        step_edges[2 * place] = StepEdge { shape, square, lost: *w0 + above.1 + own.1 + below.1 - left };
        // The strip above is wholly beyond what follows.
        *crease = crease.plus(*level).plus_times(above.0, 0.5);
        *w2 = w1.mul_add(2.0, above.1.mul_add(0.25, *w2 + *w0));
        *w1 = above.1.mul_add(0.5, *w1 + *w0);
        *w0 += above.1;
        *level = level.plus(above.0);
        let shape = crease.plus_times(above.0, 0.5 * b).plus_times(own.0, 0.5 * b);
        let near = [0.5 + 0.5 * b, 0.5 * b];
        let square = squares(above.1.mul_add(-0.25, *w2), [above.1, own.1, zero], [near[0], near[1], 0.0]);
        let crease_at_edge = fitted_edge(simd, shape, square, priors[CREASE]);
        let wide = [0.75 - 0.25 * b, 0.25 + 0.25 * b, 0.25 * b];
        let most = 1.0 - 0.25 * b;
        let shape = level.plus_times(further.0, most - 1.0).plus_times(above.0, wide[0] - 1.0);
        let shape = shape.plus_times(own.0, wide[1]).plus_times(below.0, wide[2]);
        let beyond = further.1.mul_add(most * most - 1.0, *w0 - above.1);
        let square = squares(beyond, [above.1, own.1, below.1], wide);
        let wide_step_edge = fitted_edge(simd, shape, square, priors[STEP_EDGE]);
        let steep = [1.0 - b, b];
        let shape = level.plus_times(above.0, steep[0] - 1.0).plus_times(own.0, steep[1]);
        let square = squares(*w0 - above.1, [above.1, own.1, zero], [steep[0], steep[1], 0.0]);
        let steep_step_edge = fitted_edge(simd, shape, square, priors[STEP_EDGE]);
        let left = squares(zero, [own.1, above.1, zero], [steep[0], steep[1], 0.0]);
        step_edges[2 * place + 1] = StepEdge { shape, square, lost: *w0 + own.1 - left };
        let at_middle = 0.125 + b;
        let shape = crease.plus_times(*level, 0.5).plus_times(own.0, at_middle);
        let square = squares(w0.mul_add(0.25, *w2 + *w1), [own.1, zero, zero], [at_middle, 0.0, 0.0]);
        let crease_in_middle = fitted_edge(simd, shape, square, priors[CREASE]);
        *further = above;
        [step_edge, crease_at_edge, wide_step_edge, steep_step_edge, crease_in_middle]
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
    let information = square - c.mul_add(c, b.mul_add(b, a * a));
    let information = information.max(f32x16::splat(simd, 0.0)) + prior.precision;
    let over = information.approximate_recip();
    let alpha = residual * over;
    let gain = (residual * alpha).mul_add(HALF_LOG_E, f32x16::splat(simd, prior.logarithm));
    [rough_logarithm(simd, information).mul_add(-0.5, gain), alpha, over, a, b, c, residual * alpha]
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
