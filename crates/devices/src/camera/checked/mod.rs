//! A checked camera, made of a bare device.

mod decode;
mod look;
mod state;
mod stream;

use std::sync::Arc;
use std::time::Duration;

use tracing::{debug, info, warn};

use super::automatic::exposure_unit;
use super::configure::{configure, layout, write_and_compare};
use super::control::{Control, find_control};
use super::device::VideoDevice;
use super::format::OfferedFormat;
use super::identity::CameraIdentity;
use super::moment::Moment;
use super::onlooker::{Audience, Onlooker};
use super::pixels::{Layout, PixelFormat};
use super::settings::{CameraSettings, Configuration, Pinned};
use super::timing::Timing;
use super::{Camera, CameraError, TakenFrame};
use epirig_core::frame::Frame;

use state::{Passed, Stream};

/// Number of buffers that a driver fills in turn, as usual in video programs.
const BUFFERS: usize = 4;
/// Restarts of a stream within one grab before it fails.
const RESTARTS: usize = 3;
/// Frame interval of cameras that do not report it: longer than that of any video camera, to be safe.
const UNKNOWN_INTERVAL: Duration = Duration::from_millis(200);
/// A stream is silent if nothing comes for this part of the time-out of a grab, ...
const QUIET_SHARE: u32 = 4;
/// ... and for this number of frame times.
const QUIET_FRAMES: u32 = 8;
/// Pause between two attempts to open a camera again.
const PAUSE: Duration = Duration::from_millis(100);

/// A camera made of a [`VideoDevice`]. It rejects frames that are stale, torn, damaged, out of sequence, of
/// another size, or taken with other settings than the wanted ones.
///
/// A frame is accepted if
/// - its exposure began at or after the requested moment, by the [timing rule](super::timing);
/// - the driver flags no error, the number of bytes fits the format, and they decode;
/// - its sequence number follows that of an earlier frame which meets all these conditions too;
/// - both frames show the same: [`objection`](super::Difference::objection) has none;
/// - after the frame, all watched controls have their set values, and the input has a signal.
///
/// A failed stream or a changed control leads to a restart, at most three times in a grab. A stream that is
/// silent is restarted once: `uvcvideo` never uses a USB transfer again that ended with a halt of the
/// endpoint, so that after five of them nothing comes, without an error, until the stream is started anew. A grab ends by the
/// time-out of the [settings](CameraSettings), counted from the requested moment; blocking calls of the
/// driver may add to that.
#[derive(Debug)]
pub struct CheckedCamera<D> {
    device: D,
    configured: Option<Configured>,
    /// The checked stream, if it runs.
    stream: Option<Stream>,
    /// Number of buffers of a stream that runs for [`look`](Camera::look) only.
    look_buffers: Option<usize>,
    /// Whether the stream was started anew because it was silent, and nothing has come since.
    woken: bool,
    audience: Audience,
}

#[derive(Debug, Clone)]
struct Configured {
    settings: CameraSettings,
    configuration: Configuration,
    layout: Layout,
}

impl<D: VideoDevice> CheckedCamera<D> {
    /// A camera that is neither configured nor started.
    pub fn new(device: D) -> Self {
        info!(device = %device.identity(), "camera opened");
        Self {
            device,
            configured: None,
            stream: None,
            look_buffers: None,
            woken: false,
            audience: Audience::default(),
        }
    }

    /// The device, to inject faults.
    pub fn device(&mut self) -> &mut D {
        &mut self.device
    }

    fn name(&self) -> String {
        self.device.identity().name()
    }

    fn configured(&self) -> Result<&Configured, CameraError> {
        self.configured.as_ref().ok_or_else(|| CameraError::NotStarted(self.name()))
    }

    /// The time-out of a request for frames from `moment` on.
    fn deadline(&mut self, moment: Moment) -> Result<Moment, CameraError> {
        let patience = self.configured()?.settings.patience;
        Ok(self.device.now().max(moment).after(patience))
    }

    /// Starts the stream, and waits until its picture is steady.
    fn start_until(&mut self, deadline: Moment) -> Result<(), CameraError> {
        self.stream = None;
        if self.look_buffers.take().is_some() {
            self.device.stop()?;
        }
        let made = self.start_device()?;
        let configuration = &self.configured()?.configuration;
        let interval =
            configuration.interval.and_then(|interval| interval.duration()).unwrap_or(UNKNOWN_INTERVAL);
        let seconds = configuration.exposure_us.map(|exposure_us| exposure_us * 1e-6);
        let exposure = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        debug!(device = self.name(), buffers = made, interval_s = interval.as_secs_f64(), "stream started");
        // A start needs as long as several frames; what is left of the time-out is for that.
        let quiet = (self.configured()?.settings.patience / QUIET_SHARE)
            .max((interval + exposure.unwrap_or(interval)) * QUIET_FRAMES);
        self.stream = Some(Stream::new(Timing::new(interval, exposure, made), made, quiet));
        self.settle(deadline)?;
        self.check_controls()
    }

