//! The rectified camera that fits a lens and its stage axis.

use std::ops::Range;

use rayon::prelude::*;

use super::spline::BORDER_PX;
use super::{Mapping, RectifiedCamera, RectifyError};
use crate::lens::Lens;
use epirig_core::grid::Grid;

impl Mapping {
    /// The mapping whose rectified image is as large as it can be without any pixel that the raw image does
    /// not show.
    ///
    /// Its focal length is the mean of the lens's two, so that a pixel stays as large as the sensor's: a
    /// larger one would add no detail, a smaller one would lose some. Of the grid on which the middles of
    /// both images coincide it is the largest upright rectangle of whole pixels that stay [`BORDER_PX`]
    /// inside the raw image; without roll, pan and distortion it is the raw image.
    ///
    /// # Errors
    /// [`RectifyError::NothingLeft`] if there is no such pixel.
    pub fn fitting(
        lens: Lens,
        roll_rad: f64,
        pan_rad: f64,
        raw_rows: usize,
        raw_columns: usize,
    ) -> Result<Self, RectifyError> {
        let mapping = Self::upright(lens, roll_rad, pan_rad, raw_rows, raw_columns);
        if mapping.is_identity() {
            return Ok(mapping);
        }
        let nothing = RectifyError::NothingLeft { rows: raw_rows, columns: raw_columns };
        let mapping = mapping.centred()?;
        let (last_x, last_y) = ((raw_columns - 1) as f64, (raw_rows - 1) as f64);
        let (middle_x, middle_y) = (0.5 * last_x, 0.5 * last_y);
        // The border of the raw image as whole pixels around the middle of the rectified one.
        let across = (0..raw_columns).flat_map(|x| [(x as f64, 0.0), (x as f64, last_y)]);
        let down = (0..raw_rows).flat_map(|y| [(0.0, y as f64), (last_x, y as f64)]);
        let (mut least, mut most) = ((middle_x, middle_y), (middle_x, middle_y));
        for (x, y) in across.chain(down).filter_map(|(x, y)| mapping.rectified(x, y)) {
            least = (least.0.min(x), least.1.min(y));
            most = (most.0.max(x), most.1.max(y));
        }
        let span = |least: f64, most: f64, size: usize| {
            let looked_at = mapping.looked_at(size);
            (least.floor() as i64).max(looked_at.start)
                ..(most.ceil() as i64).saturating_add(1).min(looked_at.end)
        };
        // All of the raw image, and whatever lies around it.
        let uncut = mapping.cut(span(least.0, most.0, raw_columns), span(least.1, most.1, raw_rows));
        let (columns, rows) = largest_rectangle(&uncut.valid()).ok_or(nothing)?;
        Ok(uncut.cut(columns, rows))
    }

    /// The mapping to a camera of the raw size, with the lens's principal point.
    pub(super) fn upright(
        lens: Lens,
        roll_rad: f64,
        pan_rad: f64,
        raw_rows: usize,
        raw_columns: usize,
    ) -> Self {
        let camera = RectifiedCamera {
            rows: raw_rows,
            columns: raw_columns,
            focal_length_px: 0.5 * (lens.focal_length_x_px + lens.focal_length_y_px),
            principal_point_x_px: lens.principal_point_x_px,
            principal_point_y_px: lens.principal_point_y_px,
        };
        Self { lens, roll_rad, pan_rad, raw_rows, raw_columns, camera }
    }

    /// The same mapping with the rectified camera moved so that the middles of both images coincide.
    pub(super) fn centred(mut self) -> Result<Self, RectifyError> {
        let (rows, columns) = (self.raw_rows, self.raw_columns);
        let nothing = RectifyError::NothingLeft { rows, columns };
        if rows == 0 || columns == 0 {
            return Err(nothing);
        }
        let (middle_x, middle_y) = (0.5 * (columns - 1) as f64, 0.5 * (rows - 1) as f64);
        let seen = self.rectified(middle_x, middle_y);
        let (x, y) = seen.filter(|(x, y)| x.is_finite() && y.is_finite()).ok_or(nothing)?;
        self.camera.principal_point_x_px += middle_x - x;
        self.camera.principal_point_y_px += middle_y - y;
        Ok(self)
    }

    /// The rectified columns or rows that are looked at, around `size` raw ones: twice as many as the longer
    /// side of the raw image has, so that a quarter turn keeps all of it.
    pub(super) fn looked_at(&self, size: usize) -> Range<i64> {
        let around = (self.raw_rows.max(self.raw_columns) - size.div_ceil(2)) as i64;
        -around..size as i64 + around
    }

    /// Which rectified pixels lie at least [`BORDER_PX`] inside the raw image.
    fn valid(&self) -> Grid<bool> {
        let mut valid = Grid::filled(self.camera.rows, self.camera.columns, false);
        let inside = |place: f64, size: usize| place >= BORDER_PX && place <= (size as f64 - 1.0) - BORDER_PX;
        let columns = self.camera.columns.max(1);
        let rotation = self.rotation();
        valid.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, row)| {
            for (x, valid) in row.iter_mut().enumerate() {
                let (a, b) = self.raw_ray(&rotation, x as f64, y as f64);
                let seen = self.lens.project(a, b);
                let [[aa, ab], [ba, bb]] = seen.by_ray;
                // Beyond the radius at which the distortion folds the image back on itself nothing is seen
                // twice.
                let unfolded = aa * bb - ab * ba > 0.0;
                *valid = unfolded && inside(seen.x_px, self.raw_columns) && inside(seen.y_px, self.raw_rows);
            }
        });
        valid
    }

    /// The same mapping for these columns and rows of the rectified image only.
    pub(super) fn cut(mut self, columns: Range<i64>, rows: Range<i64>) -> Self {
        self.camera.principal_point_x_px -= columns.start as f64;
        self.camera.principal_point_y_px -= rows.start as f64;
        self.camera.columns = (columns.end - columns.start).max(0) as usize;
        self.camera.rows = (rows.end - rows.start).max(0) as usize;
        self
    }
}

