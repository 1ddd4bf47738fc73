//! A rig moved by hand, and the frames of a scan as they are taken.

use std::ffi::OsString;
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
use crate::work::{EVERY, Told, done_with, interrupted, no_thread};

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The connected stage and camera of a rig.
#[pyclass(frozen)]
pub(crate) struct Connection {
    /// `None` once it is closed.
    bench: Mutex<Option<Bench>>,
    switch: StopSwitch,
}

/// Position in mm, whether the stage moves, and whether it is at a limit switch.
type State = (Option<f64>, bool, bool);

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
        Ok(Self { bench: Mutex::new(Some(bench)), switch })
    }

    /// Homes the stage.
    fn home(&self, py: Python<'_>) -> PyResult<()> {
        self.by_hand(py, |bench| bench.stage().home().map_err(Refusal::of))
    }

    /// Moves to a position in mm from home, and returns when the stage is at rest there.
    fn move_to(&self, py: Python<'_>, position_mm: f64) -> PyResult<()> {
        self.by_hand(py, |bench| bench.stage().move_to(position_mm).map_err(Refusal::of))
    }

    /// Stops the stage, also while another thread moves it.
    fn stop(&self, py: Python<'_>) -> PyResult<()> {
        self.switch.press(Urgency::Soon);
        self.by_hand(py, |bench| bench.stage().stop().map_err(Refusal::of))
    }

    /// Position in mm, whether the stage moves, and whether it is at a limit switch.
    fn state(&self, py: Python<'_>) -> PyResult<State> {
        self.by_hand(py, |bench| {
            let state = bench.stage().state().map_err(Refusal::of)?;
            Ok((state.position_mm, state.moving, state.at_limit))
        })
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
}

/// A scan whose frames are taken one after the other. When it is dropped, it ends after the frame in hand.
#[pyclass(frozen)]
pub(crate) struct Scan {
    frames: Mutex<Receiver<Taken>>,
    told: Arc<Told>,
    working: Mutex<Option<JoinHandle<Result<(), Refusal>>>>,
}

#[pymethods]
impl Scan {
    /// Begins `capture` or `resume` with these words.
    #[new]
    fn begin(py: Python<'_>, words: Vec<OsString>) -> PyResult<Self> {
        let (sender, frames) = channel();
        let told = Arc::<Told>::default();
        let heard = Arc::new(Heard { told: Arc::clone(&told), frames: Mutex::new(sender) });
        let working = Builder::new().spawn(move || embedded::call(words, heard).map(|_| ()));
        let working = working.map_err(|error| exception(py, no_thread(&error)))?;
        Ok(Self { frames: Mutex::new(frames), told, working: Mutex::new(Some(working)) })
    }

    /// The next good frame: its index, the array of (rows, columns), and its facts as text (JSON). `None` at the end.
    #[allow(clippy::type_complexity, reason = "a tuple for Python")]
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Option<(usize, Bound<'py, PyAny>, String)>> {
        let mut raised = None;
        loop {
            match py.detach(|| locked(&self.frames).recv_timeout(EVERY)) {
                Ok((index, frame, facts)) if raised.is_none() => {
                    return Ok(Some((index, array(py, &frame)?, facts)));
                }
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(error) = py.check_signals() {
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