    /// Starts the device, and returns its number of buffers.
    fn start_device(&mut self) -> Result<usize, CameraError> {
        self.device.check_signal()?;
        let mut tries = 0;
        loop {
            match self.device.start(BUFFERS) {
                Ok(made) => return Ok(made),
                Err(error) => {
                    tries += 1;
                    if tries > RESTARTS || !error.is_mended_by_restart() {
                        return Err(error);
                    }
                    warn!(device = self.name(), tries, reason = %error, "the stream does not start; trying again");
                }
            }
        }
    }

    /// Takes a frame, and checks that settings and signal were right.
    fn take_and_confirm(
        &mut self,
        moment: Moment,
        deadline: Moment,
        passed: &mut Passed,
    ) -> Result<TakenFrame, CameraError> {
        let mut taken = self.take(moment, deadline, passed)?;
        self.check_controls()?;
        self.device.check_signal()?;
        let pinned = &self.configured()?.configuration.pinned;
        taken.facts.controls = pinned.iter().map(|pinned| (pinned.name.clone(), pinned.value)).collect();
        Ok(taken)
    }

    fn check_controls(&mut self) -> Result<(), CameraError> {
        let camera = self.name();
        let ids: Vec<u32> = self.configured()?.configuration.pinned.iter().map(|pinned| pinned.id).collect();
        let found = self.device.read_controls(&ids)?;
        let pinned = &self.configured()?.configuration.pinned;
        match pinned.iter().zip(found).find(|(pinned, found)| pinned.value != *found) {
            None => Ok(()),
            Some((pinned, found)) => Err(CameraError::ControlChanged {
                camera,
                name: pinned.name.clone(),
                set: pinned.value,
                found,
            }),
        }
    }

    /// Stops, configures as before, and starts again.
    fn restart(&mut self, reason: &CameraError, deadline: Moment) -> Result<(), CameraError> {
        warn!(device = self.name(), %reason, "the stream is restarted");
        self.stream = None;
        // A failed stream may refuse to stop; the start will show whether it works.
        let _ = self.device.stop();
        self.configure_as_before()?;
        self.start_until(deadline)
    }

    /// After an error the next start must begin from a known state.
    fn give_up(&mut self, error: &CameraError) {
        warn!(device = self.name(), reason = %error, "the camera is stopped");
        (self.stream, self.look_buffers) = (None, None);
        if matches!(error, CameraError::Gone { .. }) {
            self.device.let_go();
        } else {
            // The first error is reported; the next start will meet this one.
            let _ = self.device.stop();
        }
    }

    /// Restores all settings, also those that were not wanted but only read.
    fn configure_as_before(&mut self) -> Result<(), CameraError> {
        let before = self.configured()?.clone();
        let camera = self.name();
        self.stop()?;
        let found = configure(&mut self.device, &before.settings)?;
        let shape = |configuration: &Configuration| (configuration.format, configuration.interval);
        if shape(&found) != shape(&before.configuration) {
            return Err(CameraError::substituted(&camera, &before.configuration, found));
        }
        for pinned in &before.configuration.pinned {
            let controls = self.device.controls()?;
            let control = controls.iter().find(|control| control.id == pinned.id);
            let control = control.ok_or_else(|| CameraError::NoSuchControl {
                camera: camera.clone(),
                name: pinned.name.clone(),
                nearest: None,
            })?;
            if control.value != Some(pinned.value) {
                write_and_compare(&mut self.device, &camera, control, pinned.value)?;
            }
        }
        // The relevant settings are unchanged, so what is known of the stream stays valid.
        Ok(())
    }

    /// Makes the present value of a control, set by hand, its wanted value.
    fn pin(&mut self, control: &Control) {
        let Some(value) = control.value else { return };
        let Some(Configured { configuration, .. }) = &mut self.configured else { return };
        match configuration.pinned.iter_mut().find(|pinned| pinned.id == control.id) {
            Some(pinned) => pinned.value = value,
            None => configuration.pinned.push(Pinned { id: control.id, name: control.name.clone(), value }),
        }
        let columns = configuration.format.size.columns;
        if let Some((exposure, unit_us)) = exposure_unit(std::slice::from_ref(control), columns) {
            configuration.exposure_us = exposure.value.map(|value| value as f64 * unit_us);
        }
    }
}

impl<D: VideoDevice> Camera for CheckedCamera<D> {
    fn identity(&self) -> CameraIdentity {
        self.device.identity()
    }

    fn now(&mut self) -> Moment {
        self.device.now()
    }

    fn offered(&mut self) -> Result<Vec<OfferedFormat>, CameraError> {
        self.device.offered()
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        self.device.controls()
    }

