//! The driver for stages with the Zaber ASCII protocol, version 3.

mod driver;
mod message;

use std::time::Duration;

use super::{
    Axis, CheckedStage, Homed, Kinematics, Motion, PositionSettings, StageError, StageIdentity, StageState,
    StopSwitch, Urgency,
};
use crate::link::{Inbox, Link};
pub use driver::Zaber;
pub use message::ZaberReply;
pub(in crate::stage) use message::checksum;
use message::{command, fault_text, rejection_text};

/// Name of the driver.
const NAME: &str = "zaber";

/// Number of the axis: a stage of one axis is its first.
const AXIS: u8 = 1;

/// Baud rate of the serial line.
pub const BAUD: u32 = 115_200;

/// Microsteps per step, the ends of the travel, and the count at the home sensor. Models differ in which they
/// have.
const POSITION_SETTINGS: [&str; 4] = ["resolution", "limit.min", "limit.max", "limit.home.preset"];

const UM_PER_MM: f64 = 1000.0;
const REPLY_PATIENCE: Duration = Duration::from_millis(300);
const TRIES: u32 = 8;
/// What is echoed is shorter than the longest line.
const ECHO_NUMBERS: u64 = 1_000_000_000;
/// Attempts to hear the echo behind the answers to a former process, which come at once when they come.
const ECHOES: u32 = 10;
/// After this number of rejections a command fails.
const REJECTIONS: u32 = 3;
const POLL: Duration = Duration::from_millis(50);
const HIGHEST_ID: u8 = 99;
const LONGEST: usize = 256;
/// Warnings after which the step count is invalid.
const LOST: [&str; 5] = ["WR", "WM", "FS", "WS", "WL"];

/// The protocol's velocity is microsteps per second times this; its acceleration is the same over 10000
/// (protocol manual).
const VELOCITY_UNIT: f64 = 1.6384;
const ACCELERATION_UNIT: f64 = 1.6384 / 10_000.0;

/// Options of a Zaber stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZaberOptions {
    /// Number of the device in its chain.
    pub device: u8,
    /// Length of a microstep, in um, from the data sheet.
    pub microstep_um: f64,
}

/// A stage with the Zaber ASCII protocol, checked. A stage with an encoder needs a position tolerance.
pub type ZaberStage = CheckedStage<ZaberAxis>;

impl ZaberStage {
    /// Connects to the stage on `link`.
    ///
    /// # Errors
    /// As [`ZaberAxis::connect`].
    pub fn connect(link: Box<dyn Link>, options: ZaberOptions) -> Result<Self, StageError> {
        Ok(Self::over(Box::new(ZaberAxis::connect(link, options)?)))
    }
}

/// The axis of a stage with the Zaber ASCII protocol.
///
/// Commands carry ids and checksums, and replies must carry them too. Moves are absolute, so a command
/// without an answer is sent again.
pub struct ZaberAxis {
    link: Box<dyn Link>,
    options: ZaberOptions,
    inbox: Inbox,
    line: Vec<u8>,
    id: u8,
    heard: Option<String>,
    description: String,
    travel_mm: f64,
    kinematics: Kinematics,
    stop: StopSwitch,
}

impl ZaberAxis {
    /// Connects to the stage on `link`, switches checksums on and reads its limits.
    ///
    /// # Errors
    /// [`StageError`] if nothing answers, or something else answers.
    pub fn connect(link: Box<dyn Link>, options: ZaberOptions) -> Result<Self, StageError> {
        let mut stage = Self {
            id: (link.session() % u64::from(HIGHEST_ID)) as u8,
            link,
            options,
            inbox: Inbox::default(),
            line: Vec::new(),
            heard: None,
            description: String::new(),
            travel_mm: 0.0,
            kinematics: Kinematics { velocity_mm_s: 1.0, acceleration_mm_s2: 1.0, step_mm: 0.0 },
            stop: StopSwitch::default(),
        };
        let valid_microstep = options.microstep_um.is_finite() && options.microstep_um > 0.0;
        if !valid_microstep {
            return Err(StageError::Refused {
                reason: "the length of a microstep must be positive".to_owned(),
            });
        }
        stage.synchronise()?;
        let model = stage.ask(0, "get device.id")?.data;
        let version = stage.ask(0, "get version")?.data;
        stage.read_limits()?;
        stage.description = format!("Zaber device {model}, firmware {version}, {:.1} mm", stage.travel_mm);
        Ok(stage)
    }

