//! The first search, in small pictures: how points move between two frames, and then one s for each further frame.

use rayon::prelude::*;

use super::TextureMotionError;
use super::frames::Frames;
use super::point::squares;
use super::start::{
    AMBIGUOUS, CLEAR_PX, FEWEST, LEAST_CORRELATION, MOVES_PX, ONE_PLACE_PX, POINTS, SIDE, Start, peak, start,
};
use crate::block::Block;
use epirig_core::grid::Grid;
use epirig_core::statistics::{median, quantile};

/// The same of the mean of all frames that show a square: three quarters of them at the least, and the others,
/// occluded, at 0.
const LEAST_MEAN_CORRELATION: f32 = 0.5;
/// The same of the mean of all squares in a frame that may be turned by itself: then few are where they are expected.
/// The mean of 25 squares that have nothing in common is off 0 by 1 / 60, and seldom the best of 1000 places by 0.1.
const LEAST_MEAN_OF_FRAME: f32 = 0.2;
/// Distance of the places that are tried, in px.
const HOP_PX: f64 = 0.6;
/// Share of the points found in a frame that must lie within a pixel of its place; they are a quarter of all points at
/// least. Those that are found by chance within 2.5 px do so with 0.4, but they are few, as squares with nothing in
/// common do not correlate that well. So this asks for little besides, and frames with many occluded points are kept.
const AGREE_ON_PLACE: f64 = 0.3;
/// Points whose rho is below this share of the others' tell little of s, and most of them stand still: the information
/// of a point goes with the square of its rho, and is less than a tenth of the others'.
const LEAST_RHO: f64 = 0.3;

/// Places across the motion at which a frame is looked for, in px from that of the nearest one. A square is found again up
/// to 2 px beside; the others are tried if frames are left, as more places agree by chance more often.
const BESIDE_PX: [f64; 5] = [0.0, 2.0, -2.0, 4.0, -4.0];

/// Reach of the search where points move less than is clear in pictures of half the size, in px.
pub(super) const SMALL_REACH: isize = 2 * (CLEAR_PX + ONE_PLACE_PX) as isize;

/// Frames in which points of an anchor are looked for, at most.
pub(super) const SOME: usize = 7;

/// Where frames stand, and what is needed to find points in them.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// s of each frame, in px of the frames for a rho of 1.
    pub(super) position: Vec<f64>,
    /// How far all points of a frame lie across the motion, in px of the frames.
    pub(super) across: Vec<f64>,
    /// The direction of the motion, a unit vector.
    pub(super) direction: [f64; 2],
    /// The least and the largest rho of points that move.
    pub(super) rho: (f64, f64),
    /// Frames whose points are followed.
    pub(super) anchors: Vec<usize>,
}

struct Point {
    block: Block,
    rho: f64,
    /// Sums of displacement times s, and of the squares of s.
    sums: [f64; 2],
}

/// Finds where all frames stand in pictures that are reduced by `factor`, of points that move by no more than `reach`
/// px between two of them; `None` if they move so little that larger pictures show it better, unless these are the
/// `largest`.
pub(super) fn search(
    frames: &dyn Frames,
    factor: usize,
    reach: Option<isize>,
    largest: bool,
) -> Result<Option<Found>, TextureMotionError> {
    let start = start(frames, factor, reach).ok_or(TextureMotionError::NothingFollowed)?;
    if start.moved_px < CLEAR_PX && !largest {
        return Ok(None);
    }
    let small: Vec<Grid<f32>> =
        (0..frames.count()).into_par_iter().map(|index| frames.picture(index, factor)).collect();
    TextureMotionError::if_cancelled(frames)?;
    Search::new(&small, factor, &start).connect(start).map(Some)
}

