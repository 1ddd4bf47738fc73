//! Interpolation and smoothing of an image.

use epirig_core::grid::Grid;

/// The value at (x, y) by bilinear interpolation; the nearest pixel's outside the image.
pub(super) fn bilinear(image: &Grid<f32>, x: f64, y: f64) -> f32 {
    let x = x.clamp(0.0, (image.columns() - 1) as f64);
    let y = y.clamp(0.0, (image.rows() - 1) as f64);
    let (column, row) = (x as usize, y as usize);
    let (right, below) = ((column + 1).min(image.columns() - 1), (row + 1).min(image.rows() - 1));
    let (fx, fy) = ((x - column as f64) as f32, (y - row as f64) as f32);
    let (upper, lower) = (image.row(row), image.row(below));
    let above = upper[column] + fx * (upper[right] - upper[column]);
    let under = lower[column] + fx * (lower[right] - lower[column]);
    above + fy * (under - above)
}

/// The image convolved with a Gaussian, cut off at three standard deviations; at borders the outermost pixels
/// are repeated.
pub(super) fn smoothed(image: &Grid<f32>, sigma_px: f32) -> Grid<f32> {
    let radius = (3.0 * sigma_px).ceil() as usize;
    let weight = |k: usize| (-0.5 * (k as f32 / sigma_px).powi(2)).exp();
    let total: f32 = weight(0) + 2.0 * (1..=radius).map(weight).sum::<f32>();
    let weights: Vec<f32> = (0..=radius).map(|k| weight(k) / total).collect();
    let (rows, columns) = (image.rows(), image.columns());

    let mut across = Grid::filled(rows, columns, 0.0_f32);
    let mut padded = vec![0.0_f32; columns + 2 * radius];
    for y in 0..rows {
        let row = image.row(y);
        padded[..radius].fill(row[0]);
        padded[radius..radius + columns].copy_from_slice(row);
        padded[radius + columns..].fill(row[columns - 1]);
        let out = across.row_mut(y);
        for (value, &centre) in out.iter_mut().zip(row) {
            *value = weights[0] * centre;
        }
        for (k, &weight) in weights.iter().enumerate().skip(1) {
            let (left, right) = (&padded[radius - k..], &padded[radius + k..]);
            for ((value, &a), &b) in out.iter_mut().zip(left).zip(right) {
                *value += weight * (a + b);
            }
        }
    }
    let mut smooth = Grid::filled(rows, columns, 0.0_f32);
    for y in 0..rows {
        let out = smooth.row_mut(y);
        for (value, &centre) in out.iter_mut().zip(across.row(y)) {
            *value = weights[0] * centre;
        }
        for (k, &weight) in weights.iter().enumerate().skip(1) {
            let (above, below) = (across.row(y.saturating_sub(k)), across.row((y + k).min(rows - 1)));
            for ((value, &a), &b) in out.iter_mut().zip(above).zip(below) {
                *value += weight * (a + b);
            }
        }
    }
    smooth
}
