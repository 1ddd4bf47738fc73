//! Scripted faults of simulated stages.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// A fault. Moves are counted from 1; homing does not count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DeviceFault {
    /// No switch ever closes.
    SwitchNeverCloses,
    /// The carriage stands still from this move on, unnoticed by the stage. A GRBL stage reports at once that
    /// it has arrived; a native one counts its steps, and homing reveals the error.
    NoMotion {
        /// Number of the move.
        from_move: u32,
    },
    /// Answers after this move are lost for a time.
    Mute {
        /// Number of the move.
        after_move: u32,
        /// Duration.
        lasting: Duration,
    },
    /// The stage restarts in this move.
    Reset {
        /// Number of the move.
        in_move: u32,
        /// Time since the start of the move.
        after: Duration,
    },
    /// The stage restarts in this move with another number of steps per mm: its settings were changed, or it
    /// has another controller.
    OtherSettings {
        /// Number of the move.
        in_move: u32,
        /// Time since the start of the move.
        after: Duration,
    },
    /// The cable is disconnected in this move, and connected again.
    HangUp {
        /// Number of the move.
        in_move: u32,
        /// Time since the start of the move.
        after: Duration,
        /// Time until it is connected again.
        lasting: Duration,
    },
    /// A limit switch closes for a second in this move.
    LimitCloses {
        /// Number of the move.
        in_move: u32,
        /// Time since the start of the move.
        after: Duration,
    },
}

/// The faults of a device.
///
/// As text: `switch-never-closes`, `no-motion@3`, `mute@3/2s`, `reset@3+0.2s`,
/// `settings@3+0.2s`, `hang-up@3+0.2s/1s`, `limit@3+0.2s`, where 3 is the number of the move. Several faults are separated by commas.
///
/// ```
/// use epirig_devices::stage::simulator::FaultScript;
///
/// let script: FaultScript = "reset@3+0.2s,hang-up@5+0.1s/1s".parse()?;
/// assert_eq!(script.faults.len(), 2);
/// assert_eq!(script.to_string(), "reset@3+0.2s,hang-up@5+0.1s/1s");
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaultScript {
    /// The faults, in any order.
    pub faults: Vec<DeviceFault>,
}

impl From<DeviceFault> for FaultScript {
    fn from(fault: DeviceFault) -> Self {
        Self { faults: vec![fault] }
    }
}

impl fmt::Display for DeviceFault {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let s = Duration::as_secs_f64;
        match self {
            Self::SwitchNeverCloses => write!(to, "switch-never-closes"),
            Self::NoMotion { from_move } => write!(to, "no-motion@{from_move}"),
            Self::Mute { after_move, lasting } => write!(to, "mute@{after_move}/{}s", s(lasting)),
            Self::Reset { in_move, after } => write!(to, "reset@{in_move}+{}s", s(after)),
            Self::OtherSettings { in_move, after } => write!(to, "settings@{in_move}+{}s", s(after)),
            Self::HangUp { in_move, after, lasting } => {
                write!(to, "hang-up@{in_move}+{}s/{}s", s(after), s(lasting))
            }
            Self::LimitCloses { in_move, after } => write!(to, "limit@{in_move}+{}s", s(after)),
        }
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
    if text == "switch-never-closes" {
        return Ok(DeviceFault::SwitchNeverCloses);
    }
    let (kind, rest) = text.split_once('@').ok_or_else(wrong)?;
    let (rest, lasting) = rest.split_once('/').map_or((rest, None), |(rest, time)| (rest, Some(time)));
    let (number, after) = rest.split_once('+').map_or((rest, None), |(number, time)| (number, Some(time)));
    let number: u32 = number.parse().ok().filter(|number| *number > 0).ok_or_else(wrong)?;
    let time = |text: Option<&str>| text.and_then(seconds).ok_or_else(wrong);
    match (kind, after.is_some(), lasting.is_some()) {
        ("no-motion", false, false) => Ok(DeviceFault::NoMotion { from_move: number }),
        ("mute", false, true) => Ok(DeviceFault::Mute { after_move: number, lasting: time(lasting)? }),
        ("reset", true, false) => Ok(DeviceFault::Reset { in_move: number, after: time(after)? }),
        ("settings", true, false) => Ok(DeviceFault::OtherSettings { in_move: number, after: time(after)? }),
        ("hang-up", true, true) => {
            Ok(DeviceFault::HangUp { in_move: number, after: time(after)?, lasting: time(lasting)? })
        }
        ("limit", true, false) => Ok(DeviceFault::LimitCloses { in_move: number, after: time(after)? }),
        _ => Err(wrong()),
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
        !self.script.faults.contains(&DeviceFault::SwitchNeverCloses)
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
        self.script
            .faults
            .iter()
            .any(|fault| matches!(fault, DeviceFault::NoMotion { from_move } if self.moves >= *from_move))
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
        for fault in &self.script.faults {
            if let DeviceFault::Mute { after_move, lasting } = *fault
                && after_move == self.moves
            {
                self.muted_for = lasting;
            }
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
        let now =
            |moved: u32, after: Duration| moved == self.moves && before <= after && after < self.in_move;
        let mut mishap = None;
        for fault in &self.script.faults {
            match *fault {
                DeviceFault::Reset { in_move, after } if now(in_move, after) => mishap = Some(Mishap::Reset),
                DeviceFault::OtherSettings { in_move, after } if now(in_move, after) => {
                    mishap = Some(Mishap::OtherSettings);
                }
                DeviceFault::LimitCloses { in_move, after } if now(in_move, after) => {
                    self.limit_for = LIMIT_CLOSED;
                    mishap = Some(Mishap::LimitCloses);
                }
                DeviceFault::HangUp { in_move, after, lasting } if now(in_move, after) => {
                    self.unplugged_for = lasting;
                }
                _ => {}
            }
        }
        mishap
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
