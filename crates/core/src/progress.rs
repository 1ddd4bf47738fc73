//! Progress of long-running work, as it is reported to a caller.

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
}

/// Listens to nothing: for tests and for callers without a terminal.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _count: u64) {}
    fn end(&self) {}
}
