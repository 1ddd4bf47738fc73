//! The simulated video device: frames in simulated time, at a steady rate, into a queue with few buffers.

mod driver;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::fault::{SimFault, SimStamps};
use super::pictures::Pictures;
use super::view::{SimView, ViewSwitch};
use crate::camera::{ActiveFormat, CameraError, CameraIdentity, FilledBuffer, Moment, Size, StampSource};
use crate::stage::StagePosition;
use epirig_simulator::Simulator;

const INTERVAL: Duration = Duration::from_millis(1000 / SimDevice::RATE_HZ as u64);
const READOUT: Duration = Duration::from_millis(20);
/// Exposure time that gives the simulator's own frames, in units of 100 us.
const EXPOSURE: i64 = 100;
/// Duration of a call.
const CALL: Duration = Duration::from_micros(10);
/// Longest time in real time without a glance at the stage.
const GLANCE: Duration = Duration::from_millis(10);
/// The driver's flag for damaged contents, as in V4L2.
const ERROR_FLAG: u32 = 0x40;

const EXPOSURE_AUTO: u32 = 0x009a_0901;
const GAIN: u32 = 0x0098_0913;
const MANUAL: i64 = 1;
const APERTURE_PRIORITY: i64 = 3;

/// An exposed frame.
#[derive(Debug, Clone, Copy)]
struct Exposed {
    buffer: FilledBuffer,
    position_mm: f64,
    /// Position of the stage before its latest move, which late and torn frames show.
    before_mm: f64,
    light: f32,
    view: SimView,
    number: u32,
    torn: bool,
    late: bool,
}

/// A simulated video device. Like real ones it does not check its frames.
#[derive(Debug)]
pub struct SimDevice {
    pictures: Pictures,
    stage: StagePosition,
    view: ViewSwitch,
    identity: CameraIdentity,
    now: Moment,
    streaming: bool,
    buffers: usize,
    /// Filled buffers that wait.
    queue: VecDeque<Exposed>,
    /// Buffers taken from the queue and not yet returned.
    taken: Vec<Exposed>,
    bytes: Vec<u8>,
    /// Completion time of the next frame.
    next_complete: Moment,
    frames: u32,
    sequence: u32,
    unnumbered: bool,
    /// Present position of the stage, its former position, and the time of the change.
    position_mm: f64,
    before_mm: f64,
    moved: Moment,
    /// The stage's time that has passed here too.
    stage_time: Duration,
    /// Start of the simulation, if it runs in real time.
    real_time: Option<(Instant, Moment)>,
    exposure: i64,
    exposure_auto: i64,
    gain: i64,
    /// Relative light from a frame on; the latest last.
    light: Vec<(u32, f32)>,
    late_controls: u32,
    stamps: SimStamps,
    dropped: f64,
    random: ChaCha8Rng,
    pending: Vec<SimFault>,
    /// Faults that happen once they are due, by the number of the event.
    planned: Vec<SimFault>,
    silent_until: Moment,
    signal_lost: bool,
    dead: bool,
    unheard: bool,
    deaf: bool,
    /// The exposure is rounded to multiples of it.
    exposure_multiple: i64,
    /// Attempts to open that will still fail; `None` while the device is connected.
    gone: Option<u32>,
}

impl SimDevice {
    /// Frames per second.
    pub const RATE_HZ: u32 = 25;

    /// A device that sees `simulator`, whose scene (or camera) is moved by the stage that `position` watches.
    /// It begins with automatic exposure, as cameras do after connection.
    pub fn new(simulator: Arc<Simulator>, position: StagePosition) -> Self {
        let optics = &simulator.config().optics;
        let model = format!(
            "simulated camera, {} x {} of {} bit",
            optics.columns,
            optics.rows,
            simulator.config().sensor.bit_depth
        );
        let (position_mm, stage_time) = (position.get_mm(), position.elapsed());
        let start = Moment::from_ns(1_000_000_000);
        Self {
            identity: CameraIdentity { driver: "sim".to_owned(), model, ..CameraIdentity::default() },
            pictures: Pictures::new(simulator),
            stage: position,
            view: ViewSwitch::default(),
            now: start,
            streaming: false,
            buffers: 0,
            queue: VecDeque::new(),
            taken: Vec::new(),
            bytes: Vec::new(),
            next_complete: start,
            frames: 0,
            sequence: 0,
            unnumbered: false,
            position_mm,
            before_mm: position_mm,
            moved: start,
            stage_time,
            real_time: None,
            exposure: EXPOSURE,
            exposure_auto: APERTURE_PRIORITY,
            gain: 0,
            light: vec![(0, 1.0)],
            late_controls: 2,
            stamps: SimStamps::default(),
            dropped: 0.0,
            random: ChaCha8Rng::seed_from_u64(1),
            pending: Vec::new(),
            planned: Vec::new(),
            silent_until: start,
            signal_lost: false,
            dead: false,
            unheard: false,
            deaf: false,
            exposure_multiple: 1,
            gone: None,
        }
    }

