//! Which rectified pixels the frames show: those that all show, and the rectangle that holds all that any
//! shows.

use std::ops::Range;

use rayon::prelude::*;

use super::spline::SEEN_PX;
use super::view::{ROUNDING_PX, View};
use super::{FramePose, Mapping, RectifyError};
use crate::lens::Lens;
use epirig_core::grid::Grid;

/// Rows that are looked at together, and columns of a rectangle to begin with.
const TILE: usize = 64;
/// Sides up to which pixels are looked at one by one: a rectangle costs as much as some pixels.
const SMALL: i64 = 4;

impl Mapping {
    /// The mapping whose rectified image holds everything that any frame shows.
    ///
    /// Focal length and grid are those of [`Self::fitting`]: the middles of the rectified image before it is
    /// cut and of the raw image of the mean camera coincide. Of this grid it is the smallest upright
    /// rectangle of whole pixels that holds every pixel which lies in the raw image of a frame. At most twice
    /// the longer side of the raw image is looked at, in both directions. No `poses`: all frames have the
    /// mean camera.
    ///
    /// [`Rectifier::with_poses`](super::Rectifier::with_poses) gives pixels that a frame does not show the
    /// value of its border; [`Self::seen`] says which pixels all frames show.
    ///
    /// # Errors
    /// [`RectifyError::NothingLeft`] if no frame shows any pixel.
    pub fn covering(
        lens: Lens,
        roll_rad: f64,
        pan_rad: f64,
        raw_rows: usize,
        raw_columns: usize,
        poses: &[FramePose],
    ) -> Result<Self, RectifyError> {
        let mapping = Self::upright(lens, roll_rad, pan_rad, raw_rows, raw_columns).centred()?;
        let whole = (mapping.looked_at(raw_columns), mapping.looked_at(raw_rows));
        let mut shown = None;
        for view in mapping.views(poses) {
            extend(&view, whole.clone(), &mut shown);
        }
        let (columns, rows) =
            shown.ok_or(RectifyError::NothingLeft { rows: raw_rows, columns: raw_columns })?;
        Ok(mapping.cut(columns, rows))
    }

    /// Which rectified pixels all frames show, at least 3 px inside their borders. No `poses`: all
    /// frames have the mean camera; if its pixels are rectified pixels as they are, they count up to the
    /// border.
    pub fn seen(&self, poses: &[FramePose]) -> Grid<bool> {
        let as_they_are = self.is_identity() && poses.iter().all(|pose| *pose == FramePose::default());
        let inset_px = if as_they_are { -ROUNDING_PX } else { SEEN_PX };
        let (rows, columns) = (self.camera.rows, self.camera.columns);
        let views = self.views(poses);
        let mut seen = Grid::filled(rows, columns, true);
        seen.values_mut().par_chunks_mut((TILE * columns).max(1)).enumerate().for_each(|(band, values)| {
            let top = (band * TILE) as i64;
            let height = (values.len() / columns) as i64;
            let mut band = Band { values, columns, top, inset_px };
            for left in (0..columns).step_by(TILE) {
                let tile = left as i64..columns.min(left + TILE) as i64;
                views.iter().for_each(|view| band.clear(view, tile.clone(), top..top + height));
            }
        });
        seen
    }

    /// The frames of these poses; one of the mean camera if there are none.
    pub(super) fn views(&self, poses: &[FramePose]) -> Vec<View> {
        let mean = [FramePose::default()];
        let poses = if poses.is_empty() { &mean } else { poses };
        poses.iter().map(|pose| View::new(self, pose)).collect()
    }
}

/// A band of rows of the map of seen pixels.
struct Band<'a> {
    values: &'a mut [bool],
    columns: usize,
    top: i64,
    inset_px: f64,
}

impl Band<'_> {
    /// Takes away the pixels of a rectangle that the frame does not show.
    fn clear(&mut self, view: &View, columns: Range<i64>, rows: Range<i64>) {
        match view.shows_all(columns.clone(), rows.clone(), self.inset_px) {
            Some(true) => {}
            Some(false) => rows.for_each(|y| self.row(y, &columns).fill(false)),
            None if length(&columns).max(length(&rows)) <= SMALL => {
                let inset_px = self.inset_px;
                for y in rows {
                    for (x, seen) in columns.clone().zip(self.row(y, &columns)) {
                        *seen = *seen && view.shows(x as f64, y as f64, inset_px);
                    }
                }
            }
            None => quarters(columns, rows, |columns, rows| self.clear(view, columns, rows)),
        }
    }

    fn row(&mut self, y: i64, columns: &Range<i64>) -> &mut [bool] {
        let start = (y - self.top) as usize * self.columns;
        &mut self.values[start + columns.start as usize..start + columns.end as usize]
    }
}

