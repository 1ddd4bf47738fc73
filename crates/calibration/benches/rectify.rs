//! Rectification, in samples a second on one core, beside a plain bilinear remap of the same frames in the
//! same run.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench stops at the first thing that does not work")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use epirig_calibration::lens::{Distortion, Lens};
use epirig_calibration::photometry::Correction;
use epirig_calibration::rectification::{Mapping, Rectifier};
use epirig_core::frame::{Frame, Samples};
use epirig_core::tau::Tau;

const SIDE: usize = 1024;
const FRAMES: usize = 8;

/// One frame after the other, pixel by pixel, over a table of places.
fn plain_remap(places: &[(f32, f32)], frames: &[Vec<u8>], out: &mut [Vec<f32>]) {
    for (frame, out) in frames.iter().zip(out) {
        for (out, &(x, y)) in out.iter_mut().zip(places) {
            let (column, row) = (x as usize, y as usize);
            let (f, g) = (x - column as f32, y - row as f32);
            let at = |x: usize, y: usize| f32::from(frame[y * SIDE + x]);
            let above = at(column, row) + f * (at(column + 1, row) - at(column, row));
            let below = at(column, row + 1) + f * (at(column + 1, row + 1) - at(column, row + 1));
            *out = above + g * (below - above);
        }
    }
}

fn rectify(criterion: &mut Criterion) {
    let distortion = Distortion { k1: -0.02, ..Distortion::default() };
    let lens = Lens { distortion, ..Lens::pinhole(2844.0, 520.0, 505.0) };
    let mapping = Mapping::fitting(lens, 0.7_f64.to_radians(), 0.4_f64.to_radians(), SIDE, SIDE).unwrap();
    let pixels: Vec<Vec<u8>> =
        (0..FRAMES).map(|t| (0..SIDE * SIDE).map(|i| ((i * 7919 + t * 31) % 251) as u8).collect()).collect();
    let frames: Vec<Frame> =
        pixels.iter().map(|pixels| Frame::new(SIDE, SIDE, 8, Samples::U8(pixels.clone())).unwrap()).collect();
    let camera = mapping.camera;
    let rectifier = Rectifier::new(mapping, Correction::default()).unwrap();
    let mut volume = rectifier.volume(8, Tau::equidistant(FRAMES).unwrap());
    let places: Vec<(f32, f32)> = (0..camera.rows * camera.columns)
        .map(|index| mapping.raw((index % camera.columns) as f64, (index / camera.columns) as f64))
        .map(|(x, y)| (x as f32, y as f32))
        .collect();
    let mut remapped = vec![vec![0.0; places.len()]; FRAMES];

    let name =
        format!("{FRAMES} frames of {SIDE} x {SIDE} to {} x {}, one core", camera.columns, camera.rows);
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements((places.len() * FRAMES) as u64));
    group.sample_size(10);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    group.bench_function("rectify", |bencher| {
        bencher.iter(|| pool.install(|| rectifier.insert(&mut volume, 0, &frames).unwrap()));
    });
    group.bench_function("reference: plain bilinear remap", |bencher| {
        bencher.iter(|| plain_remap(&places, &pixels, &mut remapped));
    });
    group.bench_function("places of all pixels", |bencher| {
        bencher.iter(|| pool.install(|| Rectifier::new(mapping, Correction::default()).unwrap()));
    });
    group.finish();
}

criterion_group!(benches, rectify);
criterion_main!(benches);
