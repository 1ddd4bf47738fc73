use super::*;
use crate::search::edge_refinement::tests::{COLUMNS, EDGE, NEAR_PX, ROWS, step, task};
use crate::validity::Validity;
use epirig_core::frame::{Frame, Samples};
use epirig_core::grid::Grid;
use proptest::prelude::*;

fn empty(frames: usize) -> Volume {
    Volume::new(1, 8, 8, Tau::equidistant(frames).unwrap())
}

/// Sum of squared deviations of tau, one over which a line's slope varies by.
fn information(tau: &Tau) -> f64 {
    let mean = tau.values().iter().sum::<f64>() / tau.frames() as f64;
    tau.values().iter().map(|tau| (tau - mean).powi(2)).sum()
}

#[test]
fn half_of_many_frames_leave_an_eighth_more_sigma() {
    for count in [100, 101, 200, 333] {
        let all = empty(count);
        for reference in [0, count / 2, count - 1] {
            let some = TellingFrames::of(&all, reference, 3).unwrap();
            assert!(some.volume.frames().abs_diff(count / 2) <= 1);
            assert_eq!(some.volume.tau().values()[some.reference], all.tau().values()[reference]);
            let sigma = (information(all.tau()) / information(some.volume.tau())).sqrt();
            assert!((1.12..1.15).contains(&sigma), "{count}: {sigma}");
        }
    }
    assert!(TellingFrames::of(&empty(99), 0, 3).is_none(), "fewer frames are all needed");
}

#[test]
fn what_enough_frames_see_enough_of_half_of_them_see() {
    let all = empty(100);
    // Half of the frames, wherever they lie; four fifths; all.
    for (minimum, least) in [(50, 11..16), (80, 30..41), (100, 50..52)] {
        let some = TellingFrames::of(&all, 40, minimum).unwrap();
        assert!(least.contains(&some.minimum_frames), "{minimum}: {}", some.minimum_frames);
        let tau = |t: usize| all.tau().values()[t];
        for first in 0..=100 - minimum {
            let run = tau(first)..=tau(first + minimum - 1);
            let among = some.volume.tau().values().iter().filter(|tau| run.contains(tau)).count();
            assert!(among >= some.minimum_frames, "{minimum} from {first}");
        }
    }
}

proptest! {
    #[test]
    fn telling_frames_keep_the_baseline_and_their_samples(
        steps in prop::collection::vec(0.01_f64..10.0, 100..260), reference in 0.0_f64..1.0,
    ) {
        let positions: Vec<f64> = steps.iter().scan(0.0, |sum, step| { *sum += step; Some(*sum) }).collect();
        let mut all = Volume::new(2, 8, 16, Tau::from_positions(&positions).unwrap());
        for t in 0..all.frames() {
            let frame = Frame::new(2, 8, 16, Samples::U16(vec![t as u16; 16])).unwrap();
            all.insert(t, &frame).unwrap();
        }
        let reference = (reference * positions.len() as f64) as usize;
        let some = TellingFrames::of(&all, reference, 50).unwrap();
        let mut row = [0.0; 8];
        let mut before = None;
        for (t, tau) in some.volume.tau().values().iter().enumerate() {
            some.volume.copy_row(1, t, &mut row);
            let source = row[0] as usize;
            prop_assert!(before < Some(source), "frames keep their order");
            prop_assert!((tau - all.tau().values()[source]).abs() < 1e-12);
            prop_assert_eq!(t == some.reference, source == reference);
            before = Some(source);
        }
    }
}

/// What a search of halved frames found.
fn coarse(guess: Grid<f32>, validity: Grid<Validity>) -> SearchResult {
    let filled = |value| guess.map(|_| value);
    let (cost, confidence) = (filled(1.0), filled(0.5));
    SearchResult { guess, cost, confidence, validity, deviation_share: Some(0.3) }
}

