//! Lattices of corner candidates: neighbours along their edges, with alternating colours and an edge between
//! them.

use std::collections::{BTreeMap, VecDeque};
use std::f64::consts::PI;

use super::detect::{Candidate, Scene};
use super::sampling::bilinear;

/// Side of the cells by which candidates are found, in px.
const CELL_PX: f64 = 24.0;
/// A neighbour is looked for this far, as a share of the image's longer side: boards of 2 x 2 corners fill
/// it.
const REACH: f64 = 0.3;
/// Edges are followed in steps of this, in px ...
const EDGE_STEP_PX: f64 = 3.0;
/// ... and a neighbour is looked for a little beyond, since an edge is lost where corners are blurred.
const BEYOND_EDGE: f64 = 1.3;
/// A neighbour lies within this of an edge's direction, in rad (12 deg): that of smoothed second derivatives
/// is known to some 3 deg.
const ALONG_RAD: f64 = 0.21;
/// Edges of neighbours differ by less than this, in rad (25 deg): perspective turns them by some degrees from
/// square to square.
const ALIKE_RAD: f64 = 0.44;
/// A neighbour lies within this share of a step of where its neighbours expect it.
const EXPECTED: f64 = 0.3;
/// From one step to the next a length changes by at most this factor: at 40 deg of tilt, and a camera as far
/// as three squares.
const STEP_RATIO: f64 = 1.6;
/// The step across an edge between two corners is at least this share of their own.
const LEAST_EDGE: f64 = 0.35;
/// Less corners than this are no part of a board: texture has pairs and squares of saddles by chance.
pub(super) const LEAST_CORNERS: usize = 6;

/// Where corners are, in px, by column and row, both from an arbitrary zero. Column to row turns as x to y.
pub(super) type Lattice = BTreeMap<(i32, i32), (f64, f64)>;

struct Growing<'a> {
    scene: &'a Scene,
    cells: BTreeMap<(i32, i32), Vec<usize>>,
    reach_px: f64,
    taken: Vec<bool>,
}

/// Difference of two directions, 0 to pi / 2.
fn apart(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(PI);
    difference.min(PI - difference)
}

fn cell(x: f64, y: f64) -> (i32, i32) {
    ((x / CELL_PX) as i32, (y / CELL_PX) as i32)
}

/// All lattices of at least [`LEAST_CORNERS`] corners, the largest first. No corner is in two.
pub(super) fn lattices(scene: &Scene) -> Vec<Lattice> {
    let mut cells: BTreeMap<(i32, i32), Vec<usize>> = BTreeMap::new();
    for (index, candidate) in scene.candidates.iter().enumerate() {
        cells.entry(cell(candidate.x, candidate.y)).or_default().push(index);
    }
    let longer = scene.smooth.rows().max(scene.smooth.columns()) as f64;
    let taken = vec![false; scene.candidates.len()];
    let mut growing = Growing { scene, cells, reach_px: REACH * longer, taken };
    let mut found = Vec::new();
    for seed in 0..scene.candidates.len() {
        if growing.taken[seed] || !growing.has_edges(seed) {
            continue;
        }
        let members = growing.grow(seed);
        if members.len() >= LEAST_CORNERS {
            members.values().for_each(|&index| growing.taken[index] = true);
            let place = |&index: &usize| (scene.candidates[index].x, scene.candidates[index].y);
            found.push(members.iter().map(|(&at, index)| (at, place(index))).collect());
        }
    }
    found.sort_by_key(|lattice: &Lattice| std::cmp::Reverse(lattice.len()));
    found
}