/// Columns and rows of a rectangle.
type Rectangle = (Range<i64>, Range<i64>);

/// Widens `shown` to hold all pixels of a rectangle that lie in the raw image of the frame.
fn extend(view: &View, (columns, rows): Rectangle, shown: &mut Option<Rectangle>) {
    let within =
        |outer: &Range<i64>, inner: &Range<i64>| outer.start <= inner.start && inner.end <= outer.end;
    let known = shown.as_ref().is_some_and(|known| within(&known.0, &columns) && within(&known.1, &rows));
    if known || columns.is_empty() || rows.is_empty() {
        return;
    }
    match view.shows_all(columns.clone(), rows.clone(), -ROUNDING_PX) {
        Some(false) => {}
        None if length(&columns).max(length(&rows)) > 1 => {
            quarters(columns, rows, |columns, rows| extend(view, (columns, rows), shown));
        }
        all => {
            if all == Some(true) || view.shows(columns.start as f64, rows.start as f64, -ROUNDING_PX) {
                let both = |a: &Range<i64>, b: &Range<i64>| a.start.min(b.start)..a.end.max(b.end);
                let widened = shown.as_ref().map(|known| (both(&known.0, &columns), both(&known.1, &rows)));
                *shown = Some(widened.unwrap_or((columns, rows)));
            }
        }
    }
}

fn length(range: &Range<i64>) -> i64 {
    range.end - range.start
}

