//! The levelled maps that pages look at.

use std::sync::{Arc, Mutex, PoisonError};

use super::pyramid::Pyramid;
use crate::panel::PanelError;
use epirig_surface::Plane;

/// Levelled maps that are kept: both maps of two pages.
const KEPT: usize = 4;

/// A levelled map.
pub(super) struct Levelled {
    map: String,
    by: String,
    /// What was taken away.
    pub(super) plane: Plane,
    pub(super) pyramid: Pyramid,
}

/// The levelled maps that were asked for last.
#[derive(Default)]
pub(super) struct LevelledMaps(Mutex<Vec<Arc<Levelled>>>);

impl LevelledMaps {
    /// The map `map` levelled by `by`; `make` is asked for it if it is not kept.
    pub(super) fn get(
        &self,
        map: &str,
        by: &str,
        make: impl FnOnce() -> Result<(Plane, Pyramid), PanelError>,
    ) -> Result<Arc<Levelled>, PanelError> {
        // Whoever asks for the same meanwhile waits, and finds it.
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = kept.iter().find(|one| one.map == map && one.by == by) {
            return Ok(Arc::clone(found));
        }
        let (plane, pyramid) = make()?;
        let made = Arc::new(Levelled { map: map.to_owned(), by: by.to_owned(), plane, pyramid });
        kept.insert(0, Arc::clone(&made));
        kept.truncate(KEPT);
        Ok(made)
    }
}
