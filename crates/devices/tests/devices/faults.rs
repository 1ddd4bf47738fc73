//! What a rig does when its camera fails: the same table for a real driver and for the simulated one.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::time::{Duration, Instant};

use epirig_core::frame::Frame;
use epirig_devices::camera::{Camera, CameraError, CameraSettings, Moment, TakenFrame};
use epirig_devices::stage::Stage;

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    DroppedBuffers,
    ErrorFlag,
    QueueError,
    RequestError,
    StartError,
    FatalError,
    Disconnect,
    UnbindAndBind,
    SequenceWrap,
    NoSignal,
    NoLock,
    TimingsOutOfRange,
    OtherTimings,
    InputSetOtherwise,
    StampsOfTheStart,
    StampsOfTheEnd,
    StampsOfAnotherClock,
    StampsOfZero,
    StampsRunningBack,
    StampsOfALaterStart,
    Unnumbered,
    Gap,
    ShortBuffer,
    TornFrame,
    LateContents,
    LateControls,
    ControlChanged,
    Silence,
    LongSilence,
    AnotherSocket,
    AnotherCamera,
    FrameMarkMissing,
    FrameMarkInside,
    LostPacket,
    CompressedShort,
    Halt,
    Halts,
    ControlStalled,
}

/// Every fault, in words, in the order of the table.
pub const FAULTS: &[(Fault, &str)] = &[
    (Fault::DroppedBuffers, "half of all buffers are dropped"),
    (Fault::ErrorFlag, "a buffer is flagged damaged"),
    (Fault::ShortBuffer, "half of a frame's bytes come"),
    (Fault::TornFrame, "a frame's lower half is old, and nothing tells"),
    (Fault::LateContents, "a frame is old under a new time stamp"),
    (Fault::CompressedShort, "a part of a compressed frame is missing, and nothing tells"),
    (Fault::LostPacket, "a packet is lost on the USB bus"),
    (Fault::FrameMarkMissing, "the mark between two frames is missing"),
    (Fault::FrameMarkInside, "a mark comes in the middle of a frame"),
    (Fault::Gap, "frames are lost in between"),
    (Fault::SequenceWrap, "the frame count wraps"),
    (Fault::Unnumbered, "frames are not counted at all"),
    (Fault::QueueError, "VIDIOC_QBUF fails"),
    (Fault::RequestError, "VIDIOC_REQBUFS fails"),
    (Fault::StartError, "VIDIOC_STREAMON fails"),
    (Fault::FatalError, "fatal error of the stream (EIO)"),
    (Fault::Halt, "the USB endpoint halts once"),
    (Fault::Halts, "it halts five times, after which the driver is silent"),
    (Fault::Silence, "no frame comes for a second"),
    (Fault::LongSilence, "no frame comes any more"),
    (Fault::Disconnect, "the camera is disconnected, and comes back"),
    (Fault::UnbindAndBind, "the driver is unbound and bound again"),
    (Fault::AnotherSocket, "the camera comes back in another socket"),
    (Fault::AnotherCamera, "another camera comes back in its place"),
    (Fault::NoSignal, "no signal"),
    (Fault::NoLock, "no lock on the signal"),
    (Fault::TimingsOutOfRange, "timings that cannot be received"),
    (Fault::OtherTimings, "a signal of other timings"),
    (Fault::InputSetOtherwise, "the input is set for other timings than the source"),
    (Fault::StampsOfTheStart, "time stamps of the start of the exposure"),
    (Fault::StampsOfTheEnd, "time stamps of the end of the frame"),
    (Fault::StampsOfAnotherClock, "time stamps far ahead"),
    (Fault::StampsOfZero, "time stamps of zero"),
    (Fault::StampsRunningBack, "time stamps that run backwards"),
    (Fault::StampsOfALaterStart, "time stamps of a clock that began later"),
    (Fault::LateControls, "settings take six frames to show"),
    (Fault::ControlChanged, "another program changes a control"),
    (Fault::ControlStalled, "the camera does not answer for a control any more"),
];

/// Faults of a single frame, or of a few in a row.
const SINGLE: [Fault; 11] = [
    Fault::ErrorFlag,
    Fault::ShortBuffer,
    Fault::TornFrame,
    Fault::LateContents,
    Fault::Gap,
    Fault::CompressedShort,
    Fault::LostPacket,
    Fault::FrameMarkMissing,
    Fault::FrameMarkInside,
    Fault::Halt,
    Fault::Halts,
];

/// A rig that can be made to fail.
pub trait Bench {
    fn stage(&mut self) -> &mut dyn Stage;
    fn camera(&mut self) -> &mut dyn Camera;
    fn settings(&self) -> CameraSettings;
    /// What the camera must see with the stage at a position.
    fn truth(&mut self, position_mm: f64) -> Frame;
    /// Whether a frame is what the camera showed with the stage at a position.
    fn shows(&mut self, frame: &Frame, position_mm: f64) -> bool {
        *frame == self.truth(position_mm)
    }
    /// Whether the fault is one of this rig's, if that is known before it is tried.
    fn has(&self, _fault: Fault) -> bool {
        true
    }
    /// Makes it fail; `false` if this rig cannot.
    fn inject(&mut self, fault: Fault) -> bool;
    /// Brings a camera back that has been taken away, as far as a person would.
    fn bring_back(&mut self, fault: Fault);
    /// Makes everything as it was.
    fn mend(&mut self, fault: Fault);
}

/// Time that a guest under load may take beyond what is allowed: for the calls before and after the wait.
const SLACK: Duration = Duration::from_secs(5);

