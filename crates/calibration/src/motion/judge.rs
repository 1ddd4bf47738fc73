//! From shifts of blocks to what is wrong.

use rayon::prelude::*;

use super::along;
use super::blocks::{Shift, shifts};
use super::doubt::{Doubt, Motion};
use super::order::Distances;
use super::reduced::Reduced;
use crate::texture_motion::in_usual_steps;
use epirig_core::statistics::median;

/// A block moves if it goes at least so far, in reduced pixels.
const MOVES_PX: f32 = 0.5;
/// A shift of this size tells its direction well.
const CLEAR_PX: f32 = 1.5;
/// Nothing moves if all blocks stay within this.
const STAYS_PX: f32 = 0.1;
/// Fewest blocks that speak for a motion, and for a scene that is seen at all.
const FEWEST_MOVING: usize = 3;
const FEWEST_SEEN: usize = 8;
/// Frames show another scene if no more than this share of the usual number of blocks is found again.
const FOREIGN_SHARE: f64 = 0.2;
/// A part of the frames is compared with so many others.
const COMPARED: usize = 16;
/// Share of the pairs whose shift has to be clear, or pairs farther apart are tried.
const CLEAR_SHARE: f64 = 0.75;
/// Pairs of frames that are looked at for a direction.
const PAIRS: usize = 12;
/// Vertical motion of this share of the horizontal one is not along the rows (11 degrees) ...
const OBLIQUE: f32 = 0.2;
/// ... and vertical if it is so many times as large.
const VERTICAL: f32 = 4.0;
/// Shifts agree if at least this share of the pairs can be measured ...
const MEASURED_SHARE: f64 = 0.6;
/// (no other order is looked for if this share can) ...
const SURE_SHARE: f64 = 0.9;
/// ... and at most this share of those goes the other way.
const AGAINST_SHARE: f64 = 0.05;
/// Another order is better if its path is shorter than this share of the given one.
const SHORTER: f32 = 0.8;
/// Cells of the picture that are compared where nothing seems to move, and how much more they may change.
const CELL: usize = 16;
const CHANGES: f32 = 1.5;

/// The shift of what moves between two frames.
type Moved = Option<Shift>;

pub(super) struct Judge<'a> {
    frames: Vec<(usize, &'a Reduced)>,
}

impl<'a> Judge<'a> {
    pub(super) fn new(frames: &'a [Reduced]) -> Self {
        Self { frames: frames.iter().enumerate().collect() }
    }

    pub(super) fn order(&self) -> Vec<usize> {
        let path = self.distances().short_path();
        path.into_iter().map(|place| self.frames[place].0).collect()
    }

    pub(super) fn motion(mut self, places: Option<&[f64]>) -> Motion {
        let mut motion = Motion::default();
        if self.frames.len() < 2 {
            return motion;
        }
        let shifts = self.shifts();
        let foreign = self.foreign(&shifts);
        let mut moved: Vec<Moved> = shifts.iter().map(|shifts| moving(shifts)).collect();
        if !foreign.is_empty() {
            self.frames.retain(|(number, _)| !foreign.contains(number));
            moved = self.shifts().iter().map(|shifts| moving(shifts)).collect();
            motion.doubts.push(Doubt::Foreign(foreign));
        }
        if self.is_still() {
            motion.doubts.push(Doubt::Still);
            motion.step_px = Some((0.0, 0.0));
            return motion;
        }
        let given: Vec<usize> = (0..self.frames.len()).collect();
        let mut seen = self.clear_shifts(&given);
        let is_sure = seen.agree() && seen.measured() >= SURE_SHARE;
        if let Some((path, ordered)) = if is_sure { None } else { self.better_order(&given) } {
            motion.doubts.push(self.disorder(path));
            seen = ordered;
        } else if let Some(place) = single_turn(&moved, &seen).filter(|_| seen.agree()) {
            motion.doubts.push(Doubt::TurnsRound(self.frames[place].0));
        }
        let Some((x, y)) = seen.usual() else { return motion };
        let pixels = self.frames[0].1.factor as f64 / seen.stride as f64;
        let signed = |axis: fn(&Shift) -> f32| f64::from(median_of(seen.moved.iter().flatten().map(axis)));
        motion.step_px = Some((signed(|shift| shift.0) * pixels, signed(|shift| shift.1) * pixels));
        if y > VERTICAL * x && y >= MOVES_PX {
            motion.doubts.push(Doubt::Vertical);
            return motion;
        }
        let followed = if motion.doubts.is_empty() { along::measured(&self.frames) } else { None };
        if let Some(Err(other)) = followed {
            motion.doubts.push(other);
        } else if let Some(Ok((followed, looked))) = followed {
            let numbers: Vec<usize> = looked.iter().map(|&place| self.frames[place].0).collect();
            let given = places.map(|places| {
                let places = in_usual_steps(places);
                numbers.iter().filter_map(|&number| places.get(number).copied()).collect::<Vec<f64>>()
            });
            if given.as_ref().is_none_or(|given| given.len() == numbers.len()) {
                motion.doubts.extend(along::doubts(&followed, &numbers, given.as_deref()));
            }
        } else if y > OBLIQUE * x && y >= MOVES_PX {
            let degrees = (signed(|shift| shift.1) / signed(|shift| shift.0)).atan().to_degrees();
            motion.doubts.push(Doubt::Oblique { degrees, drift_px: None });
        }
        motion
    }

