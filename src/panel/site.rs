//! The panel as a site: rig, scan and results under one roof.

use std::path::Path;
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::JoinHandle;

use super::error::PanelError;
use super::results::CurrentResults;
use super::rig::start;
use super::sequences::{Pictures, name_of};
use super::shared::{PanelOptions, SharedState};

/// The panel of a rig: it owns stage and camera until it is [closed](PanelCloser).
pub struct Panel {
    pub(super) shared: Arc<SharedState>,
    /// The sequence that the results view shows.
    results: RwLock<Option<Arc<CurrentResults>>>,
    /// The pictures that the list of the sequences has named.
    pub(super) pictures: Pictures,
}

/// Ends a panel.
pub struct PanelCloser {
    shared: Arc<SharedState>,
    threads: Vec<JoinHandle<()>>,
}

/// Asks a panel to end, from any thread.
#[derive(Clone)]
pub struct PanelEnd(Arc<SharedState>);

impl PanelEnd {
    /// A scan ends after the frame in hand; the second time the stage is stopped.
    pub fn press(&self) {
        self.0.end();
    }
}

impl PanelCloser {
    /// What asks the panel to end.
    pub fn end(&self) -> PanelEnd {
        PanelEnd(Arc::clone(&self.shared))
    }

    /// Waits until the rig is given up. A scan ends after the frame in hand, and can be resumed.
    pub fn wait(self) {
        if !self.shared.is_ending() {
            self.shared.end();
        }
        for thread in self.threads {
            // A thread that has panicked has told so.
            let _ = thread.join();
        }
    }
}

impl Panel {
    /// Opens the rig in a thread of its own.
    ///
    /// # Errors
    /// [`PanelError::Threads`].
    pub fn open(options: PanelOptions) -> Result<(Self, PanelCloser), PanelError> {
        let shared = Arc::new(SharedState::new(options));
        let threads = start(&shared).map_err(PanelError::Threads)?;
        Ok((
            Self { shared: Arc::clone(&shared), results: RwLock::default(), pictures: Pictures::default() },
            PanelCloser { shared, threads },
        ))
    }

    /// Makes the sequence in `folder` the one that the results view shows.
    ///
    /// # Errors
    /// [`PanelError`] if it cannot be read.
    pub fn show_results(&self, folder: &Path) -> Result<(), PanelError> {
        let view = Arc::new(CurrentResults::open(folder, None)?);
        view.read_ahead();
        *self.results.write().unwrap_or_else(PoisonError::into_inner) = Some(view);
        Ok(())
    }

    /// The sequence that the results view shows, as the list of the sequences names it.
    pub(super) fn shown(&self) -> Option<String> {
        let results = self.results().ok()?;
        Some(name_of(&self.shared.folder, results.folder()).unwrap_or_else(|| results.name()))
    }

    /// What the results view shows.
    ///
    /// # Errors
    /// [`PanelError::NotThere`] if there is no sequence.
    pub(super) fn results(&self) -> Result<Arc<CurrentResults>, PanelError> {
        let results = self.results.read().unwrap_or_else(PoisonError::into_inner).clone();
        results.ok_or_else(|| PanelError::NotThere("no sequence is open; choose one in the list".to_owned()))
    }
}
