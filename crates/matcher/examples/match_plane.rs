//! Matches a simulated slanted plane and prints how far the disparity is off:
//! `cargo run --release -p epirig-matcher --example match_plane`.

use epirig_core::progress::Silent;
use epirig_matcher::evaluate::compare_with_truth;
use epirig_matcher::{MatchOptions, match_volume};
use epirig_simulator::{Simulator, SimulatorConfig};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let simulator = Simulator::new(SimulatorConfig::textured_plane(160, 120, 31))?;
    let volume = simulator.render_volume(&Silent)?;
    let maps = match_volume(&volume, &MatchOptions::default(), &Silent)?;
    let truth = simulator.truth(maps.reference)?;
    let tau = volume.tau().values()[maps.reference];
    let report = compare_with_truth(&maps.disparity, Some(&maps.sigma), &truth.disparity, (tau, 1.0 - tau))?;
    println!("{report:#?}");
    Ok(())
}
