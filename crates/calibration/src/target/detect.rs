//! Corner candidates: saddles of the smoothed image with four alternating sectors around them.

use std::f64::consts::PI;

use super::sampling::{bilinear, smoothed};
use epirig_core::grid::Grid;

/// Noise of single pixels is halved and more, and squares from some 8 px on stay squares.
const SMOOTHING_PX: f32 = 1.4;
/// Half the step from black to white is at least this share of the range of intensities in the image.
const LEAST_CONTRAST: f64 = 0.02;
/// Radius of the ring on which sectors are looked at, in px: half of the smallest square.
const RING_PX: f64 = 4.0;
/// Samples on the ring.
const RING: usize = 16;
/// Opposite samples may differ by this share of the difference between neighbouring sectors: halfway between
/// a corner (0) and an edge (2).
const MOST_ODD: f32 = 0.8;
/// The most promising places that are kept: ten boards of 400 corners.
const MOST: usize = 4000;

/// A place that may be a corner.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) x: f64,
    pub(super) y: f64,
    /// Direction of the edge with a bright sector after it, as growing angles go from x to y; 0 to pi.
    pub(super) before_bright_rad: f64,
    /// Direction of the edge with a dark sector after it; 0 to pi.
    pub(super) before_dark_rad: f64,
    /// Determinant of the second derivatives, negated.
    pub(super) strength: f64,
}

/// An image as detection sees it: smoothed, with its candidates.
pub(super) struct Scene {
    pub(super) smooth: Grid<f32>,
    pub(super) candidates: Vec<Candidate>,
}

impl Scene {
    pub(super) fn new(image: &Grid<f32>) -> Self {
        let smooth = smoothed(image, SMOOTHING_PX);
        let candidates = candidates(&smooth);
        Self { smooth, candidates }
    }
}

/// Second derivatives at a pixel: xx, xy, yy.
fn second_derivatives(smooth: &Grid<f32>, x: usize, y: usize) -> [f64; 3] {
    let at = |dx: usize, dy: usize| f64::from(smooth.at(x + dx - 1, y + dy - 1));
    let centre = 2.0 * at(1, 1);
    [
        at(0, 1) - centre + at(2, 1),
        0.25 * (at(0, 0) - at(2, 0) - at(0, 2) + at(2, 2)),
        at(1, 0) - centre + at(1, 2),
    ]
}

/// The determinant of the second derivatives, negated: large at saddles.
fn responses(smooth: &Grid<f32>) -> Grid<f32> {
    let (rows, columns) = (smooth.rows(), smooth.columns());
    let mut responses = Grid::filled(rows, columns, 0.0_f32);
    for y in 1..rows.saturating_sub(1) {
        let (above, here, below) = (smooth.row(y - 1), smooth.row(y), smooth.row(y + 1));
        let out = responses.row_mut(y);
        for (((value, above), here), below) in
            out[1..].iter_mut().zip(above.windows(3)).zip(here.windows(3)).zip(below.windows(3))
        {
            let centre = 2.0 * here[1];
            let (xx, yy) = (here[0] - centre + here[2], above[1] - centre + below[1]);
            let xy = 0.25 * (above[0] - above[2] - below[0] + below[2]);
            *value = xy * xy - xx * yy;
        }
    }
    responses
}

/// Whether no value within two pixels is larger; of equal ones the first counts.
fn is_peak(responses: &Grid<f32>, x: usize, y: usize) -> bool {
    let value = responses.at(x, y);
    (y - 2..=y + 2).all(|row| {
        responses.row(row)[x - 2..=x + 2].iter().enumerate().all(|(k, &other)| {
            let first = (row, x + k - 2) < (y, x);
            if first { other < value } else { other <= value }
        })
    })
}

fn candidates(smooth: &Grid<f32>) -> Vec<Candidate> {
    let (rows, columns) = (smooth.rows(), smooth.columns());
    if rows < 16 || columns < 16 {
        return Vec::new();
    }
    let (least, most) = smooth.values().iter().fold((f32::MAX, f32::MIN), |(a, b), &v| (a.min(v), b.max(v)));
    // A corner of half step b under a blur s has a mixed derivative of 2 b / (pi s^2). Edges may be blurred
    // as much again as we smooth.
    let blur2 = 2.0 * f64::from(SMOOTHING_PX).powi(2);
    let threshold = (2.0 * LEAST_CONTRAST * f64::from(most - least) / (PI * blur2)).powi(2) as f32;
    let responses = responses(smooth);
    let mut found = Vec::new();
    for y in 4..rows - 4 {
        let row = responses.row(y);
        for (x, &value) in row.iter().enumerate().take(columns - 4).skip(4) {
            // Neighbours in the row refuse most places before a whole window is looked at.
            let may_be = value > threshold && row[x - 1] < value && row[x + 1] <= value;
            if may_be && is_peak(&responses, x, y) {
                found.extend(candidate(smooth, x, y, f64::from(value)));
            }
        }
    }
    found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    found.truncate(MOST);
    found
}

fn candidate(smooth: &Grid<f32>, column: usize, row: usize, strength: f64) -> Option<Candidate> {
    let [xx, xy, yy] = second_derivatives(smooth, column, row);
    let at = |x: usize, y: usize| f64::from(smooth.at(x, y));
    let gradient_x = 0.5 * (at(column + 1, row) - at(column - 1, row));
    let gradient_y = 0.5 * (at(column, row + 1) - at(column, row - 1));
    // The saddle lies where the gradient vanishes.
    let determinant = xx * yy - xy * xy;
    let dx = (-(yy * gradient_x - xy * gradient_y) / determinant).clamp(-1.0, 1.0);
    let dy = (-(xx * gradient_y - xy * gradient_x) / determinant).clamp(-1.0, 1.0);
    let (x, y) = (column as f64 + dx, row as f64 + dy);
    if !has_four_sectors(smooth, x, y) {
        return None;
    }
    // The curvature along an angle is m + A cos(2 (angle - middle)): positive in the bright sector, zero
    // along the edges.
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let middle = 0.5 * xy.atan2(half);
    let opening = 0.5 * (-mean / half.hypot(xy)).clamp(-1.0, 1.0).acos();
    Some(Candidate {
        x,
        y,
        before_bright_rad: (middle - opening).rem_euclid(PI),
        before_dark_rad: (middle + opening).rem_euclid(PI),
        strength,
    })
}

/// Whether the ring around (x, y) is bright, dark, bright, dark, and opposite sectors are alike.
fn has_four_sectors(smooth: &Grid<f32>, x: f64, y: f64) -> bool {
    let ring: [f32; RING] = std::array::from_fn(|k| {
        let (sin, cos) = (2.0 * PI * k as f64 / RING as f64).sin_cos();
        bilinear(smooth, x + RING_PX * cos, y + RING_PX * sin)
    });
    let mean = ring.iter().sum::<f32>() / RING as f32;
    let changes = (0..RING).filter(|&k| (ring[k] > mean) != (ring[(k + 1) % RING] > mean)).count();
    let odd: f32 = (0..RING / 2).map(|k| (ring[k] - ring[k + RING / 2]).abs()).sum();
    let even: f32 = (0..RING / 2).map(|k| (ring[k] + ring[k + RING / 2] - 2.0 * mean).abs()).sum();
    changes == 4 && odd < MOST_ODD * even
}
