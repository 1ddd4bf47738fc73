//! A camera that can be trusted, made of a device that cannot.

use std::time::Duration;

use super::configure::{configure, layout, write_and_compare};
use super::control::{Control, find_control};
use super::device::{FilledBuffer, VideoDevice};
use super::format::OfferedFormat;
use super::identity::CameraIdentity;
use super::moment::Moment;
use super::pixels::{Layout, PixelFormat};
use super::settings::{CameraSettings, Configuration};
use super::stillness::Difference;
use super::timing::{Timed, Timing};
use super::{Camera, CameraError, FrameFacts, TakenFrame};
use crate::frame::{Frame, full_scale};

/// Frames that pass before the first one counts: settings take up to 6 frames until they show (seen in USB cameras), and a few
/// more are for the sensor's own start.
const SETTLING: usize = 8;
/// So many pairs of frames in a row must agree before the picture is called steady.
const STEADY_PAIRS: usize = 4;
/// Times that a stream is started anew within one grab before its error is believed.
const RESTARTS: usize = 3;
/// Frame interval of cameras that do not tell it: longer than that of any video camera, to be on the safe side.
const UNKNOWN_INTERVAL: Duration = Duration::from_millis(200);
/// How long a camera is left alone between two attempts to open it again.
const PAUSE: Duration = Duration::from_millis(100);

/// A camera made of a [`VideoDevice`]: it lets no frame pass that is stale, torn, damaged, out of sequence, of another size, or
/// taken with other settings than those asked for.
///
/// A frame is accepted if
/// - its exposure began at or after the moment asked for, by the [timing rule](super::timing);
/// - the driver flags no error, its bytes are as many as the format needs, and they decode;
/// - its sequence number follows that of a frame before it for which all this holds too;
/// - the two frames show the same: [`Difference::objection`] has none;
/// - after it was taken all watched controls read what they were set to, and the input has its signal.
///
/// A stream that breaks down, or a control that has changed, is set up anew, at most three times in a grab. Everything ends within
/// the patience of the [settings](CameraSettings), with a frame or with an error.
#[derive(Debug)]
pub struct CheckedCamera<D> {
    device: D,
    configured: Option<Configured>,
    stream: Option<Stream>,
}

#[derive(Debug, Clone)]
struct Configured {
    settings: CameraSettings,
    configuration: Configuration,
    layout: Layout,
}

#[derive(Debug)]
struct Stream {
    timing: Timing,
    /// The latest sequence number, if the latest buffer was good.
    sequence: Option<u32>,
    /// Whether the driver numbers its frames; `None` while that is not known.
    numbered: Option<bool>,
    /// Typical difference of two frames of a steady picture, in DN.
    steady_dn: Option<f64>,
    /// The latest good frame, with the moment that its exposure began.
    latest: Option<(Frame, Moment)>,
}

/// What passed while a frame was waited for.
#[derive(Debug, Default)]
struct Passed {
    stale: usize,
    damaged: usize,
    missed: u32,
    unsteady: usize,
    restarts: usize,
    reason: Option<String>,
}

impl Passed {
    fn why(&self) -> String {
        let counts = [
            (self.stale, "too old"),
            (self.damaged, "damaged"),
            (self.missed as usize, "lost by the driver"),
            (self.unsteady, "unlike the frame before"),
        ];
        let seen: Vec<String> = counts
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        let seen = if seen.is_empty() { "no frame came at all".to_owned() } else { seen.join(", ") };
        self.reason.as_ref().map_or(seen.clone(), |reason| format!("{seen} (the latest: {reason})"))
    }
}

impl<D: VideoDevice> CheckedCamera<D> {
    /// A camera that is neither configured nor started.
    pub fn new(device: D) -> Self {
        Self { device, configured: None, stream: None }
    }

    /// The device, for whoever plays tricks on it.
    pub fn device(&mut self) -> &mut D {
        &mut self.device
    }

    fn name(&self) -> String {
        self.device.identity().name()
    }

    fn configured(&self) -> Result<&Configured, CameraError> {
        self.configured.as_ref().ok_or_else(|| CameraError::NotStarted { camera: self.name() })
    }

