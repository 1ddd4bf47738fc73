//! A camera that replays a sequence.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::control::Control;
use super::format::{OfferedFormat, Size, Sizes};
use super::onlooker::{Audience, Onlooker};
use super::settings::{CameraSettings, Configuration};
use super::{ActiveFormat, Camera, CameraError, CameraIdentity, FrameFacts, Moment, TakenFrame, TimingRule};
use epirig_core::frame::Frame;
use epirig_data::sequence::Sequence;

/// Simulated time between two frames.
const FRAME_TIME: Duration = Duration::from_millis(40);

/// A camera that gives the frames of a sequence, one for each stop of a scan in their order, checked against
/// their hashes. Its clock is simulated: a frame begins when it is requested.
#[derive(Debug)]
pub struct ReplayCamera {
    sequence: Sequence,
    next: usize,
    /// The stop that was announced, or whose frame was taken last.
    present: usize,
    started: bool,
    now: Moment,
    /// The moment of the latest request.
    asked: Option<Moment>,
    audience: Audience,
}

impl ReplayCamera {
    /// A camera for the sequence in `folder`.
    ///
    /// # Errors
    /// [`CameraError::Sequence`] if it cannot be opened.
    pub fn open(folder: &Path) -> Result<Self, CameraError> {
        let sequence = Sequence::open(folder)?;
        let camera = Self {
            sequence,
            next: 0,
            present: 0,
            started: false,
            now: Moment::from_ns(1),
            asked: None,
            audience: Audience::default(),
        };
        tracing::info!(device = %camera.identity(), "camera opened");
        Ok(camera)
    }

    fn name(&self) -> String {
        self.identity().name()
    }

    /// The frame of a stop, with its number in the sequence.
    fn frame(&self, stop: usize) -> Result<(usize, Frame), CameraError> {
        let frames = self.sequence.frames();
        let Some(record) = frames.get(stop) else {
            return Err(CameraError::Exhausted { camera: self.name(), frames: frames.len() });
        };
        Ok((record.index, self.sequence.read(record)?))
    }

    fn format(&self) -> ActiveFormat {
        let record = self.sequence.record();
        ActiveFormat::grey(Size { columns: record.columns, rows: record.rows }, record.bit_depth)
    }
}

impl Camera for ReplayCamera {
    fn identity(&self) -> CameraIdentity {
        CameraIdentity {
            driver: "replay".to_owned(),
            model: format!("sequence {}", self.sequence.record().uid),
            path: Some(format!("replay:{}", self.sequence.folder().display())),
            ..CameraIdentity::default()
        }
    }

    fn now(&mut self) -> Moment {
        self.now
    }

    fn offered(&mut self) -> Result<Vec<OfferedFormat>, CameraError> {
        let format = self.format();
        Ok(vec![OfferedFormat {
            four_cc: format.four_cc,
            description: "frames of the sequence".to_owned(),
            sizes: Sizes::Discrete(vec![(format.size, Vec::new())]),
        }])
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        Ok(Vec::new())
    }

    fn set_control(&mut self, name: &str, _value: &str) -> Result<Control, CameraError> {
        Err(CameraError::NoSuchControl { camera: self.name(), name: name.to_owned(), nearest: None })
    }

    fn configure(&mut self, settings: &CameraSettings) -> Result<Configuration, CameraError> {
        let format = self.format();
        let unlike = settings.four_cc.is_some_and(|four_cc| four_cc != format.four_cc)
            || settings.size.is_some_and(|size| size != format.size);
        let asks_for_more = settings.rate_hz.is_some()
            || settings.exposure_us.is_some()
            || settings.bayer.is_some()
            || !settings.controls.is_empty();
        if unlike || asks_for_more {
            let wanted = "other settings than its own";
            return Err(CameraError::not_offered(&self.name(), wanted, format.to_string()));
        }
        self.started = false;
        Ok(Configuration {
            format,
            rows: format.size.rows,
            columns: format.size.columns,
            bit_depth: self.sequence.record().bit_depth,
            interval: None,
            exposure_us: None,
            pinned: Vec::new(),
            notes: Vec::new(),
        })
    }

    fn start(&mut self) -> Result<(), CameraError> {
        self.started = true;
        Ok(())
    }

    fn grab_after(&mut self, moment: Moment) -> Result<TakenFrame, CameraError> {
        let camera = self.name();
        if !self.started {
            return Err(CameraError::NotStarted(camera));
        }
        // Each frame of a sequence belongs to one position, so frames cannot be averaged.
        if self.asked.replace(moment) == Some(moment) {
            return Err(CameraError::Unsupported { camera, what: "give several frames of one moment" });
        }
        let (index, frame) = self.frame(self.next)?;
        self.audience.show_this(&frame);
        let began = self.now.max(moment);
        self.now = began.after(FRAME_TIME);
        self.present = self.next;
        self.next += 1;
        let facts = FrameFacts {
            requested: moment,
            exposure_start: began,
            timing: TimingRule::StartOfExposure,
            stamp: began,
            received: self.now,
            sequence: u32::try_from(index).unwrap_or(u32::MAX),
            flags: 0,
            stale: 0,
            damaged: 0,
            missed: 0,
            unsteady: 0,
            restarts: 0,
            difference_dn: None,
            controls: Vec::new(),
        };
        Ok(TakenFrame { frame, facts })
    }

    fn look(&mut self, _patience: Duration) -> Result<Option<Frame>, CameraError> {
        self.started = false;
        self.frame(self.present).map(|(_, frame)| Some(frame))
    }

    fn show_to(&mut self, onlooker: Option<Arc<dyn Onlooker>>) {
        self.audience = Audience::of(onlooker);
    }

    fn at_stop(&mut self, index: usize) {
        (self.next, self.present) = (index, index);
    }

    fn is_live(&self) -> bool {
        false
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.started = false;
        Ok(())
    }

    fn reconnect(&mut self, _patience: Duration) -> Result<(), CameraError> {
        self.start()
    }
}
