//! Scripted faults of simulated stages.

use std::fmt;
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// A kind of fault. Moves are counted from 1; homing does not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// No switch ever closes.
    SwitchNeverCloses,
    /// The carriage stands still from this move on, unnoticed by the stage. A GRBL stage reports at once that
    /// it has arrived; a native one counts its steps, and homing reveals the error.
    NoMotion,
    /// Answers after this move are lost for a time.
    Mute,
    /// The stage restarts in this move.
    Reset,
    /// The stage restarts in this move with another number of steps per mm: its settings were changed, or it
    /// has another controller.
    OtherSettings,
    /// The cable is disconnected in this move, and connected again.
    HangUp,
    /// A limit switch closes for a second in this move.
    LimitCloses,
    /// The motor loses steps in this move: the carriage stays behind by a distance, unnoticed by the stage.
    LostSteps,
    /// From this move on the line loses, doubles and flips bytes for a time.
    Noise,
}

/// The kind without a move.
const SWITCH_NEVER_CLOSES: &str = "switch-never-closes";

/// How a kind is written that needs a move.
struct Form {
    kind: Kind,
    name: &'static str,
    /// Whether there is a time since the start of the move.
    has_start: bool,
    /// The unit of its extent, if there is one.
    extent: Option<&'static str>,
}

const SECONDS: &str = "s";
const MILLIMETRES: &str = "mm";

const FORMS: [Form; 8] = [
    Form { kind: Kind::LostSteps, name: "lost-steps", has_start: false, extent: Some(MILLIMETRES) },
    Form { kind: Kind::NoMotion, name: "no-motion", has_start: false, extent: None },
    Form { kind: Kind::Mute, name: "mute", has_start: false, extent: Some(SECONDS) },
    Form { kind: Kind::Noise, name: "noise", has_start: false, extent: Some(SECONDS) },
    Form { kind: Kind::Reset, name: "reset", has_start: true, extent: None },
    Form { kind: Kind::OtherSettings, name: "settings", has_start: true, extent: None },
    Form { kind: Kind::HangUp, name: "hang-up", has_start: true, extent: Some(SECONDS) },
    Form { kind: Kind::LimitCloses, name: "limit", has_start: true, extent: None },
];

/// A fault of a stage: one entry of a [`FaultScript`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageFault {
    kind: Kind,
    /// Number of the move.
    in_move: u32,
    /// Time since the start of the move.
    after: Duration,
    /// How long it lasts, in s, or how far it goes, in mm.
    extent: f64,
}

/// The faults of a stage.
///
/// As text, separated by commas. Here 3 is the number of a move: moves count from 1, and homing does not count.
///
/// - `switch-never-closes`: no limit switch ever closes.
/// - `lost-steps@3/0.1mm`: the carriage stays 0.1 mm behind in move 3, unnoticed by the stage.
/// - `no-motion@3`: from move 3 on the carriage stands still, unnoticed by the stage.
/// - `mute@3/2s`: after move 3 all answers are lost for 2 s.
/// - `noise@3/2s`: from move 3 on the line loses, doubles and flips one byte in a hundred each, for 2 s.
/// - `reset@3+0.2s`: the stage restarts 0.2 s after the start of move 3.
/// - `settings@3+0.2s`: the same, with another number of steps per mm.
/// - `hang-up@3+0.2s/1s`: the cable is disconnected then, and connected again after 1 s.
/// - `limit@3+0.2s`: a limit switch closes then, for a second.
///
/// ```
/// use epirig_devices::stage::simulator::FaultScript;
///
/// let script: FaultScript = "reset@3+0.2s,hang-up@5+0.1s/1s".parse()?;
/// assert_eq!(script.to_string(), "reset@3+0.2s,hang-up@5+0.1s/1s");
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct FaultScript {
    /// In any order.
    faults: Vec<StageFault>,
    added: FaultInlet,
}

/// Adds faults to a [`FaultScript`] while it is played. Clones add to the same script.
#[derive(Debug, Clone, Default)]
pub struct FaultInlet(Arc<Mutex<Vec<StageFault>>>);

impl FaultInlet {
    /// Lets a fault happen in the next move, instead of in that of its own number.
    pub fn in_next_move(&self, fault: StageFault) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(fault);
    }

    fn take(&self) -> Vec<StageFault> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl FaultScript {
    /// Where faults are added while the script is played.
    pub fn inlet(&self) -> FaultInlet {
        self.added.clone()
    }
}

impl StageFault {
    /// The number in its text: that of its move.
    pub fn number(&self) -> u32 {
        self.in_move
    }