    fn deadline(&mut self) -> Result<Moment, CameraError> {
        let patience = self.configured()?.settings.patience;
        Ok(self.device.now().after(patience))
    }

    /// Starts the stream and waits until its picture is steady.
    fn start_until(&mut self, deadline: Moment) -> Result<(), CameraError> {
        self.stream = None;
        let Configured { settings, configuration, .. } = self.configured()?;
        let buffers = settings.buffers.clamp(2, 32);
        let interval =
            configuration.interval.and_then(|interval| interval.duration()).unwrap_or(UNKNOWN_INTERVAL);
        let exposure =
            configuration.exposure_us.map(|exposure_us| Duration::from_secs_f64(exposure_us * 1e-6));
        let timing = Timing::new(interval, exposure, buffers);
        self.device.check_signal()?;
        let mut tries = 0;
        while let Err(error) = self.device.start(buffers) {
            tries += 1;
            if tries > RESTARTS || !error.is_mended_by_restart() {
                return Err(error);
            }
        }
        self.stream = Some(Stream { timing, sequence: None, numbered: None, steady_dn: None, latest: None });
        self.settle(deadline)?;
        self.check_controls()
    }

    /// Lets frames pass until what they show no longer changes.
    fn settle(&mut self, deadline: Moment) -> Result<(), CameraError> {
        let mut passed = Passed::default();
        let (mut frames, mut agreeing) = (0, Vec::new());
        let mut sequences = Vec::new();
        while frames < SETTLING || agreeing.len() < STEADY_PAIRS {
            let Some((frame, buffer, _)) = self.next_good(deadline, &mut passed)? else {
                if agreeing.is_empty() && passed.unsteady > 0 {
                    let why = passed.reason.unwrap_or_default();
                    return Err(CameraError::Unsteady { camera: self.name(), why });
                }
                return Err(self.timeout(&passed));
            };
            frames += 1;
            sequences.push(buffer.sequence);
            match self.compare(&frame) {
                None => {}
                Some(Ok(difference)) => agreeing.push(difference.typical_dn),
                Some(Err(objection)) => {
                    // Receivers without a signal show noise.
                    self.device.check_signal()?;
                    agreeing.clear();
                    passed.unsteady += 1;
                    passed.reason = Some(objection);
                }
            }
            if let Some(stream) = &mut self.stream {
                stream.latest = Some((frame, Moment::default()));
            }
        }
        // The median: settings may have taken effect between two frames of the first few.
        agreeing.sort_by(f64::total_cmp);
        if let Some(stream) = &mut self.stream {
            stream.steady_dn = agreeing.get(agreeing.len() / 2).copied();
            // Some drivers leave the number at zero.
            stream.numbered = Some(sequences.windows(2).any(|pair| pair[0] != pair[1]));
        }
        Ok(())
    }

    /// How a frame differs from the one before it in the stream; an objection in words if it differs too much.
    fn compare(&self, frame: &Frame) -> Option<Result<Difference, String>> {
        let stream = self.stream.as_ref()?;
        let (latest, _) = stream.latest.as_ref()?;
        let difference = Difference::between(latest, frame)?;
        let objection = difference.objection(full_scale(frame.bit_depth()), stream.steady_dn);
        Some(objection.map_or(Ok(difference), Err))
    }

    fn timeout(&self, passed: &Passed) -> CameraError {
        let patience =
            self.configured.as_ref().map_or(Duration::ZERO, |configured| configured.settings.patience);
        CameraError::Timeout { camera: self.name(), patience, why: passed.why() }
    }

