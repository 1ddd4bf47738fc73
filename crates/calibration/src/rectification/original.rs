//! Maps of the rectified image in the pixels of a raw frame.

use rayon::prelude::*;

use super::view::ROUNDING_PX;
use super::{FramePose, Mapping};
use epirig_core::grid::Grid;

impl Mapping {
    /// A map of the rectified image (rows x columns of [`Self::camera`]) in the pixels of a raw frame of this
    /// pose: raw rows x raw columns.
    ///
    /// Each raw pixel takes the value of the nearest rectified one, so that values stay what they were
    /// measured as; of two as near it takes the first. It is `unknown` if it lies outside the rectified
    /// image.
    pub fn in_raw_frame<T: Copy + Send + Sync>(
        &self,
        pose: &FramePose,
        map: &Grid<T>,
        unknown: T,
    ) -> Grid<T> {
        let mut raw = Grid::filled(self.raw_rows, self.raw_columns, unknown);
        raw.values_mut().par_chunks_mut(self.raw_columns.max(1)).enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                let place = self.rectified_of(pose, x as f64, y as f64);
                let pixel = place.and_then(|(x, y)| nearest(x, map.columns()).zip(nearest(y, map.rows())));
                if let Some((x, y)) = pixel {
                    *value = map.at(x, y);
                }
            }
        });
        raw
    }
}

