//! The driver of stages that speak GRBL 1.1.
//!
//! GRBL has no checksums and no ids, and its `ok` means accepted, not done. So one line is outstanding at a time, `G4 P0` is the
//! barrier that answers when motion is done, and no move counts before the position has been read back twice.

mod connect;
mod driver;
mod lines;
mod motion;
mod response;
mod settings;
mod texts;

use std::time::Duration;

use super::{
    Axis, CheckedStage, Homed, Kinematics, Motion, StageError, StageIdentity, StageState, StopSwitch, Urgency,
};
use crate::link::Link;
use connect::{ask, command, greet, hold, no_answer, read_build, read_settings, reset};
pub use driver::Grbl;
use lines::{Heard, Lines};
pub use response::{Response, State, Status};
pub use settings::AxisLetter;
use settings::{ALWAYS_POWERED, AxisSettings, IDLE_DELAY};
pub use texts::{alarm_text, error_text};

/// Speed of the serial line.
pub const BAUD: u32 = 115_200;

const SOFT_RESET: u8 = 0x18;
const STATUS_QUERY: u8 = b'?';
const FEED_HOLD: u8 = b'!';
const MILLIMETRES: &str = "G21";

/// A line is accepted in some 10 ms, settings are written in some 100.
const REPLY_PATIENCE: Duration = Duration::from_secs(2);
const STATUS_PATIENCE: Duration = Duration::from_millis(400);
/// A board boots in two seconds.
const BOOT_PATIENCE: Duration = Duration::from_secs(3);
/// How often a motion under way is looked at.
const POLL: Duration = Duration::from_millis(100);

/// The work offset comes with one answer in so many at the least.
const OFFSET_WITHIN: u32 = 30;
/// How many times an absolute move is sent that has demonstrably not begun.
const TRIES: u32 = 3;

/// GRBL does not tell whether it has been homed or only unlocked. A feed rate that nobody else sets is the mark: it lives until
/// the next reset, and so does the position. GRBL prints feed rates without decimals.
const HOMED_MARK: f64 = 27183.0;
const NOT_HOMED_MARK: f64 = 1.0;

/// How a GRBL stage is to be driven.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrblOptions {
    /// The axis that carries the object.
    pub axis: AxisLetter,
}

impl Default for GrblOptions {
    fn default() -> Self {
        Self { axis: AxisLetter::X }
    }
}

/// A stage that speaks GRBL 1.1, checked.
pub type GrblStage = CheckedStage<GrblAxis>;

impl GrblStage {
    /// Connects to the controller at the other end of `link`.
    ///
    /// # Errors
    /// As [`GrblAxis::connect`].
    pub fn connect(link: Box<dyn Link>, options: GrblOptions) -> Result<Self, StageError> {
        Ok(Self::over(GrblAxis::connect(link, options)?))
    }
}

/// The axis of a stage that speaks GRBL 1.1.
pub struct GrblAxis {
    lines: Lines,
    options: GrblOptions,
    version: String,
    axis: AxisSettings,
    notes: Vec<String>,
    /// Machine coordinate of position 0, in mm; `None` if it is not homed, or no longer surely.
    home_mm: Option<f64>,
    /// Offset of work coordinates, which G-code is written in, in mm.
    work_offset_mm: f64,
    stop: StopSwitch,
}

