//! Painted scenes are what they say: their frames agree with brute-force integration over the painted
//! surfaces.

use crate::painted::{Aperture, Camera, Painting, Strip, Texture};

const APERTURE: Aperture = Aperture { sigma_px: 0.5 };

fn camera() -> Camera {
    Camera { rows: 9, columns: 40, frames: 5, aperture: APERTURE, noise_dn: 0.0, bit_depth: 8, seed: 1 }
}

/// Light at (x, y) of a frame, from the definition: the point of the front-most strip that comes to lie
/// there.
fn reflected(painting: &Painting, x: f64, y: f64, from_middle: f64) -> f64 {
    for strip in painting.strips.iter().rev() {
        // u + c (d + p u + q y) = x by fixed-point iteration.
        let mut u = x;
        for _ in 0..60 {
            u = x - from_middle * (strip.disparity_px + strip.slant.0 * u + strip.slant.1 * y);
        }
        if (strip.columns.0..strip.columns.1).contains(&u) {
            let wave = |wave: &crate::painted::Wave| {
                let argument = std::f64::consts::TAU * (wave.across * u + wave.along * y) + wave.phase;
                wave.amplitude_dn * argument.cos()
            };
            return strip.texture.waves.iter().map(wave).sum();
        }
    }
    0.0
}

/// Weights of a grid of `fine` points per px (odd): the pixel's square times the Gaussian, normalised.
fn grid_weights(fine: i32) -> Vec<(f64, f64)> {
    let sigma = APERTURE.sigma_px * f64::from(fine);
    let reach = (5.0 * sigma) as i32 + fine / 2;
    let gaussian = |offset: i32| (-0.5 * (f64::from(offset) / sigma).powi(2)).exp();
    let weight = |offset: i32| (-fine / 2..=fine / 2).map(|cell| gaussian(offset - cell)).sum::<f64>();
    let sum: f64 = (-reach..=reach).map(weight).sum();
    (-reach..=reach).map(|offset| (f64::from(offset) / f64::from(fine), weight(offset) / sum)).collect()
}

fn integrated(painting: &Painting, x: usize, y: usize, t: usize) -> f64 {
    let from_middle = t as f64 / (painting.camera.frames - 1) as f64 - 0.5;
    let (across, along) = (grid_weights(301), grid_weights(15));
    let light = |u: f64, v: f64| reflected(painting, x as f64 + u, y as f64 + v, from_middle);
    let row = |v: f64| across.iter().map(|&(u, weight)| weight * light(u, v)).sum::<f64>();
    along.iter().map(|&(v, weight)| weight * row(v)).sum()
}

#[test]
fn frames_agree_with_brute_force_integration() {
    let paint = |seed| Texture::white(seed, 12, (1.8, 20.0)).with_contrast(APERTURE, 25.0);
    let tilted = Painting::plane(camera(), 9.3, (0.07, -0.2), paint(1));
    let ridge = Painting::ridge(camera(), 11.7, 19.6, 0.09, paint(2));
    let mut bars = Painting::plane(camera(), 4.0, (0.0, 0.0), paint(3));
    for (left, seed) in [(3.3, 4), (21.0, 5)] {
        let bar = Strip::plane(12.0, (left, 0.0), (0.05, 0.0), paint(seed));
        bars.strips.push(Strip { columns: (left, left + 6.4), ..bar });
    }
    // A grid of 1/301 px misses an edge by half of that: 0.1 DN for textures that differ by 100 DN and a
    // weight below 0.7 per px.
    for painting in [&tilted, &ridge, &bars] {
        for (t, x, y) in (0..40).step_by(3).map(|x| (x % 5, x, x % 9)).chain([(2, 19, 4), (2, 20, 4)]) {
            let (exact, found) = (integrated(painting, x, y, t), painting.light(t).at(x, y));
            assert!((exact - f64::from(found)).abs() < 0.1, "({x}, {y}) of frame {t}: {found}, not {exact}");
        }
    }
}

#[test]
fn gradients_are_what_a_small_shift_changes() {
    let paint = Texture::white(1, 12, (1.8, 20.0)).with_contrast(APERTURE, 25.0);
    let plane = |disparity: f64| Painting::plane(camera(), disparity, (0.07, -0.2), paint.clone());
    // A disparity larger by 0.08 px moves the last frame by 0.04 px.
    let (less, more) = (plane(9.26).light(4), plane(9.34).light(4));
    let gradient = plane(9.3).gradient(4);
    for ((less, more), gradient) in less.values().iter().zip(more.values()).zip(gradient.values()) {
        let difference = (less - more) / 0.04;
        // Third derivatives of such waves stay below 25 DN (2 pi / 1.8)^3, times 0.02^2 / 6.
        assert!((difference - gradient).abs() < 0.08, "{gradient} DN/px, not {difference}");
    }
}

#[test]
fn truth_is_where_the_point_goes() {
    let painting = Painting::ridge(camera(), 11.7, 19.6, 0.09, Texture::grey());
    for reference in 0..5 {
        let truth = painting.truth(reference);
        let here = reference as f64 / 4.0 - 0.5;
        for x in 0..40_usize {
            // d = 11.7 - 0.09 |u - 19.6| with u = x - (tau - 1/2) d, by fixed-point iteration.
            let mut disparity: f64 = 10.0;
            for _ in 0..60 {
                disparity = 11.7 - 0.09 * (x as f64 - here * disparity - 19.6).abs();
            }
            let found = f64::from(truth.disparity.at(x, 3));
            assert!((found - disparity).abs() < 1e-5, "{x} of {reference}: {found}, not {disparity}");
            let place = |t: usize| x as f64 + (t as f64 - reference as f64) / 4.0 * disparity;
            let seen = (0..5).filter(|&t| (0.0..=39.0).contains(&place(t))).count();
            assert_eq!(usize::from(truth.visible_frames.at(x, 3)), seen);
        }
    }
}

#[test]
fn a_bar_occludes_the_wall_behind_it() {
    let mut painting = Painting::plane(camera(), 0.0, (0.0, 0.0), Texture::grey());
    let bar = Strip::plane(8.0, (0.0, 0.0), (0.0, 0.0), Texture::grey());
    painting.strips.push(Strip { columns: (10.0, 14.0), ..bar });
    // The bar covers 6..10, 8..12, 10..14, 12..16 and 14..18.
    let truth = painting.truth(2);
    let occluded = |x: usize| 5 - truth.visible_frames.at(x, 0);
    assert_eq!([5, 6, 8, 9].map(occluded), [0, 1, 2, 2]);
    assert_eq!([14, 15, 16, 17, 18].map(occluded), [2, 2, 1, 1, 0]);
    assert_eq!([9, 10, 13, 14].map(|x| truth.disparity.at(x, 0)), [0.0, 8.0, 8.0, 0.0]);
    assert_eq!(truth.visible_frames.at(12, 0), 5);
}
