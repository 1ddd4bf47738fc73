//! What goes wrong in the middle of a scan.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use epirig_devices::camera::SimFault::*;
use epirig_devices::camera::{SimFault, SimStamps, SimView};
use epirig_devices::stage::SimStageConfig;

use super::faulty_rig::{Mischief, When};

/// Frames of a scan, ...
pub const FRAMES: usize = 8;
/// ... and the one in which things go wrong.
pub const FRAME: usize = 4;

/// Something that goes wrong with a stage behind a line.
pub struct StageFault {
    pub words: &'static str,
    /// With the number of the move to frame 4 for `N`.
    pub script: &'static str,
    /// How long the scan waits for the stage; a longer absence is for good.
    pub wait_s: f64,
    pub at_frame: AtFrame,
    /// Whether a stage that only counts its steps cannot know of it.
    pub is_hidden: bool,
}

/// What happens besides, before the move to frame 4.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum AtFrame {
    Nothing,
    SwitchesBreak,
    BytesAreLost,
    BytesAreLostDoubledAndFlipped,
    CameraGoesToo,
}

/// Long enough for all devices that reconnect; it takes no real time ...
pub const PATIENT_S: f64 = 60.0;
/// ... and short for what does not.
const IMPATIENT_S: f64 = 0.1;

const fn fault(words: &'static str, script: &'static str) -> StageFault {
    StageFault { words, script, wait_s: PATIENT_S, at_frame: AtFrame::Nothing, is_hidden: false }
}

pub const STAGE_FAULTS: &[StageFault] = &[
    fault("the stage restarts in the move", "reset@N+0.2s"),
    fault("the cable is pulled in the move, and back after 1 s", "hang-up@N+0.2s/1s"),
    StageFault { wait_s: IMPATIENT_S, ..fault("the cable is pulled for good", "hang-up@N+0.2s/1000000s") },
    fault("the power is cut in the move, and back after 3 s", "reset@N+0.2s,hang-up@N+0.2s/3s"),
    fault("the power is cut in the move, and its settings have changed", "settings@N+0.2s"),
    StageFault {
        wait_s: IMPATIENT_S,
        ..fault("the power is cut for good", "reset@N+0.2s,hang-up@N+0.2s/1000000s")
    },
    fault("its answers are lost for 2 s after the move", "mute@N/2s"),
    fault("its answers are lost for 10 s after the move", "mute@N/10s"),
    fault("a limit switch closes in the move, for 1 s", "limit@N+0.2s"),
    fault("the carriage is stuck from the move on", "no-motion@N"),
    StageFault { is_hidden: true, ..fault("the carriage is stuck from the first move on", "no-motion@1") },
    StageFault {
        at_frame: AtFrame::SwitchesBreak,
        ..fault("the stage restarts, and its home switch is broken", "reset@N+0.2s")
    },
    StageFault { at_frame: AtFrame::BytesAreLost, ..fault("for 10 s one byte in a hundred is lost", "") },
    StageFault {
        at_frame: AtFrame::BytesAreLostDoubledAndFlipped,
        ..fault("for 10 s one byte in a hundred each is lost, doubled, flipped", "")
    },
    StageFault {
        at_frame: AtFrame::CameraGoesToo,
        ..fault("the stage restarts, and the camera goes before it is homed", "reset@N+0.2s")
    },
];

/// What goes wrong with a camera, or with a stage that does not notice.
pub struct Mechanics {
    pub words: &'static str,
    pub stage: SimStageConfig,
    pub mischief: Vec<(When, Mischief)>,
}

fn camera(words: &'static str, mischief: Vec<(When, Mischief)>) -> Mechanics {
    Mechanics { words, stage: SimStageConfig::ideal(200.0), mischief }
}

/// Before the frame in question is taken.
fn at(faults: &[SimFault]) -> Vec<(When, Mischief)> {
    faults.iter().map(|fault| (When::Grab(FRAME), Mischief::Fault(*fault))).collect()
}

/// Before each frame from there on.
fn always(fault: SimFault) -> Vec<(When, Mischief)> {
    (FRAME..2 * FRAMES).map(|grab| (When::Grab(grab), Mischief::Fault(fault))).collect()
}