    /// The distance that the carriage stays behind, in mm, if steps are lost. Every other fault is one of a line or
    /// of a device behind it.
    pub fn lost_mm(&self) -> Option<f64> {
        (self.kind == Kind::LostSteps).then_some(self.extent)
    }

    /// How the faults of a stage are written, with `number` for that of the move.
    pub(crate) fn forms(number: &str) -> String {
        let form = |form: &Form| {
            let start = if form.has_start { "+TIMEs" } else { "" };
            let extent = match form.extent {
                Some(SECONDS) => "/TIMEs",
                Some(_) => "/LENGTHmm",
                None => "",
            };
            format!("{}@{number}{start}{extent}", form.name)
        };
        FORMS.iter().map(form).collect::<Vec<_>>().join(", ")
    }

    fn lasting(&self) -> Duration {
        // Parsed as a time that can be represented.
        Duration::try_from_secs_f64(self.extent).unwrap_or(Duration::MAX)
    }
}

impl fmt::Display for StageFault {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(form) = FORMS.iter().find(|form| form.kind == self.kind) else {
            return to.write_str(SWITCH_NEVER_CLOSES);
        };
        write!(to, "{}@{}", form.name, self.in_move)?;
        if form.has_start {
            write!(to, "+{}s", self.after.as_secs_f64())?;
        }
        form.extent.map_or(Ok(()), |unit| write!(to, "/{}{unit}", self.extent))
    }
}

impl fmt::Display for FaultScript {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let faults: Vec<String> = self.faults.iter().map(ToString::to_string).collect();
        write!(to, "{}", faults.join(","))
    }
}

impl FromStr for FaultScript {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split(',').filter(|part| !part.is_empty());
        let faults: Vec<StageFault> = parts.map(str::parse).collect::<Result<_, _>>()?;
        if let Some(never) =
            faults.iter().find(|fault| fault.in_move == 0 && fault.kind != Kind::SwitchNeverCloses)
        {
            return Err(format!("\"{never}\" never happens: moves are counted from 1"));
        }
        Ok(Self { faults, added: FaultInlet::default() })
    }
}

impl FromStr for StageFault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" is not a complete fault; faults are {SWITCH_NEVER_CLOSES}, {}",
                Self::forms("MOVE")
            )
        };
        let amount = |text: &str, unit| text.strip_suffix(unit).and_then(|number| number.parse::<f64>().ok());
        let time = |text: &str| Duration::try_from_secs_f64(amount(text, SECONDS)?).ok();
        let (none, now) = (0.0, Duration::ZERO);
        if text == SWITCH_NEVER_CLOSES {
            return Ok(Self { kind: Kind::SwitchNeverCloses, in_move: 0, after: now, extent: none });
        }
        let (name, rest) = text.split_once('@').ok_or_else(wrong)?;
        let (rest, extent) = rest.split_once('/').map_or((rest, None), |(rest, extent)| (rest, Some(extent)));
        let (number, after) =
            rest.split_once('+').map_or((rest, None), |(number, time)| (number, Some(time)));
        let in_move = number.parse().map_err(|_| wrong())?;
        let form = FORMS.iter().find(|form| {
            form.name == name
                && form.has_start == after.is_some()
                && form.extent.is_some() == extent.is_some()
        });
        let form = form.ok_or_else(wrong)?;
        let after = after.map_or(Some(now), time).ok_or_else(wrong)?;
        let extent = match (form.extent, extent) {
            (Some(SECONDS), Some(text)) => time(text).map(|time| time.as_secs_f64()),
            (Some(unit), Some(text)) => {
                amount(text, unit).filter(|extent| extent.is_finite() && *extent > 0.0)
            }
            _ => Some(none),
        };
        Ok(Self { kind: form.kind, in_move, after, extent: extent.ok_or_else(wrong)? })
    }
}

/// State of a script during its run.
#[derive(Debug, Clone, Default)]
pub struct Troubles {
    script: FaultScript,
    moves: u32,
    moving: bool,
    in_move: Duration,
    muted_for: Duration,
    noisy_for: Duration,
    unplugged_for: Duration,
    limit_for: Duration,
}

/// A sudden event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mishap {
    /// It restarts.
    Reset,
    /// It restarts with other settings.
    OtherSettings,
    /// A limit switch closes.
    LimitCloses,
    /// The limit switch opens again.
    LimitOpens,
}

const LIMIT_CLOSED: Duration = Duration::from_secs(1);

