//! Shifts of labels for which the board moves straight and evenly.

use std::collections::{BTreeMap, BTreeSet};

use super::views::View;
use crate::target::{ChessBoard, Target, TargetError};

/// A shift is possible if it leaves at least this share of a view's corners on the board: some may be false.
const LEAST_KEPT: f64 = 0.9;
/// A view fits a line within this, in squares: shifts are 1.4 apart, and stages err by less than a square.
const FITS_SQUARES: f64 = 0.35;
/// A labelling competes with the best one if it keeps this share of its corners ...
const COMPETES_CORNERS: f64 = 0.98;
/// ... and is less than this many times less likely than the best one.
const COMPETES_ODDS: f64 = 1000.0;
/// Most independent numbers: a stage errs alike at stops that follow each other, so more views tell no more.
const MOST_INDEPENDENT: usize = 5;
/// Less scatter than this, in squares, is chance or rounding: corners are known to some hundredths of a
/// pixel.
const LEAST_SCATTER_SQUARES: f64 = 5e-4;
/// This share of the views must fit.
const LEAST_FITTING: f64 = 2.0 / 3.0;
/// By the stage's positions a board moves one square for each square's length, within this share: scale of
/// the print and tilt of 35 deg.
const SPEED: f64 = 0.2;
/// Pairs of views from which lines are drawn, and shifts of a pair that are tried.
const PAIRS: usize = 60;
const SHIFTS_OF_A_PAIR: usize = 4000;
/// Rounds of fitting a line to the views that fit it.
const ROUNDS: usize = 3;

type Shift = (i32, i32);

/// One band's labels.
#[derive(Debug, Clone)]
pub(super) struct Line {
    /// Shift of the labels of each view that fits, by its index.
    pub(super) shifts: BTreeMap<usize, Shift>,
    /// Whether there is no other shift of all of them.
    pub(super) anchored: bool,
    board: ChessBoard,
    /// Label at a fixed place of the image less the map's part: at position 0, and per unit of position.
    start: [f64; 2],
    speed: [f64; 2],
    corners: usize,
    scatter: f64,
}

impl Line {
    /// Whether the board has such a corner.
    pub(super) fn holds(&self, (column, row): Shift) -> bool {
        holds(&self.board, (column, row))
    }

    /// The part that stays the same if all labels are shifted alike.
    fn shape(&self) -> Vec<(usize, Shift)> {
        let first = self.shifts.values().next().copied().unwrap_or((0, 0));
        self.shifts.iter().map(|(&view, shift)| (view, (shift.0 - first.0, shift.1 - first.1))).collect()
    }

    fn speed_squares(&self) -> f64 {
        self.speed[0].hypot(self.speed[1])
    }
}

fn holds(board: &ChessBoard, (column, row): Shift) -> bool {
    (0..board.columns as i32).contains(&column) && (0..board.rows as i32).contains(&row)
}

/// A view with its possible shifts, and how many corners each leaves on the board.
struct Choice {
    view: usize,
    position: f64,
    offset: [f64; 2],
    shifts: BTreeMap<Shift, usize>,
    /// Sum of a shift's columns and rows is odd.
    odd: bool,
}

impl Choice {
    fn new(index: usize, view: &View, offset: [f64; 2], board: &ChessBoard, odd_dark: bool) -> Self {
        let odd = view.odd_dark != odd_dark;
        let mut shifts = BTreeMap::new();
        if view.complete && !odd {
            shifts.insert((0, 0), view.corners.len());
        } else {
            let range = |of: &dyn Fn(usize) -> i32, size: usize| {
                let labels = (0..view.corners.len()).map(of);
                let (first, last) = labels.fold((i32::MAX, i32::MIN), |(a, b), v| (a.min(v), b.max(v)));
                -last..=size as i32 - 1 - first
            };
            let rows = range(&|k| view.corners[k].row, board.rows);
            for column in range(&|k| view.corners[k].column, board.columns) {
                for row in rows.clone().filter(|row| ((column + row).rem_euclid(2) != 0) == odd) {
                    let on_board = |k: &usize| {
                        holds(board, (view.corners[*k].column + column, view.corners[*k].row + row))
                    };
                    let kept = (0..view.corners.len()).filter(on_board).count();
                    if kept as f64 >= LEAST_KEPT * view.corners.len() as f64 {
                        shifts.insert((column, row), kept);
                    }
                }
            }
        }
        Self { view: index, position: view.position, offset, shifts, odd }
    }

