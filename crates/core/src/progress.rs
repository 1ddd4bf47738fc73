//! Progress of long-running work, as it is reported to a caller.

use std::sync::atomic::{AtomicBool, Ordering};

use thiserror::Error;

use crate::fault::{Blame, Fault};

/// A listener to work that takes a while. Methods are called from any thread.
pub trait Progress: Sync {
    /// Work named `what` begins and consists of `total` parts.
    fn begin(&self, what: &str, total: u64);
    /// `count` more parts are done.
    fn advance(&self, count: u64);
    /// The work that began last is over.
    fn end(&self);
    /// A sentence that a person should read now.
    fn note(&self, _words: &str) {}
    /// Whether the work shall end early; once it is so, it stays so. It is asked for each row of an image, or for
    /// each frame. Work that ends early fails with an error that says so.
    fn cancelled(&self) -> bool {
        false
    }
}

/// The caller has cancelled the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the work was interrupted")]
pub struct Cancelled;

impl Fault for Cancelled {
    fn blame(&self) -> Blame {
        Blame::Interruption
    }
}

impl dyn Progress + '_ {
    /// For work whose loops end early once it is cancelled, so that what they found means nothing.
    ///
    /// # Errors
    /// [`Cancelled`] if it is.
    pub fn unless_cancelled(&self) -> Result<(), Cancelled> {
        if self.cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

/// The same work, with progress that is not told: a part of it that the listener does not count.
#[derive(Clone, Copy)]
pub struct Uncounted<'a>(pub &'a dyn Progress);

impl Progress for Uncounted<'_> {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _count: u64) {}
    fn end(&self) {}
    fn note(&self, words: &str) {
        self.0.note(words);
    }
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// Work that another thread can end early.
///
/// ```
/// use epirig_core::progress::{Cancel, Progress as _};
///
/// let cancel = Cancel::default();
/// std::thread::scope(|threads| {
///     threads.spawn(|| cancel.cancel());
/// });
/// assert!(cancel.cancelled());
/// ```
#[derive(Debug, Default)]
pub struct Cancel(AtomicBool);

impl Cancel {
    /// Ends the work early.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Progress for Cancel {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _count: u64) {}
    fn end(&self) {}
    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Listens to nothing: for tests and for callers without a terminal.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _count: u64) {}
    fn end(&self) {}
}
