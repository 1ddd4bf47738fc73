//! Lists the frames of a sequence and checks them:
//! `cargo run -p epirig-data --example read_sequence -- FOLDER`.

use epirig_core::progress::Silent;
use epirig_data::sequence::{Sequence, verify};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let Some(folder) = std::env::args_os().nth(1) else {
        println!("give the folder of a sequence");
        return Ok(());
    };
    let sequence = Sequence::open(folder.as_ref())?;
    for frame in sequence.frames() {
        println!("{}  {:?} mm  mean {:.2} DN", frame.file, frame.reported_mm, frame.mean_dn);
    }
    let report = verify(&sequence, &Silent)?;
    println!("{} of {} frames are good", report.good_frames, report.planned_frames);
    Ok(())
}
