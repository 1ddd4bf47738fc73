//! Threads for what may take its time. Each kind of work has threads of its own, so that no kind waits for
//! another.

use std::sync::Arc;

use tokio::sync::{AcquireError, OwnedSemaphorePermit, Semaphore};

use super::refusal::{Refusal, RefusalKind};

/// A kind of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Work {
    /// Answers to requests.
    Answer,
    /// Orders that must not wait, such as a stop.
    Urgent,
    /// What feeds do.
    Feed,
}

impl Work {
    /// How many of this kind are worked on at once; others wait. Urgent orders are short and come from a
    /// person's hand: more than these at once means that a device does not answer.
    const fn at_once(self) -> usize {
        match self {
            Self::Answer | Self::Feed => 4,
            Self::Urgent => 16,
        }
    }
}

/// Threads that are needed if there is all the work that may be done at once.
pub(super) const MOST: usize = Work::Answer.at_once() + Work::Urgent.at_once() + Work::Feed.at_once();

/// Who waits for a thread. Must be used inside a runtime with [`MOST`] blocking threads.
pub(super) struct Threads([Arc<Semaphore>; 3]);

impl Threads {
    pub(super) fn new() -> Self {
        Self([Work::Answer, Work::Urgent, Work::Feed].map(|work| Arc::new(Semaphore::new(work.at_once()))))
    }

    /// Waits for a thread.
    pub(super) async fn turn(&self, work: Work) -> Turn {
        Turn { _held: self.0[work as usize].clone().acquire_owned().await }
    }
}

/// The right to a thread, for one job.
pub(super) struct Turn {
    /// No error in fact, as these semaphores are never closed.
    _held: Result<OwnedSemaphorePermit, AcquireError>,
}

impl Turn {
    /// Does the job, to its end even if nobody waits for it any more.
    ///
    /// # Errors
    /// [`Refusal`] if the job panics.
    pub(super) async fn run<T: Send + 'static>(
        self,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Refusal> {
        // The thread gives the turn back, not who waits for it: a client that hangs up leaves the thread busy.
        let done = tokio::task::spawn_blocking(move || {
            let _turn = self;
            job()
        });
        done.await.map_err(|error| {
            let message = format!("the answer broke off; this is a fault of epirig: {error}");
            Refusal::new(RefusalKind::Failed, message)
        })
    }
}