    fn set_control(&mut self, name: &str, value: &str) -> Result<Control, CameraError> {
        let camera = self.name();
        let controls = self.device.controls()?;
        let control = find_control(&camera, &controls, name)?;
        let value = control.parse(&camera, value)?;
        write_and_compare(&mut self.device, &camera, control, value)?;
        let controls = self.device.controls()?;
        let control = find_control(&camera, &controls, name)?.clone();
        self.pin(&control);
        if self.stream.is_some() {
            // Frames on their way have the old value, and the new one takes effect later.
            self.start()?;
        }
        Ok(control)
    }

    fn configure(&mut self, settings: &CameraSettings) -> Result<Configuration, CameraError> {
        self.stop()?;
        let configuration = configure(&mut self.device, settings)?;
        let four_cc = configuration.format.four_cc;
        let undecodable = || format!("the format {four_cc} cannot be decoded");
        let pixels = PixelFormat::from_four_cc(four_cc)
            .ok_or_else(|| CameraError::not_a_camera(&self.name(), undecodable()))?;
        info!(device = self.name(), %configuration, "camera configured");
        for Pinned { name, value, .. } in &configuration.pinned {
            debug!(device = self.name(), control = name, value, "control set and watched");
        }
        let layout = layout(&configuration.format, pixels, settings);
        self.configured =
            Some(Configured { settings: settings.clone(), configuration: configuration.clone(), layout });
        Ok(configuration)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        let now = self.device.now();
        let deadline = self.deadline(now)?;
        let mut restarts = 0;
        let mut started = self.start_until(deadline);
        while let Err(error) = &started {
            restarts += 1;
            if restarts > RESTARTS || !error.is_mended_by_restart() || self.device.now() >= deadline {
                break;
            }
            started = self.restart(error, deadline);
        }
        if let Err(error) = &started {
            self.give_up(error);
        }
        started
    }

    fn grab_after(&mut self, moment: Moment) -> Result<TakenFrame, CameraError> {
        if self.stream.is_none() {
            return Err(CameraError::NotStarted(self.name()));
        }
        let deadline = self.deadline(moment)?;
        let mut passed = Passed::default();
        let mut attempt = self.take_and_confirm(moment, deadline, &mut passed);
        while let Err(error) = &attempt {
            passed.restarts += 1;
            let hopeless = passed.restarts > RESTARTS || !error.is_mended_by_restart();
            if hopeless || self.device.now() >= deadline {
                break;
            }
            attempt = match self.restart(error, deadline) {
                Ok(()) => self.take_and_confirm(moment, deadline, &mut passed),
                Err(error) => Err(error),
            };
        }
        if let Err(error) = &attempt {
            self.give_up(error);
        }
        attempt
    }

    fn look(&mut self, patience: Duration) -> Result<Option<Frame>, CameraError> {
        self.configured()?;
        let deadline = self.device.now().after(patience);
        let mut restarts = 0;
        loop {
            let error = match self.newest_picture(deadline) {
                Ok(picture) => return Ok(picture),
                Err(error) => error,
            };
            self.give_up(&error);
            restarts += 1;
            let hopeless = restarts > RESTARTS || !error.is_mended_by_restart();
            if hopeless || self.device.now() >= deadline {
                return Err(error);
            }
        }
    }

    fn show_for(&mut self, time: Duration) -> Result<(), CameraError> {
        /// No picture is as young as this.
        const NEVER: Duration = Duration::from_secs(86_400);
        let now = self.device.now();
        let Some(stream) = &mut self.stream else {
            self.device.pause(time);
            return Ok(());
        };
        stream.timing.ask(now.after(NEVER));
        self.next_good(now.after(time), &mut Passed::default()).map(|_| ())
    }

    fn show_to(&mut self, onlooker: Option<Arc<dyn Onlooker>>) {
        self.audience = Audience::of(onlooker);
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        (self.stream, self.look_buffers) = (None, None);
        self.device.stop()
    }

    fn reconnect(&mut self, patience: Duration) -> Result<(), CameraError> {
        self.configured()?;
        let deadline = self.device.now().after(patience);
        (self.stream, self.look_buffers) = (None, None);
        loop {
            let attempt = self.device.reopen().and_then(|()| {
                self.configure_as_before()?;
                self.start()
            });
            let Err(error) = attempt else {
                let socket = self.device.identity().bus;
                warn!(device = self.name(), socket, "the camera has reconnected");
                return Ok(());
            };
            debug!(device = self.name(), reason = %error, "the camera has not reconnected");
            // Another camera in its place is an error that waiting does not change.
            if matches!(error, CameraError::AnotherCamera { .. } | CameraError::AnotherSocket { .. }) {
                return Err(error);
            }
            let now = self.device.now();
            if now >= deadline {
                return Err(CameraError::ReconnectTimeout {
                    camera: self.name(),
                    patience,
                    why: error.to_string(),
                });
            }
            self.device.pause(PAUSE.min(deadline.since(now)));
        }
    }
}