/// The shift near a start at which a square correlates best.
fn near(block: &Block, to: &Grid<f32>, start: [f64; 2]) -> Option<[f64; 2]> {
    let [x, y] = start.map(|part| part.round() as isize);
    let all = (y - 2..=y + 2).flat_map(|y| (x - 2..=x + 2).map(move |x| (x, y)));
    let tried = all.filter_map(|(x, y)| Some((block.correlation(to, x, y)?, x, y)));
    let (best, x, y) = tried.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let beside = |dx, dy| block.correlation(to, x + dx, y + dy);
    let shift = [
        x as f64 + peak(beside(-1, 0)?, best, beside(1, 0)?),
        y as f64 + peak(beside(0, -1)?, best, beside(0, 1)?),
    ];
    (best >= LEAST_CORRELATION).then_some(shift)
}

/// A place across the picture, turned into columns and rows.
pub(super) fn turned(direction: [f64; 2], along: f64, across: f64) -> [f64; 2] {
    [along * direction[0] - across * direction[1], along * direction[1] + across * direction[0]]
}

/// A frame in which a point is looked for: the picture, and how far the point has moved there: columns and rows, in px
/// of the picture, for a rho of 0, and what each unit of rho adds.
pub(super) struct Looked<'a> {
    pub(super) picture: &'a Grid<f32>,
    pub(super) standing: [f64; 2],
    pub(super) by_rho: [f64; 2],
}

impl Looked<'_> {
    /// How far the point goes for a rho of 1, in px.
    fn reach(&self) -> f64 {
        self.by_rho[0].hypot(self.by_rho[1])
    }
}

/// rho of a square: that at which it correlates best with all of these frames at once; `None` if another does
/// nearly as well.
pub(super) fn rho_of(block: &Block, frames: &[Looked], (least, most): (f64, f64)) -> Option<f64> {
    let farthest = frames.iter().map(Looked::reach).fold(0.0, f64::max);
    let hop = HOP_PX / farthest;
    let count = ((most - least) / hop).ceil() as usize;
    let score = |rho: f64| {
        let seen = frames.iter().filter_map(|frame| {
            let moved = |axis: usize| (frame.standing[axis] + rho * frame.by_rho[axis]).round() as isize;
            block.correlation(frame.picture, moved(0), moved(1))
        });
        let (sum, count) = seen.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
        if count > 0 { sum / count as f32 } else { -1.0 }
    };
    let scores: Vec<f32> = (0..=count).map(|index| score(least + index as f64 * hop)).collect();
    best_of(&scores, LEAST_MEAN_CORRELATION, ONE_PLACE_PX / HOP_PX).map(|place| least + place * hop)
}

/// The place of the best score, in parts of an index; `None` if it is less than `least`, or another farther than
/// `apart` is nearly as good.
fn best_of(scores: &[f32], least: f32, apart: f64) -> Option<f64> {
    let (index, &best) = scores.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    let far = scores.iter().enumerate().filter(|(other, _)| other.abs_diff(index) as f64 > apart);
    let second = far.map(|(_, score)| *score).fold(0.0, f32::max);
    if best < least || second > best - AMBIGUOUS {
        return None;
    }
    let beside = |index: Option<usize>| index.and_then(|index| scores.get(index)).copied().unwrap_or(best);
    Some(index as f64 + peak(beside(index.checked_sub(1)), best, beside(Some(index + 1))))
}

/// A search from two frames on. All lengths are in px of the small pictures.
struct Search<'a> {
    small: &'a [Grid<f32>],
    factor: usize,
    direction: [f64; 2],
    /// s and place across the motion of the frames that are known.
    known: Vec<Option<[f64; 2]>>,
    anchors: Vec<usize>,
    /// Places across the motion at which a frame is looked for, in px from that of the nearest one.
    beside_px: &'static [f64],
}

impl<'a> Search<'a> {
    fn new(small: &'a [Grid<f32>], factor: usize, start: &Start) -> Self {
        let mut known = vec![None; small.len()];
        known[start.anchor] = Some([0.0, 0.0]);
        known[start.other] = Some([start.moved_px, 0.0]);
        Self {
            small,
            factor,
            direction: start.direction,
            known,
            anchors: Vec::new(),
            beside_px: &BESIDE_PX[..1],
        }
    }

