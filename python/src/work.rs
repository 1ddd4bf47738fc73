//! Work that takes a while: it is done on a thread of its own, without Python's lock. The thread that called
//! waits for it, and meanwhile hands on what the work tells, and hears Ctrl-C.

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use epirig::cli::embedded::{CalledFrom, Refusal, Switches};
use epirig_core::fault::Blame;
use epirig_core::progress::{Cancelled, Progress};
use pyo3::exceptions::{PyKeyboardInterrupt, PyTypeError};
use pyo3::prelude::*;

use crate::errors::{exception, interruption};

/// How often the waiting thread looks.
pub(crate) const EVERY: Duration = Duration::from_millis(50);

/// Whether the interpreter is about to end.
static ENDING: AtomicBool = AtomicBool::new(false);
/// Calls from Python that have not yet returned.
static CALLS: AtomicUsize = AtomicUsize::new(0);

/// A call from Python, for as long as it lasts. An interpreter that ended meanwhile would end its thread in the middle
/// of Rust.
pub(crate) struct Call;

impl Call {
    pub(crate) fn begin() -> Self {
        CALLS.fetch_add(1, Ordering::SeqCst);
        Self
    }

    /// Whether it is to end, because the interpreter does.
    pub(crate) fn is_to_end() -> bool {
        ENDING.load(Ordering::SeqCst)
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        CALLS.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Ends all calls of other threads, and waits for their end: for the end of the interpreter.
#[pyfunction]
pub(crate) fn end_all_calls(py: Python<'_>) {
    /// A stage has come to rest, and a match has ended by then.
    const PATIENCE: Duration = Duration::from_secs(20);
    if refuse_forked().is_err() {
        // The calls are those of the process that it was forked from.
        return;
    }
    ENDING.store(true, Ordering::SeqCst);
    let until = Instant::now() + PATIENCE;
    while CALLS.load(Ordering::SeqCst) > 0 && Instant::now() < until {
        py.detach(|| std::thread::sleep(EVERY));
    }
}

/// What the work tells; shared by the work and the thread that waits for it.
#[derive(Default)]
pub(crate) struct Told {
    cancelled: AtomicBool,
    done: AtomicU64,
    latest: Mutex<Latest>,
    /// What an interruption presses, besides the cancellation.
    switches: Switches,
}

#[derive(Default)]
struct Latest {
    what: String,
    total: u64,
    notes: Vec<String>,
}

impl Told {
    /// Does what Ctrl-C does.
    pub(crate) fn interrupt(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
        self.switches.interrupt();
    }

    /// Gives notes to Python's `logging`.
    pub(crate) fn hand_on_notes(&self, py: Python<'_>) -> PyResult<()> {
        let notes = std::mem::take(&mut self.latest().notes);
        if notes.is_empty() {
            return Ok(());
        }
        let log = py.import("epirig._log")?.getattr("note")?;
        notes.into_iter().try_for_each(|words| log.call1((words,)).map(|_| ()))
    }

    fn latest(&self) -> MutexGuard<'_, Latest> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for Told {
    fn begin(&self, what: &str, total: u64) {
        let mut latest = self.latest();
        (latest.what, latest.total) = (what.to_owned(), total);
        self.done.store(0, Ordering::Relaxed);
    }

    fn advance(&self, count: u64) {
        self.done.fetch_add(count, Ordering::Relaxed);
    }

    fn end(&self) {}

    fn note(&self, words: &str) {
        self.latest().notes.push(words.to_owned());
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

impl CalledFrom for Told {
    fn switches(&self) -> Option<&Switches> {
        Some(&self.switches)
    }
}

/// Does `work` without Python's lock. `progress` is called with what is done, how many parts of it
/// are, and of how many. An exception of it, or of a signal's handler, cancels the work, and is
/// raised once that has ended. For Ctrl-C the work itself says how it ended.
pub(crate) fn done<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Arc<Told>) -> Result<T, Refusal> + Send,
) -> PyResult<T> {
    done_with(py, progress, &|| {}, work)
}

/// The same, where `stop` also ends the work each time that an exception wants it.
pub(crate) fn done_with<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    stop: &(dyn Fn() + Sync),
    work: impl FnOnce(Arc<Told>) -> Result<T, Refusal> + Send,
) -> PyResult<T> {
    refuse_forked().map_err(|refusal| exception(py, refusal))?;
    let _call = Call::begin();
    if let Some(progress) = progress.filter(|progress| !progress.is_callable()) {
        return Err(PyTypeError::new_err(format!("progress is {progress}, which cannot be called")));
    }
    let told = Arc::new(Told::default());
    let heard = Heard { told: &told, progress: progress.map(|callback| callback.clone().unbind()) };
    let (heard, of_work) = (&heard, Arc::clone(&told));
    let (found, raised) = py.detach(move || {
        std::thread::scope(|threads| {
            let (ended, end) = channel::<()>();
            let working = Builder::new().spawn_scoped(threads, move || {
                let found = work(of_work);
                // The waiting thread may have gone only by a panic of its own.
                let _ = ended.send(());
                found
            });
            let working = match working {
                Ok(working) => working,
                Err(error) => return (Err(no_thread(&error)), None),
            };
            let mut raised = None;
            while let Err(RecvTimeoutError::Timeout) = end.recv_timeout(EVERY) {
                // Once it is to end, only another Ctrl-C is heard: a listener that raises again is no new wish.
                let ends = raised.is_some();
                let look = |py: Python<'_>| if ends { py.check_signals() } else { heard.look(py) };
                if let Err(error) = Python::attach(look).and_then(|()| going_on(ends)) {
                    heard.told.interrupt();
                    stop();
                    raised.get_or_insert(error);
                }
            }
            let found = working.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            (found, raised)
        })
    });
    let raised = raised.or_else(|| heard.hand_on(py).err());
    match (found, raised) {
        (found, Some(error)) => Err(interrupted(py, found, error)),
        (found, None) => found.map_err(|refusal| exception(py, refusal)),
    }
}

/// An exception if the interpreter is about to end, unless the work `ends` already.
pub(crate) fn going_on(ends: bool) -> PyResult<()> {
    if Call::is_to_end() && !ends { Err(PyKeyboardInterrupt::new_err("the program ends")) } else { Ok(()) }
}

/// The threads of the matcher exist in the process that began them, and not in a fork of it, which
/// would wait for them for ever.
fn refuse_forked() -> Result<(), Refusal> {
    static BEGAN_IN: OnceLock<u32> = OnceLock::new();
    let process = std::process::id();
    if *BEGAN_IN.get_or_init(|| process) == process {
        return Ok(());
    }
    let why = "this process was forked from one that has used epirig, whose threads it lacks; begin processes by \
               multiprocessing's method \"spawn\"";
    Err(Refusal::new(Blame::System, why))
}

/// Why there is no thread for work.
pub(crate) fn no_thread(error: &std::io::Error) -> Refusal {
    Refusal::new(Blame::System, format!("the system allows no more threads: {error}; end other programs"))
}

/// What is raised after `error` has ended work: for Ctrl-C what the work says of its end, as an interruption.
pub(crate) fn interrupted<T>(py: Python<'_>, found: Result<T, Refusal>, error: PyErr) -> PyErr {
    if !error.is_instance_of::<PyKeyboardInterrupt>(py) {
        return error;
    }
    let Refusal { exit_code, kind, .. } = Refusal::of(Cancelled);
    let refusal = match found {
        Ok(_) => Refusal::of(Cancelled),
        Err(refusal) if refusal.kind == "resumable" => refusal,
        Err(refusal) => Refusal { exit_code, kind, ..refusal },
    };
    let ended = interruption(py, refusal);
    ended.set_cause(py, Some(error));
    ended
}

/// What the waiting thread hears, and whom it tells.
struct Heard<'a> {
    told: &'a Told,
    progress: Option<Py<PyAny>>,
}

impl Heard<'_> {
    fn look(&self, py: Python<'_>) -> PyResult<()> {
        py.check_signals()?;
        self.hand_on(py)
    }

    fn hand_on(&self, py: Python<'_>) -> PyResult<()> {
        self.told.hand_on_notes(py)?;
        let (what, total) = {
            let latest = self.told.latest();
            (latest.what.clone(), latest.total)
        };
        if let Some(progress) = self.progress.as_ref().filter(|_| !what.is_empty()) {
            progress.call1(py, (what, self.told.done.load(Ordering::Relaxed).min(total), total))?;
        }
        Ok(())
    }
}