    /// Shifts between neighbours.
    fn shifts(&self) -> Vec<Vec<Shift>> {
        self.frames.par_windows(2).map(|pair| shifts(pair[0].1, pair[1].1)).collect()
    }

    fn distances(&self) -> Distances {
        Distances::of(&self.frames.iter().map(|frame| frame.1).collect::<Vec<_>>())
    }

    /// Frames that do not show what most show. `shifts` are those between neighbours.
    fn foreign(&self, shifts: &[Vec<Shift>]) -> Vec<usize> {
        let count = self.frames.len();
        let usual = median_of(shifts.iter().map(|shifts| shifts.len() as f32));
        let is_break = |shifts: &[Shift]| (shifts.len() as f64) < FOREIGN_SHARE * f64::from(usual);
        if count < 4 || (usual as usize) < FEWEST_SEEN {
            return Vec::new();
        }
        let mut parts: Vec<Vec<usize>> = vec![vec![0]];
        for (index, shifts) in shifts.iter().enumerate() {
            match parts.last_mut() {
                Some(part) if !is_break(shifts) => part.push(index + 1),
                _ => parts.push(vec![index + 1]),
            }
        }
        // A disorder breaks everywhere.
        if parts.len() == 1 || parts.len() > 3 + count / 5 {
            return Vec::new();
        }
        let Some(main) = (0..parts.len()).max_by_key(|&part| parts[part].len()) else { return Vec::new() };
        let mut known = parts.remove(main);
        // In disorder a part may share nothing with its neighbours, and much with others.
        let belongs = |known: &[usize], part: &[usize]| {
            let some = known.iter().step_by(known.len().div_ceil(COMPARED)).chain([&known[known.len() - 1]]);
            let pairs: Vec<_> =
                some.flat_map(|&known| [part[0], part[part.len() - 1]].map(|end| (known, end))).collect();
            pairs.par_iter().any(|&(known, end)| {
                !is_break(&super::blocks::shifts(self.frames[known].1, self.frames[end].1))
            })
        };
        while let Some(part) = parts.iter().position(|part| belongs(&known, part)) {
            known.append(&mut parts.remove(part));
            known.sort_unstable();
        }
        let mut foreign = parts.concat();
        foreign.sort_unstable();
        if 2 * foreign.len() >= count { Vec::new() } else { foreign }
    }

    /// Whether nothing moves from one end to the other, and nothing changes in another way.
    fn is_still(&self) -> bool {
        let last = self.frames.len() - 1;
        let far = [(0, last), (0, last / 2), (last / 4, last - last / 4)];
        far.iter().all(|&(from, to)| {
            let found = shifts(self.frames[from].1, self.frames[to].1);
            let stays = |shift: &Shift| shift.0.abs().max(shift.1.abs()) <= STAYS_PX;
            from == to || (found.len() >= FEWEST_SEEN && found.iter().all(stays))
        }) && !self.changes(last)
    }

    /// Whether a part of the picture changes more towards the frame `last` than from frame to frame.
    fn changes(&self, last: usize) -> bool {
        let near = cell_changes(self.frames[0].1, self.frames[1].1);
        let far = cell_changes(self.frames[0].1, self.frames[last].1);
        let usual = median_of(near.iter().copied());
        near.iter().zip(&far).any(|(near, far)| *far > CHANGES * near.max(usual) + 0.05)
    }

    /// Shifts over so many frames of the path that most of them are clear.
    fn clear_shifts(&self, path: &[usize]) -> Seen {
        let mut best = Seen { stride: 1, moved: Vec::new() };
        let mut stride = 1;
        while stride < path.len() {
            let starts = path.len() - stride;
            let count = starts.min(PAIRS);
            let pairs: Vec<usize> =
                (0..count).map(|index| index * (starts - 1) / (count - 1).max(1)).collect();
            let shift = |from: usize, to: usize| moving(&shifts(self.frames[from].1, self.frames[to].1));
            let moved = pairs.par_iter().map(|&start| shift(path[start], path[start + stride])).collect();
            let seen = Seen { stride, moved };
            if seen.clear() > best.clear() || best.moved.is_empty() {
                best = seen;
            }
            if best.clear() >= CLEAR_SHARE {
                break;
            }
            stride *= 2;
        }
        best
    }

    /// Another order in which shifts agree, and each frame is clearly more like the next.
    fn better_order(&self, given: &[usize]) -> Option<(Vec<usize>, Seen)> {
        if given.len() < 4 {
            return None;
        }
        let distances = self.distances();
        let path = distances.short_path();
        if distances.length(&path) >= SHORTER * distances.length(given) {
            return None;
        }
        let seen = self.clear_shifts(&path);
        seen.agree().then_some((path, seen))
    }

