//! Simulated scans and what is true of them.

use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use crate::panel::{LiveMap, LiveMapMaker};
use epirig_core::frame::Frame;
use epirig_core::grid::Grid;
use epirig_simulator::{Scene, Simulator, SimulatorConfig};

/// A thread that hangs fails a test after this; no promise is about time.
const HANGS: Duration = Duration::from_secs(300);

/// A slanted plane whose disparity is about 24 px, with noise of 1.5 DN of 8 bit.
pub(super) fn plane(columns: usize, rows: usize, frames: usize, seed: u64) -> SimulatorConfig {
    let mut config = SimulatorConfig::textured_plane(columns, rows, frames);
    config.scan.step_mm *= 3.0;
    config.sensor.read_noise_dn = 1.5;
    (config.sensor.seed, config.texture.seed) = (seed, 77 * seed);
    if let Scene::Plane { slope_x, slope_y, .. } = &mut config.scene {
        // Another slant for each seed.
        (*slope_x, *slope_y) = (0.3 * (seed as f64).sin(), 0.3 * (2.0 * seed as f64).cos());
    }
    config
}

/// Frames taken at `positions_mm`.
pub(super) fn frames(simulator: &Simulator, positions_mm: &[f64]) -> Vec<Frame> {
    positions_mm.iter().zip(0..).map(|(&position, exposure)| simulator.expose(position, exposure)).collect()
}

/// True disparity where `map` has its values, times `sign`: means of squares of pixels.
pub(super) fn true_means(disparity: &Grid<f32>, map: &LiveMap, sign: f64) -> Grid<f64> {
    let bin = map.bin;
    let mut means = Grid::filled(map.disparity.rows(), map.disparity.columns(), 0.0);
    for y in 0..means.rows() {
        for x in 0..means.columns() {
            let square = disparity.cropped(bin * x..bin * (x + 1), bin * y..bin * (y + 1));
            let sum: f64 = square.values().iter().map(|&value| f64::from(value)).sum();
            means.row_mut(y)[x] = sign * sum / (bin * bin) as f64;
        }
    }
    means
}

/// How a map compares with the truth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Comparison {
    /// Share of the values that have an answer.
    pub(super) answered: f64,
    /// Median absolute error, in px.
    pub(super) error_px: f64,
    /// Median of error over sigma, signed: 0 without bias.
    pub(super) bias_sigmas: f64,
    /// Median sigma, in px.
    pub(super) sigma_px: f64,
    /// Share of the answers whose error is at most their sigma.
    pub(super) within: f64,
}

pub(super) fn compare(map: &LiveMap, truth: &Grid<f64>) -> Comparison {
    let values = map.disparity.values().iter().zip(map.sigma.values()).zip(truth.values());
    let known: Vec<(f64, f64)> = values
        .filter(|((disparity, _), truth)| !disparity.is_nan() && !truth.is_nan())
        .map(|((&disparity, &sigma), truth)| (f64::from(disparity) - truth, f64::from(sigma)))
        .collect();
    let median = |value: fn(&(f64, f64)) -> f64| {
        let mut values: Vec<f64> = known.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let within = known.iter().filter(|(error, sigma)| error.abs() <= *sigma).count();
    Comparison {
        answered: known.len() as f64 / truth.values().len() as f64,
        error_px: median(|(error, _)| error.abs()),
        bias_sigmas: median(|(error, sigma)| error / sigma),
        sigma_px: median(|(_, sigma)| *sigma),
        within: within as f64 / known.len() as f64,
    }
}

/// A maker and the maps that it makes.
pub(super) struct Maps {
    pub(super) maker: LiveMapMaker,
    maps: Receiver<LiveMap>,
}

impl Maps {
    pub(super) fn new(positions_mm: &[f64]) -> Self {
        let (made, maps) = channel();
        let maker = LiveMapMaker::new(positions_mm, move |map| {
            // After the drop nobody listens.
            let _ = made.send(map);
        });
        Self { maker, maps }
    }

    /// Waits for the map of `frames` frames.
    pub(super) fn of(&self, frames: usize) -> LiveMap {
        loop {
            let map = self.maps.recv_timeout(HANGS).expect("a map should come");
            if map.frames == frames {
                return map;
            }
        }
    }

    /// Drops the maker, waits for the end of its thread, and returns the maps that nobody has taken.
    pub(super) fn end(self) -> Vec<LiveMap> {
        let Self { maker, maps } = self;
        drop(maker);
        let mut left = Vec::new();
        loop {
            match maps.recv_timeout(HANGS) {
                Ok(map) => left.push(map),
                Err(error) => {
                    // The thread owned the sender.
                    assert_eq!(error, std::sync::mpsc::RecvTimeoutError::Disconnected);
                    return left;
                }
            }
        }
    }
}
