//! From a lattice of corners to a board: its orientation, its corners, and corners that detection has missed.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::board::{BoardCorner, ChessBoard, FoundBoard};
use super::detect::Scene;
use super::lattice::{LEAST_CORNERS, Lattice, lattices};
use super::refine::{Corner, EdgeCross, refine_corner};
use epirig_core::grid::Grid;
use epirig_core::image::reduced;
use epirig_core::statistics::upper_median;

/// Radius of the window of a fit, as a share of the distance of the nearest parallel edge: half would touch
/// it.
const WINDOW: f64 = 0.45;
/// Least and largest radius, in px: nine unknowns need some 28 pixels, and a lens bends long edges.
const RADIUS_PX: (f64, f64) = (3.0, 14.0);
/// A fit may move a corner by this share of the distance to the nearest parallel edge.
const MOVED: f64 = 0.25;
/// Blur beyond this share of the distance to the nearest parallel edge leaves no level ground in the squares;
/// waves have 0.25.
const BLUR: f64 = 0.16;
/// Of three corners in a row the middle one is this near to the line through the others, as a share of their
/// distance: a lens bends lines less.
const STRAIGHT: f64 = 0.03;
/// And by this, in px, whatever the distance: noise.
const STRAIGHT_PX: f64 = 0.2;
/// A corner has at least this share of the contrast around it: where the board ends, a false one has half.
const CONTRAST: f64 = 0.6;
/// Rounds of looking for missed corners around those found.
const ROUNDS: usize = 4;
/// Most rejected corners of a lattice, if two of three are rejected; with more it is texture.
const MOST_REFUSED: usize = 8;
/// Grids that are looked at: texture may have some, too.
const MOST_LATTICES: usize = 12;

type Label = (i32, i32);

/// The boards of an image, detected at 1 / `scale` of its size (1 or 2).
pub(super) fn boards(image: &Grid<f32>, scale: usize, board: &ChessBoard, count: usize) -> Vec<FoundBoard> {
    let scene = if scale == 2 { Scene::new(&reduced(image, 2)) } else { Scene::new(image) };
    let mut found: Vec<FoundBoard> = Vec::new();
    for mut lattice in lattices(&scene).into_iter().take(MOST_LATTICES) {
        if scale == 2 {
            lattice.values_mut().for_each(|(x, y)| (*x, *y) = (2.0 * *x + 0.5, 2.0 * *y + 0.5));
        }
        if let Some(next) = Labelled::new(&lattice, board).and_then(|labelled| labelled.finish(image))
            && !found.iter().any(|other| share_a_corner(other, &next))
        {
            found.push(next);
        }
    }
    found.sort_by_key(|found| std::cmp::Reverse(found.corners.len()));
    found.truncate(count);
    found
}

fn share_a_corner(one: &FoundBoard, other: &FoundBoard) -> bool {
    let same = |a: &Corner, b: &Corner| (a.x_px - b.x_px).hypot(a.y_px - b.y_px) < 1.0;
    one.corners.iter().any(|a| other.corners.iter().any(|b| same(&a.corner, &b.corner)))
}

/// Rough corners with labels from 0 on.
struct Labelled<'a> {
    board: &'a ChessBoard,
    rough: Lattice,
    /// Whether the square between the directions to higher columns and to higher rows is bright at even sums
    /// of column and row.
    even_bright: bool,
}

/// Steps to the next column and to the next row, in px.
struct Steps {
    column: (f64, f64),
    row: (f64, f64),
}

impl Steps {
    /// Of the corners around a label.
    fn at(places: &Lattice, (column, row): Label) -> Option<Self> {
        // The longer the chord about the corner, the better; if its own row has none, a row beside it will
        // do.
        let along = |dc: i32, dr: i32| {
            [0, 1, -1, 2, -2].into_iter().find_map(|side| {
                let (c, r) = (column + side * dr, row + side * dc);
                [(-1, 1), (0, 1), (-1, 0), (1, 2), (-2, -1)].into_iter().find_map(|(from, to)| {
                    let a = places.get(&(c + from * dc, r + from * dr))?;
                    let b = places.get(&(c + to * dc, r + to * dr))?;
                    let steps = f64::from(to - from);
                    Some(((b.0 - a.0) / steps, (b.1 - a.1) / steps))
                })
            })
        };
        Some(Self { column: along(1, 0)?, row: along(0, 1)? })
    }

