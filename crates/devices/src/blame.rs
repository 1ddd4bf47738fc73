//! Who must act on a fault.

/// Who must act on a fault. The exit code follows from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blame {
    /// The request is impossible; it must be changed.
    Request,
    /// The operating system: files, disk, memory.
    System,
    /// The device does not exist, or cannot be opened.
    NoDevice,
    /// The device, its cable or its power.
    Device,
    /// Recorded data that cannot be used.
    Data,
    /// The operator stopped it.
    Interruption,
}