impl GrblAxis {
    /// Connects to the controller at the other end of `link`, reads its settings and checks them; sets `$1=255`.
    ///
    /// # Errors
    /// [`StageError`] if nothing answers, something else than GRBL 1.1 does, or its settings do not do for a measurement.
    pub fn connect(link: Box<dyn Link>, options: GrblOptions) -> Result<Self, StageError> {
        let mut lines = Lines::new(link);
        let mut status = greet(&mut lines)?;
        let mut notes = Vec::new();
        if !matches!(status.state, State::Idle | State::Alarm) {
            notes.push("it was moving, or held, and nobody waited for it; it has been stopped".to_owned());
            // A motion that nobody waits for any more; it answers no question before it stands.
            hold(&mut lines, || false)?;
            reset(&mut lines)?;
            status = greet(&mut lines)?;
        }
        // Half a line that somebody else has left there would spoil the next one.
        lines.send_line("")?;
        lines.answer(STATUS_PATIENCE)?;
        let build = read_build(&mut lines)?;
        let mut settings = read_settings(&mut lines)?;
        if settings.get(IDLE_DELAY) != Some(ALWAYS_POWERED) {
            command(&mut lines, &format!("${IDLE_DELAY}={ALWAYS_POWERED}"))?;
            settings = read_settings(&mut lines)?;
            if settings.get(IDLE_DELAY) != Some(ALWAYS_POWERED) {
                return Err(StageError::Unsuitable {
                    port: lines.port().to_owned(),
                    what: format!(
                        "it lets go of the motor between moves and does not take ${IDLE_DELAY}=255"
                    ),
                    remedy: "set it by hand".to_owned(),
                });
            }
            notes.push(format!(
                "it let go of the motor between moves; ${IDLE_DELAY} has been set to {ALWAYS_POWERED}"
            ));
        }
        let axis = settings.check(options.axis, build.home_is_origin, lines.port())?;
        notes.extend(axis.notes.iter().cloned());
        let mut stage = Self {
            lines,
            options,
            version: build.version,
            axis,
            notes,
            home_mm: None,
            work_offset_mm: 0.0,
            stop: StopSwitch::default(),
        };
        stage.learn_offset(status.clone())?;
        if status.state == State::Idle && stage.marked_as_homed()? {
            // Somebody may have chosen inches since.
            command(&mut stage.lines, MILLIMETRES)?;
            stage.home_mm = Some(stage.axis.home_mm);
        }
        Ok(stage)
    }

    fn marked_as_homed(&mut self) -> Result<bool, StageError> {
        let mut marked = false;
        let asked = ask(&mut self.lines, "$G", |response| {
            if let Response::Feedback { kind, text } = response {
                let mut feeds = text.split_whitespace().filter_map(|word| word.strip_prefix('F'));
                marked = kind == "GC" && feeds.any(|feed| feed.parse() == Ok(HOMED_MARK));
            }
        });
        match asked {
            Ok(()) => Ok(marked),
            Err(error @ StageError::Link(_)) => Err(error),
            // A controller that cannot tell has not been homed by us.
            Err(_) => Ok(false),
        }
    }

    fn mark(&mut self, feed: f64) -> Result<(), StageError> {
        match command(&mut self.lines, &format!("F{feed}")) {
            // Then the next program will have to home it again.
            Err(StageError::Refused { .. } | StageError::NoAnswer { .. }) => Ok(()),
            other => other,
        }
    }

    /// Forgets the position, here and for who connects next.
    fn distrust(&mut self) -> Result<(), StageError> {
        self.home_mm = None;
        self.mark(NOT_HOMED_MARK)
    }

    /// Asks for the status until it comes.
    fn status(&mut self) -> Result<Status, StageError> {
        for _ in 0..TRIES {
            self.lines.send_byte(STATUS_QUERY)?;
            let until = self.lines.now() + STATUS_PATIENCE;
            while let Heard::Line(response) = self.lines.next(until.saturating_sub(self.lines.now()))? {
                match response {
                    Response::Status(status) => return Ok(self.note_offset(status)),
                    Response::Alarm(code) => return Err(self.alarm(code, "at rest")?),
                    Response::Banner { .. } => return Err(self.restarted("at rest")),
                    _ => {}
                }
            }
        }
        Err(no_answer(&self.lines, "?", STATUS_PATIENCE * TRIES))
    }

    /// The offset comes with every tenth answer at rest and every thirtieth in motion; a controller that never tells it has
    /// none.
    fn learn_offset(&mut self, first: Status) -> Result<(), StageError> {
        let mut status = self.note_offset(first);
        for _ in 0..OFFSET_WITHIN {
            if status.work_offset_mm.is_some() {
                break;
            }
            status = self.status()?;
        }
        Ok(())
    }

    fn note_offset(&mut self, status: Status) -> Status {
        let index = self.options.axis.index();
        if let Some(offset) = status.work_offset_mm.as_ref().and_then(|offsets| offsets.get(index)) {
            self.work_offset_mm = *offset;
        }
        status
    }

    fn machine_mm(&self, status: &Status) -> Option<f64> {
        let offset_mm = if status.is_work_position { self.work_offset_mm } else { 0.0 };
        status.position_mm.get(self.options.axis.index()).map(|mm| mm + offset_mm)
    }

