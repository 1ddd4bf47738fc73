//! A rig moved by hand, and the frames of a scan as they are taken.

use std::ffi::OsString;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use epirig::cli::embedded::{self, CalledFrom, Refusal, Switches};
use epirig::rig::Bench;
use epirig_core::fault::Blame;
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Progress;
use epirig_data::sequence::FrameFacts;
use epirig_devices::stage::{StopSwitch, Urgency};
use numpy::{IntoPyArray as _, PyArrayMethods as _};
use pyo3::prelude::*;
use serde_json::json;

use crate::errors::exception;
use crate::work::{Call, EVERY, Told, done_with, going_on, interrupted, no_thread};

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The connected stage and camera of a rig.
#[pyclass(frozen)]
pub(crate) struct Connection {
    /// `None` once it is closed.
    bench: Mutex<Option<Bench>>,
    switch: StopSwitch,
    /// Whether the stage moves: then it answers nobody else.
    moves: AtomicBool,
    /// The position in mm that it reported last.
    seen_mm: Mutex<Option<f64>>,
}

/// Position in mm, and whether the stage moves.
type State = (Option<f64>, bool);

#[pymethods]
impl Connection {
    /// Connects to the rig that these options of `epirig capture` describe.
    #[new]
    fn open(py: Python<'_>, words: Vec<OsString>) -> PyResult<Self> {
        let mut bench = done_with(py, None, &|| {}, |_| {
            let profile = embedded::profile(words)?;
            Bench::open(&profile).map_err(Refusal::of)
        })?;
        let switch = bench.stage().stop_switch();
        Ok(Self {
            bench: Mutex::new(Some(bench)),
            switch,
            moves: AtomicBool::new(false),
            seen_mm: Mutex::new(None),
        })
    }

    /// Homes the stage.
    fn home(&self, py: Python<'_>) -> PyResult<()> {
        self.motion(py, |bench| bench.stage().home().map_err(Refusal::of))
    }

    /// Moves to a position in mm from home, and returns when the stage is at rest there.
    fn move_to(&self, py: Python<'_>, position_mm: f64) -> PyResult<()> {
        self.motion(py, |bench| bench.stage().move_to(position_mm).map_err(Refusal::of))
    }

    /// Stops the stage, also while another thread moves it.
    fn stop(&self, py: Python<'_>) -> PyResult<()> {
        self.switch.press(Urgency::Soon);
        self.by_hand(py, |bench| bench.stage().stop().map_err(Refusal::of))
    }

    /// Position in mm, and whether the stage moves. While another thread moves it: the position before.
    fn state(&self, py: Python<'_>) -> PyResult<State> {
        if self.moves.load(Ordering::SeqCst) {
            return Ok((*locked(&self.seen_mm), true));
        }
        let state = self.by_hand(py, |bench| bench.stage().state().map_err(Refusal::of))?;
        *locked(&self.seen_mm) = state.position_mm;
        Ok((state.position_mm, state.moving))
    }

    /// Travel in mm, and the names of stage and camera.
    fn facts(&self, py: Python<'_>) -> PyResult<(f64, String, String)> {
        self.by_hand(py, |bench| {
            let travel_mm = bench.stage().travel_mm();
            let names = (bench.stage().identity().to_string(), bench.camera().identity().to_string());
            Ok((travel_mm, names.0, names.1))
        })
    }

    /// A frame whose exposure begins after this call: (rows, columns).
    fn grab<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let frame = self.by_hand(py, |bench| bench.grab().map_err(Refusal::of).map(|taken| taken.frame))?;
        array(py, &frame)
    }

    /// Lets go of stage and camera; a stage that moves is stopped.
    fn close(&self, py: Python<'_>) {
        self.switch.press(Urgency::Soon);
        py.detach(|| drop(locked(&self.bench).take()));
        self.switch.release();
    }
}

impl Connection {
    /// The same, while the stage moves.
    fn motion(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Bench) -> Result<(), Refusal> + Send,
    ) -> PyResult<()> {
        self.by_hand(py, |bench| {
            *locked(&self.seen_mm) = bench.stage().state().ok().and_then(|state| state.position_mm);
            self.moves.store(true, Ordering::SeqCst);
            let moved = work(bench);
            self.moves.store(false, Ordering::SeqCst);
            moved
        })
    }

    /// Does `work` on the bench; Ctrl-C stops the stage, the second time at once.
    fn by_hand<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Bench) -> Result<T, Refusal> + Send,
    ) -> PyResult<T> {
        let stop = || {
            let urgency = if self.switch.pressed().is_none() { Urgency::Soon } else { Urgency::AtOnce };
            self.switch.press(urgency);
        };
        done_with(py, None, &stop, |_| {
            let mut bench = locked(&self.bench);
            // What was pressed before is done, or was meant for another motion.
            self.switch.release();
            match &mut *bench {
                Some(bench) => work(bench),
                None => Err(Refusal::new(Blame::Request, "the rig is not connected; connect it first")),
            }
        })
    }
}

/// A frame of a scan that is good, and its facts as text (JSON).
type Taken = (usize, Frame, String);

/// What a scan tells: its progress, and each frame.
struct Heard {
    told: Arc<Told>,
    frames: Mutex<Sender<Taken>>,
    /// A word for each frame that the caller has done with.
    done_with: Mutex<Receiver<()>>,
}

