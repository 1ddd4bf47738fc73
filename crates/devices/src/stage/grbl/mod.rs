//! The driver for stages with GRBL 1.1.
//!
//! GRBL has no checksums and no ids, and its `ok` means accepted, not done. So only one line is outstanding
//! at a time, `G4 P0` serves as a barrier that answers at the end of motion, and no move counts before its
//! position has been read twice.

mod connect;
mod driver;
mod lines;
mod motion;
mod protocol;
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
pub use protocol::BAUD;
use protocol::{
    BOOT_PATIENCE, HOMED_MARK, MILLIMETRES, NAME, NOT_HOMED_MARK, OFFSET_WITHIN, STATUS_PATIENCE,
    STATUS_QUERY, TRIES,
};
pub use response::{Response, State, Status};
pub use settings::AxisLetter;
use settings::{ALWAYS_POWERED, AxisSettings, IDLE_DELAY};
pub use texts::{alarm_text, error_text};

/// Options of a GRBL stage.
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

/// A stage with GRBL 1.1, checked.
pub type GrblStage = CheckedStage<GrblAxis>;

impl GrblStage {
    /// Connects to the controller on `link`.
    ///
    /// # Errors
    /// As [`GrblAxis::connect`].
    pub fn connect(link: Box<dyn Link>, options: GrblOptions) -> Result<Self, StageError> {
        Ok(Self::over(GrblAxis::connect(link, options)?))
    }
}

/// The axis of a stage with GRBL 1.1.
pub struct GrblAxis {
    lines: Lines,
    options: GrblOptions,
    version: String,
    axis: AxisSettings,
    notes: Vec<String>,
    /// Machine coordinate of position 0, in mm; `None` if it is not homed, or uncertain.
    home_mm: Option<f64>,
    /// Offset of the work coordinates, which G-code uses, in mm.
    work_offset_mm: f64,
    stop: StopSwitch,
}

impl GrblAxis {
    /// Connects to the controller on `link`, reads and checks its settings, and sets `$1=255`.
    ///
    /// # Errors
    /// [`StageError`] if nothing answers, something else than GRBL 1.1 answers, or its settings prevent a
    /// measurement.
    pub fn connect(link: Box<dyn Link>, options: GrblOptions) -> Result<Self, StageError> {
        let mut lines = Lines::new(link);
        let mut status = greet(&mut lines)?;
        let mut notes = Vec::new();
        if !matches!(status.state, State::Idle | State::Alarm) {
            notes.push("it was moving or held, without a host; it has been stopped".to_owned());
            // A motion of a former host; it answers no question before it is at rest.
            hold(&mut lines, || false)?;
            reset(&mut lines)?;
            status = greet(&mut lines)?;
        }
        // An incomplete line of another program would spoil the next one.
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
                    what: format!("it switches the motor off between moves and refuses ${IDLE_DELAY}=255"),
                    remedy: "set it by hand".to_owned(),
                });
            }
            notes.push(format!(
                "it switched the motor off between moves; ${IDLE_DELAY} has been set to {ALWAYS_POWERED}"
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
            // Another program may have selected inches.
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
            // Without an answer, this program has not homed it.
            Err(_) => Ok(false),
        }
    }

    fn mark(&mut self, feed: f64) -> Result<(), StageError> {
        match command(&mut self.lines, &format!("F{feed}")) {
            // If that fails, the next program has to home it again.
            Err(StageError::Refused { .. } | StageError::NoAnswer { .. }) => Ok(()),
            other => other,
        }
    }

    /// Invalidates the position, here and for the next program that connects.
    fn distrust(&mut self) -> Result<(), StageError> {
        self.home_mm = None;
        self.mark(NOT_HOMED_MARK)
    }

    /// Asks for the status until there is an answer.
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

    /// The offset comes with every tenth answer at rest and every thirtieth in motion. A controller that
    /// never reports one has none.
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

    /// A machine coordinate in mm from home; `None` if it is not homed.
    fn place_mm(&self, machine_mm: f64) -> Option<f64> {
        // Avoids minus zero.
        Some((machine_mm - self.home_mm?) * self.axis.outwards + 0.0)
    }

    fn restarted(&mut self, during: &str) -> StageError {
        self.home_mm = None;
        StageError::Restarted { during: during.to_owned() }
    }

    /// After an alarm GRBL needs a reset before it answers.
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
            driver: NAME,
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
        // Ends any operation, and any wait.
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
        // An `ok` is not enough: one flipped bit turns `$H` into `$X`, which unlocks without homing.
        let off_mm = (machine_mm - self.axis.home_mm).abs();
        if off_mm > self.axis.kinematics.step_mm || took_s < self.axis.least_homing_s {
            return Err(StageError::Fault {
                during: "while homing".to_owned(),
                fault: format!(
                    "it reports the end of homing after {took_s:.2} s at {machine_mm} mm, but by its settings home is at {} mm after {:.2} s at least; home it again",
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
        // A failed command may fail again; the first error is reported.
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
