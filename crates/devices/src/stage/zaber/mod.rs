//! The driver of stages that speak the Zaber ASCII protocol, version 3.

mod message;

use std::time::Duration;

use super::tolerance::Kinematics;
use super::{
    Dialect, MotionLimits, Stage, StageError, StageIdentity, StageState, StopSwitch, Urgency, on_travel,
};
use crate::link::{Inbox, Link};
pub use message::ZaberReply;
pub(in crate::stage) use message::command;
use message::{fault_text, rejection_text};

/// Speed of the serial line.
pub const BAUD: u32 = 115_200;

const UM_PER_MM: f64 = 1000.0;
const REPLY_PATIENCE: Duration = Duration::from_millis(300);
const TRIES: u32 = 8;
/// So many rejections of a command are meant.
const REJECTIONS: u32 = 3;
const POLL: Duration = Duration::from_millis(50);
const HIGHEST_ID: u8 = 99;
const LONGEST: usize = 256;
/// Warnings after which its count of steps is not to be believed.
const LOST: [&str; 5] = ["WR", "WM", "FS", "WS", "WL"];
/// Homing ends at position 0, or beside it on a stage with an encoder.
const HOME_WITHIN_MM: f64 = 0.1;

/// The protocol's velocities are microsteps a second times this; its accelerations that over 10000 (protocol manual).
const VELOCITY_UNIT: f64 = 1.6384;
const ACCELERATION_UNIT: f64 = 1.6384 / 10_000.0;

/// How a Zaber stage is to be driven.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZaberOptions {
    /// Number of the device in its chain.
    pub device: u8,
    /// Number of the axis.
    pub axis: u8,
    /// Length of a microstep, in um: in the stage's data sheet.
    pub microstep_um: f64,
    /// When a move counts as done; stages with encoders need a tolerance.
    pub limits: MotionLimits,
}

/// A stage that speaks the Zaber ASCII protocol.
///
/// Commands carry ids and checksums, and replies are asked to. Moves are absolute, so a command that was not answered is sent
/// again.
pub struct ZaberStage {
    link: Box<dyn Link>,
    options: ZaberOptions,
    inbox: Inbox,
    line: Vec<u8>,
    id: u8,
    heard: Option<String>,
    description: String,
    travel_mm: f64,
    kinematics: Kinematics,
    trusted: bool,
    stop: StopSwitch,
}

impl ZaberStage {
    /// Connects to the stage at the other end of `link`, switches checksums on and reads its limits.
    ///
    /// # Errors
    /// [`StageError`] if nothing answers or what answers is no such stage.
    pub fn connect(link: Box<dyn Link>, options: ZaberOptions) -> Result<Self, StageError> {
        let mut stage = Self {
            link,
            options,
            inbox: Inbox::default(),
            line: Vec::new(),
            id: 0,
            heard: None,
            description: String::new(),
            travel_mm: 0.0,
            kinematics: Kinematics { velocity_mm_s: 1.0, acceleration_mm_s2: 1.0, step_mm: 0.0 },
            trusted: true,
            stop: StopSwitch::default(),
        };
        let valid_microstep = options.microstep_um.is_finite() && options.microstep_um > 0.0;
        if !valid_microstep {
            return Err(StageError::Refused {
                reason: "the length of a microstep must be positive".to_owned(),
            });
        }
        stage.ask(0, "set comm.checksum 1")?;
        let model = stage.ask(0, "get device.id")?.data;
        let version = stage.ask(0, "get version")?.data;
        stage.travel_mm = stage.number("get limit.max")? * stage.microstep_mm();
        stage.kinematics = Kinematics {
            velocity_mm_s: stage.number("get maxspeed")? / VELOCITY_UNIT * stage.microstep_mm(),
            acceleration_mm_s2: stage.number("get accel")? / ACCELERATION_UNIT * stage.microstep_mm(),
            step_mm: stage.microstep_mm(),
        };
        if stage.travel_mm.min(stage.kinematics.velocity_mm_s) <= 0.0 {
            return Err(stage.foreign("it has no travel or no speed".to_owned()));
        }
        stage.description = format!("Zaber device {model}, firmware {version}, {:.1} mm", stage.travel_mm);
        Ok(stage)
    }