    fn read_limits(&mut self) -> Result<(), StageError> {
        self.travel_mm = self.number("get limit.max")? * self.microstep_mm();
        self.kinematics = Kinematics {
            velocity_mm_s: self.number("get maxspeed")? / VELOCITY_UNIT * self.microstep_mm(),
            acceleration_mm_s2: self.number("get accel")? / ACCELERATION_UNIT * self.microstep_mm(),
            step_mm: self.microstep_mm(),
        };
        if self.travel_mm.min(self.kinematics.velocity_mm_s) <= 0.0 {
            return Err(self.foreign("it has no travel or no speed".to_owned()));
        }
        Ok(())
    }

    /// Waits until all answers to a former process have come: the device answers in order, and only it knows
    /// the number to repeat. It also switches checksums on.
    fn synchronise(&mut self) -> Result<(), StageError> {
        let number = (self.link.session() % ECHO_NUMBERS).to_string();
        for _ in 0..ECHOES {
            self.inbox.drain(&mut *self.link)?;
            self.line.clear();
            self.ask(0, "set comm.checksum 1")?;
            if self.ask(0, &format!("tools echo {number}"))?.data == number {
                return Ok(());
            }
        }
        Err(self.foreign("its answers are not those to the questions".to_owned()))
    }

    fn microstep_mm(&self) -> f64 {
        self.options.microstep_um / UM_PER_MM
    }

    fn foreign(&self, heard: String) -> StageError {
        let hint = "check its protocol (ASCII, 115200 baud), or choose another --driver";
        StageError::foreign(self.link.name(), NAME, heard, hint)
    }

    /// Sends a command to the axis, or to the whole device (0), until it is answered.
    fn ask(&mut self, axis: u8, words: &str) -> Result<ZaberReply, StageError> {
        let mut rejections = 0;
        for _ in 0..TRIES {
            self.id = if self.id == HIGHEST_ID { 1 } else { self.id + 1 };
            self.link.send(command(self.options.device, axis, self.id, words).as_bytes())?;
            let until = self.link.now() + REPLY_PATIENCE;
            while let Some(line) = self.next_line(until)? {
                match ZaberReply::parse(&line) {
                    Some(reply) if reply.id == self.id && reply.device == self.options.device => {
                        if reply.accepted {
                            return Ok(reply);
                        }
                        // A command that lost its colon has no checksum, so one rejection may come from line
                        // noise.
                        rejections += 1;
                        if rejections == REJECTIONS {
                            return Err(StageError::Refused { reason: rejection_text(&reply.data) });
                        }
                        break;
                    }
                    Some(_) => {}
                    None => self.heard = Some(line.chars().take(60).collect()),
                }
            }
        }
        Err(match &self.heard {
            Some(line) if line.starts_with('@') => {
                let heard = format!("its reply \"{}\" is damaged", line.escape_default());
                let hint = "the line is noisy: check cable and earth";
                StageError::foreign(self.link.name(), NAME, heard, hint)
            }
            Some(line) => self.foreign(format!("it says \"{}\"", line.escape_default())),
            None => {
                let asked = if words.is_empty() { "status" } else { words };
                let hint = "whether it speaks Zaber ASCII at 115200 baud (else choose another --driver)";
                StageError::no_answer(self.link.name(), asked, REPLY_PATIENCE * TRIES, hint)
            }
        })
    }

    fn next_line(&mut self, until: Duration) -> Result<Option<String>, StageError> {
        while let Some(byte) = self.inbox.next(&mut *self.link, until)? {
            match byte {
                b'\r' | b'\n' if self.line.is_empty() => {}
                b'\r' | b'\n' => {
                    let line = std::mem::take(&mut self.line);
                    return Ok(Some(String::from_utf8_lossy(&line).into_owned()));
                }
                other if self.line.len() < LONGEST => self.line.push(other),
                _ => self.line.clear(),
            }
        }
        Ok(None)
    }