    /// The next buffer that is whole, whatever its age; `None` after the deadline.
    fn next_good(
        &mut self,
        deadline: Moment,
        passed: &mut Passed,
    ) -> Result<Option<(Frame, FilledBuffer, Timed)>, CameraError> {
        loop {
            let now = self.device.now();
            if now >= deadline {
                return Ok(None);
            }
            let Some(buffer) = self.device.dequeue(deadline.since(now))? else { continue };
            let layout = self.configured()?.layout;
            let camera = self.name();
            let Some(stream) = &mut self.stream else { return Err(CameraError::NotStarted { camera }) };
            let timed = stream.timing.judge(&buffer);
            let ahead =
                stream.sequence.replace(buffer.sequence).map(|before| buffer.sequence.wrapping_sub(before));
            let follows = match (ahead, stream.numbered) {
                (Some(0), None) | (_, Some(false)) | (None, _) => 1,
                (Some(ahead), _) => ahead,
            };
            if follows != 1 {
                // Whatever is compared with the next frame must be its neighbour.
                stream.latest = None;
                passed.missed = passed.missed.saturating_add(follows.saturating_sub(1).min(1 << 16));
            }
            if !timed.fresh {
                passed.stale += 1;
                stream.latest = None;
                self.device.requeue(buffer)?;
                continue;
            }
            let decoded = decode(&mut self.device, &buffer, &layout);
            self.device.requeue(buffer)?;
            match decoded {
                Ok(frame) => return Ok(Some((frame, buffer, timed))),
                Err(Damage::Frame(reason)) => {
                    passed.damaged += 1;
                    passed.reason = Some(reason);
                    if let Some(stream) = &mut self.stream {
                        stream.latest = None;
                    }
                }
                Err(Damage::Device(error)) => return Err(error),
            }
        }
    }

    /// A frame that was begun after `moment` and is vouched for by its neighbour.
    fn take(
        &mut self,
        moment: Moment,
        deadline: Moment,
        passed: &mut Passed,
    ) -> Result<TakenFrame, CameraError> {
        if let Some(stream) = &mut self.stream {
            stream.timing.ask(moment);
            // A neighbour counts only if it shows the same state of the world.
            stream.latest.take_if(|(_, began)| *began < moment);
        }
        loop {
            let Some((frame, buffer, timed)) = self.next_good(deadline, passed)? else {
                return Err(self.timeout(passed));
            };
            let compared = self.compare(&frame);
            if let Some(stream) = &mut self.stream {
                stream.latest = Some((frame.clone(), timed.exposure_start));
            }
            match compared {
                None => {}
                Some(Err(objection)) => {
                    self.device.check_signal()?;
                    passed.unsteady += 1;
                    passed.reason = Some(objection);
                }
                Some(Ok(difference)) => {
                    let facts = FrameFacts {
                        requested: moment,
                        exposure_start: timed.exposure_start,
                        timing: timed.rule,
                        stamp: buffer.stamp,
                        received: buffer.received,
                        sequence: buffer.sequence,
                        flags: buffer.flags,
                        stale: passed.stale,
                        damaged: passed.damaged,
                        missed: passed.missed,
                        unsteady: passed.unsteady,
                        restarts: passed.restarts,
                        difference_dn: Some(difference.typical_dn),
                        controls: Vec::new(),
                    };
                    return Ok(TakenFrame { frame, facts });
                }
            }
        }
    }

    /// Takes a frame and makes sure that it was taken with the settings asked for, of the signal asked for.
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
        let pinned = self.configured()?.configuration.pinned.clone();
        for control in pinned {
            let found = self.device.read_control(control.id)?;
            if found != control.value {
                return Err(CameraError::ControlChanged {
                    camera,
                    name: control.name,
                    set: control.value,
                    found,
                });
            }
        }
        Ok(())
    }

    /// Stops, configures as before, and starts.
    fn restart(&mut self, deadline: Moment) -> Result<(), CameraError> {
        self.stream = None;
        // A stream that has broken down may refuse to be stopped; starting it tells.
        let _ = self.device.stop();
        self.configure_as_before()?;
        self.start_until(deadline)
    }

    /// Whatever comes after an error must start from a known state.
    fn give_up(&mut self, error: &CameraError) {
        self.stream = None;
        if matches!(error, CameraError::Gone { .. }) {
            self.device.let_go();
        } else {
            // The error that led here is the one to tell; the next start will meet this one.
            let _ = self.device.stop();
        }
    }

    /// Sets everything as it was, also what nobody asked for and was only found to be so.
    fn configure_as_before(&mut self) -> Result<(), CameraError> {
        let Configured { settings, configuration, .. } = self.configured()?.clone();
        let camera = self.name();
        self.configure(&settings)?;
        let controls = self.device.controls()?;
        for pinned in &configuration.pinned {
            let control = find_control(&camera, &controls, &pinned.name)?;
            if control.value != Some(pinned.value) {
                write_and_compare(&mut self.device, &camera, control, pinned.value)?;
            }
        }
        if let Some(configured) = &mut self.configured {
            configured.configuration.pinned = configuration.pinned;
        }
        Ok(())
    }
}

