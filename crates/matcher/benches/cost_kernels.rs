//! The matcher's costs, in candidates a second, beside a plain loop over pixels and frames in the same run.
//!
//! `cargo bench` prints the time for one whole match and for the reference; divide them by the candidates it
//! names.

#![allow(clippy::unwrap_used, missing_docs, reason = "a bench stops at the first thing that does not work")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use epirig_core::progress::Silent;
use epirig_matcher::{DisparityRange, MatchOptions, Matcher, Method, OrderingConstraint};
use epirig_simulator::{Simulator, SimulatorConfig};

mod plain;

const RANGE: DisparityRange = DisparityRange { minimum_px: 0.0, maximum_px: 15.75 };

fn costs(criterion: &mut Criterion) {
    let simulator = Simulator::new(SimulatorConfig::textured_plane(1024, 16, 100)).unwrap();
    let volume = simulator.render_volume(&Silent).unwrap();
    let mut group = criterion.benchmark_group("costs of one row, 1024 columns x 64 disparities x 100 frames");
    group.throughput(Throughput::Elements(1024 * 64 * 100));
    group.sample_size(10);
    for (name, method, window_px) in [
        ("variance 1x1", Method::Variance, 1),
        ("variance 3x3", Method::Variance, 3),
        ("ncc-first 7x7", Method::NccFirst, 7),
    ] {
        let options = MatchOptions {
            range: Some(RANGE),
            ordering_constraint: OrderingConstraint::On,
            window_px,
            ..MatchOptions::for_method(method)
        };
        let matcher = Matcher::new(volume.clone(), options).unwrap();
        let maps = matcher.matched(&Silent).unwrap();
        group.bench_function(name, |bencher| bencher.iter(|| matcher.row_costs(8, &maps)));
    }
    group.bench_function("reference: plain loop, linear", |bencher| {
        bencher.iter(|| plain::plain_variance(&volume, 8, RANGE, 0.25));
    });
    group.finish();
}

criterion_group!(benches, costs);
criterion_main!(benches);
