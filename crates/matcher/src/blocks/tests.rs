//! Blocks answer as one picture does, and joining them loses nothing.

use std::sync::Arc;

use super::*;
use crate::RowSource;
use crate::matcher::Matcher;
use crate::options::{OrderingConstraint, ReferenceFrame};
use crate::validity::Validity;
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const FRAMES: usize = 12;
const COLUMNS: usize = 120;

/// A tilted surface with a step of half a pixel in the middle, under noise: true disparity at row `y`.
fn disparity(rows: usize, y: usize) -> f64 {
    3.0 + 0.4 * y as f64 / rows as f64 + if y > rows / 2 { 0.5 } else { 0.0 }
}

fn scene(rows: usize, light: f64) -> Volume {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let waves: Vec<Vec<[f64; 3]>> = (0..rows)
        .map(|_| {
            let wave = |_| {
                [
                    random.random_range(0.5..2.2),
                    random.random_range(0.0..std::f64::consts::TAU),
                    random.random_range(4.0..12.0),
                ]
            };
            (0..8).map(wave).collect()
        })
        .collect();
    let mut volume = Volume::new(rows, COLUMNS, 8, Tau::equidistant(FRAMES).unwrap());
    for t in 0..FRAMES {
        let share = t as f64 / (FRAMES - 1) as f64;
        let sample = |index: usize| {
            let (x, y) = (index % COLUMNS, index / COLUMNS);
            let place = x as f64 - disparity(rows, y) * (share - 0.5);
            let texture: f64 = waves[y]
                .iter()
                .map(|[frequency, phase, high]| high * (frequency * place + phase).sin())
                .sum();
            let value = (110.0 + texture) * (1.0 + light * (share - 0.5)) + random.random_range(-1.5..1.5);
            value.clamp(0.0, 255.0).round() as u8
        };
        let samples = Samples::U8((0..rows * COLUMNS).map(sample).collect());
        volume.insert(t, &Frame::new(rows, COLUMNS, 8, samples).unwrap()).unwrap();
    }
    volume
}

fn in_blocks(rows: usize) -> MatchOptions {
    MatchOptions { block_rows: Some(rows), ..MatchOptions::default() }
}

/// The match of blocks one by one, each by a matcher of its own, with this order of the blocks.
fn one_by_one(volume: &Volume, blocks: &Blocks, reversed: bool) -> DisparityMaps {
    let source: Arc<dyn RowSource> = Arc::new(volume.clone());
    let matcher = || Matcher::of_source(Arc::clone(&source), blocks.clone(), &Silent).unwrap();
    let overview = matcher().overview(&Silent).unwrap();
    let mut order: Vec<usize> = (0..blocks.count()).collect();
    if reversed {
        order.reverse();
    }
    let mut parts = Vec::new();
    for block in order {
        let take = |block: usize, maps: DisparityMaps| {
            parts.push((block, maps));
            Ok::<_, MatchError>(())
        };
        matcher().match_blocks(block..block + 1, overview, &Silent, take).unwrap();
    }
    parts.sort_by_key(|(block, _)| *block);
    blocks.joined(parts.into_iter().map(|(_, part)| Ok::<_, MatchError>(part))).unwrap()
}

/// Maps as bits, so that NaN equals itself.
fn bits(maps: &DisparityMaps) -> Vec<u32> {
    let DisparityMaps { disparity, sigma, cost, confidence, .. } = maps;
    [disparity, sigma, cost, confidence]
        .iter()
        .flat_map(|map| map.values().iter().map(|value| value.to_bits()))
        .collect()
}

#[test]
fn blocks_cover_the_rows_once_and_need_a_rim() {
    let tau = Tau::equidistant(100).unwrap();
    for (rows, columns, block_rows, mask) in [
        (3648, 5472, None, None),
        (10_000, 10_000, None, Some(333..9_001)),
        (900, 500, Some(128), None),
        (900, 500, Some(1), Some(17..40)),
        (70, 50, None, None),
    ] {
        let shape = VolumeShape {
            rows,
            columns,
            bit_depth: 8,
            fine: false,
            tau: tau.clone(),
            frame_gains: vec![1.0; 100],
        };
        let options = MatchOptions { block_rows, ..MatchOptions::default() };
        let blocks = Blocks::new(&shape, options.clone()).unwrap();
        let asked = mask.clone().unwrap_or(0..rows);
        let blocks = match mask {
            Some(mask) => {
                let mut inside = Grid::filled(rows, columns, false);
                mask.for_each(|y| inside.row_mut(y)[columns / 2] = true);
                blocks.within(&inside).unwrap()
            }
            None => blocks,
        };
        let mut next = asked.start;
        for block in 0..blocks.count() {
            let (own, needed) = (blocks.answered_rows(block), blocks.needed_rows(block));
            assert_eq!(own.start, next);
            assert!(needed.start <= own.start.saturating_sub(rim_px(&options)), "{needed:?}");
            assert!(needed.end >= (own.end + rim_px(&options)).min(rows), "{needed:?}");
            assert!(block_rows.is_none_or(|most| own.len() <= most));
            next = own.end;
        }
        assert_eq!(next, asked.end);
        let sample = blocks.overview_rows();
        assert!(sample.is_sorted() && sample.iter().all(|y| asked.contains(y)));
    }
}

