//! A driver of a stage from outside epirig: dialect, settings, decoder and simulator in one file.
//!
//! The dialect `plain` is text. The host asks, the device answers:
//!
//! ```text
//! #7 who *c8             ->  #7 plain 250 150000 5 20 *62  steps/mm, travel in um, mm/s, mm/s2
//! #8 home *24            ->  #8 ok *55                     it has begun
//! #9 go 12500 *6a        ->  #9 ok *56                     to 12.5 mm from home, in um
//! #10 stop *6a           ->  #10 ok *7e                    with a ramp
//! #11 ? *e4              ->  #11 idle 12500 *5b            idle, busy or fault; position in um, or - before homing
//! #12 go 1000000000 *7d  ->  #12 no travel *31             refused, and why
//! ```
//!
//! `*` and two digits end a line: the sum of the bytes before ` *`, modulo 256, in hexadecimal. A damaged line gets no
//! answer, so the host asks again; orders are absolute, so asking again does no harm.

use std::time::Duration;

use epirig_core::settings::{Key, Settings};
use epirig_devices::link::{Inbox, Link, Side, SimulatedDevice};
use epirig_devices::stage::decode::{Decoder, LineDecoder};
use epirig_devices::stage::simulator::{Body, FaultScript, Mishap, SimulatedStage, TICK_HZ};
use epirig_devices::stage::{
    Axis, Connection, Homed, Kinematics, Motion, PositionSettings, StageDriver, StageError, StageIdentity,
    StageState, StopSwitch,
};
use firmware_protocol::axis::Way;
use firmware_protocol::ramp::{Ramp, Run};

const NAME: &str = "plain";
const BAUD: u32 = 9600;
const UM_PER_MM: f64 = 1000.0;
const LONGEST_LINE: usize = 80;
const REPLY_PATIENCE: Duration = Duration::from_millis(300);
const TRIES: u32 = 8;
const POLL: Duration = Duration::from_millis(50);

/// The driver. Its line in the table of drivers is in `main.rs`.
pub(crate) struct Plain;

impl StageDriver for Plain {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> &'static str {
        "The plain dialect of the guide"
    }

    fn page(&self) -> &'static str {
        "# Driver `plain`\n\nThe example of the chapter on writing a driver.\n"
    }

    fn keys(&self) -> Vec<&'static Key> {
        Vec::new()
    }

    fn connect(
        &self,
        connection: &mut Connection<'_>,
        _settings: &Settings,
    ) -> Result<Box<dyn Axis>, StageError> {
        Ok(Box::new(PlainAxis::connect((connection.open_line)(BAUD)?)?))
    }

    fn decoder(&self) -> Option<Box<dyn Decoder>> {
        Some(Box::new(LineDecoder::new(|_: Side, line| match unsealed(line) {
            Some(words) => words.to_owned(),
            None => format!("damaged: {line:?}"),
        })))
    }

    fn simulated(&self, faults: FaultScript, _boot: u32) -> Option<SimulatedStage> {
        let device = PlainDevice::new(faults);
        let plant = device.body.plant.clone();
        let mm_from_home = |steps| (steps - HOME_SWITCH_AT) as f64 / f64::from(STEPS_PER_MM);
        Some(SimulatedStage::new(device, plant, mm_from_home, 1.0 / f64::from(STEPS_PER_MM)))
    }
}

/// A line with its sum.
fn sealed(words: &str) -> String {
    format!("{words} *{:02x}\n", words.bytes().fold(0_u8, u8::wrapping_add))
}

/// The words of a line whose sum is right.
fn unsealed(line: &str) -> Option<&str> {
    let (words, _) = line.rsplit_once(" *")?;
    (sealed(words).trim_end() == line).then_some(words)
}

/// The host's side: sends orders, waits, reads. What counts as success is decided by epirig.
struct PlainAxis {
    link: Box<dyn Link>,
    inbox: Inbox,
    line: String,
    id: u32,
    travel_mm: f64,
    kinematics: Kinematics,
    stop: StopSwitch,
}

/// What `?` tells.
struct Status {
    state: String,
    position_mm: Option<f64>,
}

impl PlainAxis {
    fn connect(link: Box<dyn Link>) -> Result<Self, StageError> {
        let kinematics = Kinematics { velocity_mm_s: 1.0, acceleration_mm_s2: 1.0, step_mm: 0.0 };
        let (line, travel_mm, stop) = (String::new(), 0.0, StopSwitch::default());
        let mut axis = Self { link, inbox: Inbox::default(), line, id: 0, travel_mm, kinematics, stop };
        let answer = axis.ask("who")?;
        let numbers: Vec<f64> = answer
            .split(' ')
            .skip(1)
            .filter_map(|word| word.parse().ok())
            .filter(|n: &f64| *n > 0.0)
            .collect();
        let [steps_per_mm, travel_um, velocity_mm_s, acceleration_mm_s2] = numbers[..] else {
            return Err(axis.foreign(&answer));
        };
        axis.travel_mm = travel_um / UM_PER_MM;
        axis.kinematics = Kinematics { velocity_mm_s, acceleration_mm_s2, step_mm: 1.0 / steps_per_mm };
        Ok(axis)
    }

