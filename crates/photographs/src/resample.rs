//! The photographs rectified with the true motion: what a rectification could do that knew
//! everything.

use epirig_core::grid::Grid;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::Series;

/// Poles of the recursive filter of the quintic B-spline.
const POLES: [f32; 2] = [-0.430_575_34, -0.043_096_29];
/// Pixels at the edge of a photograph that a rectified frame does not reach: the spline knows
/// little there.
const MARGIN_PX: f64 = 4.0;

/// A rectified frame. Its pixel (x, y) looks along (x + left, y + top, f) in the axes of the rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Of its first column, in px from the optical axis.
    pub left: f64,
    /// Of its first row, in px from the optical axis.
    pub top: f64,
    /// Its rows.
    pub rows: usize,
    /// Its columns.
    pub columns: usize,
}

impl Series {
    /// The pixel of a photograph at which the pixel (x, y) of a rectified frame is seen, for points
    /// of middle depth; for those of other depth only the offsets of the frame differ.
    pub fn rectified_pixel(&self, frame: usize, region: &Region, x: f64, y: f64) -> (f64, f64) {
        let motion = &self.motion;
        let direction = Vector3::new(x + region.left, y + region.top, self.camera.focal_length_px);
        let common = motion.rail_axes().tr_mul(&direction);
        let common = common / common.z - self.middle_inverse_depth() * motion.offsets_mm[frame];
        self.camera.pixel(&(motion.views[frame].rotation * common))
    }

    /// The largest rectified frame that lies in all photographs, to 8 px.
    pub fn region(&self) -> Region {
        const STEP: usize = 8;
        let size = self.camera.rows.max(self.camera.columns);
        let count = 2 * (size * 4 / 5 / STEP) + 1;
        let first = -((count / 2 * STEP) as f64);
        // Without turn and wobble, rectified pixels are pixels of the photographs: the principal
        // point may lie between them.
        let centre = self.camera.centre();
        let origin =
            Region { left: first + centre.0.fract(), top: first + centre.1.fract(), rows: 0, columns: 0 };
        let (width, height) = (self.camera.columns as f64 - 1.0, self.camera.rows as f64 - 1.0);
        let is_inside = |(x, y): (f64, f64)| {
            x > MARGIN_PX && y > MARGIN_PX && x < width - MARGIN_PX && y < height - MARGIN_PX
        };
        let at = |index: usize| (index * STEP) as f64;
        let covered: Vec<Vec<bool>> = (0..count)
            .into_par_iter()
            .map(|j| {
                let is_covered = |i: &usize| {
                    (0..self.count())
                        .all(|frame| is_inside(self.rectified_pixel(frame, &origin, at(*i), at(j))))
                };
                (0..count).map(|i| is_covered(&i)).collect()
            })
            .collect();
        let (left, top, columns, rows) = largest_rectangle(&covered);
        assert!(columns > 1 && rows > 1, "no part of the scene is in all photographs");
        Region {
            left: origin.left + at(left),
            top: origin.top + at(top),
            rows: (rows - 1) * STEP + 1,
            columns: (columns - 1) * STEP + 1,
        }
    }

    /// A photograph, rectified with the true motion by a quintic B-spline.
    pub fn rectified_by_truth(&self, frame: usize, photograph: &Grid<u8>, region: &Region) -> Grid<f32> {
        let coefficients = prefiltered(photograph);
        let mut rectified = Grid::filled(region.rows, region.columns, 0.0_f32);
        rectified.values_mut().par_chunks_mut(region.columns).enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                let (x, y) = self.rectified_pixel(frame, region, x as f64, y as f64);
                *value = interpolated(&coefficients, x, y);
            }
        });
        rectified
    }
}

/// Left, top, width and height of the largest rectangle of true values.
fn largest_rectangle(covered: &[Vec<bool>]) -> (usize, usize, usize, usize) {
    let mut heights = vec![0; covered[0].len()];
    let mut best = (0, 0, 0, 0);
    for (j, row) in covered.iter().enumerate() {
        heights
            .iter_mut()
            .zip(row)
            .for_each(|(height, &is_in)| *height = if is_in { *height + 1 } else { 0 });
        // For each column: the widest rectangle to the right whose height is the least of its
        // columns.
        for left in 0..heights.len() {
            let mut height = usize::MAX;
            for (right, &other) in heights.iter().enumerate().skip(left) {
                height = height.min(other);
                let width = right - left + 1;
                if height * width > best.2 * best.3 {
                    best = (left, j + 1 - height, width, height);
                }
                if height == 0 {
                    break;
                }
            }
        }
    }
    best
}

/// Coefficients of the quintic B-spline through the grey values; the picture goes on mirrored at
/// its edges.
fn prefiltered(photograph: &Grid<u8>) -> Grid<f32> {
    let mut grid = photograph.map(f32::from);
    let (rows, columns) = (grid.rows(), grid.columns());
    grid.values_mut().par_chunks_mut(columns).for_each(filter);
    let mut turned: Vec<f32> =
        (0..columns).flat_map(|x| (0..rows).map(move |y| (x, y))).map(|(x, y)| grid.at(x, y)).collect();
    turned.par_chunks_mut(rows).for_each(filter);
    for y in 0..rows {
        grid.row_mut(y).iter_mut().enumerate().for_each(|(x, value)| *value = turned[x * rows + y]);
    }
    grid
}

fn filter(line: &mut [f32]) {
    let last = line.len() - 1;
    let gain: f32 = POLES.iter().map(|pole| (1.0 - pole) * (1.0 - 1.0 / pole)).product();
    line.iter_mut().for_each(|value| *value *= gain);
    for pole in POLES {
        let mut power = 1.0;
        let mut start = 0.0;
        for value in line.iter().take(24) {
            start += power * value;
            power *= pole;
        }
        line[0] = start;
        for index in 1..=last {
            line[index] += pole * line[index - 1];
        }
        line[last] = pole / (pole * pole - 1.0) * (line[last] + pole * line[last - 1]);
        for index in (0..last).rev() {
            line[index] = pole * (line[index + 1] - line[index]);
        }
    }
}

/// The spline's value at a place in the picture, at least 3 px from its edge.
fn interpolated(coefficients: &Grid<f32>, x: f64, y: f64) -> f32 {
    let (i, j) = (x.floor(), y.floor());
    let (wx, wy) = (quintic((x - i) as f32), quintic((y - j) as f32));
    let (i, j) = (i as usize - 2, j as usize - 2);
    let line = |row: usize| -> f32 {
        coefficients.row(j + row)[i..i + 6].iter().zip(wx).map(|(value, weight)| weight * value).sum()
    };
    wy.into_iter().enumerate().map(|(row, weight)| weight * line(row)).sum()
}

/// Weights of the quintic B-spline at `a` (0 to 1) after its third coefficient.
fn quintic(a: f32) -> [f32; 6] {
    std::array::from_fn(|k| {
        let x = (a + 2.0 - k as f32).abs();
        if x <= 1.0 {
            0.55 - 0.5 * x * x + 0.25 * x.powi(4) - x.powi(5) / 12.0
        } else if x <= 2.0 {
            0.425 + 0.625 * x - 1.75 * x * x + 1.25 * x.powi(3) - 0.375 * x.powi(4) + x.powi(5) / 24.0
        } else {
            (3.0 - x).max(0.0).powi(5) / 120.0
        }
    })
}
