//! A texture that nearly repeats is matched on the right period, without being told where to look.

use crate::painted::{Aperture, Camera, Painting, Texture};
use crate::promises::{Bounds, Figures, Promise};
use epirig_core::progress::Silent;
use epirig_matcher::{MatchOptions, ReferenceFrame, match_volume};

const PERIOD_PX: f64 = 12.0;
const FRAMES: usize = 100;
const APERTURE: Aperture = Aperture { sigma_px: 0.5 };

const WRONG_PERIOD: Promise = Promise::as_asked(Bounds::at_most(0.005));
/// Silence is no answer: nearly all that stays in view must have one.
const ANSWERED: Promise = Promise::as_asked(Bounds::at_least(0.95));

fn check(disparity_px: f64, reference: ReferenceFrame) {
    let camera = Camera {
        rows: 48,
        columns: 512,
        frames: FRAMES,
        aperture: APERTURE,
        noise_dn: 1.0,
        bit_depth: 8,
        seed: 7,
    };
    let weak = Texture::white(7, 120, (1.8, 30.0)).with_contrast(APERTURE, 4.0);
    let painting = Painting::plane(camera, disparity_px, (0.0, 0.0), weak.with_stripes(PERIOD_PX, 40.0));
    let options = MatchOptions { reference, ..MatchOptions::default() };
    let maps = match_volume(&painting.volume(), &options, &Silent).unwrap();
    let truth = painting.truth(maps.reference);
    let (mut in_view, mut answered, mut wrong) = (0_u32, 0_u32, 0_u32);
    let frames = truth.visible_frames.values();
    for (found, &frames) in maps.disparity.values().iter().zip(frames) {
        in_view += u32::from(usize::from(frames) == FRAMES);
        answered += u32::from(usize::from(frames) == FRAMES && !found.is_nan());
        wrong += u32::from((f64::from(*found) - disparity_px).abs() > 0.5 * PERIOD_PX);
    }
    let share = f64::from(wrong) / truth.disparity.values().len() as f64;
    let answered = f64::from(answered) / f64::from(in_view);
    println!(
        "{disparity_px} px, {reference:?}: {:.2} % on a wrong period, {:.1} % of what stays in view answered; searched {:?}",
        100.0 * share,
        100.0 * answered,
        maps.range
    );
    let scene = format!("{disparity_px} px, {reference:?}");
    let mut figures = Figures::default();
    figures.check(&format!("{scene}: share on a wrong period"), WRONG_PERIOD, share);
    figures.check(&format!("{scene}: share of what stays in view answered"), ANSWERED, answered);
    figures.finish();
}

#[test]
fn a_short_shift_of_a_repetitive_texture_is_found() {
    check(30.0, ReferenceFrame::First);
    check(30.0, ReferenceFrame::Middle);
}

#[test]
fn a_long_shift_of_a_repetitive_texture_is_found() {
    check(150.0, ReferenceFrame::First);
    check(150.0, ReferenceFrame::Middle);
}