/// How the program comes through a fault, in words; `None` if the rig cannot have it.
///
/// # Panics
/// If a wrong frame is delivered, a wait is longer than its patience, or the rig does not work afterwards.
pub fn outcome(bench: &mut dyn Bench, fault: Fault, step: usize) -> Option<String> {
    if !bench.has(fault) {
        return None;
    }
    let settings = bench.settings();
    if fresh_start(bench, &settings).is_err() {
        // A camera that was taken away in the fault before.
        bench.camera().reconnect(Duration::from_secs(20)).unwrap();
    }
    // Few places, whose pictures are soon known.
    let position_mm = 10.0 + 0.8 * (step % 3) as f64;
    bench.stage().move_to(position_mm).unwrap();
    let allowed = settings.patience + SLACK;
    let before_mm = position_mm;
    let position_mm = position_mm + 0.4;
    assert!(bench.truth(before_mm) != bench.truth(position_mm), "the rig cannot tell a stale frame");
    // What waits in the driver's queue now shows the place before.
    bench.stage().move_to(position_mm).unwrap();
    // Faults of a single frame are to meet one that is new enough to count.
    let moment = SINGLE.contains(&fault).then(|| look(bench).unwrap().facts.requested);
    if !bench.inject(fault) {
        return None;
    }
    let started = Instant::now();
    let mut words = String::new();
    let mut result = grab(bench, fault, &settings, moment, position_mm);
    assert!(started.elapsed() < allowed, "{fault:?}: it took {:.1} s", started.elapsed().as_secs_f64());
    if matches!(result, Err(CameraError::Gone { .. })) {
        bench.bring_back(fault);
        let patience = Duration::from_secs(15);
        let waited = Instant::now();
        result = bench.camera().reconnect(patience).and_then(|()| look(bench));
        let took = waited.elapsed();
        assert!(took < patience + allowed, "{fault:?}: it took {:.1} s", took.as_secs_f64());
        words = "gone is noticed, and after reconnecting: ".to_owned();
    }
    words += &match result {
        Ok(taken) => {
            assert!(bench.shows(&taken.frame, position_mm), "{fault:?}: A WRONG FRAME");
            assert!(taken.facts.exposure_start >= taken.facts.requested, "{fault:?}: {:?}", taken.facts);
            "the right frame".to_owned()
        }
        Err(error) => format!("error `{}`", kind(&error)),
    };
    bench.mend(fault);
    if fresh_start(bench, &settings).is_err() {
        bench.camera().reconnect(Duration::from_secs(20)).unwrap();
    }
    let after = look(bench).unwrap().frame;
    assert!(bench.shows(&after, position_mm), "{fault:?}: A WRONG FRAME afterwards");
    Some(words)
}

fn fresh_start(bench: &mut dyn Bench, settings: &CameraSettings) -> Result<(), CameraError> {
    bench.camera().configure(settings)?;
    bench.camera().start()
}

fn look(bench: &mut dyn Bench) -> Result<TakenFrame, CameraError> {
    let moment = bench.camera().now();
    bench.camera().grab_after(moment)
}

/// What shows itself at the start of a stream is provoked by a start; what is rare, by many frames.
fn grab(
    bench: &mut dyn Bench,
    fault: Fault,
    settings: &CameraSettings,
    moment: Option<Moment>,
    position_mm: f64,
) -> Result<TakenFrame, CameraError> {
    let at_start = [
        Fault::RequestError,
        Fault::StartError,
        Fault::SequenceWrap,
        Fault::InputSetOtherwise,
        Fault::StampsOfTheStart,
        Fault::StampsOfTheEnd,
        Fault::StampsOfAnotherClock,
        Fault::StampsOfZero,
        Fault::StampsRunningBack,
        Fault::StampsOfALaterStart,
        Fault::Unnumbered,
        Fault::LateControls,
    ];
    if at_start.contains(&fault) {
        bench.camera().stop()?;
        fresh_start(bench, settings)?;
    }
    let moment = moment.unwrap_or_else(|| bench.camera().now());
    let mut taken = bench.camera().grab_after(moment)?;
    let many = match fault {
        // The count begins 128 before its end.
        Fault::SequenceWrap => 160,
        // That none of them is dropped has a chance of one in a million.
        Fault::DroppedBuffers => 20,
        // Those that wait in the driver's queue come before the damaged one.
        _ if SINGLE.contains(&fault) => 8,
        _ => 0,
    };
    let first = taken.facts.sequence;
    let mut missed = 0;
    for _ in 0..many {
        let moment = taken.facts.requested;
        let next = bench.camera().grab_after(moment)?;
        let shows = next.frame == taken.frame || bench.shows(&next.frame, position_mm);
        assert!(shows, "{fault:?}: A WRONG FRAME");
        missed += next.facts.missed;
        taken = next;
    }
    match fault {
        Fault::SequenceWrap => assert!(taken.facts.sequence < first, "the count did not wrap"),
        Fault::DroppedBuffers => assert!(missed > 0, "no buffer was dropped"),
        _ => {}
    }
    Ok(taken)
}

fn kind(error: &CameraError) -> &'static str {
    match error {
        CameraError::Timeout { .. } => "Timeout",
        CameraError::NoSignal { .. } => "NoSignal",
        CameraError::AnotherCamera { .. } => "AnotherCamera",
        CameraError::ReconnectTimeout { .. } => "ReconnectTimeout",
        CameraError::Unsteady { .. } => "Unsteady",
        CameraError::Substituted { .. } => "Substituted",
        CameraError::Stream { .. } => "Stream",
        CameraError::Gone { .. } => "Gone",
        CameraError::ControlChanged { .. } => "ControlChanged",
        CameraError::NotOffered { .. } => "NotOffered",
        CameraError::System { .. } => "System",
        CameraError::ControlUnanswered { .. } => "ControlUnanswered",
        other => panic!("an error that no fault should give: {other:?}"),
    }
}
