//! Stopping a stage from another thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// How to stop a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Urgency {
    /// Decelerate; the position stays known.
    Soon = 1,
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
/// assert!(!switch.is_sent());
/// switch.release();
/// assert_eq!(switch.pressed(), None);
/// ```
#[derive(Debug, Clone, Default)]
pub struct StopSwitch {
    asked: Arc<AtomicU8>,
    /// What the waiting thread has sent to the stage.
    sent: Arc<AtomicU8>,
}

impl StopSwitch {
    /// Asks for a stop, which stays until released. A later press can only make it more urgent.
    pub fn press(&self, urgency: Urgency) {
        self.asked.fetch_max(urgency as u8, Ordering::SeqCst);
    }

    /// Called by a driver: the stop has been sent to the stage.
    pub fn sent(&self, urgency: Urgency) {
        self.sent.fetch_max(urgency as u8, Ordering::SeqCst);
    }

    /// Whether the stop that is asked for, or a more urgent one, has been sent to the stage.
    pub fn is_sent(&self) -> bool {
        self.sent.load(Ordering::SeqCst) >= self.asked.load(Ordering::SeqCst)
    }

    /// The urgency, if a stop is asked for.
    pub fn pressed(&self) -> Option<Urgency> {
        match self.asked.load(Ordering::SeqCst) {
            0 => None,
            1 => Some(Urgency::Soon),
            _ => Some(Urgency::AtOnce),
        }
    }

    /// Lets the stage move again.
    pub fn release(&self) {
        self.asked.store(0, Ordering::SeqCst);
        self.sent.store(0, Ordering::SeqCst);
    }
}
