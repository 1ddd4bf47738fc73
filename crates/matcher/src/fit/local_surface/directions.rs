//! Edges in any direction through a disc, and which of them are tried.
//!
//! Rows, columns and both diagonals are tried first. Where their edges explain something, those
//! between follow, and so on. Only directions beside one that has a part of the weight are tried,
//! so most of them never are.

use fearless_simd::{Simd, SimdBase, SimdMask, f32x16};

use super::averaged::{Average, Averaged, Weight};
use super::disc::{FEWEST, INNER, Point, directions};
use super::edges::Parallels;
use super::model::EdgePriors;
use super::plane::Plane;

const MOST_DIRECTIONS: usize = 32;
/// Directions between are tried where those so far explain this much of the sum of squares for each
/// of them: the farther apart they are, the more of it a direction between them loses. (With a half
/// or none of it the errors are the same to a hundredth of themselves.)
const TELLING_SQUARES: f32 = 2.0;
/// None is tried beside those that have less than this part of the weight of all, in all discs of a
/// block.
const NEGLIGIBLE: f32 = 1e-3;

/// The edges through a disc.
pub(super) struct Edges {
    /// By angle.
    directions: Vec<Parallels>,
}

impl Edges {
    /// Edges through the disc of these `points`, seen through a blur of this variance in px^2 of the
    /// map. Step edges of grooves also lie `at_edges` of strips.
    pub(super) fn new(points: &[Point], priors: &EdgePriors, blur: f32, at_edges: bool) -> Self {
        let directions = directions(points).into_iter();
        let directions: Vec<Parallels> =
            directions.map(|direction| Parallels::new(direction, priors, blur, at_edges)).collect();
        assert!(directions.len() <= MOST_DIRECTIONS, "the disc is too wide");
        Self { directions }
    }

    /// The average over all edges and none. Only the first directions are tried, and families are
    /// counted, if `COUNTS`.
    #[inline(always)]
    pub(super) fn average<S: Simd, const COUNTS: bool>(
        &self,
        simd: S,
        plane: &Plane<S>,
        points: &[Point],
        observations: (&[f32x16<S>], &[f32x16<S>]),
    ) -> Averaged<S> {
        let places = INNER.map(|inner| plane.place(simd, inner));
        let mut average = Average::of_no_edge(simd);
        let count = self.directions.len();
        let mut weights = [Weight::none(simd); MOST_DIRECTIONS];
        let mut tells = [true; MOST_DIRECTIONS];
        // Those that are tried now, and how far apart they and those before are then.
        let (mut first, mut step, mut spacing) = (0, count / FEWEST, count / FEWEST);
        loop {
            for turn in (first..count).step_by(step).filter(|turn| tells[*turn]) {
                let direction = &self.directions[turn];
                direction.take::<S, COUNTS>(simd, plane, &places, points, observations, &mut average);
                weights[turn] = average.weight_of_direction();
            }
            let tried = count / spacing;
            let averaged = average.averaged(simd, tried);
            let telling = averaged.explained.simd_gt(TELLING_SQUARES * tried as f32).any_true();
            if COUNTS || spacing == 1 || !telling {
                return averaged;
            }
            let half = spacing / 2;
            tells = [false; MOST_DIRECTIONS];
            for turn in (0..count).step_by(spacing) {
                if average.has(simd, weights[turn], NEGLIGIBLE, tried) {
                    tells[turn + half] = true;
                    tells[(turn + count - half) % count] = true;
                }
            }
            (first, step, spacing) = (half, spacing, half);
        }
    }
}