    /// The shift that brings this view nearest to the line, its distance, and how many corners it keeps.
    fn nearest(&self, start: [f64; 2], speed: [f64; 2]) -> Option<(Shift, f64, usize)> {
        let wanted = [0, 1].map(|axis| start[axis] + speed[axis] * self.position - self.offset[axis]);
        let mut rounded = wanted.map(f64::round);
        if ((rounded[0] + rounded[1]).rem_euclid(2.0) > 0.5) != self.odd {
            // The next point of the right colour is one step on, along the axis that was rounded most.
            let away = [0, 1].map(|axis| wanted[axis] - rounded[axis]);
            let axis = usize::from(away[1].abs() > away[0].abs());
            rounded[axis] += if away[axis] < 0.0 { -1.0 } else { 1.0 };
        }
        let distance = (wanted[0] - rounded[0]).hypot(wanted[1] - rounded[1]);
        let shift = (rounded[0] as i32, rounded[1] as i32);
        self.shifts.get(&shift).map(|&kept| (shift, distance, kept))
    }
}

/// The labels of every band.
pub(super) fn solve(
    views: &[View],
    offsets: &[[f64; 2]],
    target: &Target,
    with_positions: bool,
) -> Result<Vec<Line>, TargetError> {
    let complete: Vec<&View> = views.iter().filter(|view| view.complete).collect();
    let odd_dark = 2 * complete.iter().filter(|view| view.odd_dark).count() > complete.len();
    let mut bands: Vec<Vec<Line>> = Vec::new();
    for band in 0..target.bands {
        let choices: Vec<Choice> = views
            .iter()
            .zip(offsets)
            .enumerate()
            .filter(|(_, (view, _))| view.band == band)
            .map(|(index, (view, &offset))| Choice::new(index, view, offset, &target.board, odd_dark))
            .collect();
        let lines = competing(lines(&choices, &target.board));
        let fitting = lines.first().map_or(0, |line| line.shifts.len());
        if choices.is_empty() {
            return Err(TargetError::Bands { reason: format!("band {band} is in no frame") });
        }
        if (fitting as f64) < LEAST_FITTING * choices.len() as f64 {
            return Err(TargetError::Motion { band, fitting, boards: choices.len() });
        }
        bands.push(lines);
    }
    if with_positions {
        let expected = 1.0 / target.board.square_mm;
        bands.iter_mut().for_each(|lines| {
            keep(lines, |line| (line.speed_squares() / expected - 1.0).abs() < SPEED);
        });
    }
    // Bands move alike.
    if let [one, other] = &mut bands[..] {
        let span = views.iter().map(|view| view.position).fold(0.0_f64, |a, b| a.max(b.abs()));
        let alike = |a: &Line, b: &Line| {
            (a.speed[0] - b.speed[0]).hypot(a.speed[1] - b.speed[1]) * span < 2.0 * FITS_SQUARES
        };
        let shared: Vec<Line> = one.clone();
        keep(one, |line| other.iter().any(|other| alike(line, other)));
        keep(other, |line| shared.iter().any(|other| alike(line, other)));
    }
    let mut chosen: Vec<Line> = Vec::new();
    for lines in &bands {
        // Columns of two bands are in line, as printed: where one band leaves a choice, the other decides.
        let column = bands
            .iter()
            .find(|lines| lines.len() == 1)
            .map_or_else(|| chosen.first().map(|line| line.start[0]), |lines| Some(lines[0].start[0]));
        chosen.push(choose(lines, views, column)?);
    }
    Ok(chosen)
}

/// Keeps the lines that pass, if any does.
fn keep(lines: &mut Vec<Line>, pass: impl Fn(&Line) -> bool) {
    if lines.iter().any(&pass) {
        lines.retain(pass);
    }
}

/// One of the lines that fit equally well, if they differ by a shift of all labels only.
fn choose(lines: &[Line], views: &[View], column: Option<f64>) -> Result<Line, TargetError> {
    let best = &lines[0];
    if let Some(other) = lines.iter().find(|line| line.shape() != best.shape()) {
        let frame = |view: Option<&usize>| view.map_or(0, |&view| views[view].frame);
        let (first, last) = (best.shifts.keys().next(), best.shifts.keys().next_back());
        let position = |view: Option<&usize>| view.map_or(0.0, |&view| views[view].position);
        let moved = (position(last) - position(first)).abs();
        return Err(TargetError::Ambiguous {
            first: frame(first),
            second: frame(last),
            one: best.speed_squares() * moved,
            other: other.speed_squares() * moved,
        });
    }
    let away = |line: &Line| column.map_or(0.0, |column| (line.start[0] - column).abs().round());
    let nearest = lines
        .iter()
        .min_by(|a, b| away(a).total_cmp(&away(b)).then_with(|| a.shifts.values().cmp(b.shifts.values())));
    let mut line = nearest.unwrap_or(best).clone();
    line.anchored = lines.len() == 1;
    Ok(line)
}

