//! How far places in the image are off in the mean, part by part of it.

use super::calibration::{LensCalibration, PointResidual};

/// Parts of the region that the points reach, along each axis.
const PARTS: usize = 5;
/// Fewest points of a part: the noise of their mean is then a third of that of one.
const LEAST: usize = 9;

impl LensCalibration {
    /// Deviation of the x-y mapping that the lens leaves, in px: the largest mean residual of a part of the image, of 5 x 5
    /// parts of the region that the points reach. Residuals that are the same in all views are errors of the lens or of the
    /// board; the noise of points adds to it its part of a mean. `None` if no part has enough points.
    pub fn mapping_deviation_px(&self) -> Option<f64> {
        let points: Vec<&PointResidual> =
            self.residuals.iter().flatten().filter(|point| !point.rejected).collect();
        let part = |value: fn(&PointResidual) -> f64| {
            let all = || points.iter().map(|point| value(point));
            let (first, last) =
                (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
            let size = (last - first).max(f64::MIN_POSITIVE) / PARTS as f64;
            all().map(move |value| (((value - first) / size) as usize).min(PARTS - 1)).collect::<Vec<_>>()
        };
        let mut sums = [(0.0, 0.0, 0_usize); PARTS * PARTS];
        for ((point, column), row) in
            points.iter().zip(part(|point| point.x_px)).zip(part(|point| point.y_px))
        {
            let (x, y, count) = &mut sums[row * PARTS + column];
            (*x, *y, *count) = (*x + point.dx_px, *y + point.dy_px, *count + 1);
        }
        let means = sums.iter().filter(|(.., count)| *count >= LEAST);
        means.map(|(x, y, count)| x.hypot(*y) / *count as f64).reduce(f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::views::tests::wide_views;
    use crate::lens::views::{Terms, calibrate};

    #[test]
    fn what_all_views_have_in_common_is_told_beside_noise() {
        let views = wide_views(5, 20, 0.02);
        let (rows, columns) = (480, 640);
        let mut found = calibrate(&views, rows, columns, Terms::All5).unwrap();
        let noise_px = found.mapping_deviation_px().unwrap();
        // The largest of 25 means of some forty points each, of a noise of 0.02 px along both axes.
        assert!((0.001..0.015).contains(&noise_px), "{noise_px}");
        // The middle part is shifted in all views, of which the lens knows nothing.
        let middle = |value: f64, size: usize| (0.4..0.6).contains(&(value / size as f64));
        let inside = |point: &&mut PointResidual| middle(point.x_px, columns) && middle(point.y_px, rows);
        found.residuals.iter_mut().flatten().filter(inside).for_each(|point| point.dx_px += 0.1);
        assert!((found.mapping_deviation_px().unwrap() - 0.1).abs() < 0.03, "{found:?}");
        found.residuals.iter_mut().flatten().for_each(|point| point.rejected = true);
        assert_eq!(found.mapping_deviation_px(), None);
    }
}
