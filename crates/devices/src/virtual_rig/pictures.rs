//! Pictures of the simulator at positions of the stage.

use std::collections::HashMap;
use std::sync::Arc;

use crate::stage::simulator::NativeDevice;
use epirig_core::frame::{Frame, Samples};
use epirig_simulator::Simulator;

/// Number of cached pictures, so that a scan is not rendered twice.
const REMEMBERED: usize = 256;
/// Motion blur of a moving picture, in px. Two values alternate, so that successive pictures differ.
const SMEARS: [usize; 2] = [9, 15];

pub(super) struct Pictures {
    simulator: Arc<Simulator>,
    remembered: HashMap<i64, Frame>,
    latest: Option<Frame>,
    smears: usize,
}

impl Pictures {
    pub(super) fn new(simulator: Arc<Simulator>) -> Self {
        Self { simulator, remembered: HashMap::new(), latest: None, smears: 0 }
    }

    /// The picture with the carriage at rest at `steps`.
    pub(super) fn at(&mut self, steps: i64) -> Frame {
        if self.remembered.len() >= REMEMBERED {
            self.remembered.clear();
        }
        let simulator = &self.simulator;
        let render = || simulator.expose(NativeDevice::mm_from_home(steps), 0);
        let picture = self.remembered.entry(steps).or_insert_with(render).clone();
        self.latest = Some(picture.clone());
        picture
    }

    /// The picture of a moving object: the latest picture, blurred. `None` before the first picture.
    pub(super) fn moving(&mut self) -> Option<Frame> {
        let latest = self.latest.as_ref()?;
        self.smears += 1;
        let reach = SMEARS[self.smears % SMEARS.len()];
        let Samples::U8(samples) = latest.samples() else { return None };
        let mut smeared = Vec::with_capacity(samples.len());
        for row in samples.chunks_exact(latest.columns()) {
            let mut sum: u32 = row.iter().take(reach).map(|&sample| u32::from(sample)).sum();
            for (x, &first) in row.iter().enumerate() {
                smeared.push((sum / reach as u32) as u8);
                sum = sum - u32::from(first) + row.get(x + reach).map_or(0, |&next| u32::from(next));
            }
        }
        Frame::new(latest.rows(), latest.columns(), latest.bit_depth(), Samples::U8(smeared)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_simulator::SimulatorConfig;

    #[test]
    fn rest_is_the_simulators_exposure_and_motion_is_never_twice_the_same() {
        let simulator = Arc::new(Simulator::new(SimulatorConfig::textured_plane(64, 48, 2)).unwrap());
        let mut pictures = Pictures::new(Arc::clone(&simulator));
        assert_eq!(pictures.moving(), None);
        let home = -650;
        assert_eq!(NativeDevice::mm_from_home(home), 0.0);
        assert_eq!(pictures.at(home + 250), simulator.expose(1.0, 0));
        let smeared = [pictures.moving().unwrap(), pictures.moving().unwrap()];
        assert_ne!(smeared[0], smeared[1]);
        // A mean over 9 or 15 px keeps the level, except at the right end of the image.
        let mean = |frame: &Frame| frame.samples().mean();
        assert!((mean(&smeared[1]) / mean(&simulator.expose(1.0, 0)) - 1.0).abs() < 0.2);
    }
}
