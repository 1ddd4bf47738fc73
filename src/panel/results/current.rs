//! The results of a sequence as they are on disk now. When others have taken their place, they are read anew, and a
//! page that shows the former ones is told: it never gets maps of one match beside files of another.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use serde_json::Value;

use super::view::ResultsView;
use super::{facts, largest_question};
use crate::panel::PanelError;
use epirig_server::{Query, Refusal, RefusalKind, Reply, Site};

/// The results of a sequence, answering questions about what is on disk now.
///
/// A question may say which results it is about, by the `id` that `about` and `results` tell: as `of` in the query,
/// or in the JSON of what is asked for. It is refused if these are other ones by now.
pub struct CurrentResults {
    folder: PathBuf,
    results: Option<PathBuf>,
    view: RwLock<Arc<ResultsView>>,
    /// Held while results are read anew.
    reading: Mutex<()>,
    /// Whether frames are read in the background.
    ahead: AtomicBool,
}

impl CurrentResults {
    /// Opens the sequence in `folder` with its results in `results`; by default those in its folder `results`, if
    /// there are any.
    ///
    /// # Errors
    /// [`PanelError`] if the sequence or the results cannot be read, or do not belong together.
    pub fn open(folder: &Path, results: Option<&Path>) -> Result<Self, PanelError> {
        let view = RwLock::new(Arc::new(ResultsView::open(folder, results)?));
        let results = results.map(Path::to_owned);
        let (reading, ahead) = (Mutex::default(), AtomicBool::new(false));
        Ok(Self { folder: folder.to_owned(), results, view, reading, ahead })
    }

    /// Reads the frames in the background, so that EPIs are there at once when they are asked for.
    pub fn read_ahead(&self) {
        self.ahead.store(true, Ordering::SeqCst);
        self.held().read_ahead();
    }

    /// Name of the sequence.
    pub(in crate::panel) fn name(&self) -> String {
        self.held().sequence.name()
    }

    /// What exists and is not shown, and why: results that do not fit the sequence, or their surface.
    pub fn unfit(&self) -> Option<String> {
        self.held().unfit().map(str::to_owned)
    }

    /// What tells these results from others.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub(in crate::panel) fn id(&self) -> Result<String, PanelError> {
        Ok(self.view()?.id.clone())
    }

    /// The results that were read last.
    fn held(&self) -> Arc<ResultsView> {
        Arc::clone(&self.view.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// The results that are on disk.
    fn view(&self) -> Result<Arc<ResultsView>, PanelError> {
        let are_these =
            |view: &ResultsView| view.id == ResultsView::id_of(&self.folder, self.results.as_deref());
        let held = self.held();
        if are_these(&held) {
            return Ok(held);
        }
        let _reading = self.reading.lock().unwrap_or_else(PoisonError::into_inner);
        // Somebody else may have read them meanwhile.
        let held = self.held();
        if are_these(&held) {
            return Ok(held);
        }
        let view = Arc::new(ResultsView::open(&self.folder, self.results.as_deref())?);
        if self.ahead.load(Ordering::SeqCst) {
            view.read_ahead();
        }
        *self.view.write().unwrap_or_else(PoisonError::into_inner) = Arc::clone(&view);
        Ok(view)
    }
}

/// Refuses a question about other results than these.
fn check(view: &ResultsView, of: Option<&str>) -> Result<(), Refusal> {
    if of.is_none_or(|of| of == view.id) {
        return Ok(());
    }
    let why = "these are other results than those on the page: they were matched again, or another sequence was \
               opened; load the page again";
    Err(Refusal::new(RefusalKind::Outdated, why))
}

impl Site for CurrentResults {
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal> {
        let view = match path {
            // Tiles are in memory, and there are many: they are those of the page, or are refused.
            ["maps" | "frames", ..] => self.held(),
            _ => self.view()?,
        };
        match path {
            ["about"] => Reply::json(&facts::about(&view)),
            ["results"] => Reply::json(&facts::results(&view)),
            _ => {
                check(&view, query.text("of"))?;
                view.get(path, query)
            }
        }
    }

    fn post(&self, path: &[&str], asked: &Value) -> Result<Reply, Refusal> {
        let view = self.view()?;
        check(&view, asked.get("of").and_then(Value::as_str))?;
        view.post(path, asked)
    }

    fn largest_body(&self, path: &[&str]) -> usize {
        largest_question(path)
    }

    fn is_open_to_all(&self, _path: &[&str]) -> bool {
        // Questions change nothing.
        true
    }
}
