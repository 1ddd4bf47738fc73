//! Faults of a simulated camera.

/// A fault of a simulated camera. Faults of a single frame affect the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SimFault {
    /// The next frame is damaged, and flagged so.
    BufferError,
    /// Only half of the next frame's bytes arrive.
    ShortBuffer,
    /// The lower half of the next frame shows the view before the latest move, without any flag.
    TornFrame,
    /// The next frame shows the view before the latest move, with a new time stamp.
    LateContents,
    /// This number of frames is lost, and counted.
    Gap(u32),
    /// From now on this share of all frames is lost.
    Dropped(f64),
    /// The driver refuses the next buffer that is returned.
    QueueError,
    /// The driver refuses buffers at the next start.
    RequestError,
    /// The driver refuses the next start.
    StartError,
    /// The stream fails until it is stopped and started.
    FatalError,
    /// The camera disconnects. The given number of attempts to open it fail.
    Disconnect {
        /// Number of failing attempts.
        failing: u32,
    },
    /// Another camera is in its place when it is opened again.
    Replaced,
    /// No frame arrives for this number of frame times.
    Silence(u32),
    /// The USB endpoint halts: all free buffers come back empty and flagged, numbered and stamped zero.
    Halt,
    /// The driver is silent until its stream is stopped and started.
    Unheard,
    /// The signal is lost, or returns.
    NoSignal(bool),
    /// Another program changes the gain.
    GainDrifts,
    /// From now on exposure and gain are taken, and change nothing.
    Deaf,
    /// From now on the exposure is rounded to multiples of this number, without a word.
    CoarseExposure(i64),
    /// From now on control changes take this number of frames to take effect.
    LateControls(u32),
    /// Time stamps from the next start on.
    Stamps(SimStamps),
    /// Sets the number of the next frame.
    SequenceAt(u32),
    /// The driver stops counting frames: all numbers are 0.
    Unnumbered,
}

/// Time stamps of a simulated camera.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SimStamps {
    /// The start of the exposure.
    #[default]
    StartOfExposure,
    /// The end of the readout.
    EndOfFrame,
    /// The end of the readout, labelled as the start of the exposure.
    Mislabelled,
    /// Zero.
    Zero,
    /// From a clock that is years ahead.
    Ahead,
    /// From a clock that started with the camera.
    Behind,
    /// Running backwards.
    Backwards,
}
