//! Ending a scan after the frame in hand.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Asks a scan to end after the frame in hand, so that it can be resumed. Clones act as one.
///
/// ```
/// let pause = epirig::capture::PauseSwitch::default();
/// pause.clone().press();
/// assert!(pause.pressed());
/// ```
#[derive(Debug, Clone, Default)]
pub struct PauseSwitch(Arc<AtomicBool>);

impl PauseSwitch {
    /// Asks. It stays asked for.
    pub fn press(&self) {
        self.0.store(true, Ordering::SeqCst);
    }

    /// Whether it has been asked for.
    pub fn pressed(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
