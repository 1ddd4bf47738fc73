//! Homes a simulated stage that speaks GRBL and moves it, over a simulated serial line:
//! `cargo run -p epirig-devices --example move_stage`.

use epirig_devices::link::SimulatedLink;
use epirig_devices::stage::grbl::GrblOptions;
use epirig_devices::stage::simulator::GrblDevice;
use epirig_devices::stage::{GrblStage, Stage};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let link = SimulatedLink::new(GrblDevice::default());
    let mut stage = GrblStage::connect(Box::new(link), GrblOptions::default())?;
    println!("{}", stage.identity());
    stage.home()?;
    for position_mm in [1.5, 3.0, 4.5] {
        stage.move_to(position_mm)?;
        println!("at {:.4} mm", stage.position_mm()?);
    }
    Ok(())
}
