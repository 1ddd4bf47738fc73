//! Frames as callers have them give the maps that a volume of them gives.

use std::sync::atomic::{AtomicUsize, Ordering};

use epirig_matcher::{
    DisparityMaps, Frame, MatchError, MatchOptions, OrderingConstraint, Progress, Samples, Search, Stack,
    StackError, Tau, Volume, disparity, disparity_with, match_volume,
};
use ndarray::{Array3, s};

const SHAPE: [usize; 3] = [15, 24, 64];

/// Intensity of a scene that moves by 6 px along the rows, from 10 to 230 of 255.
fn light(t: usize, y: usize, x: usize) -> f64 {
    let (x, y) = (x as f64 - 6.0 * t as f64 / 14.0, y as f64);
    120.0 + 60.0 * (0.9 * x + y).sin() + 50.0 * (0.37 * x - 2.0 * y).sin()
}

fn places() -> impl Iterator<Item = (usize, usize, usize)> {
    let [frames, rows, columns] = SHAPE;
    (0..frames).flat_map(move |t| (0..rows).flat_map(move |y| (0..columns).map(move |x| (t, y, x))))
}

fn bytes() -> Vec<u8> {
    places().map(|(t, y, x)| light(t, y, x) as u8).collect()
}

fn found(stack: &Stack) -> DisparityMaps {
    disparity(stack, &MatchOptions::default()).unwrap()
}

/// The maps of the same samples, put into a volume frame by frame.
fn of_frames(positions: &[f64]) -> DisparityMaps {
    let [frames, rows, columns] = SHAPE;
    let mut volume = Volume::new(rows, columns, 8, Tau::from_positions(positions).unwrap());
    for (t, frame) in bytes().chunks(rows * columns).enumerate() {
        volume.insert(t, &Frame::new(rows, columns, 8, Samples::U8(frame.to_vec())).unwrap()).unwrap();
    }
    assert_eq!(volume.frames(), frames);
    match_volume(&volume, &MatchOptions::default(), &epirig_matcher::Silent).unwrap()
}

/// Bits, because NaN is unlike itself.
fn bits(maps: &DisparityMaps) -> Vec<u32> {
    [&maps.disparity, &maps.sigma].into_iter().flat_map(|map| map.values()).map(|v| v.to_bits()).collect()
}

#[test]
fn slices_arrays_and_images_are_the_same_frames() {
    let [frames, rows, columns] = SHAPE;
    let equidistant: Vec<f64> = (0..frames).map(|t| t as f64).collect();
    let expected = bits(&of_frames(&equidistant));
    let samples = bytes();
    let stack = Stack::from_u8(&samples, SHAPE).unwrap();
    assert_eq!(stack.shape(), SHAPE);
    assert_eq!(bits(&found(&stack)), expected);
    // Frames last and columns from right to left, with a sample between any two: none is where it was.
    let mut strided = Array3::<u8>::zeros((columns, 2 * rows, frames));
    for ((t, y, x), value) in places().zip(&samples) {
        strided[[columns - 1 - x, 2 * y, t]] = *value;
    }
    let view = strided.slice(s![..;-1, ..;2, ..]).permuted_axes([2, 1, 0]);
    assert_eq!(view[[3, 2, 7]], samples[(3 * rows + 2) * columns + 7]);
    assert_eq!(bits(&found(&Stack::from_array(view).unwrap())), expected);
    let images = samples
        .chunks(rows * columns)
        .map(|frame| image::GrayImage::from_raw(columns as u32, rows as u32, frame.to_vec()).unwrap());
    assert_eq!(bits(&found(&Stack::from_images(images).unwrap())), expected);
}

#[test]
fn positions_are_those_of_the_stage() {
    let stretched: Vec<f64> = (0..SHAPE[0]).map(|t| 7.0 + (t as f64).powf(1.2)).collect();
    let stack = Stack::from_u8(&bytes(), SHAPE).unwrap().at(&stretched).unwrap();
    assert_eq!(bits(&found(&stack)), bits(&of_frames(&stretched)));
    let refused = Stack::from_u8(&bytes(), SHAPE).unwrap().at(&stretched[1..]);
    assert_eq!(refused, Err(StackError::Positions { positions: 14, frames: 15 }));
}