    fn connect(mut self, start: Start) -> Result<Found, TextureMotionError> {
        let moved = start.moved_px;
        let point = |(block, along): (Block, f64)| Point {
            block,
            rho: along / moved,
            sums: [along * moved, moved * moved],
        };
        let mut points: Vec<Point> = start.points.into_iter().map(point).collect();
        let mut anchor = start.anchor;
        let mut looked = Vec::new();
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        loop {
            self.grow(anchor, &mut points);
            self.anchors.push(anchor);
            looked.push(anchor);
            let moving = moving(&points);
            range =
                moving.iter().fold(range, |(least, most), point| (least.min(point.rho), most.max(point.rho)));
            let unknown: Vec<usize> =
                (0..self.known.len()).filter(|&frame| self.known[frame].is_none()).collect();
            if unknown.is_empty() {
                return Ok(self.found(range));
            }
            let distance = |frame: usize| unknown.iter().map(|other| other.abs_diff(frame)).min();
            let next = (0..self.known.len())
                .filter(|frame| self.known[*frame].is_some() && !looked.contains(frame))
                .min_by_key(|&frame| distance(frame));
            let Some(next) = next else {
                if self.beside_px.len() == BESIDE_PX.len() {
                    return Err(TextureMotionError::Apart { frames: unknown });
                }
                self.beside_px = &BESIDE_PX;
                looked.clear();
                continue;
            };
            anchor = next;
            points = self.points_of(anchor, wider(range));
        }
    }

    /// Points of a known frame, with their rho from the other known frames.
    fn points_of(&self, anchor: usize, range: (f64, f64)) -> Vec<Point> {
        let Some([s, across]) = self.known[anchor] else { return Vec::new() };
        let width = self.small[anchor].columns().max(self.small[anchor].rows()) as f64;
        let mut frames: Vec<Looked> = (0..self.known.len())
            .filter(|&frame| frame != anchor)
            .filter_map(|frame| {
                let [s_frame, across_frame] = self.known[frame]?;
                Some(Looked {
                    picture: &self.small[frame],
                    standing: turned(self.direction, 0.0, across_frame - across),
                    by_rho: turned(self.direction, s_frame - s, 0.0),
                })
            })
            .filter(|frame| frame.reach() * range.1 < 0.5 * width)
            .collect();
        frames.sort_by(|a, b| a.reach().total_cmp(&b.reach()));
        let frames = some_of(frames);
        let squares = squares(&self.small[anchor], SIDE, POINTS, self.direction);
        let farthest = frames.iter().map(Looked::reach).fold(0.0, f64::max);
        if farthest < MOVES_PX {
            return Vec::new();
        }
        squares
            .par_iter()
            .filter_map(|&(left, top)| {
                let block = Block::of(&self.small[anchor], top, left, SIDE)?;
                let rho = rho_of(&block, &frames, range)?;
                let squares: f64 = frames.iter().map(|frame| frame.reach().powi(2)).sum();
                Some(Point { block, rho, sums: [rho * squares, squares] })
            })
            .collect()
    }

    /// Finds all frames that share enough with the points of `anchor`, the nearest first.
    fn grow(&mut self, anchor: usize, points: &mut [Point]) {
        let mut order: Vec<usize> =
            (0..self.known.len()).filter(|&frame| self.known[frame].is_none()).collect();
        order.sort_by_key(|frame| frame.abs_diff(anchor));
        for frame in order {
            self.known[frame] = self.place(frame, anchor, points);
        }
    }

    /// s and place across the motion of a frame by the points of `anchor`, whose rho it then tells better.
    fn place(&self, frame: usize, anchor: usize, points: &mut [Point]) -> Option<[f64; 2]> {
        let [s_anchor, across_anchor] = self.known[anchor]?;
        let near_frame = (0..self.known.len())
            .filter(|&other| self.known[other].is_some())
            .min_by_key(|other| other.abs_diff(frame))?;
        let across = self.known[near_frame]?[1] - across_anchor;
        let found = self.beside_px.iter().find_map(|beside| self.place_at(frame, across + beside, points))?;
        Some([s_anchor + found[0], across_anchor + found[1]])
    }

