use super::*;
use crate::OrderingUsed;
use crate::candidates::DisparityRange;
use crate::lines::{EpiLines, SeenRule};
use crate::options::{MatchOptions, Method, Occlusion};
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

/// Texture without end at `x` of `row`, in DN.
fn texture(x: f64, row: usize, seed: f64) -> f64 {
    let waves = [(16.0, 0.71), (14.0, 1.13), (12.0, 0.37), (12.0, 1.57), (10.0, 0.93), (10.0, 1.37)];
    let phase = |omega: f64| seed + (row as f64 * 2.3 + 1.7) * (omega * 5.0).sin();
    128.0 + waves.iter().map(|(height, omega)| height * (omega * x + phase(*omega)).sin()).sum::<f64>()
}

pub(crate) const ROWS: usize = 24;
pub(crate) const COLUMNS: usize = 81;
/// Columns of the first frame up to this one show the nearer surface.
pub(crate) const EDGE: usize = 40;
pub(crate) const NEAR_PX: f64 = -6.0;

/// A surface that moves `NEAR_PX` more than another, and shows ever more of it, in 16 frames.
pub(crate) fn step() -> Volume {
    let tau = Tau::equidistant(16).unwrap();
    let mut volume = Volume::new(ROWS, COLUMNS, 8, tau.clone());
    for (t, tau) in tau.values().iter().enumerate() {
        let shade = |index: usize| {
            let (x, row) = ((index % COLUMNS) as f64, index / COLUMNS);
            let near = x - tau * NEAR_PX;
            if near < EDGE as f64 + 0.5 { texture(near, row, 0.0) } else { texture(x, row, 3.0) }
        };
        let bytes = (0..ROWS * COLUMNS).map(|index| shade(index).round() as u8).collect();
        volume.insert(t, &Frame::new(ROWS, COLUMNS, 8, Samples::U8(bytes)).unwrap()).unwrap();
    }
    volume
}

/// What is searched in it.
pub(crate) fn task<'a>(volume: &'a Volume, lines: &'a EpiLines, options: &'a MatchOptions) -> Task<'a> {
    Task {
        volume,
        lines,
        range: DisparityRange { minimum_px: -12.0, maximum_px: 12.0 },
        ordering: OrderingUsed::Off,
        rule: SeenRule::new(volume.frames(), 0.5, Occlusion::OneSide),
        options,
        progress: &Silent,
    }
}

/// The step's disparities as windows of 3 px find them, which make the nearer surface a pixel wider.
fn widened() -> Grid<f32> {
    let mut guess = Grid::filled(ROWS, COLUMNS, 0.0);
    (0..ROWS).for_each(|y| guess.row_mut(y)[..=EDGE + 1].fill(NEAR_PX as f32));
    guess
}

#[test]
fn pixels_beside_an_edge_go_to_their_own_surface() {
    let volume = step();
    let lines = EpiLines::new(volume.tau(), 0, COLUMNS);
    let options = MatchOptions::default();
    let mut guess = widened();
    guess.row_mut(7)[EDGE + 1] = f32::NAN;
    refine_edges(task(&volume, &lines, &options), &mut guess, 2);
    for (x, y) in (0..ROWS).flat_map(|y| (8..COLUMNS - 8).map(move |x| (x, y))) {
        let truth = if x <= EDGE { NEAR_PX as f32 } else { 0.0 };
        let found = guess.at(x, y);
        // Between two surfaces samples are mixtures.
        assert!(
            x == EDGE || found == truth || (found.is_nan() && (x, y) == (EDGE + 1, 7)),
            "({x}, {y}): {found}"
        );
    }
    assert!(guess.at(EDGE + 1, 7).is_nan(), "what has no answer gets none");
}

#[test]
fn steep_surfaces_and_correlations_stay_as_they_are() {
    let volume = step();
    let lines = EpiLines::new(volume.tau(), 0, COLUMNS);
    let mut steep = Grid::filled(ROWS, COLUMNS, 0.0);
    (0..ROWS).for_each(|y| (0..COLUMNS).for_each(|x| steep.row_mut(y)[x] = 0.45 * x as f32));
    for (method, before) in [(Method::Variance, steep), (Method::NccFirst, widened())] {
        let options = MatchOptions::for_method(method);
        let mut guess = before.clone();
        refine_edges(task(&volume, &lines, &options), &mut guess, 2);
        assert_eq!(guess, before);
    }
}
