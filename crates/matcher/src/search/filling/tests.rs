//! Neighbours counted one by one, and scenes in which the right answer is known.

use proptest::prelude::*;

use super::*;
use crate::candidates::Candidates;
use crate::candidates::DisparityRange;
use crate::lines::SeenRule;
use crate::maps::OrderingUsed;
use crate::options::{MatchOptions, Occlusion};
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

const NONE: f32 = f32::NAN;

/// Answers with these disparities and the confidence 0.5; NaN is ambiguous.
fn answers(rows: usize, columns: usize, guess: impl Fn(usize, usize) -> f32) -> SearchResult {
    let values: Vec<f32> = (0..rows * columns).map(|index| guess(index % columns, index / columns)).collect();
    let validity = |value: &f32| if value.is_nan() { Validity::Ambiguous } else { Validity::Found };
    let validity = Grid::from_values(rows, columns, values.iter().map(validity).collect()).unwrap();
    SearchResult {
        guess: Grid::from_values(rows, columns, values).unwrap(),
        cost: Grid::filled(rows, columns, 1.0),
        confidence: Grid::filled(rows, columns, 0.5),
        validity,
        deviation_share: None,
    }
}

fn kept(searched: &SearchResult) -> Vec<(usize, usize)> {
    let (rows, columns) = (searched.guess.rows(), searched.guess.columns());
    let all = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
    all.filter(|&(x, y)| {
        let found = searched.validity.at(x, y) == Validity::Found;
        assert_eq!(found, !searched.guess.at(x, y).is_nan(), "column {x}, row {y}");
        found
    })
    .collect()
}

#[test]
fn single_candidates_are_taken_back_and_surfaces_stay() {
    let mut searched = answers(12, 30, |x, y| if (x, y) == (15, 6) { 20.0 } else { 7.0 });
    drop_ambiguous(&mut searched, 0.03);
    assert_eq!(kept(&searched).len(), 12 * 30 - 1);
    assert_eq!(searched.validity.at(15, 6), Validity::Ambiguous);
    // A surface that slants by half a pixel per pixel, seen through gaps two pixels wide, to the corners.
    let mut searched =
        answers(12, 30, |x, y| if x % 5 < 2 { 0.5 * x as f32 } else { 100.0 + (17 * x + 29 * y) as f32 });
    drop_ambiguous(&mut searched, 0.03);
    let through: Vec<_> = (0..12).flat_map(|y| (0..30).filter(|x| x % 5 < 2).map(move |x| (x, y))).collect();
    assert_eq!(kept(&searched), through);
}

#[test]
fn what_hardly_differs_from_its_rivals_is_ambiguous() {
    let mut searched = answers(9, 9, |_, _| 7.0);
    searched.confidence.row_mut(4)[3] = 0.029;
    searched.confidence.row_mut(4)[4] = 0.031;
    // No rival at all.
    searched.confidence.row_mut(4)[5] = NONE;
    // Another validity is not overruled.
    searched.guess.row_mut(2)[2] = NONE;
    searched.validity.row_mut(2)[2] = Validity::LeavesImage;
    searched.confidence.row_mut(2)[2] = 0.0;
    drop_ambiguous(&mut searched, 0.03);
    assert_eq!(searched.validity.at(3, 4), Validity::Ambiguous);
    assert_eq!(searched.validity.at(2, 2), Validity::LeavesImage);
    assert_eq!(kept(&searched).len(), 81 - 2);
}

