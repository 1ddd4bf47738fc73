//! The factorised search beside the definition, the exhaustive search and scenes whose truth is known in
//! closed form.

use super::*;
use crate::aggregation::sweep::{Consumer, Window, sweep};
use crate::candidates::DisparityRange;
use crate::lines::{EpiLines, SeenRule};
use crate::options::MatchOptions;
use crate::options::{Method, OrderingConstraint, ReferenceFrame};
use crate::validity::Validity;
use epirig_core::frame::{Frame, Samples};
use epirig_core::grid::Grid;
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

/// A texture without end: values at lattice points `grain` px apart from a hash of place and `seed`, joined
/// by cosines.
pub(crate) fn texture(x: f64, y: usize, seed: u64, grain: f64) -> f64 {
    let value = |cell: i64| {
        let mut bits = (cell as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (y as u64 + 1).wrapping_mul(0xD1B5_4A32_D192_ED03)
            ^ seed;
        for _ in 0..3 {
            bits = (bits ^ (bits >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        }
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    };
    let cell = (x / grain).floor();
    let weight = 0.5 - 0.5 * (std::f64::consts::PI * (x / grain - cell)).cos();
    let (a, b) = (value(cell as i64), value(cell as i64 + 1));
    a + weight * (b - a)
}

/// A volume of 8 bit whose sample at (x, y, t) is `shade(x, y, tau)` in 0 to 1.
pub(crate) fn volume(
    rows: usize,
    columns: usize,
    tau: &Tau,
    shade: impl Fn(f64, usize, f64) -> f64,
) -> Volume {
    let mut volume = Volume::new(rows, columns, 8, tau.clone());
    for (t, &tau) in tau.values().iter().enumerate() {
        let value = |place: usize| {
            (20.0 + 200.0 * shade((place % columns) as f64, place / columns, tau)).round() as u8
        };
        let bytes = (0..rows * columns).map(value).collect();
        volume.insert(t, &Frame::new(rows, columns, 8, Samples::U8(bytes)).unwrap()).unwrap();
    }
    volume
}

/// Keeps all costs: row, candidate, columns.
#[derive(Default)]
struct Kept {
    rows: Vec<Vec<Vec<f32>>>,
    current: Vec<Vec<f32>>,
}

impl Consumer for Kept {
    fn limit(&self, _y: usize) -> Option<&[f32]> {
        None
    }

    fn take(&mut self, _y: usize, _k: usize, costs: &mut [f32]) {
        self.current.push(costs.to_vec());
    }

    fn row_done(&mut self, _y: usize) {
        self.rows.push(std::mem::take(&mut self.current));
    }
}

/// Variance along the candidate by its definition, over the frames in `counted`.
fn defined(
    volume: &Volume,
    lines: &EpiLines,
    (x, y): (usize, usize),
    disparity: f64,
    counted: &[usize],
) -> f64 {
    let mut row = vec![0.0; volume.columns()];
    let samples: Vec<f64> = counted
        .iter()
        .map(|&t| {
            volume.copy_row(y, t, &mut row);
            let shift = lines.shift(disparity, t);
            let place = (x as isize + shift.whole) as usize;
            let next = row[(place + 1).min(volume.columns() - 1)];
            f64::from(row[place]) + shift.fraction * f64::from(next - row[place])
        })
        .collect();
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    samples.iter().map(|sample| (sample - mean).powi(2)).sum::<f64>() / (samples.len() - 1) as f64
}

fn frames_that_see(lines: &EpiLines, x: usize, disparity: f64) -> Vec<usize> {
    let sees = |&t: &usize| {
        let shift = lines.shift(disparity, t);
        (shift.first..shift.end).contains(&x)
    };
    (0..lines.frames()).filter(sees).collect()
}

#[test]
fn single_frames_give_the_variance_of_the_definition() {
    let tau = Tau::from_positions(&[0.0, 0.8, 1.7, 2.5, 3.3, 4.2, 5.1, 6.0]).unwrap();
    // Nothing moves along a line here: the costs are those of unrelated samples.
    let volume = volume(5, 90, &tau, |x, y, tau| texture(x, y, (1e6 * tau) as u64, 1.0));
    for reference in [0, 3, 7] {
        let lines = EpiLines::new(&tau, reference, 90);
        let rule = SeenRule::new(8, 0.5, Occlusion::None);
        let range = DisparityRange { minimum_px: -21.0, maximum_px: 17.5 };
        let plan = Plan::new(&lines, Candidates::covering(range, 0.5), rule);
        assert_eq!(plan.groups.extent, 0.0);
        let mut kept = Kept::default();
        sweep(&volume, &plan, Window { rows: 0, columns: 0 }, 0..5, &mut kept);
        for (k, x, y) in (0..plan.candidates.count()).flat_map(|k| (0..90).map(move |x| (k, x, (x + k) % 5)))
        {
            let disparity = plan.candidates.disparity_px(k as f64);
            let seen = frames_that_see(&lines, x, disparity);
            assert_eq!(plan.knows(k, x), seen.len() >= 4, "{reference} {disparity} {x}");
            if plan.knows(k, x) {
                let expected = defined(&volume, &lines, (x, y), disparity, &seen);
                let found = f64::from(kept.rows[y][k][x]);
                // Single precision over sums of squares up to 8 * 200^2.
                assert!((found - expected).abs() < 0.05, "{reference} {disparity} {x}: {found} {expected}");
            }
        }
    }
}

#[test]
fn groups_come_near_the_definition_for_any_reference() {
    let tau =
        Tau::from_positions(&(0..60).map(|t| f64::from(t) + 0.3 * f64::from(t % 3)).collect::<Vec<_>>())
            .unwrap();
    let scene = volume(3, 200, &tau, |x, y, tau| texture(x - 14.0 * tau, y, 7, 4.0));
    for reference in [0, 20, 59] {
        let lines = EpiLines::new(&tau, reference, 200);
        let rule = SeenRule::new(60, 0.5, Occlusion::None);
        let range = DisparityRange { minimum_px: 0.0, maximum_px: 30.0 };
        let plan = Plan::new(&lines, Candidates::covering(range, 0.5), rule);
        let mut kept = Kept::default();
        sweep(&scene, &plan, Window { rows: 0, columns: 0 }, 0..3, &mut kept);
        let (mut squares, mut norm) = (0.0, 0.0);
        for (k, x) in (0..plan.candidates.count()).flat_map(|k| (40..160).map(move |x| (k, x))) {
            let disparity = plan.candidates.disparity_px(k as f64);
            let expected = defined(&scene, &lines, (x, 1), disparity, &frames_that_see(&lines, x, disparity));
            squares += (f64::from(kept.rows[1][k][x]) - expected).powi(2);
            norm += expected * expected;
        }
        // Samples astray by 0.1 px in the root mean square (0.2 px at most), over a texture that changes
        // wholly in 4 px: each deviation errs by some 0.1 * pi / 4 of it, at random, so that the mean of 60
        // squares errs by much less than twice that.
        assert!((squares / norm).sqrt() < 0.1, "{reference}: {}", (squares / norm).sqrt());
    }
}

#[test]
fn windows_are_means_over_the_pixels_that_there_are() {
    let tau = Tau::equidistant(5).unwrap();
    let scene = volume(40, 80, &tau, |x, y, tau| texture(x - 3.0 * tau, y, 3, 2.0));
    let lines = EpiLines::new(&tau, 2, 80);
    let range = DisparityRange { minimum_px: 0.0, maximum_px: 6.0 };
    let plan = Plan::new(&lines, Candidates::covering(range, 0.5), SeenRule::new(5, 1.0, Occlusion::None));
    let run = |rows: usize, columns: usize| {
        let mut kept = Kept::default();
        sweep(&scene, &plan, Window { rows, columns }, 0..40, &mut kept);
        kept.rows
    };
    let (single, mean) = (run(0, 0), run(2, 3));
    for (k, y, x) in (0..plan.candidates.count()).flat_map(|k| (0..40).map(move |y| (k, y, (7 * y + k) % 80)))
    {
        if !plan.knows(k, x) {
            continue;
        }
        let near = (x.saturating_sub(3)..(x + 4).min(80)).filter(|&x| plan.knows(k, x));
        let values: Vec<f32> = near
            .flat_map(|x| (y.saturating_sub(2)..(y + 3).min(40)).map(move |y| (x, y)))
            .map(|(x, y)| single[y][k][x])
            .collect();
        let expected = values.iter().sum::<f32>() / values.len() as f32;
        // Rounding of running sums of some ten values below 1e4.
        assert!((mean[y][k][x] - expected).abs() < 0.02, "{k} {x} {y}: {} {expected}", mean[y][k][x]);
    }
}

pub(crate) fn searched(
    volume: &Volume,
    reference: usize,
    ordering: OrderingUsed,
    options: &MatchOptions,
) -> SearchResult {
    let lines = EpiLines::new(volume.tau(), reference, volume.columns());
    let occluded = if ordering == OrderingUsed::Off { Occlusion::OneSide } else { Occlusion::None };
    let rule = SeenRule::new(volume.frames(), options.min_visible, occluded);
    let range = DisparityRange { minimum_px: 0.0, maximum_px: 30.0 };
    search(Task { volume, lines: &lines, range, ordering, rule, options, progress: &Silent }).unwrap()
}

#[test]
fn both_searches_find_a_slanted_surface_from_any_reference() {
    let tau = Tau::equidistant(50).unwrap();
    // In the first frame d = 8 + 0.05 x; a point at x lies at X = x + d tau in the frame at tau.
    let origin = |x: f64, tau: f64| (x - 8.0 * tau) / (1.0 + 0.05 * tau);
    let scene = volume(12, 240, &tau, |x, y, tau| texture(origin(x, tau), y, 5, 3.0));
    for reference in [0, 25, 49] {
        for search_by in [Search::Exhaustive, Search::Factorised] {
            let options = MatchOptions { search: search_by, ..MatchOptions::default() };
            let found = searched(&scene, reference, OrderingUsed::On, &options);
            let tau = tau.values()[reference];
            let (mut answered, mut near) = (0, 0);
            for (x, y) in (0..240).flat_map(|x| (0..12).map(move |y| (x, y))) {
                let truth = 8.0 + 0.05 * origin(x as f64, tau);
                let error = (f64::from(found.guess.at(x, y)) - truth).abs();
                answered += usize::from(found.validity.at(x, y) == Validity::Found);
                near += usize::from(error <= 0.4);
            }
            // At 20 px of disparity some ten columns leave the image in more than half of the frames, if the
            // reference is an end.
            assert!(answered > 12 * 225, "{reference} {search_by:?}: {answered}");
            // Where the texture happens to be flat over a window of three pixels, neither finds the surface.
            assert!(
                near as f64 > 0.985 * f64::from(answered as u32),
                "{reference} {search_by:?}: {near} of {answered}"
            );
        }
    }
}

/// Bars of several widths, 10 px of disparity before a background, and how many of the frames see each pixel
/// of the reference frame.
struct Bars {
    edges: Vec<(f64, f64)>,
}

impl Bars {
    const FAR_PX: f64 = 8.0;
    const NEAR_PX: f64 = 18.0;

    fn is_bar(&self, x: f64, tau: f64) -> bool {
        let origin = x - Self::NEAR_PX * tau;
        self.edges.iter().any(|&(left, right)| origin >= left && origin < right)
    }

    fn shade(&self, x: f64, y: usize, tau: f64) -> f64 {
        if self.is_bar(x, tau) {
            texture(x - Self::NEAR_PX * tau, y, 11, 3.0)
        } else {
            texture(x - Self::FAR_PX * tau, y, 12, 3.0)
        }
    }

    /// Pixels that half of the frames see, those of them found within a disparity step, pixels answered, and
    /// those wrong by more than 1 px.
    fn count(&self, found: &Grid<f32>, tau: &Tau, reference: usize) -> [f64; 4] {
        let origin = tau.values()[reference];
        let mut counts = [0; 4];
        for x in 0..found.columns() {
            let bar = self.is_bar(x as f64, origin);
            let truth = if bar { Self::NEAR_PX } else { Self::FAR_PX };
            let sees = |tau: &&f64| {
                let place = x as f64 + truth * (**tau - origin);
                (0.0..=(found.columns() - 1) as f64).contains(&place) && (bar || !self.is_bar(place, **tau))
            };
            let half = 2 * tau.values().iter().filter(sees).count() >= tau.frames();
            for y in 0..found.rows() {
                let error = (f64::from(found.at(x, y)) - truth).abs();
                let is = [half, half && error <= 0.4, !error.is_nan(), error > 1.0];
                counts.iter_mut().zip(is).for_each(|(count, is)| *count += i32::from(is));
            }
        }
        counts.map(f64::from)
    }
}

#[test]
fn bars_before_a_background_keep_their_edges() {
    let tau = Tau::equidistant(60).unwrap();
    let bars = Bars { edges: vec![(40.5, 52.5), (80.5, 96.5), (130.5, 155.5), (190.5, 230.5)] };
    // Pixels integrate: four samples each.
    let scene = volume(40, 300, &tau, |x, y, tau| {
        (0..4).map(|i| bars.shade(x + 0.25 * f64::from(i) - 0.375, y, tau)).sum::<f64>() / 4.0
    });
    for reference in [0, 30, 59] {
        let options = MatchOptions {
            ordering_constraint: OrderingConstraint::Off,
            range: Some(DisparityRange { minimum_px: 0.0, maximum_px: 30.0 }),
            reference: ReferenceFrame::Index(reference),
            ..MatchOptions::default()
        };
        let searched = searched(&scene, reference, OrderingUsed::Off, &options).guess;
        let matched = crate::match_volume(&scene, &options, &Silent).unwrap().disparity;
        // The asked shares hold for what is answered; the fit takes back some of the candidates, and mends
        // others. What it promises of single tenths of a pixel stands in tests/occlusions.rs.
        for (found, right_asked, wrong_asked) in [(searched, 0.95, 0.02), (matched, 0.95, 0.01)] {
            let [visible, right, answered, wrong] = bars.count(&found, &tau, reference);
            println!("{reference}: right {right} of {visible}, wrong {wrong} of {answered}");
            assert!(right >= right_asked * visible, "{reference}: {right} of {visible}");
            assert!(wrong <= wrong_asked * answered, "{reference}: {wrong} of {answered}");
        }
    }
}

#[test]
fn repetitive_texture_is_surveyed_and_searched_right_without_a_range() {
    let tau = Tau::equidistant(100).unwrap();
    let shade = |x: f64, y: usize, tau: f64| {
        let origin = x - 37.0 * tau;
        0.5 + 0.4 * (std::f64::consts::TAU * origin / 12.0).sin() + 0.1 * (texture(origin, y, 9, 3.0) - 0.5)
    };
    let scene = volume(24, 320, &tau, shade);
    for reference in [ReferenceFrame::First, ReferenceFrame::Middle] {
        let options = MatchOptions { reference, fit: false, ..MatchOptions::default() };
        assert_eq!(options.method, Method::Variance);
        let maps = crate::match_volume(&scene, &options, &Silent).unwrap();
        let answered = maps.disparity.values().iter().filter(|value| !value.is_nan());
        let wrong = answered.clone().filter(|value| (**value - 37.0).abs() > 6.0).count();
        assert!(maps.share(Validity::Found) > 0.9, "{reference:?}: {}", maps.share(Validity::Found));
        assert!(wrong as f64 <= 0.005 * answered.count() as f64, "{reference:?}: {wrong}");
    }
}

#[test]
fn a_surface_in_view_of_all_frames_is_found_whatever_share_must_see_it() {
    let tau = Tau::equidistant(60).unwrap();
    let scene = volume(20, 200, &tau, |x, y, tau| 0.1 + 0.8 * texture(x - 11.0 * tau, y, 3, 3.0));
    for min_visible in [0.2, 0.5, 0.9, 1.0] {
        let options = MatchOptions { min_visible, ..MatchOptions::default() };
        let found = searched(&scene, 30, OrderingUsed::Off, &options);
        // All frames see what lies 6 px inside; candidates up to 30 px leave the image within another 15 px,
        // and may be the right ones.
        let inner = (0..20).flat_map(|y| (21..179).map(move |x| (x, y)));
        let right = inner.filter(|&(x, y)| (found.guess.at(x, y) - 11.0).abs() < 0.5).count();
        // The contrast of a pixel may be low by chance.
        assert!(right as f64 >= 0.99 * 20.0 * 158.0, "{min_visible}: {right} of {}", 20 * 158);
    }
}
