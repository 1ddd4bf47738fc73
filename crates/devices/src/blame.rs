//! Whose trouble a fault is.

/// Whose trouble a fault is. The program's exit code follows from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blame {
    /// What was asked for cannot be: another order is needed.
    Request,
    /// The operating system: files, disk, memory.
    System,
    /// There is no such device, or it cannot be opened.
    NoDevice,
    /// The device, its cable or its power.
    Device,
    /// Recorded data that cannot be used.
    Data,
    /// A person stopped it.
    Interruption,
}
