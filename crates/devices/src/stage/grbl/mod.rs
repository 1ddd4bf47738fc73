//! The driver for stages with GRBL 1.1.
//!
//! GRBL has no checksums and no ids, and its `ok` means accepted, not done. So only one line is outstanding
//! at a time, orders have a form that damage makes harmless (`order`), a motion is watched, and no position
//! counts before it has been read twice.

mod connect;
mod console;
mod driver;
mod homing;
mod lines;
mod mark;
mod motion;
mod order;
mod protocol;
mod response;
mod rest;
mod settings;
mod texts;

use std::time::Duration;

use super::{
    Axis, CheckedStage, Homed, Kinematics, Motion, PositionSettings, StageError, StageIdentity, StageState,
    StopSwitch, Urgency, WhenMoving,
};
use crate::link::Link;
use connect::{greet, hold, outlast, power_always, read_feed, read_settings, reset, set_feed};
pub use driver::Grbl;
use lines::Lines;
pub(in crate::stage) use lines::is_of_grbl;
use mark::NOT_HOMED;
pub use protocol::BAUD;
use protocol::{NAME, STATUS_PATIENCE};
pub use response::{Response, State, Status};
pub use settings::AxisLetter;
use settings::{ALWAYS_POWERED, AxisSettings, HomeIs, IDLE_DELAY, Settings};
pub use texts::{alarm_text, error_text};

/// Options of a GRBL stage.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GrblOptions {
    /// The axis that carries the object.
    pub axis: AxisLetter,
    /// What to do if it moves when it is connected.
    pub when_moving: WhenMoving,
}

/// A stage with GRBL 1.1, checked.
pub type GrblStage = CheckedStage<GrblAxis>;

impl GrblStage {
    /// Connects to the controller on `link`.
    ///
    /// # Errors
    /// As [`GrblAxis::connect`].
    pub fn connect(link: Box<dyn Link>, options: GrblOptions) -> Result<Self, StageError> {
        Ok(Self::over(Box::new(GrblAxis::connect(link, options)?)))
    }
}

/// The axis of a stage with GRBL 1.1.
pub struct GrblAxis {
    lines: Lines,
    options: GrblOptions,
    /// The axis with the home that it was found at, or else the home that leaves less travel.
    axis: AxisSettings,
    /// The same with the other home that GRBL may be built for.
    other: AxisSettings,
    notes: Vec<String>,
    /// Whether it was homed with its present settings, and nothing has happened since.
    is_homed: bool,
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
        let mut notes = Vec::new();
        lines.drain()?;
        let mut status = greet(&mut lines)?;
        // What was marked before a hold that ends in a reset.
        let mut carried = None;
        if !matches!(status.state, State::Idle | State::Alarm) {
            (carried, status) = settle(&mut lines, &status, options.when_moving, &mut notes)?;
        }
        // An incomplete line of another program would spoil the next one.
        lines.send_line("")?;
        lines.answer(STATUS_PATIENCE)?;
        let settings = read_settings(&mut lines)?;
        let (axis, other) = both_homes(&settings, options.axis, lines.port())?;
        let was_powered = power_always(&mut lines, &settings)?;
        if !was_powered {
            notes.push(format!(
                "it switched the motor off between moves; ${IDLE_DELAY} has been set to {ALWAYS_POWERED}"
            ));
        }
        notes.extend(axis.notes.iter().cloned());
        let mut stage =
            Self { lines, options, axis, other, notes, is_homed: false, stop: StopSwitch::default() };
        stage.recognise(&status, carried, was_powered)?;
        Ok(stage)
    }

    /// Trusts the position if the controller bears the mark of its present settings, and its motor has held
    /// the carriage since.
    fn recognise(
        &mut self,
        status: &Status,
        carried: Option<f64>,
        was_powered: bool,
    ) -> Result<(), StageError> {
        let feed = read_feed(&mut self.lines)?;
        let bears = |axis: &AxisSettings| [Some(feed), carried].contains(&Some(f64::from(axis.mark)));
        if bears(&self.other) {
            std::mem::swap(&mut self.axis, &mut self.other);
        }
        let (is_marked, mark) = (bears(&self.axis), f64::from(self.axis.mark));
        self.is_homed = is_marked && was_powered && status.state == State::Idle;
        if self.is_homed && feed != mark {
            set_feed(&mut self.lines, self.axis.mark)?;
        }
        if is_marked && !self.is_homed {
            self.distrust()?;
        }
        Ok(())
    }

    /// Invalidates the position, here and for the next program that connects.
    fn distrust(&mut self) -> Result<(), StageError> {
        self.is_homed = false;
        // A reset removes the mark, too.
        if self.status().is_ok_and(|status| status.state.suspended()) {
            return reset(&mut self.lines);
        }
        let unmarked = match read_feed(&mut self.lines) {
            Ok(feed) if [&self.axis, &self.other].iter().all(|axis| feed != f64::from(axis.mark)) => Ok(()),
            Ok(_) => set_feed(&mut self.lines, NOT_HOMED),
            Err(error) => Err(error),
        };
        match unmarked {
            Err(StageError::NoAnswer { .. } | StageError::Refused { .. }) => reset(&mut self.lines),
            done => done,
        }
    }
}

