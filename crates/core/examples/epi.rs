//! Prints one epipolar plane image of a tiny volume: `cargo run -p epirig-core --example epi`.

use epirig_core::frame::{Frame, Samples};
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (rows, columns, count) = (3, 24, 8);
    // A bright point that moves by one pixel from frame to frame: a straight line in the EPI.
    let frame = |t: usize| {
        let levels = (0..rows * columns).map(|index| if index % columns == 4 + t { 250 } else { 20 });
        Frame::new(rows, columns, 8, Samples::U8(levels.collect()))
    };
    let mut volume = Volume::new(rows, columns, 8, Tau::equidistant(count)?);
    for t in 0..count {
        volume.insert(t, &frame(t)?)?;
    }
    let mut row = vec![0.0; columns];
    for t in 0..count {
        volume.copy_row(1, t, &mut row);
        let line: String = row.iter().map(|&level| if level > 128.0 { '#' } else { '.' }).collect();
        println!("frame {t}  {line}");
    }
    Ok(())
}
