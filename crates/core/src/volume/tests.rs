//! What a volume gives back of what it was given.

use super::*;

#[test]
fn rows_of_frames_come_back() {
    let tau = Tau::equidistant(2).unwrap();
    let mut volume = Volume::new(2, 3, 8, tau);
    volume.insert(1, &Frame::new(2, 3, 8, Samples::U8((10..16).collect())).unwrap()).unwrap();
    let mut row = [0.0; 3];
    volume.copy_row(1, 1, &mut row);
    assert_eq!(row, [13.0, 14.0, 15.0]);
    assert_eq!(volume.bytes(), 12);
    let wide = Frame::new(2, 3, 12, Samples::U16(vec![0; 6])).unwrap();
    assert!(
        matches!(volume.insert(0, &wide), Err(VolumeError::Unlike { found, .. }) if found.bit_depth == 12)
    );
    let wrong = Frame::new(3, 2, 8, Samples::U8(vec![0; 6])).unwrap();
    assert!(volume.insert(0, &wrong).is_err());
    assert!(matches!(volume.insert(2, &wrong), Err(VolumeError::NoSuchFrame { .. })));
}

#[test]
fn frames_from_several_threads_go_to_their_places() {
    use rayon::prelude::*;
    // More rows than a thread writes at once, and not a multiple of them.
    let (rows, columns, frames) = (75, 5, 9);
    for bit_depth in [8, 12] {
        let value = |x: usize, y: usize, t: usize| 31 * x + 7 * y + 3 * t;
        let frame = |t: usize| {
            let values =
                (0..rows * columns).map(|index| value(index % columns, index / columns, t) as u16 % 251);
            let samples = match bit_depth {
                8 => Samples::U8(values.map(|value| value as u8).collect()),
                _ => Samples::U16(values.collect()),
            };
            Frame::new(rows, columns, bit_depth, samples).unwrap()
        };
        let mut volume = Volume::new(rows, columns, bit_depth, Tau::equidistant(frames).unwrap());
        let filling = volume.filling();
        (0..frames).into_par_iter().for_each(|t| filling.insert(t, &frame(t)).unwrap());
        let mut row = [0.0; 5];
        for (y, t) in (0..rows).flat_map(|y| (0..frames).map(move |t| (y, t))) {
            volume.copy_row(y, t, &mut row);
            assert_eq!(row, std::array::from_fn(|x| (value(x, y, t) % 251) as f32));
        }
    }
}

#[test]
fn counts_of_a_fine_volume_go_in_as_they_are() {
    let mut volume = Volume::fine(1, 2, 8, Tau::equidistant(2).unwrap());
    let counts = Frame::new(1, 2, 16, Samples::U16(vec![32768, 65535])).unwrap();
    volume.insert_counts(1, &counts).unwrap();
    let mut row = [0.0; 2];
    volume.copy_row(0, 1, &mut row);
    // 32768 counts are 256 DN.
    assert_eq!(row, [256.0, 65535.0 / 128.0]);
    let narrow = Frame::new(1, 2, 8, Samples::U8(vec![1, 2])).unwrap();
    assert!(
        matches!(volume.insert_counts(0, &narrow), Err(VolumeError::Unlike { found, .. }) if found.bit_depth == 8)
    );
    assert!(matches!(volume.insert_counts(2, &counts), Err(VolumeError::NoSuchFrame { .. })));
    let mut plain = Volume::new(1, 2, 16, Tau::equidistant(2).unwrap());
    assert!(plain.insert_counts(0, &counts).is_err());
}