/// Calls `each` for the four quarters of a rectangle; some may be empty.
fn quarters(columns: Range<i64>, rows: Range<i64>, mut each: impl FnMut(Range<i64>, Range<i64>)) {
    let (x, y) = (columns.start + length(&columns) / 2, rows.start + length(&rows) / 2);
    for rows in [rows.start..y, y..rows.end] {
        for columns in [columns.start..x, x..columns.end] {
            if !columns.is_empty() && !rows.is_empty() {
                each(columns, rows.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use proptest::array::uniform3;
    use proptest::prelude::*;

    use super::*;
    use crate::lens::Distortion;

    /// Raw frames of the tests.
    const ROWS: usize = 100;
    const COLUMNS: usize = 140;

    fn lens(k1: f64) -> Lens {
        Lens { distortion: Distortion { k1, ..Distortion::default() }, ..Lens::pinhole(180.0, 72.0, 47.0) }
    }

    /// Whether a frame shows a pixel, at least so far inside its border; `None` on the very border.
    fn shows(mapping: &Mapping, pose: &FramePose, x: f64, y: f64, inset_px: f64) -> Option<bool> {
        let (raw_x, raw_y) = mapping.raw_of(pose, x, y);
        // What is seen beyond the fold of the lens does not come back.
        let back = mapping.rectified_of(pose, raw_x, raw_y);
        let unfolded = back.is_some_and(|(a, b)| (a - x).abs() + (b - y).abs() < 1e-6);
        let inside = [(raw_x, COLUMNS), (raw_y, ROWS)].map(|(place, size)| {
            let last = size as f64 - 1.0;
            (place - inset_px).min(last - inset_px - place)
        });
        let margin = inside[0].min(inside[1]);
        (margin.is_nan() || margin.abs() > 1e-5).then_some(margin > 0.0 && unfolded)
    }

    fn pose() -> impl Strategy<Value = FramePose> {
        (uniform3(-0.03..0.03), uniform3(-0.03..0.03))
            .prop_map(|(rotation_rad, offset)| FramePose { rotation_rad, offset })
    }

    proptest! {
        // Each case looks at every pixel.
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn what_all_frames_show_is_seen(
            poses in proptest::collection::vec(pose(), 0..4),
            roll in -PI..PI, pan in -0.5..0.5, k1 in prop_oneof![-0.1..0.1, -2.0..2.0],
        ) {
            // Everything around, so that all of the outlines lies inside.
            let mapping = Mapping::upright(lens(k1), roll, pan, ROWS, COLUMNS).cut(-180..320, -180..280);
            let seen = mapping.seen(&poses);
            let each = if poses.is_empty() { vec![FramePose::default()] } else { poses };
            for y in 0..seen.rows() {
                for x in 0..seen.columns() {
                    let by = |pose| shows(&mapping, pose, x as f64, y as f64, SEEN_PX);
                    let by: Vec<Option<bool>> = each.iter().map(by).collect();
                    let expected =
                        if by.contains(&Some(false)) { Some(false) } else { by.into_iter().min().flatten() };
                    let found = seen.at(x, y);
                    prop_assert!(expected.is_none_or(|expected| expected == found), "({x}, {y}): {found}");
                }
            }
        }

        #[test]
        fn what_any_frame_shows_is_covered_and_no_more(
            poses in proptest::collection::vec(pose(), 0..4),
            roll in -PI..PI, pan in -0.3..0.3, k1 in -0.1..0.1,
        ) {
            let mapping = Mapping::covering(lens(k1), roll, pan, ROWS, COLUMNS, &poses).unwrap();
            // On the same grid as the largest rectangle.
            let (x, y) = mapping.rectified(69.5, 49.5).unwrap();
            prop_assert!((x - 0.5 - x.floor()).abs() < 1e-9 && (y - 0.5 - y.floor()).abs() < 1e-9, "{x} {y}");
            let each = if poses.is_empty() { vec![FramePose::default()] } else { poses };
            let (columns, rows) = (mapping.camera.columns as i64, mapping.camera.rows as i64);
            // Farthest from the middle that is looked at.
            let (middle_x, middle_y) = (x.floor() as i64, y.floor() as i64);
            let near = |x: i64, y: i64| {
                let around = |middle: i64| middle - 139..=middle + 140;
                around(middle_x).contains(&x) && around(middle_y).contains(&y)
            };
            let (mut outermost, mut unsure) = ([false; 4], false);
            for y in -60..rows + 60 {
                for x in -60..columns + 60 {
                    for pose in &each {
                        let shown = shows(&mapping, pose, x as f64, y as f64, 0.0);
                        unsure |= shown.is_none();
                        let inside = (0..columns).contains(&x) && (0..rows).contains(&y);
                        prop_assert!(shown != Some(true) || inside || !near(x, y), "({x}, {y})");
                        if shown == Some(true) && inside {
                            let side = [x == 0, x == columns - 1, y == 0, y == rows - 1];
                            outermost.iter_mut().zip(side).for_each(|(any, side)| *any |= side);
                        }
                    }
                }
            }
            prop_assert!(unsure || outermost == [true; 4], "{outermost:?}");
        }
    }

    #[test]
    fn a_straight_camera_shows_and_keeps_its_image() {
        let mapping = Mapping::covering(lens(0.0), 0.0, 0.0, ROWS, COLUMNS, &[]).unwrap();
        assert_eq!(mapping, Mapping::fitting(lens(0.0), 0.0, 0.0, ROWS, COLUMNS).unwrap());
        assert!(mapping.seen(&[FramePose::default()]).values().iter().all(|&seen| seen));
        let nodded = FramePose { rotation_rad: [1e-3, 0.0, 0.0], ..FramePose::default() };
        let seen = mapping.seen(&[FramePose::default(), nodded]);
        assert!(!seen.at(2, 50) && seen.at(4, 50) && !seen.at(70, 2) && seen.at(70, 4));
    }

    #[test]
    fn turns_by_right_angles_keep_every_pixel() {
        for (roll, rows, columns) in
            [(FRAC_PI_2, COLUMNS, ROWS), (-FRAC_PI_2, COLUMNS, ROWS), (PI, ROWS, COLUMNS)]
        {
            let lens = Lens::pinhole(180.0, 69.5, 49.5);
            let mapping = Mapping::covering(lens, roll, 0.0, ROWS, COLUMNS, &[]).unwrap();
            assert_eq!((mapping.camera.rows, mapping.camera.columns), (rows, columns));
        }
        // Also where one side is more than twice as long as the other.
        let lens = Lens::pinhole(180.0, 99.5, 19.5);
        let long = Mapping::covering(lens, FRAC_PI_2, 0.0, 40, 200, &[]).unwrap();
        assert_eq!((long.camera.rows, long.camera.columns), (200, 40));
        let fitting = Mapping::fitting(lens, FRAC_PI_2, 0.0, 40, 200).unwrap();
        assert!(fitting.camera.rows >= 182 && fitting.camera.columns >= 22, "{:?}", fitting.camera);
    }

    #[test]
    fn nothing_shown_is_an_error() {
        let behind = FramePose { rotation_rad: [0.0, 3.0, 0.0], ..FramePose::default() };
        for (lens, pan, rows, poses) in [
            (lens(0.0), 3.0, ROWS, vec![]),
            (lens(0.0), 0.0, ROWS, vec![behind]),
            (lens(0.0), 0.1, 0, vec![]),
            (lens(f64::NAN), 0.1, ROWS, vec![]),
        ] {
            let found = Mapping::covering(lens, 0.0, pan, rows, COLUMNS, &poses);
            assert!(matches!(found, Err(RectifyError::NothingLeft { .. })), "{found:?}");
        }
        let mapping = Mapping::covering(lens(0.0), 0.1, 0.0, ROWS, COLUMNS, &[]).unwrap();
        assert!(mapping.seen(&[behind]).values().iter().all(|&seen| !seen));
    }
}
