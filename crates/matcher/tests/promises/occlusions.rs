//! Bars before a background: what half of the frames see is measured, what nothing tells is not answered.

use crate::painted::{Aperture, Camera, Painting, Strip, Texture};
use crate::promises::{Bounds, Figures, Promise};
use epirig_core::progress::Silent;
use epirig_matcher::{MatchOptions, ReferenceFrame, match_volume};

const FRAMES: usize = 100;
const APERTURE: Aperture = Aperture { sigma_px: 0.5 };

/// 0.969, 0.969 and 0.984 are reached from the first, middle and last frame; the first matcher reached 0.886,
/// 0.929 and 0.884.
const RIGHT: Promise = Promise::as_asked(Bounds::at_least(0.95));
/// 0.0085, 0.0060 and 0.0084 are reached; the first matcher reached 0.085, 0.0185 and 0.083.
const WRONG: Promise = Promise::as_asked(Bounds::at_most(0.01));

fn texture(seed: u64) -> Texture {
    Texture::white(seed, 100, (1.8, 30.0)).with_contrast(APERTURE, 20.0)
}

/// Bars of 6 to 40 px, with gaps of 6 to 40 px, that move 10 px farther than what is behind them. Pixels at
/// their edges mix both as they cover them.
fn bars() -> Painting {
    let camera = Camera {
        rows: 64,
        columns: 400,
        frames: FRAMES,
        aperture: APERTURE,
        noise_dn: 1.0,
        bit_depth: 8,
        seed: 6,
    };
    let mut painting = Painting::plane(camera, 20.4, (0.0, 0.0), texture(6));
    let mut left = 4.3;
    for (index, (width, gap)) in [
        (6.0, 40.0),
        (12.0, 6.0),
        (24.0, 24.0),
        (40.0, 12.0),
        (18.0, 30.0),
        (9.0, 18.0),
        (30.0, 9.0),
        (40.0, 40.0),
    ]
    .into_iter()
    .enumerate()
    {
        let bar = Strip::plane(30.4, (0.0, 0.0), (0.0, 0.0), texture(20 + index as u64));
        painting.strips.push(Strip { columns: (left, left + width), ..bar });
        left += width + gap;
    }
    painting
}

fn check(reference: ReferenceFrame) {
    let painting = bars();
    let options = MatchOptions { reference, ..MatchOptions::default() };
    let maps = match_volume(&painting.volume(), &options, &Silent).unwrap();
    let truth = painting.truth(maps.reference);
    let (right, wrong) = truth.right_and_wrong(&maps.disparity, FRAMES);
    println!(
        "{reference:?}, {:?}: {:.2} % of the pixels that half of the frames see within 0.1 px, {:.2} % of the answers wrong by more than 1 px",
        maps.ordering,
        100.0 * right,
        100.0 * wrong
    );
    let mut figures = Figures::default();
    figures.check(&format!("{reference:?}: right of what half of the frames see"), RIGHT, right);
    figures.check(&format!("{reference:?}: wrong of the answers"), WRONG, wrong);
    figures.finish();
}

#[test]
fn bars_before_a_background_are_measured_from_the_first_frame() {
    check(ReferenceFrame::First);
}

#[test]
fn bars_before_a_background_are_measured_from_the_middle_frame() {
    check(ReferenceFrame::Middle);
}

#[test]
fn bars_before_a_background_are_measured_from_the_last_frame() {
    check(ReferenceFrame::Last);
}
