//! Frames that show the scene between slanted borders, as frames of a turned camera do once they are
//! rectified, and repeat their border beyond.

use std::ops::Range;

use crate::painted::{Aperture, Camera, Painting, Texture, Truth};
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_matcher::{Blocks, DisparityMaps, MatchError, MatchOptions, Matcher};

const APERTURE: Aperture = Aperture { sigma_px: 0.7 };
const ROWS: usize = 160;
const COLUMNS: usize = 420;
const FRAMES: usize = 30;
/// Disparity in the middle, in px; the largest is 27 px.
const DISPARITY_PX: f64 = 24.0;

fn painting() -> Painting {
    let texture = Texture::white(5, 160, (1.8, 30.0)).with_gradient(APERTURE, 10.0);
    let camera = Camera {
        rows: ROWS,
        columns: COLUMNS,
        frames: FRAMES,
        aperture: APERTURE,
        noise_dn: 1.0,
        bit_depth: 8,
        seed: 3,
    };
    Painting::plane(camera, DISPARITY_PX, (0.01, -0.02), texture)
}

/// The columns between borders that are turned by `degrees` against the columns.
fn between(degrees: f64) -> Vec<Range<usize>> {
    let left = |y: usize| 40.0 + degrees.to_radians().tan() * y as f64;
    (0..ROWS).map(|y| left(y) as usize..left(y) as usize + 200).collect()
}

/// What interpolation along lines needs beside them, in px.
const INSIDE: usize = 3;

fn inside(shown: &[Range<usize>]) -> Vec<Range<usize>> {
    shown.iter().map(|range| range.start + INSIDE..range.end - INSIDE).collect()
}

/// The frames with each row's border repeated beyond the columns that are shown.
fn with_repeated_borders(painting: &Painting, shown: &[Range<usize>]) -> Volume {
    let mut volume = Volume::new(ROWS, COLUMNS, 8, Tau::equidistant(FRAMES).unwrap());
    for t in 0..FRAMES {
        let frame = painting.frame(t);
        let Samples::U8(seen) = frame.samples() else { panic!("8 bit were asked for") };
        let repeated = (0..ROWS * COLUMNS).map(|index| {
            let (y, x) = (index / COLUMNS, index % COLUMNS);
            seen[y * COLUMNS + x.clamp(shown[y].start, shown[y].end - 1)]
        });
        let frame = Frame::new(ROWS, COLUMNS, 8, Samples::U8(repeated.collect())).unwrap();
        volume.insert(t, &frame).unwrap();
    }
    volume
}

/// What the answers of some pixels are worth.
#[derive(Debug, Default)]
struct Score {
    pixels: u32,
    answered: u32,
    within_2_sigma: u32,
    /// By more than half a pixel.
    wrong: u32,
}

impl Score {
    fn add(&mut self, maps: &DisparityMaps, truth: &Truth, (x, y): (usize, usize)) {
        let error = f64::from(maps.disparity.at(x, y) - truth.disparity.at(x, y));
        self.pixels += 1;
        if !error.is_nan() {
            self.answered += 1;
            self.within_2_sigma += u32::from(error.abs() < 2.0 * f64::from(maps.sigma.at(x, y)));
            self.wrong += u32::from(error.abs() > 0.5);
        }
    }

    fn honest(&self) -> f64 {
        f64::from(self.within_2_sigma) / f64::from(self.answered)
    }
}

/// Scores of all pixels, and of those whose line stays within what is shown.
fn scores(maps: &DisparityMaps, truth: &Truth, shown: &[Range<usize>]) -> [Score; 2] {
    let [mut all, mut inner] = [Score::default(), Score::default()];
    // From the middle frame a line reaches half of the largest disparity to each side. The search at half the
    // resolution leaves out a part of one of its pixels.
    let reach = INSIDE + 14 + 2;
    for (y, shown) in shown.iter().enumerate().take(ROWS - 4).skip(4) {
        for x in 0..COLUMNS {
            all.add(maps, truth, (x, y));
            if x >= shown.start + reach && x + reach < shown.end {
                inner.add(maps, truth, (x, y));
            }
        }
    }
    [all, inner]
}

#[test]
fn beside_a_slanted_border_answers_are_as_honest_as_elsewhere() {
    for degrees in [2.0, 45.0] {
        let (painting, shown) = (painting(), between(degrees));
        let volume = with_repeated_borders(&painting, &shown);
        let blocks = Blocks::new(&volume.shape(), MatchOptions::default()).unwrap();
        let unaware = Matcher::of_blocks(volume.clone(), blocks.clone()).matched(&Silent).unwrap();
        let blocks = blocks.showing(inside(&shown)).unwrap();
        let maps = Matcher::of_blocks(volume, blocks).matched(&Silent).unwrap();
        let truth = painting.truth(maps.reference);
        let [all, inner] = scores(&maps, &truth, &shown);
        let [all_unaware, _] = scores(&unaware, &truth, &shown);
        let figures = format!("{degrees} degrees: {all:?}, {inner:?}, unaware {all_unaware:?}");
        eprintln!("{figures}");
        assert!(f64::from(inner.answered) > 0.99 * f64::from(inner.pixels), "{figures}");
        // 0.954 of a normal distribution.
        assert!(all.honest() > 0.94, "{figures}");
        assert_eq!(all.wrong, 0, "{figures}");
        // Lines that are shown in half of the frames are followed, too.
        assert!(all.answered > inner.answered + inner.answered / 20, "{figures}");
        assert!(all_unaware.wrong > 0, "{figures}");
        assert!(all_unaware.honest() < 0.9, "{figures}");
    }
}

#[test]
fn ranges_that_do_not_suit_the_images_are_refused() {
    let all = vec![0..COLUMNS; ROWS];
    let volume = with_repeated_borders(&painting(), &all);
    let blocks = Blocks::new(&volume.shape(), MatchOptions::default()).unwrap();
    let too_few = blocks.clone().showing(all[1..].to_vec());
    assert!(matches!(too_few, Err(MatchError::ShownRows { ranges: 159, rows: ROWS, columns: COLUMNS })));
    let too_wide = blocks.showing(vec![1..COLUMNS + 1; ROWS]);
    assert!(matches!(too_wide, Err(MatchError::ShownRows { .. })));
}
