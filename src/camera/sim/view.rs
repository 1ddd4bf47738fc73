//! What is in front of a simulated camera.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// What is in front of a simulated camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SimView {
    /// The twin's scene.
    Scene,
    /// A cap on the lens.
    Dark,
    /// A white surface that fills the view, as bright as the scene's brightest paint.
    Flat,
}

/// Puts something in front of a simulated camera. Clones act on the same one.
///
/// ```
/// use epirig::camera::{SimView, ViewSwitch};
///
/// let view = ViewSwitch::default();
/// view.clone().put(SimView::Dark);
/// assert_eq!(view.get(), SimView::Dark);
/// ```
#[derive(Debug, Clone, Default)]
pub struct ViewSwitch(Arc<AtomicU8>);

impl ViewSwitch {
    /// Puts it there.
    pub fn put(&self, view: SimView) {
        let number = match view {
            SimView::Scene => 0,
            SimView::Dark => 1,
            SimView::Flat => 2,
        };
        self.0.store(number, Ordering::SeqCst);
    }

    /// What is there.
    pub fn get(&self) -> SimView {
        match self.0.load(Ordering::SeqCst) {
            1 => SimView::Dark,
            2 => SimView::Flat,
            _ => SimView::Scene,
        }
    }
}
