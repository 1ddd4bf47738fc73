//! Output of GRBL 1.1, line by line.

use std::fmt;

use super::texts::{alarm_text, error_text};

/// A line from GRBL.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Response {
    /// The last line was accepted, but perhaps not done yet.
    Ok,
    /// The last line was refused.
    Error(u8),
    /// An alarm: everything has stopped.
    Alarm(u8),
    /// Answer to `?`.
    Status(Status),
    /// The controller has started.
    Banner {
        /// Version, such as `1.1h`.
        version: String,
    },
    /// A line of the answer to `$$`.
    Setting {
        /// Number, without the `$`.
        number: u8,
        /// Value as printed.
        value: f64,
    },
    /// `[MSG:..]`, `[VER:..]`, `[GC:..]` and the like.
    Feedback {
        /// Text before the first colon.
        kind: String,
        /// Text after it.
        text: String,
    },
    /// Anything else.
    Unknown(String),
}

/// The states of GRBL 1.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// At rest and ready.
    Idle,
    /// Moving.
    Run,
    /// Held; `complete` once it is at rest.
    Hold {
        /// Whether it is at rest.
        complete: bool,
    },
    /// Moving by a jog command.
    Jog,
    /// Locked until homed, unlocked or reset.
    Alarm,
    /// Held because the safety door was opened, perhaps only for a moment.
    Door {
        /// Whether it is at rest.
        complete: bool,
    },
    /// Checks programs without moving.
    Check,
    /// Homing.
    Home,
    /// Asleep until reset.
    Sleep,
}

/// Answer to `?`.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// Present state.
    pub state: State,
    /// Machine positions in mm (or work positions, see `is_work_position`), one for each axis.
    pub position_mm: Vec<f64>,
    /// Whether the positions are work positions: machine position minus offset.
    pub is_work_position: bool,
    /// Work coordinate offset in mm, which only some answers contain.
    pub work_offset_mm: Option<Vec<f64>>,
    /// Letters of the active pins, such as `X` for the limit switch of that axis.
    pub pins: String,
}

impl Response {
    /// Parses a line without its end.
    pub fn parse(line: &str) -> Self {
        let line = line.trim();
        let unknown = || Self::Unknown(line.to_owned());
        let number = |text: &str| text.parse::<u8>().ok();
        if line == "ok" {
            Self::Ok
        } else if let Some(code) = line.strip_prefix("error:") {
            number(code).map_or_else(unknown, Self::Error)
        } else if let Some(code) = line.strip_prefix("ALARM:") {
            number(code).map_or_else(unknown, Self::Alarm)
        } else if let Some(inside) = line.strip_prefix('<').and_then(|rest| rest.strip_suffix('>')) {
            Status::parse(inside).map_or_else(unknown, Self::Status)
        } else if let Some(inside) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            let (kind, text) = inside.split_once(':').unwrap_or((inside, ""));
            Self::Feedback { kind: kind.to_owned(), text: text.to_owned() }
        } else if line.get(..4).is_some_and(|start| start.eq_ignore_ascii_case("grbl")) {
            // "Grbl 1.1h ['$' for help]", "Grbl 1.1h: Board ...", "GrblHAL 1.1f ..." and the like.
            let mut words = line.split_whitespace().skip(1);
            let version = words.find(|word| word.starts_with(|first: char| first.is_ascii_digit()));
            version.map_or_else(unknown, |version| Self::Banner {
                version: version.trim_end_matches(|last: char| !last.is_ascii_alphanumeric()).to_owned(),
            })
        } else if let Some((name, value)) = line.strip_prefix('$').and_then(|rest| rest.split_once('=')) {
            // Some builds add what it is: `$22=1 (homing cycle, bool)`.
            let value = value.split_once(" (").map_or(value, |(value, _)| value);
            match (number(name), finite(value)) {
                (Some(number), Some(value)) => Self::Setting { number, value },
                _ => unknown(),
            }
        } else {
            unknown()
        }
    }
}

fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite())
}

fn coordinates(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(finite).collect()
}

impl Status {
    fn parse(inside: &str) -> Option<Self> {
        let mut fields = inside.split('|');
        let state = State::parse(fields.next()?)?;
        let (mut position, mut is_work_position, mut work_offset_mm, mut pins) =
            (None, false, None, String::new());
        for field in fields {
            match field.split_once(':') {
                Some(("MPos", text)) => position = Some(coordinates(text)?),
                Some(("WPos", text)) => (position, is_work_position) = (Some(coordinates(text)?), true),
                Some(("WCO", text)) => work_offset_mm = Some(coordinates(text)?),
                Some(("Pn", text)) => pins = text.to_owned(),
                // Feeds, overrides, buffers, and fields of later versions.
                _ => {}
            }
        }
        Some(Self { state, position_mm: position?, is_work_position, work_offset_mm, pins })
    }
}

