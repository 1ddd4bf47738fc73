//! Images made smaller: one value for each square of `side` x `side` pixels.
//!
//! All functions panic if `side` is 0.

use std::iter::Sum;
use std::ops::AddAssign;

use crate::frame::{Frame, Samples};
use crate::grid::Grid;

/// Sums over squares of `side` x `side` values of an image with so many columns, row by row. What is left at
/// the right and at the bottom is dropped.
///
/// ```
/// use epirig_core::image::square_sums;
///
/// assert_eq!(square_sums::<u8, u32>(&[1, 2, 90, 3, 4, 90], 3, 2), [10]);
/// ```
pub fn square_sums<T, S>(values: &[T], columns: usize, side: usize) -> Vec<S>
where
    T: Copy + Into<S>,
    S: Copy + Sum + AddAssign,
{
    let across = columns / side;
    let rows = values.len() / columns.max(1);
    // Memory that is written once is not filled with zeros before.
    let mut sums = Vec::with_capacity(rows / side * across);
    if across > 0 {
        for square_row in values.chunks_exact(columns * side) {
            let first = sums.len();
            let sums_of = |row| sums_of_pieces(row, side);
            sums.extend(sums_of(&square_row[..columns]));
            for row in square_row.chunks_exact(columns).skip(1) {
                sums[first..].iter_mut().zip(sums_of(row)).for_each(|(sum, more)| *sum += more);
            }
        }
    }
    sums
}

/// Sums over pieces of `side` values of a row.
fn sums_of_pieces<T, S>(row: &[T], side: usize) -> impl Iterator<Item = S>
where
    T: Copy + Into<S>,
    S: Sum,
{
    row.chunks_exact(side).map(|piece| piece.iter().map(|&value| value.into()).sum())
}

fn means<T: Copy + Into<f32>>(values: &[T], rows: usize, columns: usize, side: usize) -> Grid<f32> {
    let share = 1.0 / (side * side) as f32;
    let means = square_sums::<T, f32>(values, columns, side).into_iter().map(|sum| sum * share).collect();
    Grid::from_values(rows / side, columns / side, means).expect("a mean for each square")
}

/// Means over squares of `side` x `side` pixels. What is left at the right and at the bottom is dropped.
///
/// The mean at (x, y) has its centre at (side x + c, side y + c) of the image, with c = (side - 1) / 2.
pub fn reduced(image: &Grid<f32>, side: usize) -> Grid<f32> {
    means(image.values(), image.rows(), image.columns(), side)
}

/// As [`reduced`], of the samples of a frame, in DN.
pub fn reduced_frame(frame: &Frame, side: usize) -> Grid<f32> {
    match frame.samples() {
        Samples::U8(values) => means(values, frame.rows(), frame.columns(), side),
        Samples::U16(values) => means(values, frame.rows(), frame.columns(), side),
    }
}

/// Means of the finite values in squares of `side` x `side` pixels, smaller ones at the right and at the
/// bottom. NaN where none is finite, or less than `least_share` of the square.
///
/// ```
/// use epirig_core::grid::Grid;
/// use epirig_core::image::reduced_known;
///
/// let map = Grid::from_values(2, 3, vec![1.0, f32::NAN, f32::NAN, 2.0, f32::NAN, 5.0]).unwrap();
/// assert_eq!(reduced_known(&map, 2, 0.5).values(), [1.5, 5.0]);
/// ```
pub fn reduced_known(map: &Grid<f32>, side: usize, least_share: f64) -> Grid<f32> {
    let (rows, columns) = (map.rows(), map.columns());
    let mut small = Grid::filled(rows.div_ceil(side), columns.div_ceil(side), f32::NAN);
    for y in 0..small.rows() {
        let down = y * side..((y + 1) * side).min(rows);
        for (x, mean) in small.row_mut(y).iter_mut().enumerate() {
            let across = x * side..((x + 1) * side).min(columns);
            let values = down.clone().flat_map(|row| &map.row(row)[across.clone()]);
            let known = values.filter(|value| value.is_finite());
            let (sum, count) = known.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
            if count > 0 && f64::from(count) >= least_share * (down.len() * across.len()) as f64 {
                *mean = sum / count as f32;
            }
        }
    }
    small
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn frames_become_means_and_what_is_left_is_dropped() {
        let wide = Frame::new(2, 5, 8, Samples::U8(vec![1, 2, 10, 10, 90, 2, 2, 20, 20, 90])).unwrap();
        assert_eq!(reduced_frame(&wide, 2).values(), [1.75, 15.0]);
        let deep = Frame::new(2, 2, 16, Samples::U16(vec![65535, 65535, 65535, 65532])).unwrap();
        assert_eq!(reduced_frame(&deep, 2).values(), [65534.25]);
        // No square fits.
        let narrow = reduced_frame(&wide, 3);
        assert_eq!((narrow.rows(), narrow.columns()), (0, 1));
        assert_eq!(reduced(&Grid::filled(4, 0, 1.0), 2).columns(), 0);
    }

    #[test]
    fn unknown_values_do_not_count() {
        let mut map = Grid::from_values(3, 4, (0..12).map(|index| index as f32).collect()).unwrap();
        map.row_mut(0)[0] = f32::NAN;
        (map.row_mut(0)[2], map.row_mut(0)[3], map.row_mut(1)[2]) = (f32::NAN, f32::INFINITY, f32::NAN);
        let small = reduced_known(&map, 2, 0.5);
        // Means of 1, 4, 5, of 8, 9 and of 10, 11; three of four are unknown at the upper right.
        assert_eq!((small.rows(), small.columns()), (2, 2));
        assert!((small.at(0, 0) - 10.0 / 3.0).abs() < 1e-6 && small.at(1, 0).is_nan());
        assert_eq!((small.at(0, 1), small.at(1, 1)), (8.5, 10.5));
        assert_eq!(reduced_known(&map, 2, 0.0).at(1, 0), 7.0);
        map.row_mut(1)[3] = f32::NAN;
        assert!(reduced_known(&map, 2, 0.0).at(1, 0).is_nan());
    }

    proptest! {
        #[test]
        fn without_unknown_values_all_means_are_alike(
            (rows, columns, side, values) in (1..9_usize, 1..9_usize, 1..5_usize).prop_flat_map(
                |(rows, columns, side)| {
                    let values = prop::collection::vec(0_u8..=255, rows * columns);
                    (Just(rows), Just(columns), Just(side), values)
                },
            ),
        ) {
            let frame = Frame::new(rows, columns, 8, Samples::U8(values.clone())).unwrap();
            let map = Grid::from_values(rows, columns, values).unwrap().map(f32::from);
            let means = reduced(&map, side);
            prop_assert_eq!(&means, &reduced_frame(&frame, side));
            let known = reduced_known(&map, side, 1.0);
            for y in 0..means.rows() {
                for x in 0..means.columns() {
                    let square = map.cropped(x * side..(x + 1) * side, y * side..(y + 1) * side);
                    let sum: f32 = square.values().iter().sum();
                    let mean = sum / (side * side) as f32;
                    prop_assert!((means.at(x, y) - mean).abs() <= 1e-4);
                    prop_assert!((known.at(x, y) - mean).abs() <= 1e-4);
                }
            }
        }
    }
}