    fn position_of(&self, status: &Status) -> Option<f64> {
        self.place_mm(self.machine_mm(status)?)
    }

    /// The place of a machine coordinate, in mm from home; `None` if it is not homed.
    fn place_mm(&self, machine_mm: f64) -> Option<f64> {
        // Never minus zero.
        Some((machine_mm - self.home_mm?) * self.axis.outwards + 0.0)
    }

    fn restarted(&mut self, during: &str) -> StageError {
        self.home_mm = None;
        StageError::Restarted { during: during.to_owned() }
    }

    /// After an alarm GRBL wants a reset before it says anything else.
    fn alarm(&mut self, code: u8, during: &str) -> Result<StageError, StageError> {
        self.home_mm = None;
        reset(&mut self.lines)?;
        Ok(StageError::Fault {
            during: during.to_owned(),
            fault: format!("{} (ALARM:{code})", alarm_text(code)),
        })
    }
}

impl Axis for GrblAxis {
    fn identity(&self) -> StageIdentity {
        StageIdentity {
            driver: driver::NAME,
            description: format!(
                "GRBL {}, axis {}, {} mm",
                self.version,
                self.options.axis.letter(),
                self.axis.travel_mm
            ),
            port: Some(self.lines.port().to_owned()),
        }
    }

    fn travel_mm(&self) -> f64 {
        self.axis.travel_mm
    }

    fn kinematics(&self) -> Kinematics {
        self.axis.kinematics
    }

    fn is_homed(&self) -> bool {
        self.home_mm.is_some()
    }

    fn home(&mut self) -> Result<Homed, StageError> {
        // Whatever it was doing or waiting for ends here.
        if !self.status().is_ok_and(|status| matches!(status.state, State::Idle | State::Alarm)) {
            reset(&mut self.lines)?;
        }
        self.distrust()?;
        let began = self.lines.now();
        let patience = Duration::try_from_secs_f64(2.0 * self.axis.homing_s)
            .unwrap_or(Duration::MAX)
            .saturating_add(BOOT_PATIENCE);
        self.barrier("$H", "while homing", patience, None)?;
        let took_s = (self.lines.now() - began).as_secs_f64();
        command(&mut self.lines, MILLIMETRES)?;
        let machine_mm = self.machine_mm_at_rest("while homing", BOOT_PATIENCE)?;
        // An `ok` is not enough: one flipped bit makes `$X` of `$H`, which unlocks without moving.
        let off_mm = (machine_mm - self.axis.home_mm).abs();
        if off_mm > self.axis.kinematics.step_mm || took_s < self.axis.least_homing_s {
            return Err(StageError::Fault {
                during: "while homing".to_owned(),
                fault: format!(
                    "it says that it is done after {took_s:.2} s at {machine_mm} mm, and its settings put home at {} mm after {:.2} s at least; home it again",
                    self.axis.home_mm, self.axis.least_homing_s
                ),
            });
        }
        self.home_mm = Some(machine_mm);
        self.mark(HOMED_MARK)?;
        Ok(Homed { position_mm: 0.0, shift_mm: None })
    }

    fn position_at_rest_mm(&mut self, during: &str) -> Result<Option<f64>, StageError> {
        let machine_mm = self.machine_mm_at_rest(during, BOOT_PATIENCE)?;
        Ok(self.place_mm(machine_mm))
    }

    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        self.run(motion)
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        let status = self.status()?;
        let at_limit = status.pins.contains(self.options.axis.letter());
        Ok(StageState { position_mm: self.position_of(&status), moving: status.state.moving(), at_limit })
    }

    fn stop(&mut self) -> Result<(), StageError> {
        let status = self.status()?;
        if status.state.moving() || matches!(status.state, State::Hold { .. }) {
            self.stop_motion(Urgency::Soon)?;
        }
        Ok(())
    }

    fn stop_switch(&self) -> StopSwitch {
        self.stop.clone()
    }

    fn forget_position(&mut self) {
        // What has failed may fail again; the first error is the one to tell.
        let _ = self.distrust();
    }

    fn now(&self) -> Duration {
        self.lines.now()
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    // Connecting sets and checks it ($1=255).
    fn holds_at_rest(&self) -> Option<bool> {
        Some(true)
    }
}