impl Troubles {
    /// The state of a script before any move.
    pub fn new(script: FaultScript) -> Self {
        Self { script, ..Self::default() }
    }

    /// Whether the limit switches work.
    pub fn switches_work(&self) -> bool {
        self.script.faults.iter().all(|fault| fault.kind != Kind::SwitchNeverCloses)
    }

    /// Whether the output of the device is lost.
    pub fn muted(&self) -> bool {
        !self.muted_for.is_zero()
    }

    /// Whether the line is noisy.
    pub fn noisy(&self) -> bool {
        !self.noisy_for.is_zero()
    }

    /// Whether the cable is connected.
    pub fn connected(&self) -> bool {
        self.unplugged_for.is_zero()
    }

    /// Whether the active move has no effect.
    pub fn no_motion(&self) -> bool {
        let mut faults = self.script.faults.iter();
        faults.any(|fault| fault.kind == Kind::NoMotion && self.moves >= fault.in_move)
    }

    /// Begins a move, in which the carriage stays behind by the returned distance in mm. Homing is not counted.
    pub fn move_begins(&mut self) -> f64 {
        self.moves += 1;
        self.moving = true;
        self.in_move = Duration::ZERO;
        let added = self.script.added.take().into_iter();
        self.script.faults.extend(added.map(|fault| StageFault { in_move: self.moves, ..fault }));
        let mut behind_mm = 0.0;
        for fault in self.script.faults.iter().filter(|fault| fault.in_move == self.moves) {
            match fault.kind {
                Kind::Noise => self.noisy_for = fault.lasting(),
                Kind::LostSteps => behind_mm += fault.extent,
                _ => {}
            }
        }
        behind_mm
    }

    /// Ends the move.
    pub fn move_ends(&mut self) {
        if !std::mem::take(&mut self.moving) {
            return;
        }
        let of_this_move = |fault: &&StageFault| fault.kind == Kind::Mute && fault.in_move == self.moves;
        if let Some(mute) = self.script.faults.iter().rfind(of_this_move) {
            self.muted_for = mute.lasting();
        }
    }

    /// Advances the time; returns an event, if one happens.
    pub fn advance(&mut self, time: Duration) -> Option<Mishap> {
        self.muted_for = self.muted_for.saturating_sub(time);
        self.noisy_for = self.noisy_for.saturating_sub(time);
        self.unplugged_for = self.unplugged_for.saturating_sub(time);
        if !self.limit_for.is_zero() {
            self.limit_for = self.limit_for.saturating_sub(time);
            if self.limit_for.is_zero() {
                return Some(Mishap::LimitOpens);
            }
        }
        if !self.moving {
            return None;
        }
        let before = self.in_move;
        self.in_move += time;
        let now = |fault: &&StageFault| {
            fault.in_move == self.moves && before <= fault.after && fault.after < self.in_move
        };
        let mut mishap = None;
        for fault in self.script.faults.iter().filter(now) {
            match fault.kind {
                Kind::Reset => mishap = Some(Mishap::Reset),
                Kind::OtherSettings => mishap = Some(Mishap::OtherSettings),
                Kind::LimitCloses => {
                    self.limit_for = LIMIT_CLOSED;
                    mishap = Some(Mishap::LimitCloses);
                }
                Kind::HangUp => self.unplugged_for = fault.lasting(),
                Kind::SwitchNeverCloses | Kind::NoMotion | Kind::Mute | Kind::LostSteps | Kind::Noise => {}
            }
        }
        mishap
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_faults_are_written_as_they_are_read() {
        let text = "switch-never-closes,no-motion@3,mute@3/2s,reset@3+0.2s,settings@3+0.2s,hang-up@3+0.2s/1s,limit@3+0.2s,\
                    lost-steps@3/0.1mm,noise@3/10s";
        assert_eq!(text.parse::<FaultScript>().unwrap().to_string(), text);
    }

    #[test]
    fn what_is_no_fault_is_refused_with_the_list() {
        for text in [
            "reset",
            "reset@x+1s",
            "reset@1",
            "reset@-1+1s",
            "lost-steps@1/1s",
            "lost-steps@1/0mm",
            "noise@1",
            "mute@1+1s",
            "hang-up@1+1s",
            "limit@1+1",
            "fire@1",
        ] {
            let error = text.parse::<FaultScript>().unwrap_err();
            assert!(error.contains("switch-never-closes"), "{error}");
        }
        assert!("reset@0+1s".parse::<FaultScript>().unwrap_err().contains("counted from 1"));
        assert_eq!("".parse::<FaultScript>().unwrap().to_string(), "");
    }
}