#[test]
fn a_fine_volume_keeps_fractions_of_a_level() {
    let mut volume = Volume::fine(1, 3, 12, Tau::equidistant(2).unwrap());
    // Full scale is 4095 DN, so a count is an eighth.
    assert_eq!((volume.dn_per_count(), volume.bit_depth()), (0.125, 12));
    volume.fine_counts_mut().unwrap().copy_from_slice(&[0, 1, 65535, 8, 80, 800]);
    let mut row = [0.0; 3];
    volume.copy_row(0, 0, &mut row);
    assert_eq!(row, [0.0, 0.125, 8191.875]);
    let raw = Frame::new(1, 3, 12, Samples::U16(vec![0; 3])).unwrap();
    assert_eq!(volume.insert(0, &raw), Err(VolumeError::NotRectified { index: 0 }));
    assert_eq!(Volume::new(1, 3, 12, Tau::equidistant(2).unwrap()).fine_counts_mut(), None);
    for (bit_depth, dn) in [(8, 1.0 / 128.0), (15, 1.0), (16, 2.0)] {
        assert_eq!(Volume::fine(1, 3, bit_depth, Tau::equidistant(2).unwrap()).dn_per_count(), dn);
    }
}

#[test]
fn bands_are_refilled_with_rounded_and_clipped_counts() {
    // Row y of frame t holds 10 y + t, then 10 y + t + 0.4 and a value that no sample can hold.
    let mut volume = Volume::new(5, 2, 12, Tau::equidistant(3).unwrap());
    for t in 0..3 {
        let samples = (0..10).map(|index| 10 * (index / 2) + t).collect();
        volume.insert(t.into(), &Frame::new(5, 2, 12, Samples::U16(samples)).unwrap()).unwrap();
    }
    volume.set_frame_gain(1, 2.0);
    let fill = |rows: Range<usize>, t: usize, values: &[f32], band: &mut [f32]| {
        let within_reach = rows.start.saturating_sub(1)..(rows.end + 1).min(5);
        assert_eq!((band.len(), values.len()), (2 * rows.len(), 2 * within_reach.len()));
        for (y, row) in within_reach.clone().zip(values.chunks_exact(2)) {
            let gain = if t == 1 { 2 } else { 1 };
            assert_eq!(row, [(gain * (10 * y + t)) as f32; 2]);
        }
        let first = rows.start - within_reach.start;
        for (row, values) in band.chunks_exact_mut(2).zip(values[2 * first..].chunks_exact(2)) {
            row.copy_from_slice(&[values[0] + 0.4, if t == 0 { -7.0 } else { 1e6 }]);
        }
    };
    let row = |volume: &Volume, y: usize, t: usize| {
        let mut row = [0.0; 2];
        volume.copy_row(y, t, &mut row);
        row
    };
    let coarse = volume.clone().refilled((10, false), (2, 1), fill);
    assert_eq!((row(&coarse, 4, 2), coarse.bytes()), ([42.0, 1023.0], 60));
    assert_eq!(row(&coarse, 1, 0), [10.0, 0.0]);
    assert_eq!(row(&coarse, 3, 1), [62.0, 1023.0]);
    assert_eq!(row(&volume, 4, 2), [42.0, 42.0]);
    let before = Arc::as_ptr(&volume.samples);
    let fine = volume.refilled((8, true), (2, 1), fill);
    assert_eq!(Arc::as_ptr(&fine.samples), before);
    // 42.4 DN are 5427.2 counts of 1/128 DN.
    assert_eq!(row(&fine, 4, 2), [5427.0 / 128.0, 65535.0 / 128.0]);
    let bytes = Volume::new(1, 2, 8, Tau::equidistant(2).unwrap());
    let bytes = bytes.refilled((8, false), (1, 0), |_, _, _, band| band.copy_from_slice(&[-7.0, 1e6]));
    assert_eq!((row(&bytes, 0, 1), bytes.bytes()), ([0.0, 255.0], 4));
}

#[test]
#[should_panic(expected = "samples of 8 bit have another width")]
fn samples_are_not_replaced_by_narrower_ones() {
    let volume = Volume::new(2, 2, 12, Tau::equidistant(2).unwrap());
    let _ = volume.refilled((8, false), (2, 0), |_, _, values, band| band.copy_from_slice(values));
}