/// Columns and rows of the largest rectangle of `true`, the first one if there are several; `None` if all is
/// `false`.
///
/// For each row the heights of the columns of `true` that end there; a stack of rising heights gives the
/// widest rectangle under each.
fn largest_rectangle(mask: &Grid<bool>) -> Option<(Range<i64>, Range<i64>)> {
    let columns = mask.columns();
    let mut heights = vec![0_usize; columns];
    let mut best = (0, None);
    for y in 0..mask.rows() {
        for (height, &valid) in heights.iter_mut().zip(mask.row(y)) {
            *height = if valid { *height + 1 } else { 0 };
        }
        // First column and height of the rectangles that are still open.
        let mut open: Vec<(usize, usize)> = Vec::new();
        for x in 0..=columns {
            let height = heights.get(x).copied().unwrap_or(0);
            let mut start = x;
            while let Some(&(first, closed)) = open.last()
                && closed >= height
            {
                open.pop();
                start = first;
                let area = closed * (x - first);
                if area > best.0 {
                    let bottom = y as i64 + 1;
                    best = (area, Some((first as i64..x as i64, bottom - closed as i64..bottom)));
                }
            }
            if height > 0 {
                open.push((start, height));
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::lens::Distortion;

    proptest! {
        #[test]
        fn no_rectangle_is_larger(bits in proptest::collection::vec(proptest::bool::weighted(0.7), 42)) {
            let mask = Grid::from_values(6, 7, bits).unwrap();
            let full = |columns: Range<usize>, rows: Range<usize>| {
                rows.clone().all(|y| columns.clone().all(|x| mask.at(x, y)))
            };
            let mut largest = 0;
            for (left, right) in (0..7).flat_map(|left| (left + 1..=7).map(move |right| (left, right))) {
                for (top, bottom) in (0..6).flat_map(|top| (top + 1..=6).map(move |bottom| (top, bottom))) {
                    if full(left..right, top..bottom) {
                        largest = largest.max((right - left) * (bottom - top));
                    }
                }
            }
            match largest_rectangle(&mask) {
                Some((columns, rows)) => {
                    let columns = columns.start as usize..columns.end as usize;
                    let rows = rows.start as usize..rows.end as usize;
                    prop_assert_eq!(columns.len() * rows.len(), largest);
                    prop_assert!(full(columns, rows));
                }
                None => prop_assert_eq!(largest, 0),
            }
        }

        #[test]
        fn every_pixel_of_a_fitting_mapping_is_seen(
            roll in -0.05..0.05, pan in -0.05..0.05, k1 in -0.2..0.1, fy in 380.0..420.0,
        ) {
            let distortion = Distortion { k1, k2: 0.03, ..Distortion::default() };
            let lens = Lens { focal_length_y_px: fy, distortion, ..Lens::pinhole(400.0, 61.0, 52.0) };
            let mapping = Mapping::fitting(lens, roll, pan, 100, 120).unwrap();
            let camera = mapping.camera;
            prop_assert!(mapping.valid().values().iter().all(|&valid| valid));
            // At most are lost: 2 x 8 px of border, 0.05 of the other side to roll, 2.5 % to the mean focal
            // length, 2 px each to pan and to whole pixels.
            prop_assert!(camera.columns >= 92 && camera.rows >= 71, "{} x {}", camera.columns, camera.rows);
            // The middles coincide, up to what was cut: a whole number of pixels.
            let (x, y) = mapping.rectified(59.5, 49.5).unwrap();
            prop_assert!((x - 0.5 - x.floor()).abs() < 1e-9 && (y - 0.5 - y.floor()).abs() < 1e-9, "{x} {y}");
        }
    }

    #[test]
    fn a_straight_camera_keeps_the_whole_image() {
        let lens = Lens::pinhole(512.0, 40.3, 29.0);
        let mapping = Mapping::fitting(lens, 0.0, 0.0, 60, 80).unwrap();
        assert!(mapping.is_identity());
        assert_eq!((mapping.camera.rows, mapping.camera.columns), (60, 80));
    }

    #[test]
    fn a_quarter_turn_exchanges_rows_and_columns() {
        let lens = Lens::pinhole(512.0, 39.5, 39.5);
        let mapping = Mapping::fitting(lens, std::f64::consts::FRAC_PI_2, 0.0, 60, 80).unwrap();
        let lost = 2 * BORDER_PX as usize;
        let camera = mapping.camera;
        // Rounding of the turn may cost one more pixel on a side whose limit is met exactly.
        assert!((60 - lost - 2..=60 - lost).contains(&camera.columns), "{}", camera.columns);
        assert!((80 - lost - 2..=80 - lost).contains(&camera.rows), "{}", camera.rows);
    }

    #[test]
    fn what_leaves_nothing_is_an_error() {
        let lens = Lens::pinhole(512.0, 39.5, 29.5);
        assert!(matches!(Mapping::fitting(lens, 0.0, 3.0, 60, 80), Err(RectifyError::NothingLeft { .. })));
        assert!(matches!(Mapping::fitting(lens, 0.1, 0.0, 3, 3), Err(RectifyError::NothingLeft { .. })));
        let nan = Lens::pinhole(f64::NAN, 39.5, 29.5);
        assert!(matches!(Mapping::fitting(nan, 0.1, 0.0, 60, 80), Err(RectifyError::NothingLeft { .. })));
    }
}