    fn foreign(&self, heard: &str) -> StageError {
        StageError::foreign(self.link.name(), NAME, heard, "choose another --driver")
    }

    fn next_line(&mut self, until: Duration) -> Result<Option<String>, StageError> {
        while let Some(byte) = self.inbox.next(&mut *self.link, until)? {
            match byte {
                b'\n' => return Ok(Some(std::mem::take(&mut self.line))),
                byte if self.line.len() < LONGEST_LINE => self.line.push(char::from(byte)),
                _ => self.line.clear(),
            }
        }
        Ok(None)
    }

    /// Asks until an answer to this very question comes.
    fn ask(&mut self, words: &str) -> Result<String, StageError> {
        for _ in 0..TRIES {
            self.id = self.id.wrapping_add(1);
            // What a damaged line has left at the other end would spoil this one.
            self.link.send(format!("\n{}", sealed(&format!("#{} {words}", self.id))).as_bytes())?;
            let until = self.link.now() + REPLY_PATIENCE;
            while let Some(line) = self.next_line(until)? {
                let answer = unsealed(&line).and_then(|words| words.strip_prefix('#')?.split_once(' '));
                match answer.filter(|(id, _)| *id == self.id.to_string()) {
                    Some((_, answer)) => match answer.strip_prefix("no ") {
                        None => return Ok(answer.to_owned()),
                        Some(reason) => return Err(StageError::Refused { reason: reason.to_owned() }),
                    },
                    None => continue,
                }
            }
        }
        let hint = "whether it speaks the plain dialect";
        Err(StageError::no_answer(self.link.name(), words, REPLY_PATIENCE * TRIES, hint))
    }

    fn status(&mut self) -> Result<Status, StageError> {
        let answer = self.ask("?")?;
        let (state, position) = answer.split_once(' ').ok_or_else(|| self.foreign(&answer))?;
        let position_mm = position.parse().ok().map(|um: f64| um / UM_PER_MM);
        Ok(Status { state: state.to_owned(), position_mm })
    }

    /// Starts an operation and waits for its end, while it minds the stop switch.
    fn run(&mut self, order: &str, during: &str, patience: Duration) -> Result<Status, StageError> {
        self.ask(order)?;
        let began = self.link.now();
        let mut was_stopped = false;
        while self.link.now() - began < patience {
            if let Some(urgency) = self.stop.pressed() {
                was_stopped = true;
                self.ask("stop")?;
                self.stop.sent(urgency);
            }
            let status = self.status()?;
            match status.state.as_str() {
                "busy" => {}
                "idle" if was_stopped => {
                    return Err(StageError::Stopped { position_mm: status.position_mm });
                }
                "idle" => return Ok(status),
                fault => {
                    let fault = format!("it reports {fault}; look for what blocks it, then home it");
                    return Err(StageError::fault(during, fault));
                }
            }
            let until = self.link.now() + POLL;
            self.next_line(until)?;
        }
        self.ask("stop")?;
        Err(StageError::too_slow(during, patience))
    }
}

impl Axis for PlainAxis {
    fn identity(&self) -> StageIdentity {
        StageIdentity {
            driver: NAME,
            description: format!("plain stage, {} mm", self.travel_mm),
            port: Some(self.link.name().to_owned()),
        }
    }

    fn travel_mm(&self) -> f64 {
        self.travel_mm
    }

    fn kinematics(&self) -> Kinematics {
        self.kinematics
    }

    // Each answer tells.
    fn is_homed(&self) -> bool {
        true
    }

    // They are built into its firmware.
    fn position_settings(&mut self) -> Result<PositionSettings, StageError> {
        Ok(PositionSettings::new())
    }

    fn home(&mut self) -> Result<Homed, StageError> {
        let patience = self.kinematics.patience(2.0 * self.travel_mm);
        let position_mm = self.run("home", "while homing", patience)?.position_mm;
        Ok(Homed { position_mm: position_mm.ok_or(StageError::NotHomed)?, shift_mm: None })
    }

    fn position_at_rest_mm(&mut self, _during: &str) -> Result<Option<f64>, StageError> {
        Ok(self.status()?.position_mm)
    }

    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        let order = format!("go {:.0}", motion.target_mm * UM_PER_MM);
        Ok(self.run(&order, &motion.during, motion.patience)?.position_mm)
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        let Status { state, position_mm } = self.status()?;
        Ok(StageState { position_mm, moving: state == "busy", at_limit: false })
    }

    fn stop(&mut self) -> Result<(), StageError> {
        self.ask("stop")?;
        let until = self.link.now() + Duration::from_secs(10);
        while self.link.now() < until {
            if self.status()?.state != "busy" {
                return Ok(());
            }
        }
        Err(StageError::TooSlow { during: "stopping".to_owned(), patience_s: 10.0 })
    }

    fn stop_switch(&self) -> StopSwitch {
        self.stop.clone()
    }

    fn now(&self) -> Duration {
        self.link.now()
    }
}

