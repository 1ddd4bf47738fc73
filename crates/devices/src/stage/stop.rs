//! Stopping a stage from another thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// How to stop a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Urgency {
    /// Decelerate; the position stays known.
    Soon,
    /// At once; the position may be lost.
    AtOnce,
}

/// Asks the thread that waits for a motion to stop it. Clones share their state.
///
/// ```
/// use epirig_devices::stage::{StopSwitch, Urgency};
///
/// let switch = StopSwitch::default();
/// switch.clone().press(Urgency::Soon);
/// assert_eq!(switch.pressed(), Some(Urgency::Soon));
/// switch.release();
/// assert_eq!(switch.pressed(), None);
/// ```
#[derive(Debug, Clone, Default)]
pub struct StopSwitch(Arc<AtomicU8>);

impl StopSwitch {
    /// Asks for a stop, which stays until released. A later press can only make it more urgent.
    pub fn press(&self, urgency: Urgency) {
        let level = match urgency {
            Urgency::Soon => 1,
            Urgency::AtOnce => 2,
        };
        self.0.fetch_max(level, Ordering::SeqCst);
    }

    /// The urgency, if a stop is asked for.
    pub fn pressed(&self) -> Option<Urgency> {
        match self.0.load(Ordering::SeqCst) {
            0 => None,
            1 => Some(Urgency::Soon),
            _ => Some(Urgency::AtOnce),
        }
    }

    /// Lets the stage move again.
    pub fn release(&self) {
        self.0.store(0, Ordering::SeqCst);
    }
}
