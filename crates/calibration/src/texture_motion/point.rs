//! Points with texture: where they are, and where each is in another picture.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::track::Sight;
use epirig_core::grid::Grid;
use epirig_core::spline::cubic::weights;

/// Points that share so little with their image elsewhere are not the same.
const LEAST_CORRELATION: f64 = 0.8;
/// A point is not looked for farther than this from where it is expected, in px.
const REACH_PX: f64 = 2.5;
/// Least standard deviation that the gradient gives a block of so many pixels, in DN per px.
const LEAST_GRADIENT_DN: f64 = 0.25;
/// Share of the gradients along the motion that is added to those across it: where texture does not tell the
/// place across the motion, it stays as expected.
const HELD: f64 = 1e-3;
/// Variance of two frames that are rounded to whole DN, after smoothing, which leaves a quarter of it: the least
/// that is left unexplained.
const ROUNDING_DN2: f64 = 0.25 * 2.0 / 12.0;
const STEPS: usize = 12;
const FINE_PX: f64 = 1e-4;

/// The square at (left, top) in each cell of the picture that tells the place along `direction` best.
pub(super) fn squares(
    picture: &Grid<f32>,
    side: usize,
    most: usize,
    direction: [f64; 2],
) -> Vec<(usize, usize)> {
    let (rows, columns) = (picture.rows(), picture.columns());
    let room = |size: usize| size.saturating_sub(side + 4);
    if room(rows) == 0 || room(columns) == 0 {
        return Vec::new();
    }
    let pitch = ((rows * columns) as f64 / most as f64).sqrt().max(side as f64);
    let count = |size: usize| ((size as f64 / pitch) as usize).max(1);
    let (down, across) = (count(rows), count(columns));
    let cells: Vec<(usize, usize)> =
        (0..down).flat_map(|row| (0..across).map(move |column| (row, column))).collect();
    let hop = (side / 2).max(1);
    let best = |&(row, column): &(usize, usize)| {
        let places = |cell: usize, count: usize, size: usize| {
            let room = room(size);
            let (from, to) = (2 + cell * room / count, 2 + (cell + 1) * room / count);
            (from..to.max(from + 1)).step_by(hop)
        };
        let tops = places(row, down, rows);
        let tried = tops.flat_map(|top| places(column, across, columns).map(move |left| (left, top)));
        let judged =
            tried.filter_map(|(left, top)| Some((tells(picture, left, top, side, direction)?, (left, top))));
        judged.max_by(|a, b| a.0.total_cmp(&b.0)).map(|judged| judged.1)
    };
    cells.par_iter().filter_map(best).collect()
}

/// How well a square tells the place along `direction`, if the place across it is open.
fn tells(picture: &Grid<f32>, left: usize, top: usize, side: usize, direction: [f64; 2]) -> Option<f64> {
    let [mut aa, mut ab, mut bb] = [0.0; 3];
    for y in top..top + side {
        let (above, here, below) = (picture.row(y - 1), picture.row(y), picture.row(y + 1));
        for x in left..left + side {
            let gx = 0.5 * f64::from(here[x + 1] - here[x - 1]);
            let gy = 0.5 * f64::from(below[x] - above[x]);
            let (along, across) =
                (gx * direction[0] + gy * direction[1], gy * direction[0] - gx * direction[1]);
            aa += along * along;
            ab += along * across;
            bb += across * across;
        }
    }
    let told = aa - ab * ab / (bb + HELD * aa).max(f64::MIN_POSITIVE);
    (told >= LEAST_GRADIENT_DN.powi(2) * (side * side) as f64).then_some(told)
}

/// A square of a picture, to be placed in others. Both are smoothed by the B-spline 1/6 4/6 1/6, along rows and
/// columns: a spline through smoothed samples is the spline with the samples as its coefficients.
pub(super) struct Template {
    left: usize,
    top: usize,
    side: usize,
    /// The square, and its gradients along and across the motion, without means.
    basis: [Vec<f32>; 3],
    inverse: Matrix3<f64>,
    direction: [f64; 2],
}

impl Template {
    /// The middle of the square, in px of its picture.
    pub(super) fn middle(&self) -> [f64; 2] {
        [self.left, self.top].map(|first| first as f64 + 0.5 * (self.side as f64 - 1.0))
    }

    /// `None` if it is too near to the border.
    pub(super) fn of(
        picture: &Grid<f32>,
        (left, top): (usize, usize),
        side: usize,
        direction: [f64; 2],
    ) -> Option<Self> {
        let mut square = vec![0.0; side * side];
        let mut rows = Vec::new();
        // Differences of neighbours of the smoothed square, from squares beside it.
        let mut beside = |x: isize, y: isize, into: &mut Vec<f32>| {
            smooth(picture, [left as f64 + x as f64, top as f64 + y as f64], side, &mut rows, into)
        };
        beside(0, 0, &mut square)?;
        let mut gradient = |x: isize, y: isize| -> Option<Vec<f32>> {
            let [mut after, mut before] = [vec![0.0; side * side], vec![0.0; side * side]];
            beside(x, y, &mut after)?;
            beside(-x, -y, &mut before)?;
            Some(after.iter().zip(&before).map(|(after, before)| 0.5 * (after - before)).collect())
        };
        let (gx, gy) = (gradient(1, 0)?, gradient(0, 1)?);
        let [cos, sin] = direction.map(|part| part as f32);
        let along = gx.iter().zip(&gy).map(|(x, y)| x * cos + y * sin).collect();
        let across = gx.iter().zip(&gy).map(|(x, y)| y * cos - x * sin).collect();
        let mut basis = [square, along, across];
        basis.iter_mut().for_each(|values| without_mean(values));
        let mut matrix = Matrix3::from_fn(|i, j| dot(&basis[i], &basis[j]));
        matrix[(2, 2)] += HELD * matrix[(1, 1)];
        let inverse = matrix.try_inverse()?;
        Some(Self { left, top, side, basis, inverse, direction })
    }

