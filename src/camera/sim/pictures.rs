//! What the simulated sensor sees, as bytes of a buffer.

use std::sync::Arc;

use super::view::SimView;
use crate::frame::{Frame, Samples};
use crate::plane::Plane;
use crate::twin::Twin;

/// Views that are remembered: before and after the latest move.
const VIEWS: usize = 2;

/// Renders views and remembers the latest, because a camera takes many frames of one view.
#[derive(Debug)]
pub(super) struct Pictures {
    twin: Arc<Twin>,
    views: Vec<(f64, Plane<f32>)>,
}

impl Pictures {
    pub(super) fn new(twin: Arc<Twin>) -> Self {
        Self { twin, views: Vec::new() }
    }

    pub(super) fn twin(&self) -> &Twin {
        &self.twin
    }

    /// The frame of `view` with the stage at `position_mm`; `light` is 1 for the twin's own exposure.
    pub(super) fn frame(&mut self, view: SimView, position_mm: f64, light: f32, exposure: u32) -> Frame {
        let brightness = match view {
            SimView::Scene => return self.scene(position_mm, light, exposure),
            SimView::Dark => 0.0,
            SimView::Flat => light,
        };
        self.twin.digitise(&self.twin.uniform_irradiance(brightness), exposure)
    }

    fn scene(&mut self, position_mm: f64, light: f32, exposure: u32) -> Frame {
        if !self.views.iter().any(|(position, _)| *position == position_mm) {
            if self.views.len() == VIEWS {
                self.views.remove(0);
            }
            self.views.push((position_mm, self.twin.irradiance(position_mm)));
        }
        match self.views.iter().find(|(position, _)| *position == position_mm) {
            Some((_, view)) if light == 1.0 => self.twin.digitise(view, exposure),
            Some((_, view)) => self.twin.digitise(&view.map(|value| value * light), exposure),
            None => self.twin.expose(position_mm, exposure),
        }
    }
}

/// The samples of a frame as a driver stores them: bytes, or 16-bit words, the lower byte first.
pub(super) fn to_bytes(frame: &Frame) -> Vec<u8> {
    match frame.samples() {
        Samples::U8(values) => values.clone(),
        Samples::U16(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
    }
}