const STEPS_PER_MM: u32 = 250;
const TRAVEL_STEPS: i64 = 150 * STEPS_PER_MM as i64;
const VELOCITY_NM_S: u32 = 5_000_000;
const ACCELERATION_NM_S2: u32 = 20_000_000;
/// 2 mm below the place where the carriage stands at the start.
const HOME_SWITCH_AT: i64 = -500;

/// The device's side, in memory.
struct PlainDevice {
    body: Body,
    position: Option<i64>,
    run: Option<(Run, Way)>,
    homing: bool,
    blocked: bool,
    line: String,
}

impl PlainDevice {
    fn new(faults: FaultScript) -> Self {
        Self {
            body: Body::new(
                faults,
                1.0 / f64::from(STEPS_PER_MM),
                HOME_SWITCH_AT,
                HOME_SWITCH_AT + TRAVEL_STEPS + 500,
            ),
            position: None,
            run: None,
            homing: false,
            blocked: false,
            line: String::new(),
        }
    }

    fn begin(&mut self, steps: i64) {
        let way = if steps > 0 { Way::Out } else { Way::Home };
        let ramp = Ramp::new(VELOCITY_NM_S, ACCELERATION_NM_S2, STEPS_PER_MM, TICK_HZ);
        let count = u32::try_from(steps.unsigned_abs()).unwrap_or(u32::MAX);
        self.run = ramp.map(|ramp| (Run::new(count, ramp), way));
        self.blocked = false;
    }

    fn obey(&mut self, words: &str) -> String {
        match words.split(' ').collect::<Vec<_>>()[..] {
            ["who"] => format!("plain {STEPS_PER_MM} {} 5 20", TRAVEL_STEPS * 4),
            ["?"] => {
                let state = if self.run.is_some() {
                    "busy"
                } else if self.blocked {
                    "fault"
                } else {
                    "idle"
                };
                let position = self.position.map_or("-".to_owned(), |steps| (steps * 4).to_string());
                format!("{state} {position}")
            }
            ["home"] if self.homing => "ok".to_owned(),
            ["home"] => {
                (self.homing, self.position) = (true, None);
                self.begin(-2 * TRAVEL_STEPS);
                "ok".to_owned()
            }
            ["go", um] => match (self.position, um.parse::<i64>().map(|um| um / 4)) {
                (None, _) => "no home".to_owned(),
                (Some(at), Ok(target)) if (0..=TRAVEL_STEPS).contains(&target) => {
                    // An order that comes again while it runs changes nothing.
                    if self.run.is_none() && at != target {
                        self.body.move_begins();
                        self.begin(target - at);
                    } else if at == target {
                        self.body.count_move();
                        self.body.move_ends();
                    }
                    "ok".to_owned()
                }
                _ => "no travel".to_owned(),
            },
            ["stop"] => {
                if let Some((run, _)) = &mut self.run {
                    run.stop();
                }
                "ok".to_owned()
            }
            _ => "no such order".to_owned(),
        }
    }

    fn tick(&mut self) {
        if self.homing && self.body.plant.limits().home {
            (self.homing, self.run, self.position) = (false, None, Some(0));
        }
        let Some((run, way)) = &mut self.run else { return };
        if run.tick() {
            let step = if *way == Way::Out { 1 } else { -1 };
            self.position = self.position.map(|position| position + step);
            self.body.plant.step(*way);
        }
        if run.finished() {
            self.run = None;
            // It has an encoder: a carriage that does not follow, or a home that is never found, is noticed.
            self.blocked = std::mem::take(&mut self.homing) || self.body.troubles.no_motion();
            self.body.move_ends();
        }
    }
}

impl SimulatedDevice for PlainDevice {
    fn receive(&mut self, byte: u8) {
        for byte in self.body.heard(byte) {
            match byte {
                b'\n' => {
                    let line = std::mem::take(&mut self.line);
                    let question = unsealed(&line).and_then(|words| words.split_once(' '));
                    if let Some((id, words)) = question {
                        let answer = sealed(&format!("{id} {}", self.obey(words)));
                        self.body.say(answer.as_bytes());
                    }
                }
                byte if self.line.len() < LONGEST_LINE => self.line.push(char::from(byte)),
                _ => self.line.clear(),
            }
        }
    }

    fn advance(&mut self, time: Duration) {
        match self.body.troubles.advance(time) {
            Some(Mishap::Reset | Mishap::OtherSettings) => {
                (self.run, self.position, self.homing) = (None, None, false);
            }
            Some(Mishap::LimitCloses) => (self.run, self.blocked, self.homing) = (None, true, false),
            Some(Mishap::LimitOpens) | None => {}
        }
        for _ in 0..self.body.ticks(time) {
            self.tick();
        }
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.body.take_sent()
    }

    fn connected(&self) -> bool {
        self.body.troubles.connected()
    }
}