    /// Distance from the corner to the nearest edge that is parallel to one of its own.
    fn spacing_px(&self) -> f64 {
        let area = (self.column.0 * self.row.1 - self.column.1 * self.row.0).abs();
        area / self.column.0.hypot(self.column.1).max(self.row.0.hypot(self.row.1))
    }
}

/// A lattice turned by quarters: its rows along the lattice's columns, and so on.
fn turned(lattice: &Lattice, quarters: usize) -> Lattice {
    let turn = |&(i, j): &Label| match quarters {
        0 => (i, j),
        1 => (j, -i),
        2 => (-i, -j),
        _ => (-j, i),
    };
    lattice.iter().map(|(at, &place)| (turn(at), place)).collect()
}

/// The window of columns x rows with most corners: how many, and its first column and row.
fn fullest_window(places: &Lattice, board: &ChessBoard) -> (usize, Label) {
    let starts = |size: usize, of: fn(&Label) -> i32| {
        let (first, last) =
            places.keys().map(of).fold((i32::MAX, i32::MIN), |(a, b), v| (a.min(v), b.max(v)));
        first..=first.max(last + 1 - size as i32)
    };
    let inside = |(column, row): Label| {
        let fits = |value: i32, first: i32, size: usize| value >= first && value < first + size as i32;
        places.keys().filter(|at| fits(at.0, column, board.columns) && fits(at.1, row, board.rows)).count()
    };
    starts(board.rows, |at| at.1)
        .flat_map(|row| starts(board.columns, |at| at.0).map(move |column| (column, row)))
        .map(|start| (inside(start), start))
        .rev()
        .max_by_key(|&(count, _)| count)
        .unwrap_or((0, (0, 0)))
}

/// The mean step from column to column, as an angle from the image's x, in rad.
fn column_angle(places: &Lattice) -> f64 {
    let (mut dx, mut dy) = (0.0, 0.0);
    for (&(column, row), here) in places {
        if let Some(next) = places.get(&(column + 1, row)) {
            dx += next.0 - here.0;
            dy += next.1 - here.1;
        }
    }
    dy.atan2(dx)
}

impl<'a> Labelled<'a> {
    fn new(lattice: &Lattice, board: &'a ChessBoard) -> Option<Self> {
        let mut best: Option<(usize, f64, Self)> = None;
        for quarters in 0..4 {
            let places = turned(lattice, quarters);
            let (count, (column, row)) = fullest_window(&places, board);
            let angle = column_angle(&places).abs();
            if best.as_ref().is_some_and(|best| (count, -angle) <= (best.0, -best.1)) {
                continue;
            }
            let inside = |at: &Label| {
                (0..board.columns as i32).contains(&at.0) && (0..board.rows as i32).contains(&at.1)
            };
            let rough = places
                .into_iter()
                .map(|(at, place)| ((at.0 - column, at.1 - row), place))
                .filter(|(at, _)| inside(at))
                .collect();
            // At the lattice's (0, 0) a bright square follows the direction of columns; each quarter of a
            // turn and each odd shift change that.
            let even_bright = (quarters as i32 + column + row).rem_euclid(2) == 0;
            best = Some((count, angle, Self { board, rough, even_bright }));
        }
        best.map(|best| best.2).filter(|labelled| labelled.rough.len() >= LEAST_CORNERS)
    }

    /// Fits the corner with this label, given about where it is.
    fn refined(
        &self,
        image: &Grid<f32>,
        places: &Lattice,
        label: Label,
        (x_px, y_px): (f64, f64),
    ) -> Option<Corner> {
        let steps = Steps::at(places, label)?;
        let spacing = steps.spacing_px();
        let (columns, rows) = (steps.column.1.atan2(steps.column.0), steps.row.1.atan2(steps.row.0));
        let bright = ((label.0 + label.1).rem_euclid(2) == 0) == self.even_bright;
        let (before_bright_rad, before_dark_rad) =
            if bright { (columns, rows) } else { (rows, columns + PI) };
        let start = EdgeCross { x_px, y_px, before_bright_rad, before_dark_rad };
        let corner = refine_corner(image, &start, (WINDOW * spacing).clamp(RADIUS_PX.0, RADIUS_PX.1))?;
        let near = (corner.x_px - x_px).hypot(corner.y_px - y_px) < (MOVED * spacing).max(1.0);
        (near && corner.blur_px < BLUR * spacing).then_some(corner)
    }

