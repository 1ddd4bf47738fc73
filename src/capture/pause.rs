//! Ending a scan after the frame in hand.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Asks a scan to end after the current frame, so that it can be resumed. Clones share their state.
///
/// ```
/// let pause = epirig::capture::PauseSwitch::default();
/// pause.clone().press();
/// assert!(pause.pressed());
/// ```
#[derive(Debug, Clone, Default)]
pub struct PauseSwitch(Arc<AtomicBool>);

impl PauseSwitch {
    /// Asks for the pause. It cannot be withdrawn.
    pub fn press(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// Whether a pause was asked for.
    pub fn pressed(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