#[test]
fn edges_are_refined_to_a_pixel() {
    let volume = step();
    let lines = EpiLines::new(volume.tau(), 0, COLUMNS);
    let options = MatchOptions::default();
    let halves = (ROWS / 2, COLUMNS / 2);
    // What windows of the halved frames do: the nearer surface reaches farther than it is, by a pixel and
    // what an edge leaves of another.
    let mut guess = Grid::filled(halves.0, halves.1, 0.0);
    let last = EDGE / 2 + 1;
    (0..halves.0).for_each(|y| guess.row_mut(y)[..=last].fill(0.5 * NEAR_PX as f32));
    let validity = Grid::filled(halves.0, halves.1, Validity::Found);
    let found = refined(task(&volume, &lines, &options), &coarse(guess, validity), 2);
    for y in 0..ROWS {
        for x in 8..COLUMNS - 8 {
            let truth = if x <= EDGE { NEAR_PX as f32 } else { 0.0 };
            // Between two surfaces samples are mixtures.
            assert!(x == EDGE || found.guess.at(x, y) == truth, "({x}, {y}): {}", found.guess.at(x, y));
        }
    }
    assert_eq!((found.cost.at(COLUMNS - 1, ROWS - 1), found.confidence.at(0, 0)), (1.0, 0.5));
}

#[test]
fn a_plane_stays_a_plane_and_reasons_stay_with_their_pixels() {
    let volume = step();
    let lines = EpiLines::new(volume.tau(), 0, COLUMNS);
    let options = MatchOptions::default();
    let halves = (ROWS / 2, COLUMNS / 2);
    // d = 5 + 0.04 x - 0.02 y, of which the middle of halved pixel (X, Y), (2 X + 0.5, 2 Y + 0.5), has half.
    let plane = |x: f32, y: f32| 5.0 + 0.04 * x - 0.02 * y;
    let mut guess = Grid::filled(halves.0, halves.1, 0.0);
    let mut validity = Grid::filled(halves.0, halves.1, Validity::Found);
    for y in 0..halves.0 {
        for x in 0..halves.1 {
            guess.row_mut(y)[x] = 0.5 * plane(2.0 * x as f32 + 0.5, 2.0 * y as f32 + 0.5);
        }
    }
    guess.row_mut(5)[20] = f32::NAN;
    validity.row_mut(5)[20] = Validity::Ambiguous;
    let found = refined(task(&volume, &lines, &options), &coarse(guess, validity), 2);
    for y in 1..ROWS - 1 {
        for x in 1..COLUMNS - 2 {
            let unknown = (40..42).contains(&x) && (10..12).contains(&y);
            assert_eq!(found.validity.at(x, y) == Validity::Ambiguous, unknown, "({x}, {y})");
            let guess = found.guess.at(x, y);
            assert_eq!(guess.is_nan(), unknown, "({x}, {y})");
            // Beside the unknown one nothing is interpolated: half a pixel of the slants is off.
            let beside = (39..43).contains(&x) && (9..13).contains(&y);
            let off = if beside { 0.031 } else { 1e-5 };
            assert!(unknown || (guess - plane(x as f32, y as f32)).abs() < off, "({x}, {y}): {guess}");
        }
    }
    assert_eq!(found.deviation_share, Some(0.3));
}

#[test]
fn frames_too_small_to_be_halved_are_not() {
    let volume = Volume::new(1, 40, 8, Tau::equidistant(5).unwrap());
    let lines = EpiLines::new(volume.tau(), 0, 40);
    assert!(Halved::of(&volume, &lines, &MatchOptions::default()).is_none());
    let volume = Volume::new(2, 16, 8, Tau::equidistant(5).unwrap());
    let lines = EpiLines::new(volume.tau(), 0, 16);
    let range = Some(DisparityRange { minimum_px: -5.0, maximum_px: 9.0 });
    let halved =
        Halved::of(&volume, &lines, &MatchOptions { range, window_px: 1, ..MatchOptions::default() });
    assert_eq!(halved.map(|halved| halved.rows()), Some(1));
    // What only just suits the whole frames is cut to what suits half of them.
    let volume = Volume::new(8, 81, 8, Tau::equidistant(5).unwrap());
    let lines = EpiLines::new(volume.tau(), 0, 81);
    let range = Some(DisparityRange { minimum_px: 90.0, maximum_px: 160.0 });
    let widest = MatchOptions { range, window_px: 31, ..MatchOptions::default() };
    widest.check(8, 81, 5).unwrap();
    let halved = Halved::of(&volume, &lines, &widest).unwrap();
    assert_eq!((halved.rows(), halved.options.window_px), (4, 31));
    assert_eq!(halved.options.range, Some(DisparityRange { minimum_px: 45.0, maximum_px: 78.0 }));
}