    fn finish(self, image: &Grid<f32>) -> Option<FoundBoard> {
        let mut corners: BTreeMap<Label, Corner> = BTreeMap::new();
        let mut refused = 0;
        // Each third is from the whole lattice, so that a bad end of a board does not stand for all of it.
        for (&label, &place) in (0..3).flat_map(|third| self.rough.iter().skip(third).step_by(3)) {
            match self.refined(image, &self.rough, label, place) {
                Some(corner) => _ = corners.insert(label, corner),
                None => refused += 1,
            }
            if refused >= MOST_REFUSED && refused > 2 * corners.len() {
                return None;
            }
        }
        drop_faint(&mut corners);
        drop_crooked(&mut corners);
        if corners.len() < LEAST_CORNERS {
            return None;
        }
        for _ in 0..ROUNDS {
            if corners.len() == self.board.corners() || !self.add_overlooked(image, &mut corners) {
                break;
            }
        }
        drop_crooked(&mut corners);
        let more = self.goes_on(image, &corners);
        (corners.len() >= LEAST_CORNERS).then(|| FoundBoard { more, ..self.board_of(corners) })
    }

    /// Fits corners at the places that the found ones predict; whether any was added.
    fn add_overlooked(&self, image: &Grid<f32>, corners: &mut BTreeMap<Label, Corner>) -> bool {
        let places = places_of(corners);
        let mut added = false;
        let labels: Vec<Label> = corners.keys().copied().collect();
        for (label, (dc, dr)) in
            labels.iter().flat_map(|&label| [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|step| (label, step)))
        {
            let missing = (label.0 + dc, label.1 + dr);
            if corners.contains_key(&missing) || !self.has_room(corners, missing) {
                continue;
            }
            if let Some(corner) = self.next(image, &places, corners[&label].contrast_dn, (label, missing)) {
                corners.insert(missing, corner);
                added = true;
            }
        }
        added
    }

    /// The corner beyond one of this contrast, if there is one as clear: `next` is the label beside `here`.
    fn next(
        &self,
        image: &Grid<f32>,
        places: &Lattice,
        contrast_dn: f64,
        (here, next): (Label, Label),
    ) -> Option<Corner> {
        let behind = places.get(&(2 * here.0 - next.0, 2 * here.1 - next.1))?;
        let (x_px, y_px) = places[&here];
        let expected = (2.0 * x_px - behind.0, 2.0 * y_px - behind.1);
        let corner = self.refined(image, places, next, expected)?;
        (corner.contrast_dn > CONTRAST * contrast_dn).then_some(corner)
    }

    /// Columns and rows that continue the lattice beyond a complete board: one at each side where half of those
    /// places that are looked at show a corner.
    fn goes_on(&self, image: &Grid<f32>, corners: &BTreeMap<Label, Corner>) -> (usize, usize) {
        /// Places that are looked at beside each side.
        const LOOKED_AT: usize = 6;
        if corners.len() != self.board.corners() {
            return (0, 0);
        }
        let places = places_of(corners);
        let goes_on = |dc: i32, dr: i32| {
            let edge: Vec<Label> = places
                .keys()
                .copied()
                .filter(|&(column, row)| !places.contains_key(&(column + dc, row + dr)))
                .collect();
            let looked_at = edge.iter().step_by(edge.len().div_ceil(LOOKED_AT).max(1));
            let goes_on = |&&label: &&Label| {
                let beyond = (label.0 + dc, label.1 + dr);
                self.next(image, &places, corners[&label].contrast_dn, (label, beyond)).is_some()
            };
            let found = looked_at.clone().filter(goes_on).count();
            usize::from(2 * found > looked_at.count())
        };
        (goes_on(1, 0) + goes_on(-1, 0), goes_on(0, 1) + goes_on(0, -1))
    }

    /// Whether the board is large enough to hold one more label.
    fn has_room(&self, corners: &BTreeMap<Label, Corner>, label: Label) -> bool {
        let spread = |of: fn(&Label) -> i32| {
            let all = corners.keys().chain([&label]).map(of);
            let (first, last) = all.fold((i32::MAX, i32::MIN), |(a, b), v| (a.min(v), b.max(v)));
            (last - first + 1) as usize
        };
        spread(|at| at.0) <= self.board.columns && spread(|at| at.1) <= self.board.rows
    }