    /// What `path`, a better order, says of the given one.
    fn disorder(&self, path: Vec<usize>) -> Doubt {
        let mut ranks = vec![0; path.len()];
        path.iter().enumerate().for_each(|(rank, &place)| ranks[place] = rank);
        let rises = |place: usize| ranks[place + 1] > ranks[place];
        // Ranks that rise and then fall are a motion there and back. Frames at the same place come in any order.
        let turns =
            (1..ranks.len() - 1).filter(|&place| rises(place) != rises(place - 1)).collect::<Vec<_>>();
        match turns[..] {
            [turn] => Doubt::TurnsRound(self.frames[turn].0),
            _ => Doubt::Disorder(path.into_iter().map(|place| self.frames[place].0).collect()),
        }
    }
}

/// Shifts between pairs of frames.
struct Seen {
    /// Frames from one of a pair to the other.
    stride: usize,
    moved: Vec<Moved>,
}

impl Seen {
    /// Share of the pairs whose shift is clear.
    fn clear(&self) -> f64 {
        let size = |shift: &&Shift| shift.0.abs().max(shift.1.abs()) >= CLEAR_PX;
        self.moved.iter().flatten().filter(size).count() as f64 / self.moved.len().max(1) as f64
    }

    /// Share of the pairs whose shift could be measured.
    fn measured(&self) -> f64 {
        self.moved.iter().flatten().count() as f64 / self.moved.len().max(1) as f64
    }

    /// Usual sizes of shifts along rows and columns, if enough could be measured.
    fn usual(&self) -> Option<(f32, f32)> {
        let known: Vec<&Shift> = self.moved.iter().flatten().collect();
        let axis = |axis: fn(&Shift) -> f32| median_of(known.iter().map(|shift| axis(shift).abs()));
        let enough = !known.is_empty() && 4 * known.len() >= self.moved.len();
        enough.then(|| (axis(|shift| shift.0), axis(|shift| shift.1)))
    }

    /// A shift along the axis of the motion.
    fn along(&self, shift: Shift) -> f32 {
        if self.usual().is_some_and(|(x, y)| y > x) { shift.1 } else { shift.0 }
    }

    /// Whether shifts go one way.
    fn agree(&self) -> bool {
        let steps: Vec<f32> = self.moved.iter().flatten().map(|&shift| self.along(shift)).collect();
        let forward = steps.iter().filter(|&&step| step > 0.0).count();
        let against = forward.min(steps.len() - forward);
        self.measured() >= MEASURED_SHARE && against as f64 <= AGAINST_SHARE * steps.len() as f64
    }
}

/// The frame from which the picture goes back to the next, while it goes on between all others.
fn single_turn(moved: &[Moved], seen: &Seen) -> Option<usize> {
    let steps: Vec<(usize, f32)> =
        moved.iter().enumerate().filter_map(|(place, shift)| Some((place, seen.along((*shift)?)))).collect();
    let usual = median_of(steps.iter().map(|step| step.1));
    let back: Vec<usize> =
        steps.iter().filter(|(_, step)| step * usual < -0.25 * usual * usual).map(|step| step.0).collect();
    match back[..] {
        [place] if usual.abs() >= MOVES_PX && 2 * steps.len() > moved.len() => Some(place),
        _ => None,
    }
}

/// The shift of the blocks that move.
fn moving(shifts: &[Shift]) -> Moved {
    let moving: Vec<&Shift> =
        shifts.iter().filter(|shift| shift.0.abs().max(shift.1.abs()) >= MOVES_PX).collect();
    let axis = |axis: fn(&Shift) -> f32| median_of(moving.iter().map(|shift| axis(shift)));
    (moving.len() >= FEWEST_MOVING).then(|| (axis(|shift| shift.0), axis(|shift| shift.1)))
}

/// Root mean square changes of the cells of a picture.
fn cell_changes(from: &Reduced, to: &Reduced) -> Vec<f32> {
    let (from, to) = (&from.fine, &to.fine);
    let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len().max(1) as f32;
    let light = mean(from.values()) / mean(to.values()).max(1e-3);
    let cells =
        (0..from.rows() / CELL).flat_map(|row| (0..from.columns() / CELL).map(move |column| (row, column)));
    let change = |(row, column): (usize, usize)| {
        let rows = (0..CELL).map(|line| {
            let from = &from.row(row * CELL + line)[column * CELL..][..CELL];
            let to = &to.row(row * CELL + line)[column * CELL..][..CELL];
            from.iter().zip(to).map(|(from, to)| (from - light * to).powi(2)).sum::<f32>()
        });
        (rows.sum::<f32>() / (CELL * CELL) as f32).sqrt()
    };
    cells.map(change).collect()
}

fn median_of(values: impl Iterator<Item = f32>) -> f32 {
    median(&mut values.map(f64::from).collect::<Vec<_>>()).unwrap_or(0.0) as f32
}