impl Growing<'_> {
    fn candidate(&self, index: usize) -> &Candidate {
        &self.scene.candidates[index]
    }

    /// Bright less dark across the line at (x, y) along `direction`, `aside` px to either side: positive if
    /// the brighter one comes after it as angles grow.
    fn across(&self, (x, y): (f64, f64), direction: f64, aside: f64) -> f32 {
        let (sin, cos) = direction.sin_cos();
        let at = |side: f64| bilinear(&self.scene.smooth, x - side * sin, y + side * cos);
        at(aside) - at(-aside)
    }

    /// Whether all four edges go on beyond the ring that detection has looked at.
    fn has_edges(&self, index: usize) -> bool {
        let corner = self.candidate(index);
        let arms = [
            (corner.before_bright_rad, 1.0),
            (corner.before_bright_rad + PI, 1.0),
            (corner.before_dark_rad, -1.0),
            (corner.before_dark_rad + PI, -1.0),
        ];
        let steps = arms.map(|(direction, sign)| {
            let (sin, cos) = direction.sin_cos();
            sign * self.across((corner.x + 5.0 * cos, corner.y + 5.0 * sin), direction, 2.0)
        });
        let largest = steps.into_iter().fold(0.0, f32::max);
        steps.into_iter().all(|step| step > LEAST_EDGE as f32 * largest)
    }

    /// Whether `to` can be the neighbour of `from`: each has an edge along the line between them, of the
    /// other kind, and the edge is there.
    fn are_neighbours(&self, from: usize, to: usize) -> bool {
        let (a, b) = (self.candidate(from), self.candidate(to));
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let (direction, length) = (dy.atan2(dx), dx.hypot(dy));
        let bright_first = apart(a.before_bright_rad, direction) < apart(a.before_dark_rad, direction);
        let (near, far, sign) = if bright_first {
            ((a.before_bright_rad, b.before_dark_rad), (a.before_dark_rad, b.before_bright_rad), 1.0)
        } else {
            ((a.before_dark_rad, b.before_bright_rad), (a.before_bright_rad, b.before_dark_rad), -1.0)
        };
        if apart(near.0, direction) > ALONG_RAD
            || apart(near.1, direction) > ALONG_RAD
            || apart(far.0, far.1) > ALIKE_RAD
        {
            return false;
        }
        let aside = (0.2 * length).clamp(1.5, 6.0);
        let steps = [0.3, 0.5, 0.7]
            .map(|share| sign * self.across((a.x + share * dx, a.y + share * dy), direction, aside));
        let largest = steps.into_iter().fold(0.0, f32::max);
        // Against the steps farther along: a line through texture has steps of either sign and any size.
        largest > 0.0 && steps.into_iter().all(|step| step > LEAST_EDGE as f32 * largest)
    }

    fn near(&self, (x, y): (f64, f64), radius: f64) -> impl Iterator<Item = usize> + '_ {
        let (first, last) = (cell(x - radius, y - radius), cell(x + radius, y + radius));
        (first.1..=last.1)
            .flat_map(move |row| (first.0..=last.0).map(move |column| (column, row)))
            .filter_map(|at| self.cells.get(&at))
            .flatten()
            .copied()
            .filter(move |&index| {
                let candidate = self.candidate(index);
                let (dx, dy) = (candidate.x - x, candidate.y - y);
                !self.taken[index] && dx * dx + dy * dy <= radius * radius
            })
    }

    /// How far the edge from `from` along `direction` keeps its colours, in px: up to the next corner. `sign`
    /// is 1 if a bright square follows it, -1 if a dark one does.
    fn edge_px(&self, from: usize, direction: f64, sign: f32) -> f64 {
        let corner = self.candidate(from);
        let (sin, cos) = direction.sin_cos();
        let mut along = 4.0;
        // Aside by 6 deg and more, since directions are not known better.
        while along < self.reach_px {
            let aside = (0.1 * along).max(2.0);
            if sign * self.across((corner.x + along * cos, corner.y + along * sin), direction, aside) <= 0.0 {
                break;
            }
            along += EDGE_STEP_PX;
        }
        along
    }

    /// The nearest neighbour from `from` along `direction`; `sign` as in [`Self::edge_px`].
    fn first_along(&self, from: usize, direction: f64, sign: f32) -> Option<usize> {
        let corner = self.candidate(from);
        let radius = BEYOND_EDGE * self.edge_px(from, direction, sign) + 2.0 * EDGE_STEP_PX;
        let mut ahead: Vec<(f64, usize)> = self
            .near((corner.x, corner.y), radius)
            .filter(|&index| index != from)
            .filter_map(|index| {
                let (dx, dy) = (self.candidate(index).x - corner.x, self.candidate(index).y - corner.y);
                let turned = (dy.atan2(dx) - direction + PI).rem_euclid(2.0 * PI) - PI;
                (turned.abs() < ALONG_RAD).then_some((dx.hypot(dy), index))
            })
            .collect();
        ahead.sort_by(|a, b| a.0.total_cmp(&b.0));
        ahead.into_iter().map(|(_, index)| index).find(|&index| self.are_neighbours(from, index))
    }

    /// The lattice around a candidate, itself at (0, 0).
    fn grow(&self, seed: usize) -> BTreeMap<(i32, i32), usize> {
        let corner = self.candidate(seed);
        let first = corner.before_bright_rad;
        // From columns to rows as from x to y.
        let second = first + (corner.before_dark_rad - first).rem_euclid(PI);
        let mut members = BTreeMap::from([((0, 0), seed)]);
        let arms = [
            ((1, 0), first, 1.0),
            ((-1, 0), first + PI, 1.0),
            ((0, 1), second, -1.0),
            ((0, -1), second + PI, -1.0),
        ];
        for (offset, direction, sign) in arms {
            let neighbour = self.first_along(seed, direction, sign);
            if let Some(index) = neighbour.filter(|index| !members.values().any(|member| member == index)) {
                members.insert(offset, index);
            }
        }
        let has = |at| members.contains_key(&at);
        if !((has((1, 0)) || has((-1, 0))) && (has((0, 1)) || has((0, -1)))) {
            return BTreeMap::new();
        }
        let mut queue: VecDeque<(i32, i32)> = members.keys().copied().collect();
        while let Some(at) = queue.pop_front() {
            for (di, dj) in [(1, 0), (0, 1), (-1, 0), (0, -1)] {
                let to = (at.0 + di, at.1 + dj);
                if members.contains_key(&to) {
                    continue;
                }
                if let Some(index) = self.expected(&members, at, (di, dj)) {
                    members.insert(to, index);
                    queue.push_back(to);
                }
            }
        }
        members
    }

    /// The candidate one step from `at`, where the steps behind it and beside it lead.
    fn expected(
        &self,
        members: &BTreeMap<(i32, i32), usize>,
        at: (i32, i32),
        step: (i32, i32),
    ) -> Option<usize> {
        let place = |at: (i32, i32)| {
            members.get(&at).map(|&index| (self.candidate(index).x, self.candidate(index).y))
        };
        let between = |from, to| Some((place(from)?, place(to)?)).map(|(a, b)| (b.0 - a.0, b.1 - a.1));
        let from = *members.get(&at)?;
        let behind = between((at.0 - step.0, at.1 - step.1), at);
        let beside = [1, -1].into_iter().find_map(|side| {
            let other = (at.0 + side * step.1, at.1 + side * step.0);
            between(other, (other.0 + step.0, other.1 + step.1))
        });
        let (dx, dy) = behind.or(beside)?;
        let length = dx.hypot(dy);
        let start = self.candidate(from);
        let expected = (start.x + dx, start.y + dy);
        let distance =
            |index: usize| (self.candidate(index).x - expected.0).hypot(self.candidate(index).y - expected.1);
        self.near(expected, EXPECTED * length)
            .filter(|&index| {
                let found = self.candidate(index);
                let ratio = (found.x - start.x).hypot(found.y - start.y) / length;
                index != from
                    && (1.0 / STEP_RATIO..STEP_RATIO).contains(&ratio)
                    && self.are_neighbours(from, index)
                    && !members.values().any(|&member| member == index)
            })
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
    }
}
