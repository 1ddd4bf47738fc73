//! The shapes of edges in a disc: which are tried, and what each is at the inner pixels.
//!
//! Across an edge, n px from it, the surface rises by alpha phi(n):
//!
//! ```text
//! step edge of width b: phi = n / b + 1/2, between 0 and 1      crease: phi = max(0, n)
//! groove: phi = step edge at the lower place - step edge at the upper place
//! ```
//!
//! Edges are tried at a few places. Each stands for those up to halfway to the next one: of their
//! shapes at a pixel the mean is taken, and the variance is one of the surface.

use super::disc::Direction;

/// Families of edges, in the order of [`EdgePriors`].
pub(super) const STEP_EDGE: usize = 0;
pub(super) const CREASE: usize = 1;
pub(super) const GROOVE: usize = 2;
/// A step edge that is tried stands for all of its width up to halfway to the next one, and so does a
/// crease, in px. So many places between are looked at.
const STEPS_BESIDE: f32 = 0.5;
const CREASES_BESIDE: f32 = 0.25;
const PLACES_BETWEEN: usize = 8;
/// Strips from one step edge of a groove to the other, at least.
const NARROWEST: usize = 3;

/// An edge's shape at the inner pixels, not spread by the lens, and its variance there if it lies
/// between the places that are tried, over alpha^2.
pub(super) struct AtInner {
    pub(super) shape: [f32; 4],
    pub(super) variance: [f32; 4],
    pub(super) family: usize,
}

impl AtInner {
    /// The mean and the variance of a `shape` over the edges that lie up to `beside_px` beside the
    /// one at `place`, and over some widths.
    fn between(
        inner: [f32; 4],
        place: f32,
        beside_px: f32,
        family: usize,
        widths: &[f32],
        shape: impl Fn(f32, f32) -> f32,
    ) -> Self {
        let places = (0..PLACES_BETWEEN).map(|index| (index as f32 + 0.5) / PLACES_BETWEEN as f32 - 0.5);
        let count = (PLACES_BETWEEN * widths.len()) as f32;
        let [mut means, mut squares] = [[0.0; 4]; 2];
        for beside in places.map(|place| 2.0 * beside_px * place) {
            for &width in widths {
                for (index, along) in inner.iter().enumerate() {
                    let value = shape(along - place - beside, width);
                    means[index] += value / count;
                    squares[index] += value * value / count;
                }
            }
        }
        let variance = std::array::from_fn(|index| (squares[index] - means[index] * means[index]).max(0.0));
        Self { shape: means, variance, family }
    }

    fn step_edge(inner: [f32; 4], place: f32, width: f32) -> Self {
        let widths = [0.5 * width, width, 1.5 * width];
        Self::between(inner, place, STEPS_BESIDE, STEP_EDGE, &widths, |from, width| {
            (from / width + 0.5).clamp(0.0, 1.0)
        })
    }

    fn crease(inner: [f32; 4], place: f32) -> Self {
        Self::between(inner, place, CREASES_BESIDE, CREASE, &[1.0], |from, _| from.max(0.0))
    }
}

/// Two step edges, of which the lower one rises and the upper one falls.
pub(super) struct Groove {
    /// Their places: two for each strip, its middle and its upper edge.
    pub(super) lower: usize,
    pub(super) upper: usize,
    pub(super) at_inner: AtInner,
}

/// All edges of a direction.
pub(super) struct ParallelEdges {
    pub(super) direction: Direction,
    /// In the order in which they are fitted.
    pub(super) at_inner: Vec<AtInner>,
    pub(super) grooves: Vec<Groove>,
}

impl ParallelEdges {
    /// The step edges of grooves lie in the middles of strips, or also at their edges.
    pub(super) fn of(direction: Direction, at_edges: bool) -> Self {
        let count = direction.ends.len();
        let at_inner = (1..count - 1).rev().flat_map(|strip| {
            let middle = direction.first + strip as f32;
            [
                AtInner::step_edge(direction.inner, middle, 1.0),
                AtInner::crease(direction.inner, middle + 0.5),
                AtInner::step_edge(direction.inner, middle + 0.5, 2.0),
                AtInner::step_edge(direction.inner, middle + 0.5, 0.5),
                AtInner::crease(direction.inner, middle),
            ]
        });
        let at_inner = at_inner.collect();
        let step_edge = |place: usize| {
            let middle = direction.first + (place / 2) as f32;
            if place.is_multiple_of(2) {
                AtInner::step_edge(direction.inner, middle, 1.0)
            } else {
                AtInner::step_edge(direction.inner, middle + 0.5, 0.5)
            }
        };
        let places = 2..2 * (count - 1);
        let lowers = places.clone().step_by(if at_edges { 1 } else { 2 });
        let pairs = lowers.flat_map(|lower| {
            (lower + 2 * NARROWEST..places.end).step_by(2).map(move |upper| (lower, upper))
        });
        let grooves = pairs.map(|(lower, upper)| {
            let (rising, falling) = (step_edge(lower), step_edge(upper));
            let at_inner = AtInner {
                shape: std::array::from_fn(|index| rising.shape[index] - falling.shape[index]),
                variance: std::array::from_fn(|index| rising.variance[index] + falling.variance[index]),
                family: GROOVE,
            };
            Groove { lower, upper, at_inner }
        });
        Self { at_inner, grooves: grooves.collect(), direction }
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &AtInner> {
        self.at_inner.iter().chain(self.grooves.iter().map(|groove| &groove.at_inner))
    }
}
