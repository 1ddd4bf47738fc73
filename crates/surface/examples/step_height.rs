//! Matches frames of a simulated tile and prints the depth of its hollows:
//! `cargo run --release -p epirig-surface --example step_height`.

use epirig_core::progress::Silent;
use epirig_matcher::{MatchOptions, match_volume};
use epirig_simulator::{Simulator, SimulatorConfig};
use epirig_surface::{Geometry, StepsOptions, TrendKind, find_extent, find_steps, heights};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut config = SimulatorConfig::tile(1024, 51);
    config.optics.rows = 128;
    config.optics.principal_point_y_px = 63.5;
    let (optics, scan) = (config.optics.clone(), config.scan);
    let volume = Simulator::new(config)?.render_volume(&Silent)?;
    let maps = match_volume(&volume, &MatchOptions::default(), &Silent)?;

    let baseline_mm = scan.step_mm * (scan.frames - 1) as f64;
    let principal_px = (optics.principal_point_x_px, optics.principal_point_y_px);
    let geometry = Geometry::exact(optics.focal_length_px, baseline_mm, principal_px);
    let heights = heights(geometry, &maps.disparity, &maps.sigma).ok_or("no disparity is known")?;
    let options = StepsOptions::for_window(TrendKind::Quadric, 5);
    let extent = find_extent(&heights, None, (options.margin_px, options.rim_px()))?;
    let steps = find_steps(&heights.only(&extent.used), None, &options)?;
    println!("{} hollows, {:.4} mm deep", steps.parts.len(), steps.depth.depth_mm);
    Ok(())
}