impl Progress for Heard {
    fn begin(&self, what: &str, total: u64) {
        self.told.begin(what, total);
    }
    fn advance(&self, count: u64) {
        self.told.advance(count);
    }
    fn end(&self) {
        self.told.end();
    }
    fn note(&self, words: &str) {
        self.told.note(words);
    }
    fn cancelled(&self) -> bool {
        self.told.cancelled()
    }
}

impl CalledFrom for Heard {
    fn switches(&self) -> Option<&Switches> {
        self.told.switches()
    }

    fn frame(&self, index: usize, frame: &Frame, facts: &FrameFacts) {
        let FrameFacts { commanded_mm, reported_mm, exposure, certificate, .. } = facts;
        let facts = json!({
            "commanded_mm": commanded_mm,
            "reported_mm": reported_mm,
            "exposure": exposure,
            "certificate": certificate,
        });
        // If nobody takes frames any more, the scan is being ended.
        let _ = locked(&self.frames).send((index, frame.clone(), facts.to_string()));
    }

    // Until the caller asks for the next frame.
    fn rests(&self) {
        let done_with = locked(&self.done_with);
        while !self.told.cancelled() && done_with.recv_timeout(EVERY) == Err(RecvTimeoutError::Timeout) {}
    }
}

/// A scan whose frames are taken one after the other. When it is dropped, it ends after the frame in hand.
#[pyclass(frozen)]
pub(crate) struct Scan {
    frames: Mutex<Receiver<Taken>>,
    done_with: Sender<()>,
    /// Whether the caller has a frame.
    gave: AtomicBool,
    told: Arc<Told>,
    working: Mutex<Option<JoinHandle<Result<(), Refusal>>>>,
}

#[pymethods]
impl Scan {
    /// Begins `capture` or `resume` with these words.
    #[new]
    fn begin(py: Python<'_>, words: Vec<OsString>) -> PyResult<Self> {
        let (sender, frames) = channel();
        let (done_with, is_done_with) = channel();
        let told = Arc::<Told>::default();
        let heard = Heard {
            told: Arc::clone(&told),
            frames: Mutex::new(sender),
            done_with: Mutex::new(is_done_with),
        };
        let heard = Arc::new(heard);
        let working = Builder::new().spawn(move || embedded::call(words, heard).map(|_| ()));
        let working = working.map_err(|error| exception(py, no_thread(&error)))?;
        let working = Mutex::new(Some(working));
        Ok(Self { frames: Mutex::new(frames), done_with, gave: AtomicBool::new(false), told, working })
    }

    /// The next good frame: its index, the array of (rows, columns), and its facts as text (JSON). `None` at the end.
    #[allow(clippy::type_complexity, reason = "a tuple for Python")]
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Option<(usize, Bound<'py, PyAny>, String)>> {
        let _call = Call::begin();
        if self.gave.swap(false, Ordering::SeqCst) {
            // A scan that has ended hears no more.
            let _ = self.done_with.send(());
        }
        let mut raised = None;
        loop {
            match py.detach(|| locked(&self.frames).recv_timeout(EVERY)) {
                Ok((index, frame, facts)) if raised.is_none() => {
                    self.told.hand_on_notes(py)?;
                    self.gave.store(true, Ordering::SeqCst);
                    return Ok(Some((index, array(py, &frame)?, facts)));
                }
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout) => {
                    let notes = self.told.hand_on_notes(py);
                    if let Err(error) =
                        py.check_signals().and(notes).and_then(|()| going_on(raised.is_some()))
                    {
                        self.told.interrupt();
                        raised.get_or_insert(error);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => {
                    let ended = py.detach(|| self.ended());
                    return match (ended, raised) {
                        (ended, Some(error)) => Err(interrupted(py, ended, error)),
                        (Err(refusal), None) => Err(exception(py, refusal)),
                        (Ok(()), None) => Ok(None),
                    };
                }
            }
        }
    }

    /// Does what Ctrl-C does: the first time the scan ends after the frame in hand, then the stage is stopped.
    fn interrupt(&self) {
        self.told.interrupt();
    }

    /// Ends the scan after the frame in hand.
    fn close(&self, py: Python<'_>) {
        py.detach(|| self.end());
    }
}

impl Scan {
    /// How the scan ended; once it has.
    fn ended(&self) -> Result<(), Refusal> {
        let working = locked(&self.working).take();
        working
            .map_or(Ok(()), |working| working.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    }

    fn end(&self) {
        if locked(&self.working).as_ref().is_some_and(|working| !working.is_finished()) {
            self.told.interrupt();
        }
        // It can be resumed, as the caller wished.
        let _ = self.ended();
    }
}

impl Drop for Scan {
    fn drop(&mut self) {
        self.end();
    }
}

/// A frame as an array of (rows, columns).
fn array<'py>(py: Python<'py>, frame: &Frame) -> PyResult<Bound<'py, PyAny>> {
    let size = [frame.rows(), frame.columns()];
    Ok(match frame.samples() {
        Samples::U8(samples) => samples.clone().into_pyarray(py).reshape(size)?.into_any(),
        Samples::U16(samples) => samples.clone().into_pyarray(py).reshape(size)?.into_any(),
    })
}
