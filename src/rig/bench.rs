//! A rig moved by hand: a connection to the stage and the camera of a profile.

use super::camera::{camera_settings, open_camera};
use super::{RigError, RigStage};
use crate::profile::Profile;
use epirig_devices::camera::{Camera, CameraSettings, TakenFrame};
use epirig_devices::stage::{Stage, StageSource as _};

/// The connected stage and camera of a profile. When it is dropped, a stage that moves is stopped.
///
/// ```
/// use epirig::profile::{Profile, SIM};
/// use epirig::rig::Bench;
///
/// let mut bench = Bench::open(&Profile::read(SIM, "sim.toml", &[])?)?;
/// bench.stage().home()?;
/// bench.stage().move_to(12.0)?;
/// let taken = bench.grab()?;
/// assert_eq!((taken.frame.rows(), taken.frame.columns()), (1024, 1024));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Bench {
    stage: Box<dyn Stage>,
    camera: Box<dyn Camera>,
    settings: CameraSettings,
    /// Whether the camera is set as the profile says.
    configured: bool,
    /// Whether frames are coming.
    started: bool,
}

impl Bench {
    /// Connects to the stage, and opens the camera.
    ///
    /// # Errors
    /// [`RigError`] if one of them is missing, or the profile does not suit it.
    pub fn open(profile: &Profile) -> Result<Self, RigError> {
        let settings = camera_settings(profile)?;
        let mut source = RigStage::of(profile)?;
        let stage = source.connect()?;
        let camera = open_camera(profile, &source.watch())?.camera;
        Ok(Self { stage, camera, settings, configured: false, started: false })
    }

    /// The stage.
    pub fn stage(&mut self) -> &mut dyn Stage {
        &mut *self.stage
    }

    /// The camera.
    pub fn camera(&mut self) -> &mut dyn Camera {
        &mut *self.camera
    }

    /// A frame whose exposure begins after this call. The first one takes longer, until the picture is steady.
    ///
    /// # Errors
    /// [`RigError::Camera`] if no good frame came in time; the next call starts the camera again.
    pub fn grab(&mut self) -> Result<TakenFrame, RigError> {
        if !self.configured {
            self.camera.configure(&self.settings)?;
            self.configured = true;
        }
        if !self.started {
            self.camera.start()?;
            self.started = true;
        }
        let now = self.camera.now();
        self.camera.grab_after(now).map_err(|error| {
            self.started = false;
            error.into()
        })
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        // Who drops it cannot be told of an error; a stage that does not answer is told of by the next connection.
        if self.stage.state().is_ok_and(|state| state.moving) {
            let _ = self.stage.stop();
        }
        let _ = self.camera.stop();
    }
}
