//! Why something that was asked for is not given.

/// The kind of a refusal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RefusalKind {
    /// What is asked for makes no sense.
    Wrong,
    /// The token is missing.
    NoToken,
    /// More was sent than is read.
    TooLarge,
    /// Nobody may ask this way.
    Forbidden,
    /// There is no such thing.
    NotFound,
    /// What it is about has changed since the client last asked.
    Outdated,
    /// Not now: come back in a moment.
    Busy,
    /// It was tried and failed.
    Failed,
}

/// A request that is not answered, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The kind.
    pub kind: RefusalKind,
    /// What happened, where, and what to do, for a person.
    pub message: String,
}

impl Refusal {
    /// A refusal.
    pub fn new(kind: RefusalKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }

    /// Nothing stands at `path`.
    pub fn unknown(path: &[&str]) -> Self {
        Self::new(RefusalKind::NotFound, format!("there is nothing at /api/{}", path.join("/")))
    }
}
