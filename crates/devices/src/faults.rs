//! Faults of a simulated rig at frames of its scan.

use std::str::FromStr;
use std::time::Duration;

use crate::camera::{SimDevice, SimFault};
use crate::stage::simulator::StageFault;

/// How a fault of the camera is written.
struct Form {
    name: &'static str,
    /// Whether there is a duration.
    has_duration: bool,
    fault: fn(Duration) -> SimFault,
}

const FORMS: [Form; 10] = [
    Form { name: "camera-silent", has_duration: true, fault: |time| SimFault::Silence(frames(time)) },
    Form { name: "camera-torn", has_duration: false, fault: |_| SimFault::TornFrame },
    Form { name: "camera-late", has_duration: false, fault: |_| SimFault::LateContents },
    Form { name: "camera-damaged", has_duration: false, fault: |_| SimFault::BufferError },
    Form { name: "camera-short", has_duration: false, fault: |_| SimFault::ShortBuffer },
    Form { name: "camera-error", has_duration: false, fault: |_| SimFault::FatalError },
    // The fourth attempt to open it succeeds.
    Form { name: "camera-unplugged", has_duration: false, fault: |_| SimFault::Disconnect { failing: 3 } },
    Form { name: "camera-gone", has_duration: false, fault: |_| SimFault::Disconnect { failing: u32::MAX } },
    Form { name: "camera-gain", has_duration: false, fault: |_| SimFault::GainDrifts },
    Form { name: "camera-no-signal", has_duration: false, fault: |_| SimFault::NoSignal(true) },
];

/// Number of frames in a time.
fn frames(time: Duration) -> u32 {
    (time.as_secs_f64() * f64::from(SimDevice::RATE_HZ)).ceil() as u32
}

fn camera_forms(number: &str) -> String {
    let form =
        |form: &Form| format!("{}@{number}{}", form.name, if form.has_duration { "/TIMEs" } else { "" });
    FORMS.iter().map(form).collect::<Vec<_>>().join(", ")
}

/// Faults of a simulated rig by script, separated by commas. A fault happens once: as soon as the stage is sent
/// to the position of a frame for the first time. Frames are counted from 0.
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
}

impl FromStr for RigFaults {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut faults = Self::default();
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            if let Some(fault) = camera_fault(part) {
                faults.camera.push(fault);
            } else if let Some(fault) = part.parse().ok().filter(|_| part.contains('@')) {
                faults.stage.push(fault);
            } else {
                return Err(format!(
                    "\"{part}\" is not a complete fault; faults are {}, {}",
                    StageFault::forms("FRAME"),
                    camera_forms("FRAME")
                ));
            }
        }
        Ok(faults)
    }
}

fn camera_fault(text: &str) -> Option<(u32, SimFault)> {
    let (name, rest) = text.split_once('@')?;
    let (number, time) = rest.split_once('/').map_or((rest, None), |(number, time)| (number, Some(time)));
    let seconds = time.map(|time| time.strip_suffix('s')?.parse::<f64>().ok());
    let lasting = match seconds {
        Some(seconds) => Some(Duration::try_from_secs_f64(seconds?).ok()?),
        None => None,
    };
    let form = FORMS.iter().find(|form| form.name == name && form.has_duration == lasting.is_some())?;
    Some((number.parse().ok()?, (form.fault)(lasting.unwrap_or_default())))
}