proptest! {
    /// A quarter of the neighbours within two pixels that the image has must agree.
    #[test]
    fn as_many_neighbours_must_agree_as_are_asked(
        rows in 1_usize..7, columns in 1_usize..9, levels in prop::collection::vec(0_usize..4, 54),
    ) {
        let level = |x: usize, y: usize| [0.0_f32, 10.0, 20.0, NONE][levels[y * 9 + x]];
        let mut searched = answers(rows, columns, level);
        drop_ambiguous(&mut searched, 0.03);
        for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
            let (mut like, mut there) = (-1.0, 0.0);
            for (v, u) in (0..rows).flat_map(|v| (0..columns).map(move |u| (v, u))) {
                if u.abs_diff(x) <= 2 && v.abs_diff(y) <= 2 {
                    there += 1.0;
                    like += f64::from(u8::from(level(u, v) == level(x, y)));
                }
            }
            // Six where there are all 25.
            let stays = !level(x, y).is_nan() && like >= 6.0 / 25.0 * there - 1e-9;
            prop_assert_eq!(searched.validity.at(x, y) == Validity::Found, stays);
            prop_assert_eq!(searched.guess.at(x, y).is_nan(), !stays);
        }
    }

    #[test]
    fn every_disparity_around_lies_on_a_surface_and_surfaces_are_those_around(
        disparities in prop::collection::vec(prop_oneof![3 => 0.0_f32..30.0, 1 => Just(NONE)], 11 * 10), x in 0_usize..11, y in 0_usize..10,
    ) {
        let guess = Grid::from_values(10, 11, disparities).unwrap();
        let found = surfaces_around(&guess, x, y);
        let near: Vec<f32> = (0..10_usize)
            .flat_map(|v| (0..11_usize).map(move |u| (u, v)))
            .filter(|&(u, v)| u.abs_diff(x) <= 3 && v.abs_diff(y) <= 3)
            .map(|(u, v)| guess.at(u, v))
            .filter(|value| !value.is_nan())
            .collect();
        prop_assert_eq!(found.is_empty(), near.is_empty());
        prop_assert!(found.iter().all(|surface| near.contains(surface)));
        // Each is the middle one of those from the gap below it to the gap above it.
        for pair in found.windows(2) {
            prop_assert!(pair[1] - pair[0] > 1.0);
        }
        let gaps = |low: f32, high: f32| {
            let mut between: Vec<f32> = near.iter().copied().filter(|&value| value >= low && value <= high).collect();
            between.sort_by(f32::total_cmp);
            between.windows(2).filter(|pair| pair[1] - pair[0] > 1.0).count()
        };
        prop_assert_eq!(gaps(f32::NEG_INFINITY, f32::INFINITY) + 1, found.len().max(1));
        prop_assert!(found.windows(2).all(|pair| gaps(pair[0], pair[1]) == 1));
    }
}

#[test]
fn a_surface_is_represented_by_its_median() {
    let row = [5.0, 5.9, 6.5, 20.0, 20.1, NONE, 20.2];
    let guess = Grid::from_values(1, 7, row.to_vec()).unwrap();
    assert_eq!(surfaces_around(&guess, 3, 0), [5.9, 20.1]);
    // Three columns to each side.
    assert_eq!(surfaces_around(&guess, 0, 0), [5.9, 20.0]);
    assert!(surfaces_around(&Grid::filled(4, 4, NONE), 1, 1).is_empty());
}

const FRAMES: usize = 41;
const COLUMNS: usize = 160;
const ROWS: usize = 8;
const RANGE: DisparityRange = DisparityRange { minimum_px: 0.0, maximum_px: 60.0 };

/// What the point at `x` of the first frame looks like, in DN.
fn texture(x: f64, y: usize) -> f64 {
    128.0 + 50.0 * (0.61 * x + y as f64).sin() + 40.0 * (0.37 * x + (3 * y) as f64).sin()
}

/// A texture that moves by `disparity_px`, counted in 1/128 DN.
fn scene(disparity_px: f64) -> Volume {
    let tau = Tau::equidistant(FRAMES).unwrap();
    let mut volume = Volume::fine(ROWS, COLUMNS, 8, tau.clone());
    for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
        let (x, y, t) = (index % COLUMNS, index / COLUMNS / FRAMES, index / COLUMNS % FRAMES);
        *count = (128.0 * texture(x as f64 - disparity_px * tau.values()[t], y)).round() as u16;
    }
    volume
}

#[test]
fn disagreement_is_the_mean_squared_deviation_in_view() {
    for (reference, disparity_px) in [(0, 23.7), (20, -31.2), (40, 40.0), (7, 0.0)] {
        let volume = scene(11.0);
        let lines = EpiLines::new(volume.tau(), reference, COLUMNS);
        let epi = LinearEpi::new(&volume, 5);
        let mut row = vec![0.0; COLUMNS];
        for x in 0..COLUMNS {
            let (mut squares, mut seen) = (0.0_f64, 0_u32);
            let own = texture(x as f64 - 11.0 * volume.tau().values()[reference], 5);
            for t in 0..FRAMES {
                let shift = lines.shift(disparity_px, t);
                if (shift.first..shift.end).contains(&x) {
                    volume.copy_row(5, t, &mut row);
                    let place = (x as isize + shift.whole) as usize;
                    let next = f64::from(row[(place + 1).min(COLUMNS - 1)]);
                    let sample = f64::from(row[place]) + shift.fraction * (next - f64::from(row[place]));
                    squares += ((sample - own).powi(2) / 900.0).min(1.0);
                    seen += 1;
                }
            }
            let (cost, count) = disagreement(&epi, &lines, x, disparity_px as f32, 900.0);
            assert_eq!(count, seen as usize, "reference {reference}, column {x}");
            // Counts are 1/256 DN off, and places 160 * 2^-24 px at 40 DN/px.
            assert!((f64::from(cost) - squares / f64::from(seen)).abs() < 1e-3, "{reference}, {x}: {cost}");
        }
    }
}

