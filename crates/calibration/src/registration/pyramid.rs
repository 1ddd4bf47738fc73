//! An image pyramid, and the search in its smallest image.

use rayon::prelude::*;

use epirig_core::grid::Grid;

/// Images are halved until their shorter side is below this, in px.
const SMALL: usize = 64;
/// In the smallest all shifts up to a quarter of its sides are tried, but not beyond this, in px.
const FARTHEST: usize = 16;

/// The pair at falling sizes, the given one first.
pub(super) fn pyramid(first: Grid<f32>, second: Grid<f32>) -> Vec<[Grid<f32>; 2]> {
    let mut levels = vec![[first, second]];
    loop {
        let [first, second] = &levels[levels.len() - 1];
        if first.rows().min(first.columns()) < SMALL {
            return levels;
        }
        let halved = [halved(first), halved(second)];
        levels.push(halved);
    }
}

/// Half as large: each pixel is the binomial mean 1 3 3 1 about the corner of four pixels, which lets little
/// alias.
fn halved(image: &Grid<f32>) -> Grid<f32> {
    let (rows, columns) = (image.rows() / 2, image.columns() / 2);
    let mut small = Grid::filled(rows, columns, 0.0);
    small.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
        let row = |offset: usize| image.row((2 * y + offset).saturating_sub(1).min(image.rows() - 1));
        let [a, b, c, d] = [row(0), row(1), row(2), row(3)];
        let line: Vec<f32> =
            (0..image.columns()).map(|x| 0.125 * (a[x] + d[x]) + 0.375 * (b[x] + c[x])).collect();
        for (x, out) in out.iter_mut().enumerate() {
            let at = |offset: usize| line[(2 * x + offset).saturating_sub(1).min(line.len() - 1)];
            *out = 0.125 * (at(0) + at(3)) + 0.375 * (at(1) + at(2));
        }
    });
    small
}

/// The shift of whole pixels at which the images correlate best.
pub(super) fn best_whole_shift([first, second]: &[Grid<f32>; 2]) -> [f64; 2] {
    let reach = |size: usize| (size / 4).min(FARTHEST) as isize;
    let (across, down) = (reach(first.columns()), reach(first.rows()));
    let shifts: Vec<[isize; 2]> =
        (-down..=down).flat_map(|y| (-across..=across).map(move |x| [x, y])).collect();
    let scores: Vec<f64> = shifts.par_iter().map(|&shift| correlation(first, second, shift)).collect();
    let best = shifts.iter().zip(scores).max_by(|(_, one), (_, other)| one.total_cmp(other));
    best.map_or([0.0; 2], |(shift, _)| shift.map(|pixels| pixels as f64))
}

/// Correlation of the common part of both images if the second is shifted by whole pixels.
fn correlation(first: &Grid<f32>, second: &Grid<f32>, [x, y]: [isize; 2]) -> f64 {
    let range = |size: usize, shift: isize| {
        ((-shift).max(0) as usize, (size as isize - shift.max(0)).max(0) as usize)
    };
    let (left, right) = range(first.columns(), x);
    let (top, bottom) = range(first.rows(), y);
    let [mut a, mut b, mut aa, mut ab, mut bb] = [0.0_f64; 5];
    for row in top..bottom {
        let one = &first.row(row)[left..right];
        let other = &second.row(row.saturating_add_signed(y))[left.saturating_add_signed(x)..];
        for (&one, &other) in one.iter().zip(other) {
            let (one, other) = (f64::from(one), f64::from(other));
            a += one;
            b += other;
            aa += one * one;
            ab += one * other;
            bb += other * other;
        }
    }
    let count = ((right - left) * (bottom - top)) as f64;
    let spread = ((aa - a * a / count) * (bb - b * b / count)).sqrt();
    if spread > 0.0 { (ab - a * b / count) / spread } else { 0.0 }
}
