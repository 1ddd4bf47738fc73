//! Progress of long work, as the task of the state.

use std::sync::Arc;

use crate::panel::shared::SharedState;
use epirig_core::progress::Progress;

/// Shows progress as the task in hand, and notes in the log. A measurement that is to stop ends here: work reports
/// its progress from all its threads, and unwinding brings all of them to an end.
pub(in crate::panel) struct Notes<'a>(pub(in crate::panel) &'a Arc<SharedState>);

/// What unwinds when a measurement is to stop.
struct Stopped;

impl Notes<'_> {
    fn check(&self) {
        if self.0.look(|state| state.rig.task.as_ref().is_some_and(|task| task.stops)) {
            // Unlike a panic this is no fault, and is not told as one.
            std::panic::resume_unwind(Box::new(Stopped));
        }
    }
}

impl Progress for Notes<'_> {
    fn begin(&self, what: &str, total: u64) {
        self.check();
        self.0.task(|task| (task.step, task.done, task.of) = (Some(what.to_owned()), Some(0), Some(total)));
    }

    fn advance(&self, count: u64) {
        self.check();
        // The page is told a hundred times at most: rows are counted, and there are thousands.
        let told = self.0.look(|state| {
            let task = state.rig.task.as_ref()?;
            Some((task.done?, task.of?))
        });
        let Some((done, of)) = told else { return };
        let now = done + count;
        let share = |part: u64| 100 * part / of.max(1);
        self.0.count(now, share(now) != share(done));
    }

    fn end(&self) {
        self.0.task(|task| (task.step, task.done, task.of) = (None, None, None));
    }

    fn note(&self, words: &str) {
        self.0.note(words);
    }
}
