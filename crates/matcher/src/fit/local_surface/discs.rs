//! The surface by the discs around each 2 x 2 pixels.

use fearless_simd::{Level, Select, Simd, SimdBase, SimdFloat, SimdMask, dispatch, f32x16};
use rayon::prelude::*;

use super::averaged::Averaged;
use super::directions::Edges;
use super::disc::{INNER, Point, points};
use super::model::{EdgePriors, Model};
use super::observed::Observed;
use super::plane::{Normal, Plane};
use super::surface::{Surface, SurfaceRow};
use crate::fit::padded::{LANES, PAD, Padded};
use crate::one_surface::OneSurface;

/// Pixels of the largest disc.
const MOST_POINTS: usize = 176;

/// A pixel beside all that is observed has a variance of more than this many times that of the mean
/// of the disc: on a straight outline it has 3.6, in the corner of a square 8.3.
const BESIDE: f32 = 10.0;
/// Its own texture is that of the pixels around it, within so many px.
const AROUND_PX: f32 = 2.0;

/// So many blocks of 16 discs are a sample of all.
const SAMPLED_BLOCKS: usize = 128;
/// Multiples of it, modulo 1, are spread most evenly.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// A place of padded maps: the upper left one of the inner pixels of the first of sixteen discs.
#[derive(Clone, Copy)]
struct Place {
    row: usize,
    column: usize,
}

/// What was fitted to a disc.
struct Fitted<S: Simd> {
    plane: Plane<S>,
    averaged: Averaged<S>,
    /// Sum of the squared observations times their weights, and their number.
    squares: f32x16<S>,
    number: f32x16<S>,
    /// Sum of the weights of the inner pixels and their neighbours.
    around: f32x16<S>,
}

/// Discs of one size.
pub(super) struct Discs {
    points: Vec<Point>,
    /// Largest difference of guesses of one surface at each point, in px: for each px of distance the
    /// steepest slant more.
    slack_px: Vec<f32>,
    edges: Option<Edges>,
    /// Width of the map's pixels, in px of the image.
    pixel: f32,
    /// How many points are inner pixels or neighbours of them.
    inner: usize,
    /// Pixels beside all that is observed stay unknown if the mean precision of those around them
    /// is less, in 1/px^2.
    least_texture: f32,
}

impl Discs {
    /// Discs of this squared radius in pixels of the map, which are `pixel` px of the image wide;
    /// with edges if these are known before.
    pub(super) fn new(squared_radius: usize, edges: Option<EdgePriors>, model: &Model, pixel: f32) -> Self {
        let points = points(squared_radius);
        let slack_px =
            points.iter().map(|point| OneSurface::FINE.slack_px(pixel * point.distance())).collect();
        let edges = edges.map(|priors| {
            // Step edges are narrow against wide pixels.
            let at_edges = pixel > 1.0;
            Edges::new(&points, &priors, model.blur / (pixel * pixel), at_edges)
        });
        let inner = points.iter().filter(|point| point.distance() < AROUND_PX).count();
        Self { inner, points, slack_px, edges, pixel, least_texture: 0.0 }
    }

    /// The same, of which pixels beside all that is observed stay unknown if those around them have
    /// less texture than this: where the texture ends the surface may, too.
    pub(super) fn ending_with_the_texture(self, least_texture: f32) -> Self {
        Self { least_texture, ..self }
    }

    /// How much likelier each family of `edges` makes the observations of some discs than a plane
    /// alone, for a sample of so many blocks of 16 discs.
    pub(super) fn likelihoods(
        level: Level,
        observed: &Observed,
        squared_radius: usize,
        model: &Model,
        edges: EdgePriors,
    ) -> Vec<[f32; 3]> {
        let discs = Self::new(squared_radius, Some(edges), model, 1.0);
        let (pairs, blocks) = (observed.rows().div_ceil(2), observed.columns.div_ceil(2 * LANES));
        let count = SAMPLED_BLOCKS.min(pairs * blocks);
        let sampled = (0..count).into_par_iter().flat_map_iter(|index| {
            // Rows and columns are both spread evenly (a lattice of Fibonacci).
            let column = ((index as f64 * GOLDEN).fract() * blocks as f64) as usize;
            let place = Place { row: 2 * (index * pairs / count), column: PAD + 2 * LANES * column };
            dispatch!(level, simd => discs.likelihoods_of_block(simd, observed, place))
        });
        sampled.collect()
    }