    /// Injects a fault.
    pub fn inject(&mut self, fault: SimFault) {
        match fault {
            SimFault::Gap(frames) => self.sequence = self.sequence.wrapping_add(frames),
            SimFault::Dropped(share) => self.dropped = share.clamp(0.0, 1.0),
            SimFault::FatalError => self.dead = true,
            SimFault::Unheard => self.unheard = true,
            SimFault::Disconnect { failing } => {
                self.gone = Some(failing);
                self.streaming = false;
                self.queue.clear();
                self.taken.clear();
            }
            SimFault::Replaced => self.identity.model += ", another one",
            SimFault::Silence(frames) => self.silent_until = self.now.after(INTERVAL * frames),
            SimFault::NoSignal(lost) => self.signal_lost = lost,
            SimFault::GainDrifts => {
                self.gain += 1;
                self.light_changes();
            }
            SimFault::Deaf => self.deaf = true,
            SimFault::CoarseExposure(multiple) => self.exposure_multiple = multiple.max(1),
            SimFault::LateControls(frames) => self.late_controls = frames,
            SimFault::Stamps(stamps) => self.stamps = stamps,
            SimFault::SequenceAt(sequence) => self.sequence = sequence,
            SimFault::Unnumbered => (self.unnumbered, self.sequence) = (true, 0),
            waiting => self.pending.push(waiting),
        }
    }

    /// Plans faults: when the stage says that the event of a number is due, the fault of that number is injected
    /// before the next frame that [counts](crate::camera::VideoDevice::next_is_compared).
    pub fn plan(&mut self, faults: Vec<SimFault>) {
        self.planned = faults;
    }

    /// Whether this fault is pending; if so, it happens now.
    fn happens(&mut self, fault: SimFault) -> bool {
        let found = self.pending.iter().position(|pending| *pending == fault);
        found.map(|index| self.pending.remove(index)).is_some()
    }

    fn there(&self) -> Result<(), CameraError> {
        match self.gone {
            Some(_) => Err(CameraError::Gone(self.identity.name())),
            None => Ok(()),
        }
    }

    fn stream_error(&self, action: &'static str) -> CameraError {
        CameraError::Stream { camera: self.identity.name(), action, detail: "a simulated fault".to_owned() }
    }

    /// Changes of exposure and gain take effect from a later frame on.
    fn light_changes(&mut self) {
        if self.deaf {
            return;
        }
        let light = self.exposure as f32 / EXPOSURE as f32 * (1.0 + self.gain as f32 / 100.0);
        self.light.push((self.frames.saturating_add(self.late_controls), light));
    }

    fn light_of(&self, number: u32) -> f32 {
        let light =
            self.light.iter().rev().find(|(from, _)| *from <= number).map_or(1.0, |(_, light)| *light);
        // Automatic exposure changes all the time.
        let hunting = if self.exposure_auto == MANUAL { 0.0 } else { 0.1 * (number as f32).sin() };
        light * (1.0 + hunting)
    }

    /// Selects the view.
    pub fn view(&self) -> ViewSwitch {
        self.view.clone()
    }

    /// From now on simulated time runs as real time: for rehearsals. The stage must take real time, too.
    pub fn in_real_time(&mut self) {
        self.real_time = Some((Instant::now(), self.now));
    }

    /// Moves of a simulated stage take no real time; their simulated time passes here. In real time it has
    /// passed already.
    fn mind_the_stage(&mut self) {
        let (position_mm, stage_time) = (self.stage.get_mm(), self.stage.elapsed());
        let moving = stage_time.saturating_sub(self.stage_time);
        self.stage_time = stage_time;
        // During a move the camera sees the start position.
        self.pass(if self.real_time.is_some() { Duration::ZERO } else { moving });
        if position_mm != self.position_mm {
            (self.before_mm, self.position_mm) = (self.position_mm, position_mm);
            self.moved = self.now;
        }
    }

