//! The results of a sequence as they are on disk now. When others have taken their place, they are read anew, and a
//! page that shows the former ones is told: it never gets maps of one match beside files of another.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError, RwLock};

use serde_json::Value;

use super::compare::CompareInfo;
use super::compare_scans::compare_scans;
use super::view::ResultsView;
use super::{facts, questions, tiles};
use crate::panel::PanelError;
use crate::panel::questions::{Framed, Json, Method, Question, Questions};
use crate::panel::requests::Nothing;
use epirig_server::{PostRules, Query, Refusal, RefusalKind, Reply, Site};

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
        self.held().unfit.clone()
    }

    /// What tells these results from others.
    pub(in crate::panel) fn id(&self) -> Result<String, PanelError> {
        Ok(self.view()?.id.clone())
    }

    /// Folder of the sequence.
    pub(in crate::panel) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The results that `of` names, compared with the heights of the sequence in `folder`.
    pub(in crate::panel) fn compared_with(
        &self,
        of: Option<&str>,
        folder: &Path,
    ) -> Result<Framed<CompareInfo>, Refusal> {
        Ok(compare_scans(&*check(self.view()?, of)?, folder)?)
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

/// These results, unless the question is about others.
fn check(view: Arc<ResultsView>, of: Option<&str>) -> Result<Arc<ResultsView>, Refusal> {
    if of.is_none_or(|of| of == view.id) {
        return Ok(view);
    }
    let why = "these are other results than those on the page: they were matched again, or another sequence was \
               opened; load the page again";
    Err(Refusal::new(RefusalKind::Outdated, why))
}

/// All questions about results as they are now.
pub(in crate::panel) fn results_questions() -> impl Iterator<Item = Question<CurrentResults>> {
    let first = [
        Question::get("about", |view: &ResultsView, Nothing {}| Ok(Json(facts::about(view))))
            .of(|current: &CurrentResults, _| Ok(current.view()?)),
        // It borrows from what it is about.
        Question::new(Method::Get, "results", |view, _| Reply::json(&facts::results(view)))
            .typed::<Nothing, Json<facts::Results<'static>>>()
            .of(|current: &CurrentResults, _| Ok(current.view()?)),
    ];
    // They are those of the page, or are refused.
    let tiles = tiles()
        .into_iter()
        .map(|row| row.of(|current: &CurrentResults, asked| check(current.held(), asked.query.text("of"))));
    let others = questions().into_iter().map(|row| {
        row.of(|current: &CurrentResults, asked| {
            let of = asked.query.text("of").or_else(|| asked.json.get("of").and_then(Value::as_str));
            check(current.view()?, of)
        })
    });
    first.into_iter().chain(tiles).chain(others)
}

/// The table.
static QUESTIONS: LazyLock<Questions<CurrentResults>> =
    LazyLock::new(|| Questions(results_questions().collect()));

impl Site for CurrentResults {
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal> {
        QUESTIONS.get(self, path, query)
    }

    fn post(&self, path: &[&str], asked: &Value) -> Result<Reply, Refusal> {
        QUESTIONS.post(self, path, asked)
    }

    fn rules(&self, path: &[&str]) -> PostRules {
        // Questions change nothing.
        PostRules { open_to_all: true, ..QUESTIONS.rules(path) }
    }
}