/// The column or row nearest to a place, if it is one of `size`.
fn nearest(place_px: f64, size: usize) -> Option<usize> {
    let last = size.checked_sub(1)? as f64;
    // Turns by right angles can put whole rows between two pixels. There, rounding must not choose.
    let is_inside = place_px > -0.5 - ROUNDING_PX && place_px < last + 0.5 + ROUNDING_PX;
    is_inside.then(|| (place_px + 0.5 - ROUNDING_PX).floor().max(0.0) as usize)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::lens::{Distortion, Lens};

    /// Raw frames of the tests.
    const ROWS: usize = 100;
    const COLUMNS: usize = 140;
    const FOCAL_LENGTH_PX: f64 = 180.0;
    /// No place of a map.
    const NOWHERE: (usize, usize) = (usize::MAX, usize::MAX);

    fn lens() -> Lens {
        Lens::pinhole(FOCAL_LENGTH_PX, 69.5, 49.5)
    }

    /// A rectified map whose value at each pixel is the place of that: column and row.
    fn places(mapping: &Mapping) -> Grid<(usize, usize)> {
        let (rows, columns) = (mapping.camera.rows, mapping.camera.columns);
        let places = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).collect();
        Grid::from_values(rows, columns, places).unwrap()
    }

    fn in_raw_frame(mapping: &Mapping, pose: &FramePose) -> Grid<(usize, usize)> {
        let raw = mapping.in_raw_frame(pose, &places(mapping), NOWHERE);
        assert_eq!((raw.rows(), raw.columns()), (mapping.raw_rows, mapping.raw_columns));
        raw
    }

    #[test]
    fn turns_by_right_angles_turn_the_map() {
        type Turned = fn(usize, usize) -> (usize, usize);
        let cases: [(f64, Turned); 4] = [
            (0.0, |x, y| (x, y)),
            (FRAC_PI_2, |x, y| (ROWS - 1 - y, x)),
            (-FRAC_PI_2, |x, y| (y, COLUMNS - 1 - x)),
            (PI, |x, y| (COLUMNS - 1 - x, ROWS - 1 - y)),
        ];
        for (roll_rad, turned) in cases {
            let mapping = Mapping::covering(lens(), roll_rad, 0.0, ROWS, COLUMNS, &[]).unwrap();
            let raw = in_raw_frame(&mapping, &FramePose::default());
            for y in 0..ROWS {
                for x in 0..COLUMNS {
                    assert_eq!(raw.at(x, y), turned(x, y), "{roll_rad}: ({x}, {y})");
                }
            }
        }
    }

    #[test]
    fn rounding_does_not_choose_between_two_pixels() {
        // Middles coincide: with an odd and an even side, turned pixels lie between two.
        let lens = Lens::pinhole(FOCAL_LENGTH_PX, 70.0, 49.5);
        let mapping = Mapping::covering(lens, FRAC_PI_2, 0.0, ROWS, 141, &[]).unwrap();
        let raw = in_raw_frame(&mapping, &FramePose::default());
        // The first of two; at the border there is no other.
        assert_eq!((mapping.camera.rows, mapping.camera.columns), (140, 99));
        for y in 0..ROWS {
            for x in 0..141 {
                assert_eq!(raw.at(x, y), (98_usize.saturating_sub(y), x.saturating_sub(1)), "({x}, {y})");
            }
        }
    }

    #[test]
    fn a_pixel_takes_the_value_of_the_nearest_rectified_one() {
        let turn = |angle_rad: f64, (a, b): (f64, f64)| {
            let (sin, cos) = angle_rad.sin_cos();
            (cos * a - sin * b, sin * a + cos * b)
        };
        let roll_rad = 7.0_f64.to_radians();
        let mapping = Mapping::fitting(lens(), roll_rad, 0.0, ROWS, COLUMNS).unwrap();
        let camera = mapping.camera;
        let rolled = |roll_rad, x| FramePose { rotation_rad: [0.0, 0.0, roll_rad], offset: [x, 0.0, 0.0] };
        for (pose_rad, offset) in [(0.0, 0.0), (3.0_f64.to_radians(), 0.05), (-roll_rad, 0.0)] {
            let raw = in_raw_frame(&mapping, &rolled(pose_rad, offset));
            let mut outside = 0;
            for y in 0..ROWS {
                for x in 0..COLUMNS {
                    let ray = ((x as f64 - 69.5) / FOCAL_LENGTH_PX, (y as f64 - 49.5) / FOCAL_LENGTH_PX);
                    let (a, b) = turn(-pose_rad, ray);
                    let (a, b) = turn(roll_rad, (a + offset, b));
                    let place = (
                        FOCAL_LENGTH_PX * a + camera.principal_point_x_px,
                        FOCAL_LENGTH_PX * b + camera.principal_point_y_px,
                    );
                    let (u, v) = raw.at(x, y);
                    if (u, v) == NOWHERE {
                        let is_in = |place: f64, size: usize| place > -0.499 && place < size as f64 - 0.501;
                        let is_inside = is_in(place.0, camera.columns) && is_in(place.1, camera.rows);
                        assert!(!is_inside, "({x}, {y}): {place:?}");
                        outside += 1;
                    } else {
                        let far = (place.0 - u as f64).abs().max((place.1 - v as f64).abs());
                        assert!(far < 0.500_01, "({x}, {y}): {place:?}, {u}, {v}");
                    }
                }
            }
            let all = ROWS * COLUMNS - camera.rows * camera.columns;
            assert!(outside > all / 2 && outside < 2 * all, "{outside} of {all}");
        }
    }

    #[test]
    fn what_the_rectified_camera_does_not_see_is_unknown() {
        let mapping = Mapping::covering(lens(), 0.1, 0.0, ROWS, COLUMNS, &[]).unwrap();
        let mask = Grid::filled(mapping.camera.rows, mapping.camera.columns, 255_u8);
        // A covering map has a value for each raw pixel but those on its very border.
        let raw = mapping.in_raw_frame(&FramePose::default(), &mask, 200);
        assert!((1..ROWS - 1).all(|y| raw.row(y)[1..COLUMNS - 1].iter().all(|&value| value == 255)));
        let behind = FramePose { rotation_rad: [0.0, 3.0, 0.0], ..FramePose::default() };
        let raw = mapping.in_raw_frame(&behind, &mask, 200);
        assert!(raw.values().iter().all(|&value| value == 200));
        // Here the distortion cannot be undone far from the middle.
        let folded = Lens { distortion: Distortion { k1: -2.0, ..Distortion::default() }, ..lens() };
        let raw = Mapping { lens: folded, ..mapping }.in_raw_frame(&FramePose::default(), &mask, 200);
        assert_eq!([raw.at(69, 49), raw.at(0, 0)], [255, 200]);
    }
}
