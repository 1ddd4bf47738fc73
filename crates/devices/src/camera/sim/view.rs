//! What is in front of a simulated camera.

use std::sync::{Arc, Mutex, PoisonError};

/// The view of a simulated camera.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SimView {
    /// The simulator's scene.
    #[default]
    Scene,
    /// A cap on the lens.
    Dark,
    /// A white surface that fills the view, as bright as the scene's brightest paint.
    Flat,
    /// The simulator's hand-held board, in this pose of an endless list.
    Board(usize),
}

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
pub struct ViewSwitch(Arc<Mutex<SimView>>);

impl ViewSwitch {
    /// Selects a view.
    pub fn put(&self, view: SimView) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = view;
    }

    /// The present view.
    pub fn get(&self) -> SimView {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