    fn microstep_mm(&self) -> f64 {
        self.options.microstep_um / UM_PER_MM
    }

    fn port(&self) -> String {
        self.link.name().to_owned()
    }

    fn foreign(&self, heard: String) -> StageError {
        let hint = "check its protocol (ASCII, 115200 baud), or choose another --driver".to_owned();
        StageError::Foreign { port: self.port(), expected: Dialect::Zaber.name(), heard, hint }
    }

    /// Sends a command to the axis, or to the device as a whole (0), until it is answered.
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
                        // A command that lost its colon has no checksum: one rejection may be the line's fault.
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
            Some(line) if line.starts_with('@') => StageError::Foreign {
                port: self.port(),
                expected: Dialect::Zaber.name(),
                heard: format!("its reply \"{}\" is damaged", line.escape_default()),
                hint: "the line is noisy: check cable and earth".to_owned(),
            },
            Some(line) => self.foreign(format!("it says \"{}\"", line.escape_default())),
            None => StageError::NoAnswer {
                port: self.port(),
                asked: if words.is_empty() { "status" } else { words }.to_owned(),
                patience_s: (REPLY_PATIENCE * TRIES).as_secs_f64(),
                hint: "whether it speaks Zaber ASCII at 115200 baud (else choose another --driver)",
            },
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
        let data = self.ask(self.options.axis, words)?.data;
        let number = data.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.foreign(format!("\"{data}\" to \"{words}\"")))
    }

    /// All warnings that are in force. A reply shows only the one of the highest priority, which may hide that the reference is lost.
    fn warnings(&mut self, reply: &ZaberReply, words: &str) -> Result<Vec<String>, StageError> {
        if reply.warning == "--" {
            return Ok(Vec::new());
        }
        // Their number, then their names.
        let data = self.ask(self.options.axis, words)?.data;
        Ok(data.split_whitespace().skip(1).map(str::to_owned).collect())
    }

    /// Where it is, if it has a reference.
    fn look(&mut self) -> Result<(Option<f64>, ZaberReply), StageError> {
        let reply = self.ask(self.options.axis, "get pos")?;
        let warnings = self.warnings(&reply, "warnings")?;
        let microsteps: f64 =
            reply.data.parse().map_err(|_| self.foreign(format!("\"{}\" to \"get pos\"", reply.data)))?;
        let lost = warnings.iter().any(|warning| LOST.contains(&warning.as_str()));
        let known = self.trusted && !lost;
        Ok((known.then_some(microsteps * self.microstep_mm()), reply))
    }

    /// Starts an operation and waits until the axis is idle.
    fn operate(&mut self, words: &str, during: &str, patience: Duration) -> Result<(), StageError> {
        self.refuse_if_stopped()?;
        self.ask(self.options.axis, words)?;
        let since = self.link.now();
        let mut stopped = None;
        while self.link.now() - since < patience {
            let urgency = self.stop.pressed();
            if urgency.is_some() {
                stopped = urgency;
                let stop = if urgency == Some(Urgency::AtOnce) { "estop" } else { "stop" };
                self.ask(self.options.axis, stop)?;
            }
            let reply = self.ask(self.options.axis, "")?;
            if !reply.busy {
                let warnings = self.warnings(&reply, "warnings")?;
                let fault =
                    warnings.iter().find_map(|warning| fault_text(warning).map(|text| (text, warning)));
                return match (stopped, fault) {
                    // A motor that is stopped dead may slip.
                    (Some(Urgency::AtOnce), _) => {
                        self.trusted = false;
                        Err(StageError::Stopped { position_mm: None })
                    }
                    (_, Some((text, warning))) => Err(StageError::Fault {
                        during: during.to_owned(),
                        fault: format!("{text} ({warning})"),
                    }),
                    (Some(Urgency::Soon), None) => Err(StageError::Stopped { position_mm: self.look()?.0 }),
                    (None, None) if warnings.iter().any(|warning| warning == "NI") => {
                        Err(StageError::Fault {
                            during: during.to_owned(),
                            fault:
                                "something else interrupted it (NI); end what gives it orders, then home it"
                                    .to_owned(),
                        })
                    }
                    (None, None) => Ok(()),
                };
            }
            // Nothing is said unasked: this waits.
            let until = self.link.now() + POLL;
            self.next_line(until)?;
        }
        self.ask(self.options.axis, "stop")?;
        Err(StageError::TooSlow { during: during.to_owned(), patience_s: patience.as_secs_f64() })
    }

    fn refuse_if_stopped(&mut self) -> Result<(), StageError> {
        if self.stop.pressed().is_none() {
            return Ok(());
        }
        Err(StageError::Stopped { position_mm: self.look()?.0 })
    }

    fn move_and_check(&mut self, target_mm: f64) -> Result<(), StageError> {
        let during = format!("in the move to {target_mm:.3} mm");
        let (Some(from_mm), _) = self.look()? else { return Err(StageError::NotHomed) };
        let microsteps = (target_mm / self.microstep_mm()).round();
        let began = self.link.now();
        let patience = self.kinematics.patience(target_mm - from_mm);
        self.operate(&format!("move abs {microsteps:.0}"), &during, patience)?;
        let took = self.link.now() - began;
        let (Some(reported_mm), _) = self.look()? else { return Err(StageError::NotHomed) };
        self.options.limits.check(&self.kinematics, from_mm, target_mm, reported_mm, took)
    }
}