    #[inline(always)]
    fn likelihoods_of_block<S: Simd>(&self, simd: S, observed: &Observed, place: Place) -> Vec<[f32; 3]> {
        let own = load_every_other(simd, &observed.guess, place);
        if own.is_nan().all_true() {
            return Vec::new();
        }
        let Fitted { plane, averaged, .. } = self.fitted::<S, true>(simd, observed, place, own);
        let over = averaged.families.map(|family| family / averaged.none);
        let known = |lane: usize| !own.as_slice()[lane].is_nan() && plane.known.as_slice()[lane] > 0.0;
        let lanes = (0..LANES).filter(|lane| known(*lane));
        lanes.map(|lane| over.each_ref().map(|family| family.as_slice()[lane])).collect()
    }

    /// How many pixels of the image a disc holds.
    pub(super) fn pixels(&self) -> f32 {
        self.points.len() as f32 * self.pixel * self.pixel
    }

    /// The surface at all pixels whose `guesses` are numbers; it stays unknown at the others.
    pub(super) fn surface(&self, level: Level, observed: &Observed, guesses: &Padded) -> Surface {
        // Slants carry disparities from wide pixels to narrow ones.
        let mut surface = Surface::unknown(observed.rows(), observed.columns, self.pixel > 1.0);
        surface.par_row_pairs().enumerate().for_each(|(pair, mut rows)| {
            if !observed.progress.cancelled() {
                dispatch!(level, simd => self.rows(simd, observed, guesses, 2 * pair, &mut rows));
            }
        });
        surface
    }

