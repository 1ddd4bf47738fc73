//! Takes two frames of a simulated rig and prints the true disparity:
//! `cargo run --release -p epirig-simulator --example expose`.

use epirig_simulator::{Simulator, SimulatorConfig};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let simulator = Simulator::new(SimulatorConfig::textured_plane(64, 48, 9))?;
    for (index, &position_mm) in simulator.config().scan.positions_mm().iter().enumerate() {
        let frame = simulator.expose(position_mm, index as u32);
        println!("at {position_mm:.3} mm: mean {:.2} DN", frame.samples().mean());
    }
    let truth = simulator.truth(0)?;
    println!("disparity in the middle: {:.4} px", truth.disparity.at(32, 24));
    Ok(())
}