#[test]
fn gains_multiply_what_is_read_and_go_with_their_frames() {
    let mut volume = Volume::fine(2, 2, 8, Tau::equidistant(3).unwrap());
    let counts = volume.fine_counts_mut().unwrap();
    counts.iter_mut().enumerate().for_each(|(index, count)| *count = 128 * index as u16);
    volume.set_frame_gain(1, 1.5);
    let mut row = [0.0; 2];
    volume.copy_row(1, 1, &mut row);
    assert_eq!((row, volume.frame_gain(1)), ([12.0, 13.5], 1.5));
    let selected = volume.selected(&[1], &[1, 2], Tau::equidistant(2).unwrap());
    let mut again = [0.0; 2];
    selected.copy_row(0, 0, &mut again);
    assert_eq!((again, selected.dn_per_count()), (row, 1.0 / 128.0));
    selected.copy_row(0, 1, &mut again);
    assert_eq!(again, [10.0, 11.0]);
}

#[test]
fn shown_frames_share_their_samples_until_one_is_written() {
    let mut all = Volume::new(2, 2, 8, Tau::equidistant(4).unwrap());
    for t in 0..4_u8 {
        all.insert(usize::from(t), &Frame::new(2, 2, 8, Samples::U8(vec![10 * t; 4])).unwrap()).unwrap();
    }
    all.set_frame_gain(2, 1.5);
    let firsts = |volume: &Volume| -> Vec<f32> {
        let mut row = [0.0; 2];
        let first = |t: usize| {
            volume.copy_row(1, t, &mut row);
            row[0]
        };
        (0..volume.frames()).map(first).collect()
    };
    let tau = Tau::from_positions(&[0.0, 1.0, 3.0]).unwrap();
    let mut shown = all.showing(&[0, 2, 3], tau.clone());
    assert!(Arc::ptr_eq(&all.samples, &shown.samples));
    assert_eq!((firsts(&shown), shown.tau()), (vec![0.0, 30.0, 30.0], &tau));
    // What is made of some frames is made of these.
    let again = shown.showing(&[1, 2], Tau::equidistant(2).unwrap());
    assert_eq!(firsts(&again), [30.0, 30.0]);
    assert_eq!(firsts(&shown.selected(&[0, 1], &[2, 1], Tau::equidistant(2).unwrap())), [30.0, 30.0]);
    let mut halved = [0.0];
    shown.halved().copy_row(0, 2, &mut halved);
    assert_eq!(halved, [30.0]);
    shown.insert(0, &Frame::new(2, 2, 8, Samples::U8(vec![7; 4])).unwrap()).unwrap();
    assert_eq!((firsts(&shown), shown.bytes()), (vec![7.0, 30.0, 30.0], 12));
    assert_eq!(firsts(&all), [0.0, 10.0, 30.0, 30.0]);
}

/// Row 0 of frame 1 of `volume` at half the resolution.
fn halved_row(volume: &Volume) -> (Vec<f32>, (usize, usize)) {
    let halved = volume.halved();
    let mut row = vec![0.0; halved.columns()];
    halved.copy_row(0, 1, &mut row);
    (row, (halved.rows(), halved.columns()))
}

#[test]
fn half_the_resolution_has_means_of_four_samples_of_any_depth() {
    let tau = || Tau::equidistant(2).unwrap();
    let mut bytes = Volume::new(3, 5, 8, tau());
    let samples = vec![255, 255, 0, 1, 9, 255, 255, 0, 0, 9, 9, 9, 9, 9, 9];
    bytes.insert(1, &Frame::new(3, 5, 8, Samples::U8(samples)).unwrap()).unwrap();
    bytes.set_frame_gain(1, 2.0);
    // The odd row and column are left out; fractions of a level stay; the gain goes along.
    assert_eq!(halved_row(&bytes), (vec![510.0, 0.5], (1, 2)));
    for (bit_depth, samples, means) in [
        (12, [4095, 4095, 4095, 4095], 4095.0),
        (12, [1, 0, 0, 0], 0.25),
        (15, [3, 3, 3, 4], 3.25),
        (16, [65535, 65535, 65535, 65533], 65534.5),
    ] {
        let mut words = Volume::new(2, 2, bit_depth, tau());
        words.insert(1, &Frame::new(2, 2, bit_depth, Samples::U16(samples.to_vec())).unwrap()).unwrap();
        assert_eq!(halved_row(&words).0, [means], "{bit_depth} bit");
    }
    assert_eq!(Volume::new(4, 1, 8, tau()).halved().columns(), 0);
    let mut fine = Volume::fine(2, 2, 8, tau());
    // Rows x frames x columns.
    fine.fine_counts_mut().unwrap().copy_from_slice(&[0, 0, 65535, 65535, 0, 0, 65535, 65531]);
    assert_eq!(halved_row(&fine).0, [65534.0 / 128.0]);
}