/// The axis with the home that leaves less travel, and with the other one that GRBL may be built for. `$I`
/// tells which it is, but one flipped bit makes `$H` of it. The end of homing tells it, too.
fn both_homes(
    settings: &Settings,
    letter: AxisLetter,
    port: &str,
) -> Result<(AxisSettings, AxisSettings), StageError> {
    let [axis, other] = [HomeIs::PullOff, HomeIs::Origin].map(|home| settings.check(letter, home, port));
    let (axis, other) = (axis?, other?);
    Ok(if other.travel_mm < axis.travel_mm { (other, axis) } else { (axis, other) })
}

/// Comes to rest a controller that was found moving or held. Returns its mark, if it was held by this program
/// with its position kept, and its status.
fn settle(
    lines: &mut Lines,
    found: &Status,
    when_moving: WhenMoving,
    notes: &mut Vec<String>,
) -> Result<(Option<f64>, Status), StageError> {
    let moves = matches!(found.state, State::Run | State::Jog);
    if moves && when_moving == WhenMoving::Wait && outlast(lines)? {
        notes.push("it was moving, without a host; its end was waited for".to_owned());
        let status = greet(lines)?;
        if matches!(status.state, State::Idle | State::Alarm) {
            return Ok((None, status));
        }
    }
    // Held, it answers no question.
    let mark = if moves { read_feed(lines).ok() } else { None };
    notes.push(match found.state {
        State::Hold { .. } => {
            "it was in feed hold, which has been ended; its position is not trusted".to_owned()
        }
        _ => "it was not at rest, without a host; it has been stopped".to_owned(),
    });
    let held = hold(lines, || false)?;
    reset(lines)?;
    Ok((mark.filter(|_| held), greet(lines)?))
}

impl Axis for GrblAxis {
    fn identity(&self) -> StageIdentity {
        StageIdentity {
            driver: NAME,
            description: format!(
                "GRBL {}, axis {}, {} mm",
                self.lines.version().unwrap_or("1.1"),
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
        self.is_homed
    }

    fn position_settings(&mut self) -> Result<PositionSettings, StageError> {
        // It tells them at rest only.
        if !self.status().is_ok_and(|status| matches!(status.state, State::Idle | State::Alarm)) {
            reset(&mut self.lines)?;
        }
        self.distrust()?;
        let letter = self.options.axis;
        let settings = read_settings(&mut self.lines)?;
        (self.axis, self.other) = both_homes(&settings, letter, self.lines.port())?;
        power_always(&mut self.lines, &settings)?;
        Ok(settings.of_positions(letter))
    }

    fn home(&mut self) -> Result<Homed, StageError> {
        self.find_home()
    }

    fn position_at_rest_mm(&mut self, during: &str) -> Result<Option<f64>, StageError> {
        let rest = self.at_rest(during)?;
        Ok(self.place_mm(rest.machine_mm[self.options.axis.index()]))
    }

    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        self.run(motion)
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        let status = self.status()?;
        let at_limit = status.pins.contains(self.options.axis.letter());
        let steps = self.steps_of(&status).filter(|_| self.is_homed);
        Ok(StageState {
            position_mm: steps.map(|steps| self.axis.place_mm(steps)),
            moving: status.state.moving(),
            at_limit,
        })
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
