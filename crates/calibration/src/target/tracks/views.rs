//! The boards of all frames, turned alike and sorted into bands.

use std::f64::consts::PI;

use crate::target::{BoardCorner, FoundBoard, Target, TargetError};
use epirig_core::statistics::upper_median;

/// The distance of two bands in one frame may be off by this factor: perspective shortens it.
const BAND_DISTANCE_RATIO: f64 = 1.6;

/// One band in one frame.
#[derive(Debug, Clone)]
pub(super) struct View {
    pub(super) frame: usize,
    /// Of the stage, in mm, or the frame's number.
    pub(super) position: f64,
    pub(super) band: usize,
    pub(super) complete: bool,
    /// Whether a dark square comes before corners with an odd sum of column and row (true), or with an even
    /// one.
    pub(super) odd_dark: bool,
    pub(super) corners: Vec<BoardCorner>,
}

impl View {
    fn extent(&self, of: fn(&BoardCorner) -> i32) -> (i32, i32) {
        self.corners.iter().map(of).fold((i32::MAX, i32::MIN), |(a, b), v| (a.min(v), b.max(v)))
    }

    /// Columns and rows that it covers.
    fn size(&self) -> (usize, usize) {
        let size = |(first, last): (i32, i32)| (last - first + 1).max(0) as usize;
        (size(self.extent(|corner| corner.column)), size(self.extent(|corner| corner.row)))
    }

    /// Mean place, in px.
    fn middle(&self) -> (f64, f64) {
        let count = self.corners.len() as f64;
        let mean = |of: fn(&BoardCorner) -> f64| self.corners.iter().map(of).sum::<f64>() / count;
        (mean(|corner| corner.corner.x_px), mean(|corner| corner.corner.y_px))
    }

    /// Mean step to the next column (or row), in px, by regression of places on labels.
    fn step(&self, of: fn(&BoardCorner) -> i32) -> (f64, f64) {
        let count = self.corners.len() as f64;
        let mean = self.corners.iter().map(|corner| f64::from(of(corner))).sum::<f64>() / count;
        let (x, y) = self.middle();
        let (mut dx, mut dy, mut squares) = (0.0, 0.0, 0.0);
        for corner in &self.corners {
            let away = f64::from(of(corner)) - mean;
            dx += away * (corner.corner.x_px - x);
            dy += away * (corner.corner.y_px - y);
            squares += away * away;
        }
        if squares > 0.0 { (dx / squares, dy / squares) } else { (0.0, 0.0) }
    }

    fn column_direction(&self) -> f64 {
        let (dx, dy) = self.step(|corner| corner.column);
        dy.atan2(dx)
    }

    /// Turns the labels by quarters; a complete board's begin at 0 again.
    fn turn(&mut self, quarters: usize) {
        for _ in 0..quarters {
            for corner in &mut self.corners {
                (corner.column, corner.row) = (corner.row, -corner.column);
            }
            // Squares beside each other differ in colour.
            self.odd_dark = !self.odd_dark;
        }
        if self.complete {
            let (column, row) = (self.extent(|corner| corner.column).0, self.extent(|corner| corner.row).0);
            for corner in &mut self.corners {
                corner.column -= column;
                corner.row -= row;
            }
            self.odd_dark ^= (column + row).rem_euclid(2) != 0;
        }
    }
}

/// All views, in the order of frames.
pub(super) fn views(
    found: &[Vec<FoundBoard>],
    target: &Target,
    positions: &[f64],
) -> Result<Vec<View>, TargetError> {
    let mut frames: Vec<Vec<View>> = found
        .iter()
        .zip(positions)
        .enumerate()
        .map(|(frame, (boards, &position))| {
            let boards = boards.iter().filter(|board| !board.corners.is_empty());
            let view = |board: &FoundBoard| View {
                frame,
                position,
                band: 0,
                complete: board.complete,
                odd_dark: !board.even_dark,
                corners: board.corners.clone(),
            };
            let mut views: Vec<View> = boards.map(view).collect();
            views.sort_by_key(|view| std::cmp::Reverse(view.corners.len()));
            views.truncate(target.bands);
            views
        })
        .collect();
    let largest = frames.iter().flatten().max_by_key(|view| (view.complete, view.corners.len()));
    let Some(largest) = largest else {
        return Err(TargetError::NoBoard { columns: target.board.columns, rows: target.board.rows });
    };
    let reference = largest.column_direction();
    frames.iter_mut().flatten().for_each(|view| turn_alike(view, reference, target));
    if target.bands == 2 {
        sort_into_bands(&mut frames, target)?;
    }
    Ok(frames.into_iter().flatten().collect())
}

/// Turns a view so that its columns run along `reference`, as far as its size allows.
fn turn_alike(view: &mut View, reference: f64, target: &Target) {
    let (columns, rows) = view.size();
    let direction = view.column_direction();
    let board = &target.board;
    let fits = |quarters: usize| {
        let (columns, rows) = if quarters.is_multiple_of(2) { (columns, rows) } else { (rows, columns) };
        columns <= board.columns && rows <= board.rows
    };
    // After a quarter of a turn columns run where rows did.
    let off = |quarters: usize| {
        let turned = direction + quarters as f64 * PI / 2.0 - reference;
        ((turned + PI).rem_euclid(2.0 * PI) - PI).abs()
    };
    let best = (0..4).filter(|&quarters| fits(quarters)).min_by(|&a, &b| off(a).total_cmp(&off(b)));
    view.turn(best.unwrap_or(0));
}

fn sort_into_bands(frames: &mut [Vec<View>], target: &Target) -> Result<(), TargetError> {
    let Some(largest) = frames.iter().flatten().max_by_key(|view| view.corners.len()) else { return Ok(()) };
    let (dx, dy) = largest.step(|corner| corner.row);
    let step_px = dx.hypot(dy);
    // Distance along the rows' direction, in squares.
    let along = |view: &View| {
        let (x, y) = view.middle();
        (x * dx + y * dy) / (step_px * step_px)
    };
    let distance = target.band_distance_mm / target.board.square_mm;
    let mut pairs: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
    for views in frames.iter_mut().filter(|views| views.len() == 2) {
        views.sort_by(|a, b| along(a).total_cmp(&along(b)));
        let ratio = (along(&views[1]) - along(&views[0])) / distance;
        if (1.0 / BAND_DISTANCE_RATIO..BAND_DISTANCE_RATIO).contains(&ratio) {
            views[1].band = 1;
            views.iter().zip(&mut pairs).for_each(|(view, places)| places.push(along(view)));
        } else {
            // Two pieces of one board, or something else that looks like a board.
            views.sort_by_key(|view| std::cmp::Reverse(view.corners.len()));
            views.truncate(1);
        }
    }
    let middle = |places: &mut Vec<f64>| upper_median(places).unwrap_or(f64::NAN);
    let border = if pairs[0].is_empty() {
        let mut places: Vec<f64> = frames.iter().flatten().map(along).collect();
        places.sort_by(f64::total_cmp);
        let gap = places.windows(2).max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
        match gap {
            Some(gap) if gap[1] - gap[0] > distance / BAND_DISTANCE_RATIO => 0.5 * (gap[0] + gap[1]),
            _ => {
                let reason = "only one of them is ever in view".to_owned();
                return Err(TargetError::Bands { reason });
            }
        }
    } else {
        0.5 * (middle(&mut pairs[0]) + middle(&mut pairs[1]))
    };
    for views in frames.iter_mut().filter(|views| views.len() == 1) {
        views[0].band = usize::from(along(&views[0]) > border);
    }
    Ok(())
}
