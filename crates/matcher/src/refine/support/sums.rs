//! Sums over the observations that belong to the pixels of a block, for one window or for several nested
//! ones.
//!
//! Whether a neighbour belongs depends on its place only, not on the window. So windows of equal length and
//! different width are summed together: a wider window adds two lines along its length to the next narrower
//! one.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, f32x16};

use super::rule::{LEAST_SLANT_SPREAD, SupportRule};
use crate::options::LARGEST_FIT_WINDOW_PX;
use crate::refine::padded::Padded;
use crate::refine::planes::{ObservationMaps, SurfacePlanes};

/// Lines of the longest window.
pub(super) const LONGEST: usize = LARGEST_FIT_WINDOW_PX;

/// Neighbours belong in part: at the allowed difference half of an observation counts, and over this share of
/// it (in squares) the weight falls from all to none. So a small change of the input changes the result by
/// little.
const FADING: f32 = 0.5;

/// By how much a neighbour may differ.
#[derive(Debug, Clone, Copy)]
struct Allowance {
    /// Variance of the pixel's plane at the neighbour over that in its middle.
    growth: f32,
    /// Squared number of sigmas.
    limit: f32,
    /// Square of the slack, in px^2.
    slack_squared: f32,
    /// Factor from the squared difference of slants to a variance of disparities, in px^2; zero where slants
    /// are not known.
    slant_spread: f32,
}

/// The allowance at each place of the widest window, row by row.
#[derive(Debug)]
pub(super) struct Allowances {
    reach: (usize, usize),
    places: Vec<Allowance>,
}

impl Allowances {
    pub(super) fn of(rule: SupportRule) -> Self {
        let (reach_u, reach_v) = rule.reach;
        let limit = rule.belongs_sigmas * rule.belongs_sigmas;
        let (columns, rows) = (offsets(reach_u), offsets(reach_v));
        let place = |u: f32, v: f32| {
            let slack = rule.slack.0 + rule.slack.1 * u.abs().max(v.abs());
            // A pixel belongs to itself whatever is known of it.
            let slack_squared = if u == 0.0 && v == 0.0 { f32::INFINITY } else { slack * slack };
            let slants_tell = rule.slants_known && slack_squared.is_finite();
            Allowance {
                growth: 1.0 + (u * u + v * v) / rule.slant_spread,
                limit,
                slack_squared,
                slant_spread: if slants_tell { LEAST_SLANT_SPREAD } else { 0.0 },
            }
        };
        let places = rows.flat_map(|v| columns.clone().map(move |u| place(u, v))).collect();
        Self { reach: rule.reach, places }
    }
}

/// Places from -`reach` to `reach`.
fn offsets(reach: usize) -> impl Iterator<Item = f32> + Clone {
    (0..=2 * reach).map(move |index| offset(index, reach))
}

/// Place of line `index` of a window.
pub(super) fn offset(index: usize, reach: usize) -> f32 {
    index as f32 - reach as f32
}

/// Weights, moments, and weights times the place along the line, of one column or row of a window.
pub(super) type Line<S> = [f32x16<S>; 3];

/// Sums over one window.
pub(super) struct WindowSums<'a, S: Simd> {
    /// Number of observations.
    pub(super) count: f32x16<S>,
    /// Weights times how far the observations belong.
    pub(super) belonging: f32x16<S>,
    pub(super) columns: &'a [Line<S>],
    pub(super) rows: &'a [Line<S>],
}

/// Sums over the observations that belong to the pixels of a block. The widest window has at most `N` lines
/// along its length; each other one is one pixel narrower on both sides than the next.
pub(super) struct Sums<S: Simd, const N: usize, const WINDOWS: usize> {
    counts: [f32x16<S>; WINDOWS],
    belonging: [f32x16<S>; WINDOWS],
    /// Lines along the length of the widest window.
    along: [Line<S>; N],
    /// Lines across, for each window.
    across: [[Line<S>; LONGEST]; WINDOWS],
    reach: (usize, usize),
}