/// Fills the gaps of `guess` in a scene of the disparity `disparity_px`.
fn filled(
    disparity_px: f64,
    reference: usize,
    typical: f32,
    guess: impl Fn(usize, usize) -> f32,
) -> SearchResult {
    let volume = scene(disparity_px);
    let lines = EpiLines::new(volume.tau(), reference, COLUMNS);
    let rule = SeenRule::new(FRAMES, 0.5, Occlusion::OneSide);
    let plan = Plan::new(&lines, Candidates::covering(RANGE, 0.5), rule);
    let options = MatchOptions::default();
    let task = Task {
        volume: &volume,
        lines: &lines,
        range: RANGE,
        ordering: OrderingUsed::Off,
        rule,
        options: &options,
        progress: &Silent,
    };
    let mut searched = answers(ROWS, COLUMNS, guess);
    fill(task, &plan, Tolerance { share: 0.1, typical }, &mut searched);
    searched
}

#[test]
fn gaps_get_the_disparity_of_the_surface_that_frames_agree_with() {
    // Each gap has two surfaces beside it, of which one is right; half of the gaps seem occluded.
    let guess = |x: usize, y: usize| match x % 8 {
        0 | 1 => 11.0,
        2..=4 => NONE,
        5 => 34.0 + (y % 2) as f32 * 0.5,
        _ => 11.25,
    };
    let found = filled(11.0, 20, 0.05, guess);
    for (y, x) in (0..ROWS).flat_map(|y| (24..COLUMNS - 24).map(move |x| (y, x))) {
        let right = (found.guess.at(x, y) - 11.0).abs() <= 0.25;
        if guess(x, y).is_nan() {
            assert!(
                right && found.validity.at(x, y) == Validity::Found,
                "column {x}, row {y}: {}",
                found.guess.at(x, y)
            );
            assert!(found.confidence.at(x, y).is_nan() && found.cost.at(x, y) >= 0.0);
        } else {
            assert_eq!((found.guess.at(x, y), found.confidence.at(x, y)), (guess(x, y), 0.5));
        }
    }
}

#[test]
fn what_no_frame_agrees_with_stays_without_an_answer() {
    // Two points of the texture 23 px of disparity astray have nothing to do with each other.
    let guess = |x: usize, _| if x.is_multiple_of(2) { 34.0 } else { NONE };
    let found = filled(11.0, 20, 0.05, guess);
    let gaps = (0..ROWS).flat_map(|y| (25..COLUMNS - 25).step_by(2).map(move |x| (x, y)));
    // The texture repeats itself here and there within the tolerance, for half of the frames.
    let answered = gaps.clone().filter(|&(x, y)| found.validity.at(x, y) == Validity::Found).count();
    assert!(answered as f64 <= 0.03 * gaps.count() as f64, "{answered}");
}

#[test]
fn nothing_is_filled_in_that_too_few_frames_have_in_view() {
    // From the first frame, 60 px: points right of the column 159 - 30 are in view in less than half of the
    // frames. Of the first of them the neighbour is in view, and agrees.
    let tau = Tau::equidistant(FRAMES).unwrap();
    for gaps in [0, 1] {
        let found = filled(60.0, 0, 0.1, |x, _| if x % 2 == gaps { NONE } else { 60.0 });
        for (y, x) in (0..ROWS).flat_map(|y| (gaps..COLUMNS).step_by(2).map(move |x| (y, x))) {
            let in_view = |tau: &&f64| x as f64 + 60.0 * **tau <= (COLUMNS - 1) as f64;
            let seen = tau.values().iter().filter(in_view).count();
            assert_eq!(found.validity.at(x, y) == Validity::Found, 2 * seen >= FRAMES, "column {x}: {seen}");
        }
    }
}
