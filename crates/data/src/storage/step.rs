//! Steps of the disk, which no interruption cuts: the end of the program by a signal waits for them.

use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Whether steps may begin, and how many threads are in one.
struct State {
    closed: bool,
    steps: usize,
}

static STATE: Mutex<State> = Mutex::new(State { closed: false, steps: 0 });
static CHANGED: Condvar = Condvar::new();

thread_local! {
    /// Steps of this thread, one within the other.
    static DEPTH: Cell<usize> = const { Cell::new(0) };
}

/// As long as it lives, an interruption does not end the program. Steps may lie within each other.
///
/// A thread that begins a step after an interruption waits until the program has ended.
#[derive(Debug)]
#[must_use = "the step ends when this is dropped"]
pub struct Step {
    /// It counts for its thread.
    thread: PhantomData<*const ()>,
}

impl Step {
    /// Begins a step of this thread.
    pub fn begin() -> Self {
        let depth = DEPTH.get();
        if depth == 0 {
            let open = CHANGED.wait_while(state(), |state| state.closed);
            open.unwrap_or_else(PoisonError::into_inner).steps += 1;
        }
        DEPTH.set(depth + 1);
        Self { thread: PhantomData }
    }
}

impl Drop for Step {
    fn drop(&mut self) {
        let depth = DEPTH.get() - 1;
        DEPTH.set(depth);
        if depth == 0 {
            state().steps -= 1;
            CHANGED.notify_all();
        }
    }
}

/// Lets no further step begin, and waits for those under way. `false`: after `patience` one is still under way.
pub(super) fn close(patience: Duration) -> bool {
    let mut state = state();
    state.closed = true;
    let waited = CHANGED.wait_timeout_while(state, patience, |state| state.steps > 0);
    waited.unwrap_or_else(PoisonError::into_inner).0.steps == 0
}

fn state() -> MutexGuard<'static, State> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}
