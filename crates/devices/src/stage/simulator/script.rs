//! Scripted faults of simulated stages.

use std::fmt;
use std::str::FromStr;
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
}

/// The kind without a move.
const SWITCH_NEVER_CLOSES: &str = "switch-never-closes";

/// How a kind is written that needs a move.
struct Form {
    kind: Kind,
    name: &'static str,
    /// Whether there is a time since the start of the move.
    has_start: bool,
    /// Whether there is a duration.
    has_duration: bool,
}

const FORMS: [Form; 6] = [
    Form { kind: Kind::NoMotion, name: "no-motion", has_start: false, has_duration: false },
    Form { kind: Kind::Mute, name: "mute", has_start: false, has_duration: true },
    Form { kind: Kind::Reset, name: "reset", has_start: true, has_duration: false },
    Form { kind: Kind::OtherSettings, name: "settings", has_start: true, has_duration: false },
    Form { kind: Kind::HangUp, name: "hang-up", has_start: true, has_duration: true },
    Form { kind: Kind::LimitCloses, name: "limit", has_start: true, has_duration: false },
];

/// A fault.
#[derive(Debug, Clone, Copy, PartialEq)]
struct DeviceFault {
    kind: Kind,
    /// Number of the move.
    in_move: u32,
    /// Time since the start of the move.
    after: Duration,
    lasting: Duration,
}

/// The faults of a device.
///
/// As text, separated by commas. Here 3 is the number of a move: moves count from 1, and homing does not count.
///
/// - `switch-never-closes`: no limit switch ever closes.
/// - `no-motion@3`: from move 3 on the carriage stands still, unnoticed by the stage.
/// - `mute@3/2s`: after move 3 all answers are lost for 2 s.
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
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaultScript {
    /// In any order.
    faults: Vec<DeviceFault>,
}

impl fmt::Display for DeviceFault {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(form) = FORMS.iter().find(|form| form.kind == self.kind) else {
            return to.write_str(SWITCH_NEVER_CLOSES);
        };
        write!(to, "{}@{}", form.name, self.in_move)?;
        if form.has_start {
            write!(to, "+{}s", self.after.as_secs_f64())?;
        }
        if form.has_duration { write!(to, "/{}s", self.lasting.as_secs_f64()) } else { Ok(()) }
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
        let faults =
            text.split(',').filter(|part| !part.is_empty()).map(parse_fault).collect::<Result<_, _>>()?;
        Ok(Self { faults })
    }
}

fn parse_fault(text: &str) -> Result<DeviceFault, String> {
    let wrong = || {
        format!(
            "\"{text}\" is not a complete fault; faults are switch-never-closes, no-motion@MOVE, mute@MOVE/TIMEs, reset@MOVE+TIMEs, \
             settings@MOVE+TIMEs, \
             hang-up@MOVE+TIMEs/TIMEs, limit@MOVE+TIMEs"
        )
    };
    let seconds = |text: &str| {
        let seconds = text.strip_suffix('s').and_then(|number| number.parse::<f64>().ok());
        seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
    };
    let none = Duration::ZERO;
    if text == SWITCH_NEVER_CLOSES {
        return Ok(DeviceFault { kind: Kind::SwitchNeverCloses, in_move: 0, after: none, lasting: none });
    }
    let (name, rest) = text.split_once('@').ok_or_else(wrong)?;
    let (rest, lasting) = rest.split_once('/').map_or((rest, None), |(rest, time)| (rest, Some(time)));
    let (number, after) = rest.split_once('+').map_or((rest, None), |(number, time)| (number, Some(time)));
    let in_move: u32 = number.parse().ok().filter(|number| *number > 0).ok_or_else(wrong)?;
    let form = FORMS.iter().find(|form| {
        form.name == name && form.has_start == after.is_some() && form.has_duration == lasting.is_some()
    });
    let kind = form.ok_or_else(wrong)?.kind;
    let time = |text: Option<&str>| text.map_or(Some(none), seconds).ok_or_else(wrong);
    Ok(DeviceFault { kind, in_move, after: time(after)?, lasting: time(lasting)? })
}

/// State of a script during its run.
#[derive(Debug, Clone, Default)]
pub struct Troubles {
    script: FaultScript,
    moves: u32,
    moving: bool,
    in_move: Duration,
    muted_for: Duration,
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

    /// Whether the cable is connected.
    pub fn connected(&self) -> bool {
        self.unplugged_for.is_zero()
    }

    /// Whether the active move has no effect.
    pub fn no_motion(&self) -> bool {
        let mut faults = self.script.faults.iter();
        faults.any(|fault| fault.kind == Kind::NoMotion && self.moves >= fault.in_move)
    }

    /// Begins a move. Homing is not counted.
    pub fn move_begins(&mut self) {
        self.moves += 1;
        self.moving = true;
        self.in_move = Duration::ZERO;
    }

    /// Ends the move.
    pub fn move_ends(&mut self) {
        if !std::mem::take(&mut self.moving) {
            return;
        }
        let of_this_move = |fault: &&DeviceFault| fault.kind == Kind::Mute && fault.in_move == self.moves;
        if let Some(mute) = self.script.faults.iter().rfind(of_this_move) {
            self.muted_for = mute.lasting;
        }
    }

    /// Advances the time; returns an event, if one happens.
    pub fn advance(&mut self, time: Duration) -> Option<Mishap> {
        self.muted_for = self.muted_for.saturating_sub(time);
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
        let now = |fault: &&DeviceFault| {
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
                Kind::HangUp => self.unplugged_for = fault.lasting,
                Kind::SwitchNeverCloses | Kind::NoMotion | Kind::Mute => {}
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
        let text = "switch-never-closes,no-motion@3,mute@3/2s,reset@3+0.2s,settings@3+0.2s,hang-up@3+0.2s/1s,limit@3+0.2s";
        assert_eq!(text.parse::<FaultScript>().unwrap().to_string(), text);
    }

    #[test]
    fn what_is_no_fault_is_refused_with_the_list() {
        for text in [
            "reset",
            "reset@x+1s",
            "reset@1",
            "reset@0+1s",
            "mute@1+1s",
            "hang-up@1+1s",
            "limit@1+1",
            "fire@1",
        ] {
            let error = text.parse::<FaultScript>().unwrap_err();
            assert!(error.contains("switch-never-closes"), "{error}");
        }
        assert_eq!("".parse::<FaultScript>(), Ok(FaultScript::default()));
    }
}
