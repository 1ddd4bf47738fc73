//! Progress of long work, as the task of the state.

use std::sync::Arc;

use crate::panel::shared::Shared;
use epirig_core::progress::Progress;

/// Shows progress as the task in hand, and notes in the log.
pub(in crate::panel) struct Notes<'a>(pub(in crate::panel) &'a Arc<Shared>);

impl Progress for Notes<'_> {
    fn begin(&self, what: &str, total: u64) {
        self.0.task(|task| (task.step, task.done, task.of) = (Some(what.to_owned()), Some(0), Some(total)));
    }

    fn advance(&self, count: u64) {
        // The page is told a hundred times at most: rows are counted, and there are thousands.
        let told = self.0.look(|state| {
            let task = state.task.as_ref()?;
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