    /// Labels as [`super::find_boards`] promises them.
    fn board_of(&self, corners: BTreeMap<Label, Corner>) -> FoundBoard {
        let complete = corners.len() == self.board.corners();
        let least = |of: fn(&Label) -> i32| corners.keys().map(of).min().unwrap_or(0);
        let (column, row) = (least(|at| at.0), least(|at| at.1));
        // The squares on either side of a corner, before and after both directions, have one colour.
        let dark = self.even_bright == ((column + row).rem_euclid(2) != 0);
        let (last_column, last_row) = (self.board.columns as i32 - 1, self.board.rows as i32 - 1);
        let half_turn = complete && !dark && (last_column + last_row) % 2 != 0;
        let shift = i32::from(!complete && !dark);
        let label = |at: Label| {
            let at = (at.0 - column, at.1 - row);
            if half_turn { (last_column - at.0, last_row - at.1) } else { (at.0 + shift, at.1) }
        };
        let median = |of: fn(&Corner) -> f64| {
            let mut values: Vec<f64> = corners.values().map(of).collect();
            upper_median(&mut values).unwrap_or(f64::NAN)
        };
        let (blur_px, contrast_dn) = (median(|corner| corner.blur_px), median(|corner| corner.contrast_dn));
        let mut labelled: Vec<BoardCorner> = corners
            .iter()
            .map(|(&at, &corner)| BoardCorner { column: label(at).0, row: label(at).1, corner })
            .collect();
        labelled.sort_by_key(|corner| (corner.row, corner.column));
        FoundBoard {
            corners: labelled,
            complete,
            even_dark: dark || half_turn || shift == 1,
            more: (0, 0),
            blur_px,
            contrast_dn,
        }
    }
}

fn places_of(corners: &BTreeMap<Label, Corner>) -> Lattice {
    corners.iter().map(|(&at, corner)| (at, (corner.x_px, corner.y_px))).collect()
}

/// Removes corners that have much less contrast than those around them: where the board ends, shadows make
/// false ones.
fn drop_faint(corners: &mut BTreeMap<Label, Corner>) {
    let faint: Vec<Label> = corners
        .iter()
        .filter(|&(&(column, row), corner)| {
            let mut around: Vec<f64> = [(1, 0), (-1, 0), (0, 1), (0, -1)]
                .into_iter()
                .filter_map(|(dc, dr)| corners.get(&(column + dc, row + dr)))
                .map(|other| other.contrast_dn)
                .collect();
            upper_median(&mut around).is_some_and(|usual| corner.contrast_dn < CONTRAST * usual)
        })
        .map(|(&at, _)| at)
        .collect();
    for label in faint {
        corners.remove(&label);
    }
}

/// Removes corners that are in fewer straight lines of three than in crooked ones, until none is: the edges
/// of a board are straight.
fn drop_crooked(corners: &mut BTreeMap<Label, Corner>) {
    loop {
        let mut scores: BTreeMap<Label, i32> = corners.keys().map(|&at| (at, 0)).collect();
        for (&(column, row), middle) in corners.iter() {
            for (dc, dr) in [(1, 0), (0, 1)] {
                let (before, after) = ((column - dc, row - dr), (column + dc, row + dr));
                if let (Some(a), Some(b)) = (corners.get(&before), corners.get(&after)) {
                    let score = if is_straight(a, middle, b) { 1 } else { -1 };
                    for at in [before, (column, row), after] {
                        *scores.entry(at).or_default() += score;
                    }
                }
            }
        }
        let worst = scores.into_iter().min_by_key(|&(_, score)| score).filter(|&(_, score)| score < 0);
        let Some((label, _)) = worst else { return };
        corners.remove(&label);
    }
}

fn is_straight(a: &Corner, middle: &Corner, b: &Corner) -> bool {
    let (dx, dy) = (b.x_px - a.x_px, b.y_px - a.y_px);
    let length = dx.hypot(dy);
    let off = ((middle.x_px - a.x_px) * dy - (middle.y_px - a.y_px) * dx).abs() / length;
    off < STRAIGHT * length + STRAIGHT_PX
}
