//! Camera drivers as plug-ins.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use super::{
    Camera, CameraChoice, CameraError, ReplayCamera, SimCamera, SimFault, ViewSwitch, cameras, choose,
    open_camera,
};
use crate::stage::StagePosition;
use epirig_simulator::Simulator;

/// A kind of camera: the names it claims, and how it is opened.
///
/// A driver is added by a file of its own and a line in the table of [`camera_drivers`]. A program with its
/// own driver adds it at its start with [`add_camera_drivers`].
pub trait CameraDriver: Sync {
    /// Its name, for messages and the guide.
    fn name(&self) -> &'static str;

    /// Whether `device`, as named in a profile or on the command line, is one of its cameras. The first
    /// driver in the table that claims the name opens it.
    fn claims(&self, device: &str) -> bool;

    /// Whether the camera shows a simulated object.
    fn is_simulated(&self) -> bool {
        false
    }

    /// Opens the camera; `None` means the only camera.
    ///
    /// # Errors
    /// [`CameraError`] if there is no such camera, or it cannot be opened.
    fn open(&self, device: Option<&str>, around: &Surroundings) -> Result<OpenCamera, CameraError>;
}

/// The scene of a simulated camera.
#[derive(Debug, Clone, Default)]
pub struct Surroundings {
    /// The simulated object; `None` for real cameras.
    pub simulator: Option<Arc<Simulator>>,
    /// Position of the stage.
    pub stage: StagePosition,
    /// Whether frames take real time.
    pub in_real_time: bool,
    /// Faults of a simulated camera: each happens when `stage` says that the event of its number is due.
    pub faults: Vec<SimFault>,
}

/// An open camera.
pub struct OpenCamera {
    /// The camera.
    pub camera: Box<dyn Camera>,
    /// Changes what a simulated camera sees.
    pub view: Option<ViewSwitch>,
}

/// `sim`: a camera that sees a simulated object.
struct Simulated;

impl CameraDriver for Simulated {
    fn name(&self) -> &'static str {
        "sim"
    }

    fn claims(&self, device: &str) -> bool {
        device.parse() == Ok(CameraChoice::Simulated)
    }

    fn is_simulated(&self) -> bool {
        true
    }

    fn open(&self, _device: Option<&str>, around: &Surroundings) -> Result<OpenCamera, CameraError> {
        let missing = || CameraError::not_a_camera(self.name(), "there is no simulated object");
        let simulator = around.simulator.clone().ok_or_else(missing)?;
        let mut camera = SimCamera::before_simulator(simulator, around.stage.clone());
        if around.in_real_time {
            camera.device().in_real_time();
        }
        camera.device().plan(around.faults.clone());
        let view = Some(camera.device().view());
        Ok(OpenCamera { camera: Box::new(camera), view })
    }
}

/// `replay:FOLDER`: the frames of a sequence.
struct Replay;

impl CameraDriver for Replay {
    fn name(&self) -> &'static str {
        "replay"
    }

    fn claims(&self, device: &str) -> bool {
        matches!(device.parse(), Ok(CameraChoice::Replay(_)))
    }

    fn open(&self, device: Option<&str>, _around: &Surroundings) -> Result<OpenCamera, CameraError> {
        let folder = device.and_then(|device| device.split_once(':')).map_or("", |(_, folder)| folder);
        Ok(OpenCamera { camera: Box::new(ReplayCamera::open(Path::new(folder))?), view: None })
    }
}

/// All other names: V4L2 cameras.
struct V4l2;

impl CameraDriver for V4l2 {
    fn name(&self) -> &'static str {
        "v4l2"
    }

    fn claims(&self, _device: &str) -> bool {
        true
    }

    fn open(&self, device: Option<&str>, _around: &Surroundings) -> Result<OpenCamera, CameraError> {
        let not_a_name = |reason: String| CameraError::not_a_camera(device.unwrap_or_default(), reason);
        let choice = device.map_or(Ok(CameraChoice::Any), str::parse).map_err(not_a_name)?;
        let known = if matches!(choice, CameraChoice::Path(_)) { Ok(Vec::new()) } else { cameras() };
        let known = known.map_err(|error| match error {
            CameraError::NotOnThisSystem { .. } => CameraError::NotOnThisSystem(choice.to_string()),
            other => other,
        })?;
        Ok(OpenCamera { camera: open_camera(&choose(&choice, &known)?)?, view: None })
    }
}

/// The table of camera drivers. A driver of this crate adds one line, before the last, which claims all
/// names.
static BUILT_IN: [&dyn CameraDriver; 3] = [&Simulated, &Replay, &V4l2];

/// Drivers added by the program.
static ADDED: Mutex<Vec<&dyn CameraDriver>> = Mutex::new(Vec::new());

/// All camera drivers: the added ones, then those of this crate.
pub fn camera_drivers() -> Vec<&'static dyn CameraDriver> {
    let added = ADDED.lock().unwrap_or_else(PoisonError::into_inner);
    added.iter().copied().chain(BUILT_IN).collect()
}

/// Adds drivers for the rest of the program. A driver with a known name is ignored.
pub fn add_camera_drivers(more: &[&'static dyn CameraDriver]) {
    for driver in more {
        if camera_drivers().iter().all(|known| known.name() != driver.name()) {
            ADDED.lock().unwrap_or_else(PoisonError::into_inner).push(*driver);
        }
    }
}

/// The driver of a named camera; `None` means the only camera.
pub fn camera_driver(device: Option<&str>) -> &'static dyn CameraDriver {
    let claims = |driver: &&dyn CameraDriver| device.is_some_and(|device| driver.claims(device));
    camera_drivers().into_iter().find(claims).unwrap_or(&V4l2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_name_has_one_driver() {
        for (device, name) in [
            (Some("sim"), "sim"),
            (Some("replay:a/b"), "replay"),
            (Some("/dev/video0"), "v4l2"),
            (Some("usb:1A2B"), "v4l2"),
            (None, "v4l2"),
        ] {
            assert_eq!(camera_driver(device).name(), name, "{device:?}");
        }
        assert!(camera_driver(Some("sim")).is_simulated());
        assert!(camera_driver(Some("sim")).open(None, &Surroundings::default()).is_err());
    }
}