impl<S: Simd, const N: usize, const WINDOWS: usize> Sums<S, N, WINDOWS> {
    #[inline(always)]
    pub(super) fn none(simd: S) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        Self {
            counts: [zero; WINDOWS],
            belonging: [zero; WINDOWS],
            along: [[zero; 3]; N],
            across: [[[zero; 3]; LONGEST]; WINDOWS],
            reach: (0, 0),
        }
    }

    /// The sums of the window with this index, narrowest first.
    #[inline(always)]
    pub(super) fn of_window<const TURNED: bool>(&self, window: usize) -> WindowSums<'_, S> {
        let (narrow, long) = if TURNED { (self.reach.1, self.reach.0) } else { self.reach };
        let left_out = WINDOWS - 1 - window;
        let along = &self.along[left_out..2 * narrow + 1 - left_out];
        let across = &self.across[window][..2 * long + 1];
        let (columns, rows) = if TURNED { (across, along) } else { (along, across) };
        WindowSums { count: self.counts[window], belonging: self.belonging[window], columns, rows }
    }

    /// Sums anew, for the block of row `y` from place `start` on. The widest window is longest along its
    /// columns, or with `TURNED` along its rows.
    #[inline(always)]
    pub(super) fn take<const TURNED: bool>(
        &mut self,
        simd: S,
        (observations, map): (&ObservationMaps, &SurfacePlanes),
        allowances: &Allowances,
        y: usize,
        start: usize,
    ) {
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let rows = observations.rows();
        let block = Block::of(simd, map, y, start);
        let (reach_u, reach_v) = allowances.reach;
        self.reach = allowances.reach;
        let (narrow, long) = if TURNED { (reach_v, reach_u) } else { (reach_u, reach_v) };
        // A constant lets the loops over sides be unrolled.
        let narrow = if N < LONGEST { N / 2 } else { narrow };
        let mut along = [[zero; 3]; N];
        let (mut counts, mut belonging) = ([zero; WINDOWS], [zero; WINDOWS]);
        for across in 0..=2 * long {
            let mut line = [zero; 3];
            let (mut count, mut belongs) = (zero, zero);
            for (window, (counted, belonging)) in counts.iter_mut().zip(&mut belonging).enumerate() {
                // The narrowest window whole, then the sides that each other one has more.
                let left_out = WINDOWS - 1 - window;
                let last = 2 * narrow - left_out;
                let step = if window == 0 { 1 } else { last - left_out };
                let mut side = left_out;
                while side <= last {
                    let (column, row) = if TURNED { (across, side) } else { (side, across) };
                    let offset = (offset(column, reach_u), offset(row, reach_v));
                    let allowance = allowances.places[row * (2 * reach_u + 1) + column];
                    // Rows above the image come out as huge numbers.
                    let (row, place) = ((y + row).wrapping_sub(reach_v), start + column - reach_u);
                    if row < rows {
                        let (share, observation) =
                            block.belonging(simd, (observations, map), offset, (row, place), allowance);
                        belongs = share.mul_add(observation[0], belongs);
                        count += observation[0].simd_gt(zero).select(one, zero);
                        let (u, v) = offset;
                        add(&mut line, observation, if TURNED { v } else { u });
                        add(&mut along[side], observation, if TURNED { u } else { v });
                    }
                    side += step;
                }
                self.across[window][across] = line;
                *counted += count;
                *belonging += belongs;
            }
        }
        self.along = along;
        self.counts = counts;
        self.belonging = belonging;
    }
}

#[inline(always)]
fn add<S: Simd>(line: &mut Line<S>, [weight, moment]: [f32x16<S>; 2], place: f32) {
    line[0] += weight;
    line[1] += moment;
    line[2] = weight.mul_add(place, line[2]);
}

#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, plane: &Padded, row: usize, place: usize) -> f32x16<S> {
    f32x16::from_slice(simd, plane.block(row, place))
}

/// The planes of a block of pixels.
struct Block<S: Simd> {
    disparity: f32x16<S>,
    slant_x: f32x16<S>,
    slant_y: f32x16<S>,
    variance: f32x16<S>,
}

impl<S: Simd> Block<S> {
    #[inline(always)]
    fn of(simd: S, map: &SurfacePlanes, y: usize, start: usize) -> Self {
        let own = |plane: &Padded| load(simd, plane, y, start);
        Self {
            disparity: own(&map.disparity),
            slant_x: own(&map.slant_x),
            slant_y: own(&map.slant_y),
            variance: own(&map.variance),
        }
    }

    /// How far the neighbours belong, and their weights and moments as far as they do, of those that lie `u`
    /// columns and `v` rows away, in `row` from `place` on.
    #[inline(always)]
    fn belonging(
        &self,
        simd: S,
        (observations, map): (&ObservationMaps, &SurfacePlanes),
        (u, v): (f32, f32),
        (row, place): (usize, usize),
        allowance: Allowance,
    ) -> (f32x16<S>, [f32x16<S>; 2]) {
        let zero = f32x16::splat(simd, 0.0);
        let load = |plane: &Padded| load(simd, plane, row, place);
        let expected = self.slant_x.mul_add(u, self.slant_y.mul_add(v, self.disparity));
        let difference = load(&map.disparity) - expected;
        let others = load(&map.variance);
        let variance = self.variance * allowance.growth + others;
        let allowed = variance.mul_add(allowance.limit, f32x16::splat(simd, allowance.slack_squared));
        let mut over = difference * difference / allowed;
        if allowance.slant_spread > 0.0 {
            // Faces that meet at a crease differ in slant, and next to it in nothing else.
            let (p, q) = (load(&map.slant_x) - self.slant_x, load(&map.slant_y) - self.slant_y);
            let apart = p.mul_add(p, q * q) * allowance.slant_spread;
            over = over.max(apart / ((self.variance + others) * allowance.limit));
        }
        let share = ((over - 1.0) * (-1.0 / FADING) + 0.5).max(zero).min(f32x16::splat(simd, 1.0));
        let weight = share * load(&observations.weight);
        // The observation less the pixel's own disparity.
        let moment = share * load(&observations.moment) - weight * self.disparity;
        (share, [weight, moment])
    }
}