enum Damage {
    Frame(String),
    Device(CameraError),
}

fn decode(device: &mut dyn VideoDevice, buffer: &FilledBuffer, layout: &Layout) -> Result<Frame, Damage> {
    if buffer.damaged {
        return Err(Damage::Frame("the driver flags an error".to_owned()));
    }
    let needed = layout.format.image_bytes(layout.rows, layout.stride).unwrap_or(1);
    if buffer.bytes_used < needed {
        let reason = format!("{} bytes came of {needed}", buffer.bytes_used);
        return Err(Damage::Frame(reason));
    }
    let bytes = device.bytes(buffer).map_err(Damage::Device)?;
    layout.decode(bytes).map_err(|error| Damage::Frame(error.to_string()))
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
        if let Some(configured) = &mut self.configured {
            let pinned = configured.configuration.pinned.iter_mut();
            pinned.filter(|pinned| pinned.id == control.id).for_each(|pinned| pinned.value = value);
        }
        let controls = self.device.controls()?;
        Ok(find_control(&camera, &controls, name)?.clone())
    }

    fn configure(&mut self, settings: &CameraSettings) -> Result<Configuration, CameraError> {
        self.stop()?;
        let configuration = configure(&mut self.device, settings)?;
        let pixels = PixelFormat::from_four_cc(configuration.format.four_cc).ok_or_else(|| {
            CameraError::NotACamera {
                camera: self.name(),
                reason: format!("the format {} is not understood", configuration.format.four_cc),
            }
        })?;
        let layout = layout(&configuration.format, pixels, settings);
        self.configured =
            Some(Configured { settings: settings.clone(), configuration: configuration.clone(), layout });
        Ok(configuration)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        let deadline = self.deadline()?;
        let mut restarts = 0;
        let mut started = self.start_until(deadline);
        while let Err(error) = &started {
            restarts += 1;
            if restarts > RESTARTS || !error.is_mended_by_restart() || self.device.now() >= deadline {
                break;
            }
            started = self.restart(deadline);
        }
        if let Err(error) = &started {
            self.give_up(error);
        }
        started
    }

    fn grab_after(&mut self, moment: Moment) -> Result<TakenFrame, CameraError> {
        if self.stream.is_none() {
            return Err(CameraError::NotStarted { camera: self.name() });
        }
        let deadline = self.deadline()?;
        let mut passed = Passed::default();
        let mut attempt = self.take_and_confirm(moment, deadline, &mut passed);
        while let Err(error) = &attempt {
            passed.restarts += 1;
            let hopeless = passed.restarts > RESTARTS || !error.is_mended_by_restart();
            if hopeless || self.device.now() >= deadline {
                break;
            }
            attempt = match self.restart(deadline) {
                Ok(()) => self.take_and_confirm(moment, deadline, &mut passed),
                Err(error) => Err(error),
            };
        }
        if let Err(error) = &attempt {
            self.give_up(error);
        }
        attempt
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.stream = None;
        self.device.stop()
    }

    fn reconnect(&mut self, patience: Duration) -> Result<(), CameraError> {
        self.configured()?;
        let deadline = self.device.now().after(patience);
        self.stream = None;
        loop {
            let attempt = self.device.reopen().and_then(|()| {
                self.configure_as_before()?;
                self.start()
            });
            let Err(error) = attempt else { return Ok(()) };
            // Another camera in its place stays another one.
            if matches!(error, CameraError::AnotherCamera { .. }) {
                return Err(error);
            }
            let now = self.device.now();
            if now >= deadline {
                return Err(CameraError::StaysAway { camera: self.name(), patience, why: error.to_string() });
            }
            self.device.pause(PAUSE.min(deadline.since(now)));
        }
    }
}
