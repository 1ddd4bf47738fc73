//! Pictures of the simulated sensor, as bytes of a buffer.

use std::sync::Arc;

use super::view::SimView;
use epirig_core::frame::{Frame, Samples};
use epirig_core::grid::Grid;
use epirig_simulator::Simulator;

/// Number of cached views: before and after the latest move.
const VIEWS: usize = 2;

/// A view that takes time to render.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shown {
    /// The scene with the stage at this position, in mm.
    Scene(f64),
    /// The board in this pose.
    Board(usize),
}

/// Renders views, and caches the latest, because a camera takes many frames of one view.
#[derive(Debug)]
pub(super) struct Pictures {
    simulator: Arc<Simulator>,
    views: Vec<(Shown, Grid<f32>)>,
}

impl Pictures {
    pub(super) fn new(simulator: Arc<Simulator>) -> Self {
        Self { simulator, views: Vec::new() }
    }

    pub(super) fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    /// The frame of `view` with the stage at `position_mm`; `light` is 1 for the simulator's own exposure.
    pub(super) fn frame(&mut self, view: SimView, position_mm: f64, light: f32, exposure: u32) -> Frame {
        let brightness = match view {
            SimView::Scene => return self.rendered(Shown::Scene(position_mm), light, exposure),
            SimView::Board(pose) => return self.rendered(Shown::Board(pose), light, exposure),
            SimView::Dark => 0.0,
            SimView::Flat => light,
        };
        self.simulator.digitise(&self.simulator.uniform_irradiance(brightness), exposure)
    }

    fn rendered(&mut self, shown: Shown, light: f32, exposure: u32) -> Frame {
        let place = self.views.iter().position(|(view, _)| *view == shown).unwrap_or_else(|| {
            if self.views.len() == VIEWS {
                self.views.remove(0);
            }
            let picture = match shown {
                Shown::Scene(position_mm) => self.simulator.irradiance(position_mm),
                Shown::Board(pose) => self.simulator.board_irradiance(pose),
            };
            self.views.push((shown, picture));
            self.views.len() - 1
        });
        let view = &self.views[place].1;
        if light == 1.0 {
            self.simulator.digitise(view, exposure)
        } else {
            self.simulator.digitise(&view.map(|value| value * light), exposure)
        }
    }
}

/// The samples of a frame as a driver stores them: bytes, or little-endian words of 16 bit.
pub(super) fn to_bytes(frame: &Frame) -> Vec<u8> {
    match frame.samples() {
        Samples::U8(values) => values.clone(),
        Samples::U16(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
    }
}
