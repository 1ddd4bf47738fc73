//! The surface by the discs around each 2 x 2 pixels.

use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, SimdMask, dispatch, f32x16};
use rayon::prelude::*;

use super::disc::{INNER, Point, directions, points};
use super::lines::{Averaged, Lines};
use super::model::{Model, STEEPEST, Shapes};
use super::observed::Observed;
use super::plane::Normal;
use super::surface::{Surface, SurfaceRow};
use crate::refine::moments::LANES;
use crate::refine::padded::{PAD, Padded};

/// Guesses of one surface differ by this step at most, and for each px of distance by the steepest slant.
const SLACK_PX: f32 = 0.5;
/// Pixels of the largest disc.
const MOST_POINTS: usize = 176;

/// Discs of one size.
pub(super) struct Discs {
    points: Vec<Point>,
    /// Largest difference of guesses at each point, in px.
    slack_px: Vec<f32>,
    lines: Option<Lines>,
    /// Width of the map's pixels, in px of the image.
    pixel: f32,
}

impl Discs {
    /// Discs of this squared radius in pixels of the map, which are `pixel` px of the image wide.
    pub(super) fn new(squared_radius: usize, shapes: Shapes, model: &Model, pixel: f32) -> Self {
        let points = points(squared_radius);
        let slack_px = points.iter().map(|point| SLACK_PX + STEEPEST * pixel * point.distance()).collect();
        let lines = (shapes == Shapes::PlanesAndLines).then(|| {
            Lines::new(directions(&points, model.rim_px), model.line_odds, model.blur / (pixel * pixel))
        });
        Self { points, slack_px, lines, pixel }
    }

    /// How many pixels of the image a disc holds.
    pub(super) fn pixels(&self) -> f32 {
        self.points.len() as f32 * self.pixel * self.pixel
    }

    /// The surface at all pixels whose `guesses` are numbers; it stays unknown at the others. And the share of
    /// discs that a line crosses.
    pub(super) fn surface(&self, level: Level, observed: &Observed, guesses: &Padded) -> (Surface, f64) {
        // Slants carry disparities from wide pixels to narrow ones.
        let mut surface = Surface::unknown(observed.rows(), observed.columns, self.pixel > 1.0);
        let pairs = surface.par_row_pairs().enumerate();
        let counts = pairs.map(|(pair, mut rows)| {
            dispatch!(level, simd => self.rows(simd, (observed, guesses), 2 * pair, &mut rows))
        });
        // In the order of rows, so that the sum does not depend on threads.
        let counts: Vec<[f64; 2]> = counts.collect();
        let [discs, crossed] = counts.iter().fold([0.0, 0.0], |sum, row| [sum[0] + row[0], sum[1] + row[1]]);
        (surface, if discs > 0.0 { crossed / discs } else { 0.0 })
    }