/// The scatter beyond which a line no longer competes with this one.
///
/// Where the deviation of single views is not known beforehand, a line's likelihood goes with the power
/// `-numbers` of its scatter, if `numbers` are left after fitting it (Jeffreys' prior): two for each view,
/// less the four that a line has.
fn scatter_told_from(best: &Line) -> f64 {
    let numbers = (2 * best.shifts.len()).saturating_sub(4).min(MOST_INDEPENDENT);
    let factor = COMPETES_ODDS.powf(1.0 / numbers as f64);
    factor * best.scatter.max(LEAST_SCATTER_SQUARES)
}

/// Of the lines that keep about as many corners as any, the one that scatters least, first, and those that
/// may be as likely.
fn competing(mut lines: Vec<Line>) -> Vec<Line> {
    let most = lines.iter().map(|line| line.corners).max().unwrap_or(0);
    lines.retain(|line| line.corners as f64 >= COMPETES_CORNERS * most as f64);
    lines.sort_by(|a, b| a.scatter.total_cmp(&b.scatter).then(b.corners.cmp(&a.corners)));
    if let Some(scatter) = lines.first().map(scatter_told_from) {
        lines.retain(|line| line.scatter <= scatter);
    }
    lines
}

/// Lines through pairs of views, each with the views that fit it.
fn lines(choices: &[Choice], board: &ChessBoard) -> Vec<Line> {
    let mut pairs: Vec<(usize, f64, usize, usize)> = Vec::new();
    for one in 0..choices.len() {
        for other in one + 1..choices.len() {
            let away = (choices[other].position - choices[one].position).abs();
            let shifts = choices[one].shifts.len() * choices[other].shifts.len();
            if away > 0.0 && shifts > 0 && shifts <= SHIFTS_OF_A_PAIR {
                pairs.push((shifts, away, one, other));
            }
        }
    }
    // Few shifts first, then long lines, which are known best.
    pairs.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    let mut found = Vec::new();
    let mut known = BTreeSet::new();
    let mut add = |start: [f64; 2], speed: [f64; 2]| {
        let line = fitted(choices, board, start, speed);
        let key: Vec<(usize, Shift)> = line.shifts.iter().map(|(&view, &shift)| (view, shift)).collect();
        if !key.is_empty() && known.insert(key) {
            found.push(line);
        }
    };
    let at = |choice: &Choice, shift: &Shift| {
        [choice.offset[0] + f64::from(shift.0), choice.offset[1] + f64::from(shift.1)]
    };
    for &(_, _, one, other) in pairs.iter().take(PAIRS) {
        let (one, other) = (&choices[one], &choices[other]);
        for first in one.shifts.keys() {
            for second in other.shifts.keys() {
                let (a, b) = (at(one, first), at(other, second));
                let speed = [0, 1].map(|axis| (b[axis] - a[axis]) / (other.position - one.position));
                add([0, 1].map(|axis| a[axis] - speed[axis] * one.position), speed);
            }
        }
    }
    if pairs.is_empty() {
        for choice in choices {
            choice.shifts.keys().for_each(|shift| add(at(choice, shift), [0.0; 2]));
        }
    }
    found
}

/// The line fitted to the views near it.
fn fitted(choices: &[Choice], board: &ChessBoard, start: [f64; 2], speed: [f64; 2]) -> Line {
    let mut line = Line {
        shifts: BTreeMap::new(),
        anchored: false,
        board: *board,
        start,
        speed,
        corners: 0,
        scatter: 0.0,
    };
    for _ in 0..ROUNDS {
        let mut near = Vec::new();
        (line.corners, line.scatter) = (0, 0.0);
        line.shifts.clear();
        for choice in choices {
            if let Some((shift, distance, kept)) = choice.nearest(line.start, line.speed)
                && distance < FITS_SQUARES
            {
                line.shifts.insert(choice.view, shift);
                line.corners += kept;
                line.scatter += distance * distance;
                let label = [choice.offset[0] + f64::from(shift.0), choice.offset[1] + f64::from(shift.1)];
                near.push((choice.position, label));
            }
        }
        line.scatter = (line.scatter / near.len().max(1) as f64).sqrt();
        regress(&mut line, &near);
    }
    line
}

/// Least squares of labels over positions.
fn regress(line: &mut Line, near: &[(f64, [f64; 2])]) {
    let count = near.len() as f64;
    let position = near.iter().map(|(position, _)| position).sum::<f64>() / count;
    let squares: f64 = near.iter().map(|(at, _)| (at - position).powi(2)).sum();
    if near.is_empty() || squares == 0.0 {
        return;
    }
    for axis in 0..2 {
        let mean = near.iter().map(|(_, label)| label[axis]).sum::<f64>() / count;
        let product: f64 = near.iter().map(|(at, label)| (at - position) * (label[axis] - mean)).sum();
        line.speed[axis] = product / squares;
        line.start[axis] = mean - line.speed[axis] * position;
    }
}