    /// The same for a place near `across`, from the anchor.
    fn place_at(&self, frame: usize, across: f64, points: &mut [Point]) -> Option<[f64; 2]> {
        let picture = &self.small[frame];
        let moving = moving(points);
        let rhos = || moving.iter().map(|point| point.rho).collect::<Vec<f64>>();
        let (usual, large) = (median(&mut rhos())?, quantile(&mut rhos(), 0.9)?);
        let hop = HOP_PX / large;
        let side = picture.columns().max(picture.rows()) as f64;
        let reach = (0.8 * side / usual / hop) as isize;
        let fewest = FEWEST.max(moving.len() / 4);
        let score = |index: isize| {
            let seen = moving.iter().filter_map(|point| {
                let shift = turned(self.direction, index as f64 * hop * point.rho, across);
                let [x, y] = shift.map(|part| part.round() as isize);
                point.block.correlation(picture, x, y)
            });
            let (sum, count) = seen.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
            if count >= fewest { sum / count as f32 } else { 0.0 }
        };
        let scores: Vec<f32> = (-reach..=reach).into_par_iter().map(score).collect();
        let place = best_of(&scores, LEAST_MEAN_OF_FRAME, ONE_PLACE_PX / HOP_PX * large / usual)?;
        let s = (place - reach as f64) * hop;
        let placed: Vec<(f64, f64, f64)> = moving
            .iter()
            .filter_map(|point| {
                let [x, y] = near(&point.block, picture, turned(self.direction, s * point.rho, across))?;
                let along = x * self.direction[0] + y * self.direction[1];
                Some((point.rho, along, y * self.direction[0] - x * self.direction[1]))
            })
            .collect();
        let s = median(&mut placed.iter().map(|(rho, along, _)| along / rho).collect::<Vec<_>>())?;
        let good: Vec<&(f64, f64, f64)> =
            placed.iter().filter(|(rho, along, _)| (along - rho * s).abs() < 1.0).collect();
        if good.len() < fewest.max((AGREE_ON_PLACE * placed.len() as f64) as usize) {
            return None;
        }
        let across = median(&mut good.iter().map(|good| good.2).collect::<Vec<_>>())?;
        let direction = self.direction;
        points.par_iter_mut().for_each(|point| {
            if let Some([x, y]) = near(&point.block, picture, turned(direction, s * point.rho, across)) {
                let along = x * direction[0] + y * direction[1];
                if (along - point.rho * s).abs() < 1.0 {
                    point.sums[0] += along * s;
                    point.sums[1] += s * s;
                    point.rho = point.sums[0] / point.sums[1];
                }
            }
        });
        Some([s, across])
    }

    fn found(self, range: (f64, f64)) -> Found {
        let px = self.factor as f64;
        let mut anchors = self.anchors;
        anchors.extend([0, self.known.len() - 1]);
        anchors.sort_unstable();
        anchors.dedup();
        let of = |part: usize| {
            self.known.iter().map(|known| known.map_or(0.0, |known| px * known[part])).collect()
        };
        Found { position: of(0), across: of(1), direction: self.direction, rho: range, anchors }
    }
}

/// Points that tell of s.
fn moving(points: &[Point]) -> Vec<&Point> {
    let rho = median(&mut points.iter().map(|point| point.rho).filter(|rho| *rho > 0.0).collect::<Vec<_>>());
    let least = LEAST_RHO * rho.unwrap_or(f64::INFINITY);
    points.iter().filter(|point| point.rho >= least).collect()
}

/// A range of rho in which there may be points that no anchor has shown yet.
pub(super) fn wider((least, most): (f64, f64)) -> (f64, f64) {
    let more = 0.25 * (most - least) + 0.1 * most;
    ((least - more).max(0.0), most + more)
}

/// Some of a list in its order, among them the first and the last: more tell little more.
pub(super) fn some_of<T>(list: Vec<T>) -> Vec<T> {
    let last = list.len().saturating_sub(1);
    let is_kept = |index: usize| last < SOME || (0..SOME).any(|place| place * last / (SOME - 1) == index);
    list.into_iter().enumerate().filter(|(index, _)| is_kept(*index)).map(|(_, item)| item).collect()
}
