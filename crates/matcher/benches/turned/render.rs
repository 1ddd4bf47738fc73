//! Frames of a scene as an 8-bit camera gives them: light is averaged over each pixel and spread by the lens
//! in the frame, not on the surface. A turned camera's frames are rectified as a rig's are.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;

use super::scenes::Scene;
use super::texture::Texture;
use epirig_calibration::lens::{Distortion, Lens};
use epirig_calibration::photometry::Correction;
use epirig_calibration::rectification::{Mapping, Rectifier};
use epirig_core::frame::{Frame, Samples};
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

#[derive(Debug, Clone, Copy)]
pub(super) struct Size {
    pub(super) side_px: usize,
    pub(super) frames: usize,
}

/// Samples to the pixel, along rows and along columns.
const ALONG: usize = 4;
const DOWN: usize = 3;
/// Standard deviation of the lens's point spread, in px.
const SPREAD_PX: f64 = 0.45;
/// DN of the darkest and of the lightest shade.
const DARK_DN: f64 = 20.0;
const LIGHT_DN: f64 = 230.0;

/// How a turned camera is: roll and pan, and a lens that brings corners nearer to the middle by some px.
const ROLL_RAD: f64 = 0.012;
const PAN_RAD: f64 = 0.007;
const FOCAL_PX: f64 = 700.0;
const DISTORTION: f64 = -0.3;

/// All frames; tau goes from 0 to 1, and disparity is that of the middle.
pub(super) fn rendered(scene: &Scene, size: Size) -> Volume {
    let Size { side_px, frames } = size;
    let tau = Tau::equidistant(frames).unwrap();
    let texture = Texture::new(scene.paint, scene.seed);
    let middle = tau.values()[tau.middle_frame()];
    let offsets: Vec<f64> = tau.values().iter().map(|tau| tau - middle).collect();
    let frames = |place: &(dyn Fn(f64, f64) -> (f64, f64) + Sync)| -> Vec<Frame> {
        let offsets = offsets.par_iter().enumerate();
        offsets.map(|(t, &offset)| frame((scene, place), &texture, (t as u64, offset), side_px)).collect()
    };
    if !scene.rectified {
        let mut volume = Volume::new(side_px, side_px, 8, tau);
        let all = frames(&|x, y| (x, y));
        all.iter().enumerate().for_each(|(t, frame)| volume.insert(t, frame).unwrap());
        return volume;
    }
    let middle = 0.5 * (side_px - 1) as f64;
    let distortion = Distortion { k1: DISTORTION, ..Distortion::default() };
    let lens = Lens { distortion, ..Lens::pinhole(FOCAL_PX, middle, middle) };
    let mapping = Mapping::fitting(lens, ROLL_RAD, PAN_RAD, side_px, side_px).unwrap();
    let (right, down) = (0.5 * (mapping.camera.columns - 1) as f64, 0.5 * (mapping.camera.rows - 1) as f64);
    let rectifier = Rectifier::new(mapping, Correction::default()).unwrap();
    let all = frames(&|x, y| {
        let (x, y) = mapping.rectified(x + middle, y + middle).unwrap();
        (x - right, y - down)
    });
    let mut volume = rectifier.volume(8, tau);
    rectifier.insert(&mut volume, 0, &all).unwrap();
    volume
}

/// A frame whose pixels lie at these places of the scene, by column and row from the middle.
fn frame(
    (scene, place): (&Scene, &(dyn Fn(f64, f64) -> (f64, f64) + Sync)),
    texture: &Texture,
    (t, offset): (u64, f64),
    side_px: usize,
) -> Frame {
    let (along, down) = (aperture(ALONG), aperture(DOWN));
    let (reach_x, reach_y) = (along.len() / 2, down.len() / 2);
    let middle = 0.5 * (side_px - 1) as f64;
    let wide = (side_px - 1) * ALONG + along.len();
    let high = (side_px - 1) * DOWN + down.len();
    let mut narrowed = vec![0.0; high * side_px];
    let mut samples = vec![0.0; wide];
    for (row, narrowed) in narrowed.chunks_exact_mut(side_px).enumerate() {
        let y = (row as f64 - reach_y as f64) / DOWN as f64 - middle;
        for (index, sample) in samples.iter_mut().enumerate() {
            let x = (index as f64 - reach_x as f64) / ALONG as f64 - middle;
            let (x, y) = place(x, y);
            *sample = texture.shade(origin(scene, x, y, offset), y);
        }
        for (x, value) in narrowed.iter_mut().enumerate() {
            *value = samples[x * ALONG..].iter().zip(&along).map(|(sample, weight)| sample * weight).sum();
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(scene.seed ^ (t + 1) << 32);
    let noise = Normal::new(0.0, scene.noise_dn).unwrap();
    let shown = scene.light.of_frame(scene.seed, t, offset);
    let mut counts = Vec::with_capacity(side_px * side_px);
    for y in 0..side_px {
        for x in 0..side_px {
            let light: f64 =
                (0..down.len()).map(|index| down[index] * narrowed[(y * DOWN + index) * side_px + x]).sum();
            let dn = DARK_DN + (LIGHT_DN - DARK_DN) * light;
            let dn = shown.on(dn, x as f64 - middle, y as f64 - middle) + noise.sample(&mut random);
            counts.push(dn.round().clamp(0.0, 255.0) as u8);
        }
    }
    Frame::new(side_px, side_px, 8, Samples::U8(counts)).unwrap()
}

/// The column in the middle frame of what is seen at `x` in a frame `offset` away: s + d(s, y) offset = x. The
/// disparity changes by less than a fifth of a px per px, and the offset is at most half, so that each round
/// brings it ten times nearer.
fn origin(scene: &Scene, x: f64, y: f64, offset: f64) -> f64 {
    const NEAR_PX: f64 = 1e-7;
    let mut s = x;
    loop {
        let next = x - (scene.disparity)(s, y) * offset;
        if (next - s).abs() < NEAR_PX {
            return next;
        }
        s = next;
    }
}

/// Weights of samples around a pixel's middle: its width with the point spread.
fn aperture(density: usize) -> Vec<f64> {
    let reach = (2.2 * density as f64).ceil() as i64;
    let at = |index: i64| index as f64 / density as f64;
    let steps = 32;
    let weight = |place: f64| -> f64 {
        let inside = (0..steps).map(|step| (f64::from(step) + 0.5) / f64::from(steps) - 0.5);
        inside.map(|inside| (-0.5 * ((place - inside) / SPREAD_PX).powi(2)).exp()).sum()
    };
    let weights: Vec<f64> = (-reach..=reach).map(|index| weight(at(index))).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}