impl State {
    pub(super) fn parse(text: &str) -> Option<Self> {
        let (name, detail) = text.split_once(':').unwrap_or((text, ""));
        Some(match name {
            "Idle" => Self::Idle,
            "Run" => Self::Run,
            "Hold" => Self::Hold { complete: detail == "0" },
            "Jog" => Self::Jog,
            "Alarm" => Self::Alarm,
            // 0 is closed again, 1 open; 2 is before, and 3 after.
            "Door" => Self::Door { complete: matches!(detail, "0" | "1") },
            "Check" => Self::Check,
            "Home" => Self::Home,
            "Sleep" => Self::Sleep,
            _ => return None,
        })
    }

    /// Whether it is at rest and answers no line until it is reset or goes on.
    pub(super) fn suspended(self) -> bool {
        matches!(self, Self::Hold { complete: true } | Self::Door { complete: true } | Self::Sleep)
    }

    /// Whether the stage may be moving.
    pub fn moving(self) -> bool {
        matches!(
            self,
            Self::Run
                | Self::Jog
                | Self::Home
                | Self::Hold { complete: false }
                | Self::Door { complete: false }
        )
    }
}

impl fmt::Display for Response {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ok => write!(to, "ok: accepted"),
            Self::Error(code) => write!(to, "error:{code}: {}", error_text(*code)),
            Self::Alarm(code) => write!(to, "ALARM:{code}: {}", alarm_text(*code)),
            Self::Status(status) => {
                let kind = if status.is_work_position { "work position" } else { "machine position" };
                write!(to, "{:?}, {kind} {:?} mm", status.state, status.position_mm)?;
                if let Some(offset) = &status.work_offset_mm {
                    write!(to, ", work offset {offset:?} mm")?;
                }
                if status.pins.is_empty() { Ok(()) } else { write!(to, ", pins {}", status.pins) }
            }
            Self::Banner { version } => write!(to, "GRBL {version} has started"),
            Self::Setting { number, value } => write!(to, "setting ${number} is {value}"),
            Self::Feedback { kind, text } => write!(to, "{kind}: {text}"),
            Self::Unknown(line) => write!(to, "unknown: {line:?}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statuses_are_read_with_what_they_carry() {
        let Response::Status(status) =
            Response::parse("<Hold:0|MPos:-7.024,-1.000,-1.000|FS:0,0|Pn:X|WCO:0.100,0.000,0.000>")
        else {
            panic!()
        };
        assert_eq!(status.state, State::Hold { complete: true });
        assert_eq!(status.position_mm, [-7.024, -1.0, -1.0]);
        assert_eq!(status.work_offset_mm, Some(vec![0.1, 0.0, 0.0]));
        assert_eq!(status.pins, "X");
    }

    #[test]
    fn a_safety_door_is_at_rest_or_not() {
        for (detail, complete) in [("0", true), ("1", true), ("2", false), ("3", false)] {
            let line = format!("<Door:{detail}|MPos:0.000,0.000,0.000|FS:0,0>");
            let Response::Status(status) = Response::parse(&line) else { panic!() };
            assert_eq!((status.state, status.state.moving()), (State::Door { complete }, !complete));
        }
    }

    #[test]
    fn words_of_other_builds_are_no_part_of_numbers_and_versions() {
        for (line, expected) in [
            ("Grbl 1.1f ['$' for help]", "1.1f"),
            ("Grbl 1.1h: MyBoard ['$' for help]", "1.1h"),
            ("GrblHAL 1.1f ['$' or '$HELP' for help]", "1.1f"),
            ("Grbl 3.7 [FluidNC 3.7.10 (wifi) '$' for help]", "3.7"),
        ] {
            assert_eq!(Response::parse(line), Response::Banner { version: expected.to_owned() }, "{line}");
        }
        let setting = Response::parse("$22=1 (homing cycle, bool)");
        assert_eq!(setting, Response::Setting { number: 22, value: 1.0 });
        let damaged = "$22=1 0 (homing cycle, bool)";
        assert_eq!(Response::parse(damaged), Response::Unknown(damaged.to_owned()));
    }

    #[test]
    fn damaged_lines_are_unknown() {
        for line in [
            "<Idle|MPos:1.x,0,0>",
            "<Idle>",
            "<Idl|MPos:0,0,0>",
            "error:",
            "ALARM:999",
            "okk",
            "$1=",
            "<Idle|MPos:inf,0,0>",
            "",
        ] {
            assert_eq!(Response::parse(line), Response::Unknown(line.to_owned()), "{line}");
        }
    }
}