    fn number(&mut self, words: &str) -> Result<f64, StageError> {
        let data = self.ask(AXIS, words)?.data;
        let number = data.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.foreign(format!("\"{data}\" to \"{words}\"")))
    }

    /// All active warnings. A reply shows only the one of the highest priority, which may conceal a lost
    /// reference.
    fn warnings(&mut self, reply: &ZaberReply) -> Result<Vec<String>, StageError> {
        if reply.warning == "--" {
            return Ok(Vec::new());
        }
        // Their number, then their names.
        let data = self.ask(AXIS, "warnings")?.data;
        Ok(data.split_whitespace().skip(1).map(str::to_owned).collect())
    }

    /// The position, if it has a reference.
    fn look(&mut self) -> Result<(Option<f64>, ZaberReply), StageError> {
        let reply = self.ask(AXIS, "get pos")?;
        let warnings = self.warnings(&reply)?;
        let microsteps: f64 =
            reply.data.parse().map_err(|_| self.foreign(format!("\"{}\" to \"get pos\"", reply.data)))?;
        let lost = warnings.iter().any(|warning| LOST.contains(&warning.as_str()));
        Ok(((!lost).then_some(microsteps * self.microstep_mm()), reply))
    }

    /// Starts an operation, and waits until the axis is idle.
    fn operate(&mut self, words: &str, during: &str, patience: Duration) -> Result<(), StageError> {
        self.ask(AXIS, words)?;
        let since = self.link.now();
        let mut stopped = None;
        while self.link.now() - since < patience {
            let urgency = self.stop.pressed();
            if urgency.is_some() {
                stopped = urgency;
                let stop = if urgency == Some(Urgency::AtOnce) { "estop" } else { "stop" };
                self.ask(AXIS, stop)?;
                urgency.into_iter().for_each(|urgency| self.stop.sent(urgency));
            }
            let reply = self.ask(AXIS, "")?;
            if !reply.busy {
                let warnings = self.warnings(&reply)?;
                let fault =
                    warnings.iter().find_map(|warning| fault_text(warning).map(|text| (text, warning)));
                return match (stopped, fault) {
                    // A motor that is stopped at once may slip.
                    (Some(Urgency::AtOnce), _) => Err(StageError::Stopped { position_mm: None }),
                    (_, Some((text, warning))) => {
                        Err(StageError::fault(during, format!("{text} ({warning})")))
                    }
                    (Some(Urgency::Soon), None) => Err(StageError::Stopped { position_mm: self.look()?.0 }),
                    (None, None) if warnings.iter().any(|warning| warning == "NI") => Err(StageError::fault(
                        during,
                        "something else interrupted it (NI); end the program that sends commands, then home it",
                    )),
                    (None, None) => Ok(()),
                };
            }
            // The device sends nothing by itself, so this is only a wait.
            let until = self.link.now() + POLL;
            self.next_line(until)?;
        }
        self.ask(AXIS, "stop")?;
        Err(StageError::too_slow(during, patience))
    }
}

impl Axis for ZaberAxis {
    fn identity(&self) -> StageIdentity {
        let port = Some(self.link.name().to_owned());
        StageIdentity { driver: NAME, description: self.description.clone(), port }
    }

    fn travel_mm(&self) -> f64 {
        self.travel_mm
    }

    fn kinematics(&self) -> Kinematics {
        self.kinematics
    }

    /// Its warnings show in each answer whether it has a reference.
    fn is_homed(&self) -> bool {
        true
    }

    fn position_settings(&mut self) -> Result<PositionSettings, StageError> {
        // A device that has restarted sends no checksums.
        self.synchronise()?;
        self.read_limits()?;
        let mut settings = PositionSettings::new();
        for name in POSITION_SETTINGS {
            match self.number(&format!("get {name}")) {
                Ok(value) => drop(settings.insert(name.to_owned(), value)),
                Err(StageError::Refused { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(settings)
    }

    fn home(&mut self) -> Result<Homed, StageError> {
        // Old warnings stay active until cleared, and would make this homing fail.
        self.ask(AXIS, "warnings clear")?;
        let patience = self.kinematics.patience(self.travel_mm).saturating_mul(4);
        self.operate("home", "while homing", patience)?;
        let position_mm = self.look()?.0.ok_or_else(|| {
            StageError::fault(
                "while homing",
                "it reports the end of homing without a reference; home it again",
            )
        })?;
        Ok(Homed { position_mm, shift_mm: None })
    }

    fn position_at_rest_mm(&mut self, _during: &str) -> Result<Option<f64>, StageError> {
        Ok(self.look()?.0)
    }

    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        let microsteps = (motion.target_mm / self.microstep_mm()).round();
        self.operate(&format!("move abs {microsteps:.0}"), &motion.during, motion.patience)?;
        Ok(self.look()?.0)
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        let (position_mm, reply) = self.look()?;
        Ok(StageState {
            position_mm,
            moving: reply.busy,
            at_limit: matches!(reply.warning.as_str(), "FE" | "WL"),
        })
    }

    fn stop(&mut self) -> Result<(), StageError> {
        self.ask(AXIS, "stop")?;
        let until = self.link.now() + Duration::from_secs(10);
        while self.link.now() < until {
            if !self.ask(AXIS, "")?.busy {
                return Ok(());
            }
        }
        self.ask(AXIS, "estop")?;
        Err(StageError::TooSlow { during: "stopping".to_owned(), patience_s: 10.0 })
    }

    fn stop_switch(&self) -> StopSwitch {
        self.stop.clone()
    }

    fn now(&self) -> Duration {
        self.link.now()
    }
}
