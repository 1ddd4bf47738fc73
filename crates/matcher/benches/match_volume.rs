//! The whole match, in samples of the volume a second on all cores, beside a plain search on one core in the
//! same run.
//!
//! A slanted plane, 1024 columns x 256 rows x 100 frames, about 40 px of disparity; 60 px of range, known and
//! unknown. The plain search takes a few rows only and stops at the candidates: no mapping, no fit, no sigma.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench stops at the first thing that does not work")]

use std::time::Duration;

use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use epirig_core::progress::Silent;
use epirig_matcher::{DisparityRange, MatchOptions, match_volume};
use epirig_simulator::{Scene, Simulator, SimulatorConfig};

mod plain;

const COLUMNS: usize = 1024;
const ROWS: usize = 256;
const FRAMES: usize = 100;
/// Rows that the plain search takes.
const PLAIN_ROWS: usize = 2;
const RANGE: DisparityRange = DisparityRange { minimum_px: 10.0, maximum_px: 70.0 };

fn slanted_plane() -> SimulatorConfig {
    let mut config = SimulatorConfig::textured_plane(COLUMNS, ROWS, FRAMES);
    config.scene = Scene::Plane { distance_mm: 500.0, slope_x: 0.4, slope_y: 0.1 };
    // 8 px become 40.
    config.scan.step_mm *= 5.0;
    config.sensor.read_noise_dn = 1.0;
    config
}

fn whole_match(criterion: &mut Criterion) {
    let simulator = Simulator::new(slanted_plane()).unwrap();
    let volume = simulator.render_volume(&Silent).unwrap();
    let mut group = criterion.benchmark_group("match of 1024 x 256 pixels x 100 frames");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_secs(1)).measurement_time(Duration::from_secs(5));
    group.throughput(Throughput::Elements((COLUMNS * ROWS * FRAMES) as u64));
    let known = MatchOptions { range: Some(RANGE), ..MatchOptions::default() };
    let unknown = MatchOptions::default();
    for (name, options) in [
        ("60 px of range", known.clone()),
        ("range unknown", unknown.clone()),
        ("60 px of range, a first look", known.quick()),
        ("range unknown, a first look", unknown.quick()),
    ] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| match_volume(&volume, &options, &Silent).unwrap());
        });
    }
    group.throughput(Throughput::Elements((COLUMNS * PLAIN_ROWS * FRAMES) as u64));
    group.bench_function("reference: plain search", |bencher| {
        bencher.iter(|| -> f64 {
            (0..PLAIN_ROWS).map(|y| plain::plain_variance(&volume, y, RANGE, 0.25)).sum()
        });
    });
    group.finish();
}

criterion_group!(benches, whole_match);
criterion_main!(benches);
