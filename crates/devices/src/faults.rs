//! Faults of a simulated rig at frames of its scan.

use std::str::FromStr;

use crate::camera::{SimDevice, SimFault};
use crate::stage::simulator::{StageFault, amount, names};

/// How a fault of the camera is written.
struct Form {
    name: &'static str,
    fault: CameraFault,
    /// What happens, for a person.
    what: &'static str,
}

enum CameraFault {
    At(SimFault),
    /// For this number of frames.
    Lasting(fn(u32) -> SimFault),
}
use CameraFault::{At, Lasting};

const FORMS: [Form; 10] = [
    Form { name: "camera-silent", fault: Lasting(SimFault::Silence), what: "no frame comes for this time" },
    Form {
        name: "camera-torn",
        fault: At(SimFault::TornFrame),
        what: "the lower half of a frame is old, and nothing tells",
    },
    Form {
        name: "camera-late",
        fault: At(SimFault::LateContents),
        what: "a frame is old under a new time stamp",
    },
    Form { name: "camera-damaged", fault: At(SimFault::BufferError), what: "a frame is flagged as damaged" },
    Form {
        name: "camera-short",
        fault: At(SimFault::ShortBuffer),
        what: "half of the bytes of a frame come",
    },
    Form { name: "camera-error", fault: At(SimFault::FatalError), what: "the stream breaks down" },
    Form {
        name: "camera-unplugged",
        // The fourth attempt to open it succeeds.
        fault: At(SimFault::Disconnect { failing: 3 }),
        what: "the camera is pulled, and comes back",
    },
    Form {
        name: "camera-gone",
        fault: At(SimFault::Disconnect { failing: u32::MAX }),
        what: "the camera is pulled for good",
    },
    Form { name: "camera-gain", fault: At(SimFault::GainDrifts), what: "another program changes the gain" },
    Form { name: "camera-no-signal", fault: At(SimFault::NoSignal(true)), what: "the signal goes for good" },
];

/// Faults of a simulated rig by script, separated by commas. A fault happens once: when the stage is sent to the
/// position of a frame for the first time. Frames are counted from 0.
///
/// - Of the stage, as in a [`FaultScript`](crate::stage::simulator::FaultScript), with the number of a frame for
///   that of a move: `lost-steps@40/0.1mm`; over a line also `noise@40/10s`, `mute@40/2s`, `reset@40+0.2s`, ...
/// - Of the camera: `camera-silent@40/2s`, `camera-torn@40`, `camera-unplugged@40`, ...
///
/// ```
/// use epirig_devices::faults::RigFaults;
///
/// let faults: RigFaults = "lost-steps@40/0.1mm,camera-torn@12".parse()?;
/// assert_eq!((faults.stage.len(), faults.camera.len()), (1, 1));
/// let error = "fire@40".parse::<RigFaults>().unwrap_err();
/// assert!(error.contains("camera-torn@FRAME"));
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RigFaults {
    /// Those of the stage and its line. The [number](StageFault::number) of each is that of its frame.
    pub stage: Vec<StageFault>,
    /// Those of the camera, each with the number of its frame.
    pub camera: Vec<(u32, SimFault)>,
}

impl RigFaults {
    /// What a text of them must be, for a person.
    pub const ALLOWED: &str =
        "faults such as lost-steps@40/0.1mm or camera-silent@12/2s, separated by commas";

    /// How faults are written, and what happens.
    pub fn forms() -> Vec<(String, &'static str)> {
        let camera = FORMS.iter().map(|Form { name, fault, what }| {
            let time = if matches!(fault, Lasting(_)) { "/TIMEs" } else { "" };
            (format!("{name}@FRAME{time}"), *what)
        });
        StageFault::forms("FRAME").into_iter().chain(camera).collect()
    }
}

impl FromStr for RigFaults {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut faults = Self::default();
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            match (StageFault::numbered(part), camera_fault(part)) {
                (Some(fault), _) => faults.stage.push(fault),
                (None, Some(fault)) => faults.camera.push(fault),
                (None, None) => {
                    let all = names(&Self::forms());
                    return Err(format!("\"{part}\" is not a complete fault; faults are {all}"));
                }
            }
        }
        Ok(faults)
    }
}

fn camera_fault(text: &str) -> Option<(u32, SimFault)> {
    let (name, rest) = text.split_once('@')?;
    let (number, time) = rest.split_once('/').map_or((rest, None), |(number, time)| (number, Some(time)));
    let form = FORMS.iter().find(|form| form.name == name)?;
    let fault = match (&form.fault, time) {
        (At(fault), None) => *fault,
        (Lasting(fault), Some(time)) => {
            fault((amount(time, "s")? * f64::from(SimDevice::RATE_HZ)).ceil() as u32)
        }
        _ => return None,
    };
    Some((number.parse().ok()?, fault))
}