    /// Advances the time: frames are completed into free buffers, or lost.
    fn pass(&mut self, time: Duration) {
        let mut until = self.now.after(time);
        if let Some((began, start)) = self.real_time {
            // Other work of the program takes time too.
            until = until.max(start.after(began.elapsed()));
            std::thread::sleep(until.since(start).saturating_sub(began.elapsed()));
        }
        while self.streaming && !self.dead && self.next_complete <= until {
            self.complete(self.next_complete);
            self.next_complete = self.next_complete.after(INTERVAL);
        }
        self.now = until;
    }

    fn complete(&mut self, complete: Moment) {
        if complete < self.silent_until || self.unheard {
            return;
        }
        if self.happens(SimFault::Halt) {
            self.give_back_empty(complete);
            return;
        }
        let number = self.frames;
        let sequence = self.sequence;
        self.frames = self.frames.wrapping_add(1);
        self.sequence = if self.unnumbered { 0 } else { self.sequence.wrapping_add(1) };
        let lost = self.dropped > 0.0 && self.random.random_bool(self.dropped);
        let free = self.queue.len() + self.taken.len() < self.buffers;
        if lost || !free {
            return;
        }
        let exposure = Duration::from_micros(self.exposure.unsigned_abs() * 100);
        let began = complete.before(READOUT).before(exposure);
        let second = 1_000_000_000;
        let (stamp, stamp_source) = match self.stamps {
            SimStamps::StartOfExposure => (began, StampSource::StartOfExposure),
            SimStamps::EndOfFrame => (complete, StampSource::EndOfFrame),
            SimStamps::Mislabelled => (complete, StampSource::StartOfExposure),
            SimStamps::Zero => (Moment::default(), StampSource::StartOfExposure),
            SimStamps::Ahead => (began.after(Duration::from_secs(1 << 30)), StampSource::StartOfExposure),
            SimStamps::Behind => {
                (began.before(Duration::from_nanos(second - 1)), StampSource::StartOfExposure)
            }
            SimStamps::Backwards => {
                (Moment::from_ns((1 << 40) - complete.as_ns()), StampSource::StartOfExposure)
            }
        };
        let format = self.format();
        let whole = format.stride * format.size.rows;
        let earlier = began < self.moved;
        // A stale frame is skipped in any case. Faults of contents wait until the view has changed.
        let damaged = !earlier && self.happens(SimFault::BufferError);
        let short = !earlier && self.happens(SimFault::ShortBuffer);
        let torn = !earlier && self.happens(SimFault::TornFrame);
        let late = !earlier && self.happens(SimFault::LateContents);
        self.queue.push_back(Exposed {
            buffer: FilledBuffer {
                index: 0,
                bytes_used: if short { whole / 2 } else { whole },
                stamp,
                stamp_source,
                sequence,
                flags: if damaged { ERROR_FLAG } else { 0 },
                damaged,
                received: complete,
            },
            position_mm: if earlier { self.before_mm } else { self.position_mm },
            before_mm: self.before_mm,
            light: self.light_of(number),
            view: self.view.get(),
            number,
            torn,
            late,
        });
    }

    fn give_back_empty(&mut self, complete: Moment) {
        for _ in self.queue.len() + self.taken.len()..self.buffers {
            let number = self.frames;
            self.frames = self.frames.wrapping_add(1);
            self.queue.push_back(Exposed {
                buffer: FilledBuffer {
                    index: 0,
                    bytes_used: 0,
                    stamp: Moment::default(),
                    stamp_source: StampSource::StartOfExposure,
                    sequence: 0,
                    flags: ERROR_FLAG,
                    damaged: true,
                    received: complete,
                },
                position_mm: self.position_mm,
                before_mm: self.before_mm,
                light: 1.0,
                view: self.view.get(),
                number,
                torn: false,
                late: false,
            });
        }
    }

    fn format(&self) -> ActiveFormat {
        let config = self.pictures.simulator().config();
        let size = Size { columns: config.optics.columns, rows: config.optics.rows };
        ActiveFormat::grey(size, config.sensor.bit_depth)
    }
}
