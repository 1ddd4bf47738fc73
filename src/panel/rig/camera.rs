//! The camera of the panel: opened, shown, and opened again when it was lost.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::panel::shared::SharedState;
use crate::panel::state::{CameraState, Presence};
use crate::profile::Profile;
use crate::rig::{RigError, camera_settings, open_camera};
use epirig_devices::camera::{Camera, Configuration, OpenCamera, SimView, ViewSwitch, exposure_unit};
use epirig_devices::stage::StagePosition;

/// Pause between two attempts to open a camera.
const RETRY: Duration = Duration::from_secs(3);
/// Longest wait for a picture, so that orders are not kept waiting.
const PATIENCE: Duration = Duration::from_millis(50);
/// Pictures are shown no more often than this.
const INTERVAL: Duration = Duration::from_millis(33);

/// The camera.
pub(super) struct CameraSide<'a> {
    shared: &'a Arc<SharedState>,
    profile: &'a Profile,
    position: StagePosition,
    camera: Option<Box<dyn Camera>>,
    /// Of a simulated camera.
    view: Option<ViewSwitch>,
    /// When it is tried next.
    next_try: Instant,
    streams: bool,
    shown: Instant,
}

impl<'a> CameraSide<'a> {
    pub(super) fn new(shared: &'a Arc<SharedState>, profile: &'a Profile, position: StagePosition) -> Self {
        let now = Instant::now();
        Self {
            shared,
            profile,
            position,
            camera: None,
            view: None,
            next_try: now,
            streams: false,
            shown: now,
        }
    }

    /// Opens the camera if it is not open and it is time for it.
    pub(super) fn open(&mut self) {
        if self.camera.is_some() || Instant::now() < self.next_try {
            return;
        }
        if let Err(error) = self.try_open() {
            self.lost(&error.to_string());
        }
    }

    fn try_open(&mut self) -> Result<(), RigError> {
        let OpenCamera { mut camera, view } = open_camera(self.profile, &self.position)?;
        let configuration = camera.configure(&camera_settings(self.profile)?)?;
        let controls = camera.controls()?;
        let name = camera.identity().to_string();
        camera.show_to(Some(Arc::clone(self.shared) as _));
        (self.camera, self.view, self.streams) = (Some(camera), view, false);
        let simulated = self.view.is_some();
        let described = described(name, simulated, &configuration);
        self.shared.change(|state| (state.rig.camera, state.controls) = (described, controls));
        Ok(())
    }

    fn lost(&mut self, why: &str) {
        self.camera = None;
        self.next_try = Instant::now() + RETRY;
        let is_new = self.shared.look(|state| state.rig.camera.error.as_deref() != Some(why));
        if is_new {
            self.shared.fail(format!("camera: {why}"));
        }
        self.shared.change(|state| {
            let camera = &mut state.rig.camera;
            (camera.state, camera.error, camera.picture_hz) = (Presence::Lost, Some(why.to_owned()), None);
        });
    }

    /// Shows the next picture, if a page looks; takes little time in any case.
    pub(super) fn pump(&mut self) {
        self.open();
        let Some(camera) = &mut self.camera else { return std::thread::sleep(PATIENCE) };
        if !self.shared.pictures.are_watched() {
            if std::mem::take(&mut self.streams) {
                // A camera that has gone is noticed when it is looked through again.
                let _ = camera.stop();
            }
            return std::thread::sleep(PATIENCE);
        }
        // A simulated camera that is not bound to real time would have one picture after the other.
        std::thread::sleep(INTERVAL.saturating_sub(self.shown.elapsed()));
        self.shown = Instant::now();
        self.streams = true;
        match camera.look(PATIENCE) {
            Ok(Some(frame)) => self.shared.pictures.put(frame),
            Ok(None) => {}
            Err(error) => self.lost(&error.to_string()),
        }
    }

    /// Whether pictures are wanted, and there is a camera to give them.
    pub(super) fn is_busy(&self) -> bool {
        self.camera.is_some() && self.shared.pictures.are_watched()
    }

    /// The camera for a scan or an examination; afterwards call [`released`](Self::released).
    ///
    /// # Errors
    /// Why there is none.
    pub(super) fn lend(&mut self) -> Result<&mut Box<dyn Camera>, String> {
        self.next_try = Instant::now();
        self.open();
        self.streams = false;
        match &mut self.camera {
            Some(camera) => {
                self.shared.change(|state| state.rig.camera.state = Presence::Busy);
                Ok(camera)
            }
            None => {
                let why = self.shared.look(|state| state.rig.camera.error.clone()).unwrap_or_default();
                Err(format!("there is no camera: {why}"))
            }
        }
    }

    /// The camera is the panel's again.
    pub(super) fn released(&mut self) {
        let Some(camera) = &mut self.camera else { return };
        let configured = camera_settings(self.profile)
            .and_then(|settings| Ok((camera.configure(&settings)?, camera.controls()?)));
        match configured {
            Ok((configuration, controls)) => {
                let (name, simulated) = (camera.identity().to_string(), self.view.is_some());
                let described = described(name, simulated, &configuration);
                self.shared.change(|state| (state.rig.camera, state.controls) = (described, controls));
            }
            Err(error) => self.lost(&error.to_string()),
        }
    }

    pub(super) fn view(&self) -> Option<ViewSwitch> {
        self.view.clone()
    }

    /// Shows something else to a simulated camera.
    pub(super) fn show(&self, what: SimView) {
        if let Some(view) = &self.view {
            view.put(what);
        }
    }

    /// Sets a control, and keeps it in the profile.
    ///
    /// # Errors
    /// Why it was not set, for a person.
    pub(super) fn set_control(&mut self, name: &str, value: &str) -> Result<(), String> {
        let camera = self.camera.as_mut().ok_or("there is no camera")?;
        let control = camera.set_control(name, value).map_err(|error| error.to_string())?;
        let controls = camera.controls().map_err(|error| error.to_string())?;
        let columns = self.shared.look(|state| state.rig.camera.columns);
        let exposure = exposure_unit(&controls, columns);
        let exposure_us =
            exposure.and_then(|(found, unit_us)| found.value.map(|value| value as f64 * unit_us));
        let is_exposure = exposure.is_some_and(|(found, _)| found.id == control.id);
        let change = match (exposure_us, control.value) {
            (Some(us), _) if is_exposure => Some(("camera.exposure".to_owned(), format!("{us} us"))),
            (_, Some(value)) => Some((format!("camera.controls.{}", control.name), value.to_string())),
            _ => None,
        };
        // Nobody else changes the draft.
        let draft = self.shared.draft().changed(&change.into_iter().collect());
        self.shared.change(|state| {
            (state.controls, state.draft, state.rig.camera.exposure_us) = (controls, draft, exposure_us);
        });
        Ok(())
    }
}

fn described(name: String, simulated: bool, configuration: &Configuration) -> CameraState {
    CameraState {
        state: Presence::Live,
        name,
        error: None,
        simulated,
        rows: configuration.rows,
        columns: configuration.columns,
        bit_depth: configuration.bit_depth,
        exposure_us: configuration.exposure_us,
        rate_hz: configuration.interval.map(|interval| interval.rate_hz()).filter(|rate| rate.is_finite()),
        picture_hz: None,
    }
}
