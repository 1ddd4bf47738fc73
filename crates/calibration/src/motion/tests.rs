//! Scenes that are drawn here: noise of several scales, sampled where the camera would see it.

use super::*;
use crate::texture_motion::Return;
use epirig_core::frame::Samples;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const ROWS: usize = 168;
const COLUMNS: usize = 256;

/// A texture without an end: random values on grids, joined smoothly.
struct Texture {
    seed: u64,
    /// Distances of the grids, in px, and their contrasts.
    scales: Vec<(f64, f64)>,
}

impl Texture {
    fn at(&self, x: f64, y: f64) -> f64 {
        self.scales
            .iter()
            .map(|&(pitch, contrast)| contrast * self.noise(x / pitch, y / pitch, pitch as u64))
            .sum()
    }

    fn noise(&self, x: f64, y: f64, scale: u64) -> f64 {
        let (left, top) = (x.floor(), y.floor());
        let smooth = |part: f64| part * part * (3.0 - 2.0 * part);
        let (right, low) = (smooth(x - left), smooth(y - top));
        let corner = |dx: f64, dy: f64| {
            let mut bits = self.seed.wrapping_mul(0xd6e8_feb8_6659_fd93) ^ (scale << 48);
            bits ^= ((left + dx) as i64 as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            bits ^= ((top + dy) as i64 as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
            // The finisher of SplitMix64.
            bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            bits ^= bits >> 31;
            (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let above = corner(0.0, 0.0) * (1.0 - right) + corner(1.0, 0.0) * right;
        let below = corner(0.0, 1.0) * (1.0 - right) + corner(1.0, 1.0) * right;
        above * (1.0 - low) + below * low
    }
}

fn fine(seed: u64) -> Texture {
    Texture { seed, scales: vec![(3.0, 60.0), (11.0, 20.0)] }
}

fn natural(seed: u64) -> Texture {
    Texture { seed, scales: vec![(4.0, 12.0), (12.0, 22.0), (40.0, 35.0), (130.0, 40.0)] }
}

/// A frame of what `scene` shows at each pixel, with noise of 2 DN.
fn exposed(index: usize, light: f64, scene: impl Fn(f64, f64) -> f64) -> Frame {
    let mut random = ChaCha8Rng::seed_from_u64(index as u64);
    let mut values = Vec::with_capacity(ROWS * COLUMNS);
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            // The sum of four bytes has a mean of 510 and a standard deviation of 148.
            let bytes: u32 = random.random::<u32>().to_ne_bytes().iter().map(|&byte| u32::from(byte)).sum();
            let noise = 2.0 * (f64::from(bytes) - 510.0) / 148.0;
            values.push((light * (120.0 + scene(column as f64, row as f64)) + noise).clamp(0.0, 255.0) as u8);
        }
    }
    Frame::new(ROWS, COLUMNS, 8, Samples::U8(values)).unwrap()
}

/// Frames of a texture that has moved by `shift` in each.
fn moved(texture: &Texture, shifts: impl IntoIterator<Item = (f64, f64)>) -> Vec<Frame> {
    let shifts = shifts.into_iter().enumerate();
    shifts.map(|(index, (x, y))| exposed(index, 1.0, |column, row| texture.at(column - x, row - y))).collect()
}

fn steps(count: usize, x: f64, y: f64) -> impl Iterator<Item = (f64, f64)> {
    (0..count).map(move |index| (x * index as f64, y * index as f64))
}

fn motion(frames: &[Frame]) -> Motion {
    let mut check = MotionCheck::new(frames.len());
    frames.iter().for_each(|frame| check.look(frame));
    check.motion(None)
}

fn doubts(frames: &[Frame]) -> Vec<Doubt> {
    motion(frames).doubts
}

/// Numbers in two orders: one that jumps by 7, and one without any rule.
fn shuffled(count: usize) -> [Vec<usize>; 2] {
    let mut random: Vec<usize> = (0..count).collect();
    random.sort_by_key(|&place| (place as u64 + 5).wrapping_mul(0xd6e8_feb8_6659_fd93) >> 20);
    [(0..count).map(|index| (index * 7 + 3) % count).collect(), random]
}

#[test]
fn motion_along_the_rows_is_measured_and_nothing_is_told() {
    for texture in [fine(1), natural(2)] {
        for step in [0.2, -0.7, 9.0, -20.0] {
            let seen = motion(&moved(&texture, steps(16, step, 0.0)));
            assert_eq!(seen.doubts, [], "{step}");
            let (x, y) = seen.step_px.unwrap();
            // Peaks of a correlation are placed to some tenth of a pixel.
            assert!((x - step).abs() < 0.1 && y.abs() < 0.1, "{step}: {x}, {y}");
        }
    }
}

#[test]
fn a_small_object_before_what_stands_still_is_motion() {
    for (texture, contrast) in [(fine(3), 1.0), (natural(4), 1.0), (natural(5), 0.0)] {
        for step in [0.2, 6.0] {
            let frames: Vec<Frame> = (0..14)
                .map(|index| {
                    let shift = step * index as f64;
                    let background =
                        Texture { seed: 99, scales: vec![(7.0, 40.0 * contrast), (50.0, 30.0 * contrast)] };
                    exposed(index, 1.0 - 0.01 * index as f64, |x, y| {
                        // The share of the pixel that the tile covers.
                        let covered = |at: f64, from: f64| {
                            (at - from + 0.5).clamp(0.0, 1.0) * (from + 100.5 - at).clamp(0.0, 1.0)
                        };
                        let tile = covered(x - shift, 30.0) * covered(y, 40.0);
                        tile * texture.at(x - shift, y) + (1.0 - tile) * background.at(x, y)
                    })
                })
                .collect();
            assert_eq!(doubts(&frames), [], "{step} {contrast}");
        }
    }
}

#[test]
fn motion_of_another_direction_is_told() {
    for texture in [fine(6), natural(7)] {
        for step in [0.4, -14.0] {
            assert_eq!(doubts(&moved(&texture, steps(14, 0.0, step))), [Doubt::Vertical], "{step}");
            match &doubts(&moved(&texture, steps(14, step, step)))[..] {
                [Doubt::Oblique { degrees, .. }] => assert!((degrees - 45.0).abs() < 5.0, "{degrees}"),
                other => panic!("{step}: {other:?}"),
            }
            // A camera that is a degree out of its place, either way.
            for tilt in [0.02, -0.02_f64] {
                match &doubts(&moved(&texture, steps(14, step, tilt * step)))[..] {
                    [Doubt::Oblique { degrees, drift_px: Some(drift_px) }] => {
                        assert!((degrees - tilt.atan().to_degrees()).abs() < 0.1, "{degrees}");
                        assert!((drift_px - 13.0 * (tilt * step).abs()).abs() < 0.1, "{drift_px}");
                    }
                    // 0.1 px over all frames costs less than noise.
                    other => assert!(step == 0.4 && other.is_empty(), "{step}: {other:?}"),
                }
            }
            assert_eq!(doubts(&moved(&texture, steps(14, step, 0.0005 * step))), []);
        }
    }
}

#[test]
fn a_scene_that_stands_still_is_told() {
    for texture in [fine(8), natural(9)] {
        assert_eq!(doubts(&moved(&texture, steps(12, 0.0, 0.0))), [Doubt::Still]);
    }
    // Without texture nothing is known.
    let blank = Texture { seed: 1, scales: vec![] };
    assert_eq!(doubts(&moved(&blank, steps(12, 0.0, 0.0))), []);
}

#[test]
fn frames_in_disorder_are_put_in_order() {
    for texture in [fine(10), natural(11)] {
        for step in [0.5, 3.0, 9.0] {
            for order in shuffled(20) {
                let frames = moved(&texture, order.iter().map(|&place| (step * place as f64, 0.0)));
                match &doubts(&frames)[..] {
                    [Doubt::Disorder(path)] => {
                        let places: Vec<usize> = path.iter().map(|&frame| order[frame]).collect();
                        assert!(places.is_sorted() || places.iter().rev().is_sorted(), "{step}: {places:?}");
                    }
                    other => panic!("{step} {order:?}: {other:?}"),
                }
            }
        }
    }
}

#[test]
fn a_motion_there_and_back_is_told() {
    let there_and_back = (0..20_i32).map(|index| (4.0 * f64::from(10 - (index - 10).abs()), 0.0));
    assert_eq!(doubts(&moved(&natural(12), there_and_back)), [Doubt::TurnsRound(10)]);
}

#[test]
fn frames_of_another_scene_are_named() {
    for step in [0.3, 4.0] {
        let mut frames = moved(&natural(13), steps(16, step, 0.0));
        frames[5] = moved(&natural(14), [(0.0, 0.0)]).remove(0);
        assert_eq!(doubts(&frames), [Doubt::Foreign(vec![5])], "{step}");
        frames[0] = moved(&fine(15), [(0.0, 0.0)]).remove(0);
        frames[15] = exposed(15, 0.02, |_, _| 0.0);
        assert_eq!(doubts(&frames), [Doubt::Foreign(vec![0, 5, 15])], "{step}");
    }
}

#[test]
fn frames_in_disorder_that_share_little_with_their_neighbours_are_not_foreign() {
    // Frames that stand beside each other share next to nothing twice.
    let places = [0, 1, 2, 9, 10, 11, 3, 4, 5, 6, 7, 8];
    let frames = moved(&fine(3), places.map(|place| (-30.0 * f64::from(place), 0.0)));
    let doubts = doubts(&frames);
    assert!(!doubts.iter().any(|doubt| matches!(doubt, Doubt::Foreign(_))), "{doubts:?}");
}

#[test]
fn what_repeats_and_what_drifts_is_not_called_wrong() {
    use std::f64::consts::TAU;
    // Stripes and a grid: steps of half a period and more.
    for (step, period) in [(5.0, 10.0), (7.0, 9.0), (3.0, 31.0)] {
        let grid = |x: f64, y: f64| 40.0 * (TAU * x / period).sin() + 40.0 * (TAU * y / period).sin();
        let stripes = |x: f64, _: f64| 60.0 * (TAU * x / period).sin();
        for scene in [&grid as &dyn Fn(f64, f64) -> f64, &stripes] {
            let frame = |index: usize| exposed(index, 1.0, |x, y| scene(x - step * index as f64, y));
            assert_eq!(doubts(&(0..14).map(frame).collect::<Vec<_>>()), [], "{step} {period}");
        }
    }
    // A lamp that fades, unevenly.
    let texture = natural(16);
    let fading = |index: usize| {
        let light = 1.0 - 0.03 * index as f64;
        exposed(index, light, |x, y| texture.at(x - 2.0 * index as f64, y) + 0.05 * x * index as f64)
    };
    assert_eq!(doubts(&(0..14).map(fading).collect::<Vec<_>>()), []);
}

#[test]
fn steps_that_differ_are_told_with_their_gaps() {
    let even = |count: usize| (0..count).map(|index| 6.0 * index as f64).collect::<Vec<f64>>();
    let seen = |places: &[f64]| doubts(&moved(&fine(21), places.iter().map(|&x| (x, 0.0))));
    assert_eq!(seen(&even(14)), []);
    let mut gap = even(16);
    gap.drain(5..7);
    match &seen(&gap)[..] {
        [Doubt::Uneven { gaps, share, .. }] => {
            let [gap] = gaps[..] else { panic!("{gaps:?}") };
            assert_eq!((gap.from, gap.to, gap.taken), (4, 5, 1.0));
            assert!((gap.length - 3.0).abs() < 0.05, "{gap:?}");
            assert_eq!(*share, 0.0);
        }
        other => panic!("{other:?}"),
    }
    let by_hand: Vec<f64> =
        even(14).iter().enumerate().map(|(index, x)| x + if index % 3 == 1 { 0.9 } else { 0.0 }).collect();
    match &seen(&by_hand)[..] {
        // Two steps of three are 15 % off.
        [Doubt::Uneven { gaps, share, displacement_px }] => {
            assert!(gaps.is_empty() && (share - 0.124).abs() < 0.02, "{share} {gaps:?}");
            assert!((displacement_px - 0.43).abs() < 0.1, "{displacement_px}");
        }
        other => panic!("{other:?}"),
    }
    // Where they are taken to stand there, nothing is wrong.
    assert_eq!(doubts_at(&gap, &gap), []);
}

/// What is told of frames at these places, in px, that are taken to stand at others.
fn doubts_at(places: &[f64], given: &[f64]) -> Vec<Doubt> {
    let mut check = MotionCheck::new(places.len());
    moved(&fine(21), places.iter().map(|&x| (x, 0.0))).iter().for_each(|frame| check.look(frame));
    check.motion(Some(given)).doubts
}

#[test]
fn a_short_step_is_a_step_and_one_that_may_be_none_is_not() {
    let counted = |count: usize| (0..count).map(|index| index as f64).collect::<Vec<f64>>();
    // Frame 6 is a quarter of a step, 1.5 px, beyond frame 5.
    let mut short: Vec<f64> = (0..14).map(|index| 6.0 * f64::from(index)).collect();
    short.iter_mut().skip(6).for_each(|place| *place -= 4.5);
    assert_eq!(doubts_at(&short, &short), []);
    assert!(matches!(doubts_at(&short, &counted(14))[..], [Doubt::Uneven { .. }]));
    // A repeated frame, and one that goes back by a tenth of a step. Left out, nothing is wrong.
    let mut repeated: Vec<f64> = (0..14).map(|index| 6.0 * f64::from(index)).collect();
    repeated.insert(6, repeated[5]);
    repeated.insert(10, repeated[9] - 0.6);
    let without_given = doubts(&moved(&fine(21), repeated.iter().map(|&x| (x, 0.0))));
    let mut given: Vec<f64> = repeated.clone();
    (given[6], given[10]) = (given[5] + 3.0, given[9] + 3.0);
    for found in [without_given, doubts_at(&repeated, &given)] {
        match &found[..] {
            [Doubt::Returns(frames)] => match frames[..] {
                [(6, Return::Repeated), (10, Return::Back(steps))] => {
                    let usual = 0.1;
                    assert!((steps - usual).abs() < 0.01, "{steps}");
                }
                _ => panic!("{frames:?}"),
            },
            other => panic!("{other:?}"),
        }
    }
    // A gap is told besides.
    repeated.iter_mut().skip(12).for_each(|place| *place += 12.0);
    let found = doubts(&moved(&fine(21), repeated.iter().map(|&x| (x, 0.0))));
    assert!(
        matches!(&found[..], [Doubt::Returns(_), Doubt::Uneven { gaps, .. }] if gaps.len() == 1),
        "{found:?}"
    );
}

#[test]
fn steps_of_many_frames_are_told_in_steps_of_one() {
    // Of more than 400 frames every second one is looked at. One frame is missing behind the 250th, three are behind
    // the 400th.
    let places = (0..504).filter(|index| *index != 251 && !(402..405).contains(index)).map(f64::from);
    match &doubts(&moved(&fine(22), places.map(|place| (1.2 * place, 0.0))))[..] {
        [Doubt::Uneven { gaps, .. }] => match gaps[..] {
            [one, three] => {
                assert_eq!((one.from, one.to, one.taken), (250, 252, 2.0));
                assert!((one.length - 3.0).abs() < 0.1, "{one:?}");
                assert_eq!((three.from, three.to, three.taken), (400, 402, 2.0));
                assert!((three.length - 5.0).abs() < 0.1, "{three:?}");
            }
            _ => panic!("{gaps:?}"),
        },
        other => panic!("{other:?}"),
    }
}