/// Samples of 16 bit and numbers of any unit show the scene in finer steps than bytes do.
#[test]
fn wider_samples_find_the_disparity_in_any_unit() {
    let error = |stack: &Stack| {
        let maps = found(stack);
        let inner = (4..20).flat_map(|y| (12..52).map(move |x| (x, y)));
        inner.map(|(x, y)| (maps.disparity.at(x, y) - 6.0).abs()).fold(0.0, f32::max)
    };
    let wide: Vec<u16> = places().map(|(t, y, x)| (200.0 * light(t, y, x)) as u16).collect();
    assert!(error(&Stack::from_u16(&wide, SHAPE).unwrap()) < 1e-3);
    let mut maps = Vec::new();
    for unit in [1.0 / 256.0, 1.0, 4096.0] {
        let floats: Vec<f32> = places().map(|(t, y, x)| (unit * light(t, y, x)) as f32).collect();
        let stack = Stack::from_f32(&floats, SHAPE).unwrap();
        assert!(error(&stack) < 1e-3);
        let array = Array3::from_shape_vec((SHAPE[0], SHAPE[1], SHAPE[2]), floats).unwrap();
        assert_eq!(Stack::from_array(array.view()).unwrap(), stack);
        maps.push(bits(&found(&stack)));
    }
    assert!(maps.iter().all(|map| *map == maps[0]), "powers of two are no other light");
    let below: Vec<f32> = places().map(|(t, y, x)| light(t, y, x) as f32 - 120.0).collect();
    assert!(error(&Stack::from_f32(&below, SHAPE).unwrap()) < 1e-3);
}

#[test]
fn what_is_no_stack_is_refused_with_its_place() {
    let [frames, rows, columns] = SHAPE;
    let samples = bytes();
    let refused = |shape| Stack::from_u8(&samples, shape).unwrap_err();
    assert!(matches!(refused([frames, columns, columns]), StackError::Length { samples: 23040, .. }));
    assert!(matches!(refused([usize::MAX, rows, columns]), StackError::Length { .. }));
    assert!(matches!(Stack::from_u8(&[], [0, rows, columns]), Err(StackError::Length { .. })));
    assert!(matches!(Stack::from_u8(&samples[..64], [1, 1, 64]), Err(StackError::Tau(_))));
    let mut floats: Vec<f32> = samples.iter().map(|&value| value.into()).collect();
    for value in [f32::NAN, f32::NEG_INFINITY] {
        floats[(3 * rows + 5) * columns + 7] = value;
        let error = Stack::from_f32(&floats, SHAPE).unwrap_err();
        assert!(matches!(error, StackError::NotFinite { frame: 3, row: 5, column: 7, .. }), "{error}");
    }
    let unlike = [(4, 9), (4, 8)].map(|(rows, columns)| image::GrayImage::new(columns, rows));
    assert!(matches!(Stack::from_images(unlike.into_iter()), Err(StackError::Unlike(_))));
    let dark = Stack::from_f32(&vec![0.0; 15 * 24 * 64], SHAPE).unwrap();
    assert_eq!(disparity(&dark, &MatchOptions::default()), Err(MatchError::NoRange));
}

/// Says that the work is cancelled from the n-th question on.
struct After {
    asked: AtomicUsize,
    n: usize,
}

impl Progress for After {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _count: u64) {}
    fn end(&self) {}
    fn cancelled(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) >= self.n
    }
}

#[test]
fn a_match_that_is_cancelled_at_any_place_says_so() {
    let stack = Stack::from_u8(&bytes(), SHAPE).unwrap();
    let ordered = MatchOptions::default();
    let free = MatchOptions { ordering_constraint: OrderingConstraint::Off, ..ordered.clone() };
    let exhaustive = MatchOptions { search: Search::Exhaustive, ..ordered.clone() };
    let semi_global = MatchOptions { semi_global: true, ..free.clone() };
    for options in [ordered.clone().quick(), ordered, free, exhaustive, semi_global] {
        let counted = After { asked: AtomicUsize::new(0), n: usize::MAX };
        disparity_with(&stack, &options, &counted).unwrap();
        let questions = counted.asked.into_inner();
        // For each row it is asked several times.
        assert!(questions > 3 * SHAPE[1], "{questions}");
        for n in (0..questions).step_by(7).chain([questions - 1]) {
            let after = After { asked: AtomicUsize::new(0), n };
            let outcome = disparity_with(&stack, &options, &after);
            assert_eq!(outcome, Err(MatchError::Cancelled), "at question {n} of {questions}");
        }
    }
}
