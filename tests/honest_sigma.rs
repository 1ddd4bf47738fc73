//! The stated sigma is that of the errors: 68 +- 3 % lie within one, 95 +- 2 % within two, on every surface and at every noise.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "support/painted/mod.rs"]
mod painted;

use epirig::epi::{MatchOptions, match_volume};
use epirig::evaluate::{ErrorStatistics, compare_with_truth};
use epirig::plane::Plane;
use epirig::progress::Silent;
use epirig::twin::{Twin, TwinConfig};
use epirig::volume::Volume;
use painted::{Aperture, Camera, Painting, Texture};

const FRAMES: usize = 100;
const APERTURE: Aperture = Aperture { sigma_px: 0.7 };
const NOISES_DN: [f64; 3] = [0.5, 1.0, 3.0];

fn camera(noise_dn: f64) -> Camera {
    Camera { rows: 160, columns: 320, frames: FRAMES, aperture: APERTURE, noise_dn, bit_depth: 8, seed: 5 }
}

fn texture() -> Texture {
    Texture::white(5, 160, (1.8, 30.0)).with_gradient(APERTURE, 10.0)
}

/// Errors of all answered pixels that have a truth.
fn errors(volume: &Volume, truth: impl Fn(usize) -> Plane<f32>) -> ErrorStatistics {
    let maps = match_volume(volume, &MatchOptions::default(), &Silent).unwrap();
    let truth = truth(maps.reference);
    compare_with_truth(&maps.disparity, Some(&maps.sigma), &truth, (0.0, 1.0)).unwrap().all
}

/// Measures a scene at each noise; all are printed before one of them fails.
fn check(scene: &str, measure: impl Fn(f64) -> ErrorStatistics) {
    let found = NOISES_DN.map(|noise_dn| (noise_dn, measure(noise_dn)));
    for (noise_dn, errors) in &found {
        println!(
            "{scene}, noise {noise_dn} DN: {:.1} % within 1 sigma, {:.1} % within 2; {errors:?}",
            100.0 * errors.within_1_sigma,
            100.0 * errors.within_2_sigma
        );
    }
    for (noise_dn, errors) in found {
        assert!(errors.answered as f64 > 0.5 * errors.pixels as f64, "{scene}: {errors:?}");
        assert!((errors.within_1_sigma - 0.68).abs() <= 0.03, "{scene}, noise {noise_dn} DN: {errors:?}");
        assert!((errors.within_2_sigma - 0.95).abs() <= 0.02, "{scene}, noise {noise_dn} DN: {errors:?}");
    }
}

fn painted(painting: &Painting) -> ErrorStatistics {
    errors(&painting.volume(), |reference| painting.truth(reference).disparity)
}

fn twin(mut config: TwinConfig, noise_dn: f64) -> ErrorStatistics {
    config.sensor.read_noise_dn = noise_dn;
    let twin = Twin::new(config).unwrap();
    errors(&twin.render_volume(&Silent).unwrap(), |reference| twin.truth(reference).unwrap().disparity)
}

#[test]
fn sigma_is_honest_on_a_plane() {
    check("plane", |noise_dn| painted(&Painting::plane(camera(noise_dn), 21.7, (0.04, -0.02), texture())));
}

#[test]
fn sigma_is_honest_on_a_painted_edge() {
    check("painted edge", |noise_dn| {
        painted(&Painting::ridge(camera(noise_dn), 48.3, 171.4, 0.09, texture()))
    });
}

#[test]
fn sigma_is_honest_on_the_cube_edge() {
    check("cube edge", |noise_dn| twin(TwinConfig::cube_edge(320, FRAMES), noise_dn));
}

#[test]
fn sigma_is_honest_on_the_tile() {
    check("tile", |noise_dn| twin(TwinConfig::tile(512, FRAMES), noise_dn));
}
