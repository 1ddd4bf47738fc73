//! What G-code sets for the lines that follow.

use super::settings::AXES;

/// Modal state that persists from line to line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Modal {
    pub(super) absolute: bool,
    pub(super) rapid: bool,
    pub(super) feed_mm_min: f64,
    pub(super) offset_mm: [f64; AXES],
}

impl Default for Modal {
    fn default() -> Self {
        Self { absolute: true, rapid: true, feed_mm_min: 0.0, offset_mm: [0.0; AXES] }
    }
}