    #[inline(always)]
    fn rows<S: Simd>(
        &self,
        simd: S,
        observed: &Observed,
        guesses: &Padded,
        y: usize,
        rows: &mut [SurfaceRow<'_>],
    ) {
        for start in (PAD..guesses.stride - PAD).step_by(2 * LANES) {
            self.block(simd, observed, guesses, Place { row: y, column: start }, rows);
        }
    }

    /// The surface at 2 rows of 2 times 16 pixels. Where guesses among 2 x 2 pixels are of several
    /// surfaces, each has a round of its own.
    #[inline(always)]
    fn block<S: Simd>(
        &self,
        simd: S,
        observed: &Observed,
        guesses: &Padded,
        place: Place,
        rows: &mut [SurfaceRow<'_>],
    ) {
        let nothing = f32x16::splat(simd, f32::NAN);
        let mut open = [nothing; 4];
        for (open, pair) in open.chunks_exact_mut(2).zip(0..rows.len()) {
            let [even, odd] = load_pair(simd, guesses, Place { row: place.row + pair, ..place });
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
            let found = self.found(simd, observed, place, own);
            for (pair, row) in rows.iter_mut().enumerate() {
                let guesses = [open[2 * pair], open[2 * pair + 1]];
                let served = guesses.map(|guess| (guess - own).abs().simd_le(OneSurface::FINE.step_px));
                row.put(simd, place.column, served, [found[2 * pair], found[2 * pair + 1]]);
                for (side, served) in served.into_iter().enumerate() {
                    open[2 * pair + side] = served.select(nothing, guesses[side]);
                }
            }
        }
    }

    /// Disparity, variance, variance by place and slants at the inner pixels, for the surface of
    /// the guess `own`.
    #[inline(always)]
    fn found<S: Simd>(
        &self,
        simd: S,
        observed: &Observed,
        place: Place,
        own: f32x16<S>,
    ) -> [[f32x16<S>; 5]; 4] {
        let zero = f32x16::splat(simd, 0.0);
        let Fitted { plane, averaged, squares, number, around } =
            self.fitted::<S, false>(simd, observed, place, own);
        let left = squares - plane.explained_squares() - averaged.explained;
        let freedom = (number - 3.0).max(f32x16::splat(simd, 1.0));
        // Chance scatters the mean of squares by the root of 2 over their number.
        let one = f32x16::splat(simd, 1.0);
        let misfit = (left / (freedom + (freedom * 2.0).sqrt())).max(one);
        let known = plane.known.simd_gt(zero);
        // Texture of its own tells that the surface is there.
        let blank = around.simd_lt(self.least_texture * self.inner as f32);
        let infinite = f32x16::splat(simd, f32::INFINITY);
        let mut found = [[zero; 5]; 4];
        for ((found, inner), change) in found.iter_mut().zip(INNER).zip(averaged.changes) {
            let [a, b, c] = plane.place(simd, inner);
            let of_plane = a.mul_add(a, b.mul_add(b, c * c));
            let beside = (of_plane * plane.weight).simd_gt(BESIDE);
            let known = known & !(beside & blank);
            let variance = (of_plane + change.variance) * misfit;
            *found = [
                known.select(own + plane.at(inner) + change.shift, own),
                known.select(variance, infinite),
                known.select(change.by_place, zero),
                known.select(plane.slants[0], zero),
                known.select(plane.slants[1], zero),
            ];
        }
        found
    }

    /// The plane through the observations of a disc, and the average over edges.
    #[inline(always)]
    fn fitted<S: Simd, const COUNTS: bool>(
        &self,
        simd: S,
        observed: &Observed,
        place: Place,
        own: f32x16<S>,
    ) -> Fitted<S> {
        let zero = f32x16::splat(simd, 0.0);
        let mut weights = [zero; MOST_POINTS];
        let mut moments = [zero; MOST_POINTS];
        let mut normal = Normal::prior(simd);
        let [mut squares, mut number, mut around] = [zero; 3];
        for (index, point) in self.points.iter().enumerate() {
            // Rows above the image come out as huge numbers.
            let row = place.row.wrapping_add_signed(point.row);
            if row >= observed.rows() {
                continue;
            }
            let at = Place { row, column: place.column.wrapping_add_signed(point.column) };
            let guess = load_every_other(simd, &observed.guess, at);
            let near = (guess - own).abs().simd_le(self.slack_px[index]);
            let weight = near.select(load_every_other(simd, &observed.precision, at), zero);
            let value = load_every_other(simd, &observed.value, at) - own;
            let moment = weight * value;
            squares = moment.mul_add(value, squares);
            if point.distance() < AROUND_PX {
                around += weight;
            }
            number += weight.simd_gt(zero).select(f32x16::splat(simd, 1.0), zero);
            normal.add((point.x, point.y), weight, moment);
            (weights[index], moments[index]) = (weight, moment);
        }
        let plane = normal.solve(simd);
        let count = self.points.len();
        let observations = (&weights[..count], &moments[..count]);
        let averaged = match &self.edges {
            Some(edges) => edges.average::<S, COUNTS>(simd, &plane, &self.points, observations),
            None => Averaged::none(simd),
        };
        Fitted { plane, averaged, squares, number, around }
    }
}

/// Every other value of a row, from `place` on.
#[inline(always)]
fn load_every_other<S: Simd>(simd: S, map: &Padded, place: Place) -> f32x16<S> {
    load_pair(simd, map, place)[0]
}

/// Every other value of a row, from `place` on and from the next place on.
#[inline(always)]
fn load_pair<S: Simd>(simd: S, map: &Padded, Place { row, column }: Place) -> [f32x16<S>; 2] {
    let row = &map.row(row)[column..column + 2 * LANES];
    let (first, second) = row.split_at(LANES);
    let (even, odd) = f32x16::from_slice(simd, first).deinterleave(f32x16::from_slice(simd, second));
    [even, odd]
}
