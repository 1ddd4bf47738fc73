//! Means of squares of pixels.

use crate::panel::live_map::binned::{Binned, bin_for};
use epirig_core::frame::{Frame, Samples};
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

/// Means in DN, as a volume has them.
fn means(frame: &Frame, bin: usize) -> Vec<Vec<f32>> {
    let binned = Binned::of(frame, bin).unwrap();
    let (rows, columns) = (binned.counts.rows(), binned.counts.columns());
    let mut volume = Volume::fine(rows, columns, frame.bit_depth(), Tau::equidistant(2).unwrap());
    volume.insert_counts(1, &binned.counts).unwrap();
    let row = |y| {
        let mut row = vec![0.0; columns];
        volume.copy_row(y, 1, &mut row);
        row
    };
    (0..rows).map(row).collect()
}

#[test]
fn values_are_means_of_squares_without_the_rest_at_the_edges() {
    // Squares of 2 x 2; the last column and row fill none.
    let samples =
        vec![1, 2, 10, 20, 99, 3, 4, 30, 41, 99, 0, 0, 255, 255, 99, 0, 1, 255, 255, 99, 9, 9, 9, 9, 9];
    let frame = Frame::new(5, 5, 8, Samples::U8(samples)).unwrap();
    assert_eq!(means(&frame, 2), [[2.5, 25.25], [0.25, 255.0]]);
}

#[test]
fn deep_frames_keep_fractions_of_a_level() {
    let frame = Frame::new(2, 2, 12, Samples::U16(vec![4095, 4094, 4095, 4095])).unwrap();
    assert_eq!(means(&frame, 2), [[4094.75]]);
    assert_eq!(means(&frame, 1), [[4095.0, 4094.0], [4095.0, 4095.0]]);
    // 16 bit fill a count of two levels; a mean of many pixels is known no better than that.
    let frame = Frame::new(2, 2, 16, Samples::U16(vec![65535, 65534, 65532, 65531])).unwrap();
    let mean = means(&frame, 2)[0][0];
    assert!((mean - 65533.0).abs() <= 1.0, "{mean}");
}

#[test]
fn squares_grow_with_the_frame_and_the_number_of_frames() {
    assert_eq!(bin_for(1024, 1024, 101), 4);
    assert_eq!(bin_for(240, 320, 41), 1);
    assert!(bin_for(1024, 1024, 1000) > 4);
    assert!(bin_for(4000, 6000, 101) > 16);
    for (rows, columns, planned) in [(1, 1_000_000, 101), (3, 3, usize::MAX / 2), (0, 0, 3), (2, 9, 0)] {
        let bin = bin_for(rows, columns, planned);
        assert!(bin >= 1 && bin <= rows.min(columns).max(1), "{rows} x {columns}: {bin}");
    }
}