/// Every fault of a camera. What shows at a start only is made to by a stream that breaks down.
pub fn camera_faults() -> Vec<Mechanics> {
    let gain = |gain| vec![(When::Grab(FRAME), Mischief::Gain(gain))];
    let back = (When::Start(1), Mischief::Fault(NoSignal(false)));
    let stamps = |stamps| at(&[Stamps(stamps), FatalError]);
    vec![
        camera("a buffer is flagged damaged", at(&[BufferError])),
        camera("half of a frame's bytes come", at(&[ShortBuffer])),
        camera("a frame's lower half is old, and nothing tells", at(&[TornFrame])),
        camera("a frame is old under a new time stamp", at(&[LateContents])),
        camera("frames are lost in between", at(&[Gap(3)])),
        camera("from then on half of all buffers are dropped", at(&[Dropped(0.5)])),
        camera("the frame count wraps", at(&[SequenceAt(u32::MAX - 1)])),
        camera("from then on frames are not counted at all", at(&[Unnumbered])),
        camera("`VIDIOC_QBUF` fails", at(&[QueueError])),
        camera("the stream breaks down", at(&[FatalError])),
        camera("it breaks down, and `VIDIOC_REQBUFS` fails", at(&[FatalError, RequestError])),
        camera("it breaks down, and `VIDIOC_STREAMON` fails", at(&[FatalError, StartError])),
        camera("it breaks down at each frame from then on", always(FatalError)),
        camera("no frame comes for a second", at(&[Silence(25)])),
        camera("no frame comes for 15 s", at(&[Silence(375)])),
        camera("no frame comes any more", at(&[Silence(100_000)])),
        camera(
            "the signal goes, and is back at the next start",
            [at(&[NoSignal(true)]), vec![back]].concat(),
        ),
        camera("the signal goes for good", at(&[NoSignal(true)])),
        camera("the camera is disconnected, and comes back", at(&[Disconnect { failing: 3 }])),
        camera("the camera is disconnected for good", at(&[Disconnect { failing: 1_000_000 }])),
        camera("another camera comes back in its place", at(&[Replaced, Disconnect { failing: 0 }])),
        camera("another program changes a control", at(&[GainDrifts])),
        camera("the same, and settings take six frames to show", at(&[LateControls(6), GainDrifts])),
        camera("another program changes a control at each frame from then on", always(GainDrifts)),
        camera("it gets too bright", gain(100)),
        camera("the lamp goes out", vec![(When::Grab(FRAME), Mischief::View(SimView::Dark))]),
        camera("after a restart: time stamps of the end of the frame", stamps(SimStamps::EndOfFrame)),
        camera("after a restart: the same, said to be of the start", stamps(SimStamps::Mislabelled)),
        camera("after a restart: time stamps of zero", stamps(SimStamps::Zero)),
        camera("after a restart: time stamps far ahead", stamps(SimStamps::Ahead)),
        camera("after a restart: time stamps of a later clock", stamps(SimStamps::Behind)),
        camera("after a restart: time stamps that run backwards", stamps(SimStamps::Backwards)),
    ]
}

/// What a stage does that it does not notice.
pub fn mechanics() -> Vec<Mechanics> {
    // A seed for which one of the moves to the stops slips: the one to the frame in question.
    let slips =
        |slip_um| SimStageConfig { slip_probability: 0.2, slip_um, seed: 38, ..SimStageConfig::ideal(200.0) };
    let play = SimStageConfig { backlash_um: 100.0, ..SimStageConfig::ideal(200.0) };
    let camera_goes = (When::Grab(FRAME + 2), Mischief::Fault(Disconnect { failing: 3 }));
    vec![
        Mechanics { stage: play, ..camera("a play of 0.1 mm between screw and nut", vec![]) },
        Mechanics { stage: slips(1000.0), ..camera("1 mm of steps is lost unnoticed in a move", vec![]) },
        Mechanics { stage: slips(100.0), ..camera("0.1 mm of steps is lost unnoticed in a move", vec![]) },
        Mechanics {
            stage: slips(100.0),
            ..camera("the same, and two frames later the camera is disconnected", vec![camera_goes])
        },
    ]
}
