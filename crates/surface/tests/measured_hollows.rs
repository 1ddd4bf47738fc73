//! The surface's own search for levels finds the depth of the ideal tile's hollows to 0.003 mm, and of each
//! to 0.010 mm.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "../../matcher/tests/promises/promises.rs"]
mod promises;

use epirig_core::progress::Silent;
use epirig_matcher::{MatchOptions, match_volume};
use epirig_simulator::{Simulator, SimulatorConfig};
use epirig_surface::{Geometry, StepsOptions, TrendKind, find_extent, find_steps, heights};
use promises::{Bounds, Figures, Promise};

const FRAMES: usize = 100;
const DEPTH_MM: f64 = 0.2;
/// Rows of the strip across the tile that is looked at; all hollows cross it.
const ROWS: usize = 256;
/// Walls are 1.3 px wide; windows of 3 px reach one px farther.
const WINDOW_PX: usize = 3;

const MEAN_OFF_MM: Promise = Promise::as_asked(Bounds::at_most(0.003));
const WORST_OFF_MM: Promise = Promise::as_asked(Bounds::at_most(0.010));

#[test]
fn the_surface_tells_the_depth_of_the_ideal_tiles_hollows() {
    let mut config = SimulatorConfig::tile(1024, FRAMES);
    config.optics.rows = ROWS;
    config.optics.principal_point_y_px = 0.5 * (ROWS as f64 - 1.0);
    config.sensor.read_noise_dn = 1.0;
    let optics = config.optics.clone();
    let baseline_mm = config.scan.step_mm * (FRAMES - 1) as f64;
    let simulator = Simulator::new(config).unwrap();
    let maps =
        match_volume(&simulator.render_volume(&Silent).unwrap(), &MatchOptions::default(), &Silent).unwrap();

    let principal = (optics.principal_point_x_px, optics.principal_point_y_px);
    let geometry = Geometry::exact(optics.focal_length_px, baseline_mm, principal);
    let all = heights(geometry, &maps.disparity, &maps.sigma).unwrap();
    let options = StepsOptions::for_window(TrendKind::Plane, WINDOW_PX);
    let extent = find_extent(&all, None, (options.margin_px, options.rim_px())).unwrap();
    let steps = find_steps(&all.only(&extent.used), None, &options).unwrap();
    let each: Vec<f64> = steps.parts.iter().map(|part| part.depth.depth_mm).collect();
    println!("{} hollows: {:?}; {each:.4?}", each.len(), steps.depth);
    // The tile has 19 hollows, of which those at its ends may be cut off with the rim.
    assert!((17..=19).contains(&each.len()), "{} hollows", each.len());
    let worst = each.iter().map(|depth| (depth - DEPTH_MM).abs()).fold(0.0, f64::max);
    let mut figures = Figures::default();
    figures.check("depth off by, in mm", MEAN_OFF_MM, (steps.depth.depth_mm - DEPTH_MM).abs());
    figures.check("worst hollow off by, in mm", WORST_OFF_MM, worst);
    figures.finish();
}