#[test]
fn half_the_resolution_takes_no_memory_until_it_is_selected() {
    let mut volume = Volume::new(4, 6, 8, Tau::equidistant(3).unwrap());
    for t in 0..3_u8 {
        let samples = (0..24).map(|index| 10 * t + index).collect();
        volume.insert(usize::from(t), &Frame::new(4, 6, 8, Samples::U8(samples)).unwrap()).unwrap();
    }
    volume.set_frame_gain(2, 0.5);
    let halved = volume.halved();
    assert!(Arc::ptr_eq(&volume.samples, &halved.samples) && halved.is_fine());
    let rows = |volume: &Volume| -> Vec<Vec<f32>> {
        let mut row = vec![0.0; volume.columns()];
        let all = (0..volume.rows()).flat_map(|y| (0..volume.frames()).map(move |t| (y, t)));
        all.map(|(y, t)| {
            volume.copy_row(y, t, &mut row);
            row.clone()
        })
        .collect()
    };
    // Pixels (0, 0), (1, 0), (0, 1) and (1, 1) of the first frame are 0, 1, 6 and 7.
    assert_eq!(rows(&halved)[0], [3.5, 5.5, 7.5]);
    let tau = Tau::equidistant(2).unwrap();
    let shown = halved.showing(&[1, 2], tau.clone());
    let selected = halved.selected(&[0, 1], &[1, 2], tau);
    assert_eq!((rows(&selected), selected.bytes()), (rows(&shown), 24));
    // Means of means: of 0 to 3, 6 to 9, 12 to 15 and 18 to 21.
    let quarter = halved.halved();
    assert_eq!((rows(&quarter)[0].as_slice(), quarter.rows()), ([10.5].as_slice(), 1));
    let refilled =
        halved.clone().refilled((8, true), (1, 0), |_, _, values, filled| filled.copy_from_slice(values));
    assert_eq!(rows(&refilled), rows(&halved));
    let raw = Frame::new(2, 3, 8, Samples::U8(vec![0; 6])).unwrap();
    assert_eq!(halved.clone().insert(0, &raw), Err(VolumeError::NotRectified { index: 0 }));
    let mut own = halved.clone();
    own.fine_counts_mut().unwrap()[0] = 128;
    assert_eq!((rows(&own)[0][0], rows(&halved)[0][0]), (1.0, 3.5));
    assert_eq!(rows(&own)[1..], rows(&halved)[1..]);
}

#[test]
fn rows_that_are_kept_stay_as_they_were_and_the_others_go() {
    let mut volume = Volume::new(5, 3, 8, Tau::equidistant(2).unwrap());
    let frame = |first: u8| Frame::new(5, 3, 8, Samples::U8((first..first + 15).collect())).unwrap();
    volume.insert(0, &frame(0)).unwrap();
    volume.insert(1, &frame(100)).unwrap();
    volume.set_frame_gain(1, 2.0);
    let whole = volume.clone();
    volume.keep_rows(1..3);
    let mut row = [0.0; 3];
    assert_eq!((volume.rows(), volume.bytes()), (2, 12));
    volume.copy_row(0, 0, &mut row);
    assert_eq!(row, [3.0, 4.0, 5.0]);
    volume.copy_row(1, 1, &mut row);
    assert_eq!(row, [212.0, 214.0, 216.0]);
    // A volume that shared the samples keeps all of them, and one that shows some frames loses no row of these.
    assert_eq!((whole.rows(), whole.bytes()), (5, 30));
    let mut last = whole.showing(&[0, 1], Tau::equidistant(2).unwrap());
    last.keep_rows(4..5);
    last.copy_row(0, 1, &mut row);
    assert_eq!(row, [224.0, 226.0, 228.0]);
}