#[test]
fn a_picture_that_fits_is_one_block() {
    let volume = scene(60, 0.0);
    let blocks = Blocks::new(&volume.shape(), MatchOptions::default()).unwrap();
    assert_eq!((blocks.count(), blocks.needed_rows(0)), (1, 0..60));
}

#[test]
fn who_matches_blocks_and_when_does_not_change_a_bit() {
    // Steady light, light that makes the search take normalised frames, and normalised frames for the fit, too.
    let of_method = |method| MatchOptions { block_rows: Some(50), ..MatchOptions::for_method(method) };
    for (light, options) in [
        (0.0, in_blocks(50)),
        (0.5, in_blocks(50)),
        (0.3, of_method(crate::Method::Normalised)),
        (0.0, MatchOptions { ordering_constraint: OrderingConstraint::Off, ..in_blocks(70) }),
        (0.0, MatchOptions { reference: ReferenceFrame::First, ..in_blocks(50).quick() }),
    ] {
        let volume = scene(170, light);
        let blocks = Blocks::new(&volume.shape(), options.clone()).unwrap();
        assert!(blocks.count() > 2);
        let together = Matcher::new(volume.clone(), options).unwrap().matched(&Silent).unwrap();
        for reversed in [false, true] {
            let one_by_one = one_by_one(&volume, &blocks, reversed);
            assert!(bits(&one_by_one) == bits(&together));
            assert_eq!((one_by_one.locking, one_by_one.light), (together.locking, together.light));
        }
        let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert!(bits(&one_thread.install(|| one_by_one(&volume, &blocks, false))) == bits(&together));
    }
}

/// Where a block ends, errors are those of a match in one piece, and the surface has no step.
#[test]
fn ends_of_blocks_do_not_show() {
    const HEIGHT: usize = 100;
    let rows = 4 * HEIGHT;
    let volume = scene(rows, 0.0);
    let whole = Matcher::new(volume.clone(), MatchOptions::default()).unwrap().matched(&Silent).unwrap();
    let blocks = Matcher::new(volume, in_blocks(HEIGHT)).unwrap().matched(&Silent).unwrap();
    let from_end = |y: usize| (y % HEIGHT).min(HEIGHT - y % HEIGHT);
    // Not at borders of the picture, nor beside its step.
    let counts = |y: usize| (10..rows - 10).contains(&y) && y.abs_diff(rows / 2) > 10;
    let errors = |maps: &DisparityMaps, near: bool| -> Vec<f64> {
        let rows = (0..rows).filter(|&y| counts(y) && (from_end(y) < 10) == near);
        let pixels = rows.flat_map(|y| (20..COLUMNS - 20).map(move |x| (x, y)));
        let error = |(x, y)| f64::from(maps.disparity.at(x, y)) - disparity(rows_of(maps), y);
        pixels.map(error).filter(|error| !error.is_nan()).collect()
    };
    let square =
        |errors: &[f64]| (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    for near in [true, false] {
        let [one, other] = [&whole, &blocks].map(|maps| errors(maps, near));
        assert!(other.len() > 2000);
        let [in_one, in_blocks] = [square(&one), square(&other)];
        // Independent estimates of what is common to a picture may differ by a part of the scatter.
        assert!(in_blocks < 1.1 * in_one, "near ends: {near}: {in_blocks} px and {in_one} px");
        assert!(
            (mean(&one) - mean(&other)).abs() < 0.1 * in_one,
            "near ends: {near}: {} and {}",
            mean(&one),
            mean(&other)
        );
    }
}

fn rows_of(maps: &DisparityMaps) -> usize {
    maps.disparity.rows()
}

#[test]
fn a_mask_and_blocks_answer_what_is_inside() {
    let volume = scene(300, 0.0);
    let mut inside = Grid::filled(300, COLUMNS, false);
    for y in (20..90).chain(230..260) {
        inside.row_mut(y)[30..80].fill(true);
    }
    let blocks = Blocks::new(&volume.shape(), in_blocks(60)).unwrap().within(&inside).unwrap();
    let matcher = Matcher::of_blocks(volume, blocks);
    let maps = matcher.matched(&Silent).unwrap();
    for y in 0..300 {
        for x in 0..COLUMNS {
            let outside = maps.validity.at(x, y) == Validity::Outside;
            assert_eq!(outside, !inside.at(x, y), "{x} {y}");
        }
    }
    let found = maps.validity.values().iter().filter(|&&validity| validity == Validity::Found).count();
    assert!(found > 4500, "{found}");
    // Two empty blocks between are not matched.
    assert_eq!(
        Blocks::new(&scene(300, 0.0).shape(), in_blocks(60)).unwrap().within(&inside).unwrap().count(),
        3
    );
    let equal = matcher.in_equal_discs(&maps, &Silent).unwrap();
    assert!(!equal.disparity.at(50, 50).is_nan() && equal.disparity.at(50, 150).is_nan());
    let (candidates, _) = matcher.row_costs(40, &maps).unwrap();
    assert!(candidates.count() > 3);
}

#[test]
fn blocks_without_rows_are_refused() {
    let refused = Blocks::new(&scene(20, 0.0).shape(), in_blocks(0)).unwrap_err();
    assert!(refused.to_string().contains("at least 1"), "{refused}");
}
