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

/// How a kind is written.
struct Form {
    kind: Kind,
    name: &'static str,
    /// Whether there is a time since the start of the move.
    has_start: bool,
    /// The unit of its extent, if there is one.
    extent: Option<&'static str>,
    /// What happens, for a person.
    what: &'static str,
}

const SECONDS: &str = "s";
const MILLIMETRES: &str = "mm";

const fn form(kind: Kind, name: &'static str, what: &'static str) -> Form {
    Form { kind, name, has_start: false, extent: None, what }
}

/// The only one without a move.
const SWITCH_NEVER_CLOSES: Form =
    form(Kind::SwitchNeverCloses, "switch-never-closes", "homing finds no switch");

const FORMS: [Form; 8] = [
    Form {
        extent: Some(MILLIMETRES),
        ..form(
            Kind::LostSteps,
            "lost-steps",
            "the carriage stays behind by this length, unnoticed by the stage",
        )
    },
    form(Kind::NoMotion, "no-motion", "from then on the carriage stands still"),
    Form {
        extent: Some(SECONDS),
        ..form(Kind::Mute, "mute", "all answers are lost for this time after the move")
    },
    Form {
        extent: Some(SECONDS),
        ..form(Kind::Noise, "noise", "the line loses, doubles and flips one byte in a hundred each")
    },
    Form {
        has_start: true,
        ..form(Kind::Reset, "reset", "the stage restarts, so long after the move began")
    },
    Form {
        has_start: true,
        ..form(Kind::OtherSettings, "settings", "the same, and other settings: steps per mm, resolution")
    },
    Form {
        has_start: true,
        extent: Some(SECONDS),
        ..form(Kind::HangUp, "hang-up", "the cable is pulled, and back after the second time")
    },
    Form { has_start: true, ..form(Kind::LimitCloses, "limit", "a limit switch closes for a second") },
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
/// `reset@3+0.2s` restarts the stage 0.2 s after the start of move 3. [`forms`](Self::forms) has all faults.
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
    /// How all faults are written, and what happens.
    pub fn forms() -> Vec<(String, &'static str)> {
        let Form { name, what, .. } = SWITCH_NEVER_CLOSES;
        let mut forms = vec![(name.to_owned(), what)];
        forms.extend(StageFault::forms("MOVE"));
        forms
    }

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

    /// How faults are written, with `number` for that of the move, and what happens.
    pub fn forms(number: &str) -> Vec<(String, &'static str)> {
        let form = |form: &Form| {
            let start = if form.has_start { "+TIMEs" } else { "" };
            let extent = match form.extent {
                Some(SECONDS) => "/TIMEs",
                Some(_) => "/LENGTHmm",
                None => "",
            };
            (format!("{}@{number}{start}{extent}", form.name), form.what)
        };
        FORMS.iter().map(form).collect()
    }

    fn lasting(&self) -> Duration {
        // Parsed as a time that can be represented.
        Duration::try_from_secs_f64(self.extent).unwrap_or(Duration::MAX)
    }
}

impl fmt::Display for StageFault {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(form) = FORMS.iter().find(|form| form.kind == self.kind) else {
            return to.write_str(SWITCH_NEVER_CLOSES.name);
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
        let wrong =
            || format!("\"{text}\" is not a complete fault; faults are {}", names(&FaultScript::forms()));
        if text == SWITCH_NEVER_CLOSES.name {
            let (kind, none) = (SWITCH_NEVER_CLOSES.kind, Duration::ZERO);
            return Ok(Self { kind, in_move: 0, after: none, extent: 0.0 });
        }
        Self::numbered(text).ok_or_else(wrong)
    }
}

/// The forms in a list.
pub(crate) fn names(forms: &[(String, &str)]) -> String {
    forms.iter().map(|(form, _)| form.as_str()).collect::<Vec<_>>().join(", ")
}

/// An amount with its unit, such as `0.2s`; above 0.
pub(crate) fn amount(text: &str, unit: &str) -> Option<f64> {
    let amount = text.strip_suffix(unit)?.parse::<f64>().ok()?;
    (amount > 0.0 && Duration::try_from_secs_f64(amount).is_ok()).then_some(amount)
}

impl StageFault {
    /// The fault of a move that a text says; `None` if it says none.
    pub(crate) fn numbered(text: &str) -> Option<Self> {
        let (name, rest) = text.split_once('@')?;
        let (rest, extent) = rest.split_once('/').map_or((rest, None), |(rest, extent)| (rest, Some(extent)));
        let (number, after) =
            rest.split_once('+').map_or((rest, None), |(number, time)| (number, Some(time)));
        let form = FORMS.iter().find(|form| {
            form.name == name
                && form.has_start == after.is_some()
                && form.extent.is_some() == extent.is_some()
        })?;
        let seconds =
            |text: &str| Duration::try_from_secs_f64(text.strip_suffix(SECONDS)?.parse().ok()?).ok();
        Some(Self {
            kind: form.kind,
            in_move: number.parse().ok()?,
            after: after.map_or(Some(Duration::ZERO), seconds)?,
            extent: extent.zip(form.extent).map_or(Some(0.0), |(text, unit)| amount(text, unit))?,
        })
    }
}

/// State of a script during its run.
#[derive(Debug, Clone, Default)]
pub struct Troubles {
    script: FaultScript,
    moves: u32,
    moving: bool,
    /// Faults of moves that have begun, each with the time that is left until it happens.
    coming: Vec<(Duration, StageFault)>,
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
    #[must_use]
    pub fn move_begins(&mut self) -> f64 {
        self.moves += 1;
        self.moving = true;
        let added = self.script.added.take().into_iter();
        self.script.faults.extend(added.map(|fault| StageFault { in_move: self.moves, ..fault }));
        let mut behind_mm = 0.0;
        for fault in self.script.faults.iter().filter(|fault| fault.in_move == self.moves) {
            match fault.kind {
                Kind::Noise => self.noisy_for = fault.lasting(),
                Kind::LostSteps => behind_mm += fault.extent,
                Kind::Reset | Kind::OtherSettings | Kind::HangUp | Kind::LimitCloses => {
                    self.coming.push((fault.after, *fault));
                }
                Kind::SwitchNeverCloses | Kind::NoMotion | Kind::Mute => {}
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
        let mut mishap = None;
        for (left, fault) in std::mem::take(&mut self.coming) {
            if left >= time {
                self.coming.push((left - time, fault));
                continue;
            }
            match fault.kind {
                Kind::Reset => mishap = Some(Mishap::Reset),
                Kind::OtherSettings => mishap = Some(Mishap::OtherSettings),
                Kind::HangUp => self.unplugged_for = fault.lasting(),
                _ => {
                    self.limit_for = LIMIT_CLOSED;
                    mishap = Some(Mishap::LimitCloses);
                }
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
        let text = "switch-never-closes,reset@1+0s,no-motion@3,mute@3/2s,reset@3+0.2s,settings@3+0.2s,hang-up@3+0.2s/1s,limit@3+0.2s,\
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
            "noise@1/0s",
            "noise@1/1e300s",
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
