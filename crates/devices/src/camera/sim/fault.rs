//! What can go wrong with a simulated camera.

/// A fault of a simulated camera. Those of a single frame happen to the next one that is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SimFault {
    /// The next frame is damaged, and flagged so.
    BufferError,
    /// Half of the next frame's bytes come.
    ShortBuffer,
    /// The lower half of the next frame shows what was there before the latest move; nothing tells.
    TornFrame,
    /// The next frame shows what was there before the latest move; its time stamp is new.
    LateContents,
    /// So many frames are lost, and counted.
    Gap(u32),
    /// From now on this share of all frames is lost.
    Dropped(f64),
    /// The driver refuses the next buffer that is given back.
    QueueError,
    /// The driver refuses buffers at the next start.
    RequestError,
    /// The driver refuses the next start.
    StartError,
    /// The stream is dead until it is stopped and started.
    FatalError,
    /// The camera goes; it is back at the given attempt to open it, if there are so many.
    Disconnect {
        /// Attempts that fail.
        failing: u32,
    },
    /// When it is opened next, another camera is in its place.
    Replaced,
    /// No frame comes for so many frame times.
    Silence(u32),
    /// The signal goes, or comes back.
    NoSignal(bool),
    /// Somebody else changes the gain.
    GainDrifts,
    /// From now on control changes take so many frames until they show.
    LateControls(u32),
    /// What its time stamps are from the next start on.
    Stamps(SimStamps),
    /// The number of the next frame.
    SequenceAt(u32),
    /// The driver stops numbering its frames: all are 0.
    Unnumbered,
}

/// What the time stamps of a simulated camera are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SimStamps {
    /// The start of the exposure.
    #[default]
    StartOfExposure,
    /// The end of the readout.
    EndOfFrame,
    /// The end of the readout, said to be the start of the exposure.
    Mislabelled,
    /// Zero.
    Zero,
    /// Of a clock that is years ahead.
    Ahead,
    /// Of a clock that started when the camera did.
    Behind,
    /// Running backwards.
    Backwards,
}