impl Stage for ZaberStage {
    fn identity(&self) -> StageIdentity {
        StageIdentity {
            dialect: Dialect::Zaber,
            description: self.description.clone(),
            port: Some(self.port()),
        }
    }

    fn travel_mm(&self) -> f64 {
        self.travel_mm
    }

    fn home(&mut self) -> Result<(), StageError> {
        self.trusted = false;
        // What it has warned of stays in force until it is cleared, and so would this homing fail.
        self.ask(self.options.axis, "warnings clear")?;
        let patience = self.kinematics.patience(self.travel_mm).saturating_mul(4);
        self.operate("home", "while homing", patience)?;
        self.trusted = true;
        let (position_mm, _) = self.look()?;
        self.trusted = position_mm.is_some_and(|position_mm| position_mm.abs() <= HOME_WITHIN_MM);
        if self.trusted {
            return Ok(());
        }
        Err(StageError::Fault {
            during: "while homing".to_owned(),
            fault: "it says that it is done and is not at home; home it again".to_owned(),
        })
    }

    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError> {
        if !self.trusted {
            return Err(StageError::NotHomed);
        }
        let target_mm = on_travel(position_mm, self.travel_mm)?;
        let moved = self.move_and_check(target_mm);
        let kept = |error: &StageError| {
            matches!(error, StageError::Stopped { position_mm: Some(_) } | StageError::Refused { .. })
        };
        self.trusted = self.trusted && moved.as_ref().err().is_none_or(kept);
        moved
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
        self.ask(self.options.axis, "stop")?;
        let until = self.link.now() + Duration::from_secs(10);
        while self.link.now() < until {
            if !self.ask(self.options.axis, "")?.busy {
                return Ok(());
            }
        }
        self.ask(self.options.axis, "estop")?;
        self.trusted = false;
        Err(StageError::TooSlow { during: "stopping".to_owned(), patience_s: 10.0 })
    }

    fn stop_switch(&self) -> StopSwitch {
        self.stop.clone()
    }

    fn expected_duration(&self, distance_mm: f64) -> Option<Duration> {
        Some(self.kinematics.duration(distance_mm))
    }
}