    #[inline(always)]
    fn rows<S: Simd>(
        &self,
        simd: S,
        (observed, guesses): (&Observed, &Padded),
        y: usize,
        rows: &mut [SurfaceRow<'_>],
    ) -> [f64; 2] {
        let mut count = [0.0; 2];
        let mut start = PAD;
        while start + PAD < guesses.stride {
            self.block(simd, (observed, guesses), (y, start), rows, &mut count);
            start += 2 * LANES;
        }
        count
    }

    /// The surface at 2 rows of 2 times 16 pixels. Where guesses among 2 x 2 pixels are of several surfaces,
    /// each has a round of its own. `count` counts discs and probabilities that lines cross them.
    #[inline(always)]
    fn block<S: Simd>(
        &self,
        simd: S,
        (observed, guesses): (&Observed, &Padded),
        (y, start): (usize, usize),
        rows: &mut [SurfaceRow<'_>],
        count: &mut [f64; 2],
    ) {
        let nothing = f32x16::splat(simd, f32::NAN);
        let mut open = [nothing; 4];
        for (open, pair) in open.chunks_exact_mut(2).zip(0..rows.len()) {
            let [even, odd] = load_pair(simd, guesses, (y + pair, start));
            (open[0], open[1]) = (even, odd);
        }
        for _ in 0..INNER.len() {
            // The first guess that is left.
            let mut own = open[3];
            for guess in [open[2], open[1], open[0]] {
                own = guess.is_nan().select(own, guess);
            }
            if own.is_nan().all_true() {
                break;
            }
            let (found, share) = self.found(simd, observed, (y, start), own);
            let is_disc = own.is_nan().select(f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
            count[0] += f64::from(is_disc.reduce_sum());
            count[1] += f64::from((is_disc * own.is_nan().select(is_disc, share)).reduce_sum());
            for (pair, row) in rows.iter_mut().enumerate() {
                let guesses = [open[2 * pair], open[2 * pair + 1]];
                let served = guesses.map(|guess| (guess - own).abs().simd_le(SLACK_PX));
                row.put(simd, start, served, [found[2 * pair], found[2 * pair + 1]]);
                for (side, served) in served.into_iter().enumerate() {
                    open[2 * pair + side] = served.select(nothing, guesses[side]);
                }
            }
        }
    }

    /// Disparity, variance, variance by place and slants at the inner pixels, for the surface of the guess
    /// `own`; and the probability that a line crosses the disc.
    #[inline(always)]
    fn found<S: Simd>(
        &self,
        simd: S,
        observed: &Observed,
        (y, start): (usize, usize),
        own: f32x16<S>,
    ) -> ([[f32x16<S>; 5]; 4], f32x16<S>) {
        let zero = f32x16::splat(simd, 0.0);
        let mut weights = [zero; MOST_POINTS];
        let mut moments = [zero; MOST_POINTS];
        let mut normal = Normal::prior(simd);
        let (mut squares, mut number) = (zero, zero);
        for (index, point) in self.points.iter().enumerate() {
            // Rows above the image come out as huge numbers.
            let row = y.wrapping_add_signed(point.row);
            if row >= observed.rows() {
                continue;
            }
            let at = (row, start.wrapping_add_signed(point.column));
            let guess = load_every_other(simd, &observed.guess, at);
            let near = (guess - own).abs().simd_le(self.slack_px[index]);
            let weight = near.select(load_every_other(simd, &observed.precision, at), zero);
            let value = load_every_other(simd, &observed.value, at) - own;
            let moment = weight * value;
            squares = moment.mul_add(value, squares);
            number += weight.simd_gt(zero).select(f32x16::splat(simd, 1.0), zero);
            normal.add((point.x, point.y), weight, moment);
            (weights[index], moments[index]) = (weight, moment);
        }
        let plane = normal.solve(simd);
        let count = self.points.len();
        let averaged = match &self.lines {
            None => Averaged::none(simd),
            Some(lines) => lines.average(simd, &plane, &self.points, (&weights[..count], &moments[..count])),
        };
        let left = squares - plane.explained_squares() - averaged.explained;
        let freedom = (number - 3.0).max(f32x16::splat(simd, 1.0));
        let misfit = (left / freedom).max(f32x16::splat(simd, 1.0));
        let known = plane.known.simd_gt(zero);
        let infinite = f32x16::splat(simd, f32::INFINITY);
        let mut found = [[zero; 5]; 4];
        for ((found, inner), change) in found.iter_mut().zip(INNER).zip(averaged.changes) {
            let [a, b, c] = plane.place(simd, inner);
            let variance = (a.mul_add(a, b.mul_add(b, c * c)) + change.variance) * misfit;
            *found = [
                known.select(own + plane.at(inner) + change.shift, own),
                known.select(variance, infinite),
                known.select(change.by_place, zero),
                known.select(plane.slants[0], zero),
                known.select(plane.slants[1], zero),
            ];
        }
        (found, averaged.share)
    }
}

/// Every other value of a row, from `place` on.
#[inline(always)]
fn load_every_other<S: Simd>(simd: S, map: &Padded, (y, place): (usize, usize)) -> f32x16<S> {
    load_pair(simd, map, (y, place))[0]
}

/// Every other value of a row, from `place` on and from the next place on.
#[inline(always)]
fn load_pair<S: Simd>(simd: S, map: &Padded, (y, place): (usize, usize)) -> [f32x16<S>; 2] {
    let row = &map.row(y)[place..place + 2 * LANES];
    let (first, second) = row.split_at(LANES);
    let (even, odd) = f32x16::from_slice(simd, first).deinterleave(f32x16::from_slice(simd, second));
    [even, odd]
}