    /// Places the square in `picture`, from a start that is columns and rows from where it is in its own: Gauss-Newton
    /// steps with gradients of the square itself, whose noise is independent of the picture's; contrast and brightness
    /// are free. The picture is that of a frame, reduced by `factor`.
    pub(super) fn place(
        &self,
        picture: &Grid<f32>,
        (frame, factor): (usize, usize),
        [x, y]: [f64; 2],
        scratch: &mut Scratch,
    ) -> Option<Sight> {
        let [cos, sin] = self.direction;
        let start = [x * cos + y * sin, y * cos - x * sin];
        let mut moved = start;
        let count = (self.side * self.side) as f64;
        scratch.square.resize(self.side * self.side, 0.0);
        for _ in 0..STEPS {
            let [along, across] = moved;
            let corner =
                [self.left as f64 + along * cos - across * sin, self.top as f64 + along * sin + across * cos];
            smooth(picture, corner, self.side, &mut scratch.rows, &mut scratch.square)?;
            without_mean(&mut scratch.square);
            let products = Vector3::from_fn(|i, _| dot(&self.basis[i], &scratch.square));
            let fit = self.inverse * products;
            if fit[0] <= 0.0 {
                return None;
            }
            let step = [fit[1] / fit[0], fit[2] / fit[0]];
            moved = [moved[0] - step[0], moved[1] - step[1]];
            if (moved[0] - start[0]).hypot(moved[1] - start[1]) > REACH_PX {
                return None;
            }
            if step[0].hypot(step[1]) < FINE_PX {
                let energy = dot(&scratch.square, &scratch.square);
                let left = (energy - fit.dot(&products)).max(0.0);
                let variance = (left / (count - 4.0)).max(ROUNDING_DN2) / (fit[0] * fit[0]);
                let correlates = energy > 0.0 && left <= (1.0 - LEAST_CORRELATION.powi(2)) * energy;
                let middle = self.middle();
                let [along, across] = moved;
                let seen = [middle[0] + along * cos - across * sin, middle[1] + along * sin + across * cos];
                let px = factor as f64;
                return correlates.then_some(Sight {
                    frame,
                    place: seen.map(|part| in_full(part, factor)),
                    along_variance: px * px * (variance * self.inverse[(1, 1)]),
                    across_variance: px * px * (variance * self.inverse[(2, 2)]),
                });
            }
        }
        None
    }
}

/// A place of a picture that is reduced by `factor` in the frame itself.
pub(super) fn in_full(place: f64, factor: usize) -> f64 {
    let px = factor as f64;
    px * place + 0.5 * (px - 1.0)
}

/// Memory that placing uses again.
#[derive(Default)]
pub(super) struct Scratch {
    square: Vec<f32>,
    rows: Vec<f32>,
}

/// The spline with the pixels of `picture` as its coefficients, over a square from `corner` on; `None` beyond the
/// border.
fn smooth(
    picture: &Grid<f32>,
    corner: [f64; 2],
    side: usize,
    rows: &mut Vec<f32>,
    square: &mut [f32],
) -> Option<()> {
    let whole = corner.map(f64::floor);
    let inside = |whole: f64, size: usize| whole >= 1.0 && whole + (side + 2) as f64 <= size as f64;
    if !inside(whole[0], picture.columns()) || !inside(whole[1], picture.rows()) {
        return None;
    }
    let [x, y] = [0, 1].map(|axis| weights((corner[axis] - whole[axis]) as f32));
    let (left, top) = (whole[0] as usize - 1, whole[1] as usize - 1);
    rows.clear();
    for row in top..top + side + 3 {
        let from = &picture.row(row)[left..][..side + 3];
        let value = |taps: &[f32]| x[0] * taps[0] + x[1] * taps[1] + x[2] * taps[2] + x[3] * taps[3];
        rows.extend(from.windows(4).map(value));
    }
    for (row, line) in square.chunks_exact_mut(side).enumerate() {
        let from = &rows[row * side..][..4 * side];
        for (column, value) in line.iter_mut().enumerate() {
            *value = (0..4).map(|tap| y[tap] * from[tap * side + column]).sum();
        }
    }
    Some(())
}

fn without_mean(values: &mut [f32]) {
    let mean = values.iter().sum::<f32>() / values.len() as f32;
    values.iter_mut().for_each(|value| *value -= mean);
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    f64::from(a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>())
}
