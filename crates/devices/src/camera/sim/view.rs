//! What is in front of a simulated camera.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The view of a simulated camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SimView {
    /// The simulator's scene.
    Scene,
    /// A cap on the lens.
    Dark,
    /// A white surface that fills the view, as bright as the scene's brightest paint.
    Flat,
    /// The simulator's hand-held board, in this pose of an endless list.
    Board(usize),
}

/// Number of the board's first pose; lower numbers are the other views.
const FIRST_POSE: usize = 3;

/// Selects the view of a simulated camera. Clones share their state.
///
/// ```
/// use epirig_devices::camera::{SimView, ViewSwitch};
///
/// let view = ViewSwitch::default();
/// view.clone().put(SimView::Dark);
/// assert_eq!(view.get(), SimView::Dark);
/// view.put(SimView::Board(4));
/// assert_eq!(view.get(), SimView::Board(4));
/// ```
#[derive(Debug, Clone, Default)]
pub struct ViewSwitch(Arc<AtomicUsize>);

impl ViewSwitch {
    /// Selects a view.
    pub fn put(&self, view: SimView) {
        let number = match view {
            SimView::Scene => 0,
            SimView::Dark => 1,
            SimView::Flat => 2,
            SimView::Board(pose) => pose.saturating_add(FIRST_POSE),
        };
        self.0.store(number, Ordering::SeqCst);
    }

    /// The present view.
    pub fn get(&self) -> SimView {
        match self.0.load(Ordering::SeqCst) {
            0 => SimView::Scene,
            1 => SimView::Dark,
            2 => SimView::Flat,
            pose => SimView::Board(pose - FIRST_POSE),
        }
    }
}
