//! Mistakes in a profile.

use std::fmt;

use epirig_core::fault::{Blame, Fault};
use thiserror::Error;

/// A profile with mistakes: all of them, one line each.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}", .mistakes.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct ProfileError {
    /// The mistakes, at least one.
    pub mistakes: Vec<Mistake>,
}

impl Fault for ProfileError {
    fn blame(&self) -> Blame {
        Blame::Request
    }

    /// One line for each mistake.
    fn message(&self) -> String {
        self.to_string()
    }
}

impl ProfileError {
    pub(super) fn one(place: Place, problem: Problem) -> Self {
        Self { mistakes: vec![Mistake { place, problem }] }
    }
}

/// The place of a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In a file.
    Line {
        /// Name of the file.
        source: String,
        /// Number of the line, from 1.
        line: usize,
    },
    /// In an override.
    Override {
        /// The source of the override: `--set`, or the name of an environment variable.
        from: String,
    },
    /// In the record of a sequence.
    Record,
    /// In a [`Draft`](super::Draft).
    Draft {
        /// The key, with its section.
        key: String,
    },
}

impl Place {
    /// A value at a place of higher rank replaces one at a lower rank: the command line before the
    /// environment, and the environment before the file.
    pub(super) fn rank(&self) -> u8 {
        match self {
            Self::Line { .. } | Self::Record | Self::Draft { .. } => 0,
            Self::Override { from } if from.starts_with("EPIRIG_") => 1,
            Self::Override { .. } => 2,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line { source, line } => write!(to, "{source}, line {line}"),
            Self::Override { from } => write!(to, "{from}"),
            Self::Record => write!(to, "sequence.json"),
            Self::Draft { key } => write!(to, "{key}"),
        }
    }
}

/// A mistake in a profile, with its place.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{place}: {}", one_line(.problem))]
pub struct Mistake {
    /// Where.
    pub place: Place,
    /// What.
    pub problem: Problem,
}

/// Names and values in a file may contain line breaks.
pub(super) fn one_line(problem: &Problem) -> String {
    problem.to_string().replace(char::is_control, " ")
}

/// A mistake in a profile. Keys include their section.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file is not TOML.
    #[error("this is not valid TOML: {0}")]
    NotToml(String),
    /// Too many entries; the rest is ignored.
    #[error("more than {most} {what}; the rest is ignored")]
    TooMany {
        /// The kind of entry.
        what: &'static str,
        /// The limit.
        most: usize,
    },
    /// An override without key or value.
    #[error("{0:?} is not a setting; write SECTION.KEY=VALUE, such as plan.step=1.5 mm")]
    NoSetting(String),
    /// The value of an environment variable is not Unicode.
    #[error("the value is not Unicode; set it again or unset it")]
    NotUnicode,
    /// There is no such section.
    #[error("there is no section {name}; {hint}")]
    UnknownSection {
        /// As it was given.
        name: String,
        /// The nearest name, or all.
        hint: String,
    },
    /// A section's name has a value.
    #[error("{0} is a section; write [{0}] and its keys in the lines below it")]
    NotASection(String),
    /// A key before the first section.
    #[error("{name} is outside all sections; {hint}")]
    OutsideSections {
        /// The key.
        name: String,
        /// What to do.
        hint: String,
    },
    /// There is no such key.
    #[error("there is no key {key}; {hint}")]
    UnknownKey {
        /// As it was given.
        key: String,
        /// The nearest name, or all.
        hint: String,
    },
    /// A key ends in a suffix that is not a unit of its quantity.
    #[error("there is no key {key}: {suffix} is not a unit of it; write {proposal}, or another of {units}")]
    UnknownUnitInKey {
        /// As it was given.
        key: String,
        /// The suffix.
        suffix: String,
        /// The key with a unit.
        proposal: String,
        /// All units.
        units: String,
    },
    /// A number that needs a unit has none.
    #[error("{key} = {value} has no unit; write {proposal}")]
    NoUnit {
        /// The key.
        key: String,
        /// As it was given.
        value: String,
        /// The value with a unit.
        proposal: String,
    },
    /// The key has a unit, but the value is not a number.
    #[error("{key} = {value} is not a number; the unit is in the key; write {proposal}")]
    UnitInKey {
        /// The key.
        key: String,
        /// As it was given.
        value: String,
        /// A correct form.
        proposal: String,
    },
    /// The unit belongs to another quantity, or does not exist.
    #[error("{key} = {value}: {reason}; write {proposal}")]
    WrongUnit {
        /// The key.
        key: String,
        /// As it was given.
        value: String,
        /// What is wrong with the unit.
        reason: String,
        /// A correct value.
        proposal: String,
    },
    /// The value has a wrong type or is out of range.
    #[error("{key} = {value} is not possible; it must be {allowed}")]
    NotAllowed {
        /// The key.
        key: String,
        /// As it was given.
        value: String,
        /// The allowed values.
        allowed: String,
    },
    /// The same key is given twice.
    #[error("{key} is given twice, first at {first}; remove one")]
    Twice {
        /// The key.
        key: String,
        /// The first place.
        first: Place,
    },
    /// A value that contradicts another one.
    #[error("{key} = {value} is not possible: {reason}")]
    Contradicts {
        /// The key.
        key: String,
        /// As it was given.
        value: String,
        /// What it contradicts, and what is possible.
        reason: String,
    },
    /// A key without effect.
    #[error("{key} has no effect {with}; remove it")]
    MeansNothing {
        /// The key.
        key: String,
        /// The condition: `with ...` or `without ...`.
        with: String,
    },
    /// A key that needs another one.
    #[error("{key} needs {needed}; {advice}")]
    Needs {
        /// The key.
        key: String,
        /// The other key.
        needed: String,
        /// What to do.
        advice: String,
    },
}

/// A hint with the most similar name, or with all names if none is similar.
pub(super) fn did_you_mean(wanted: &str, names: impl Iterator<Item = String>) -> String {
    /// Names below this similarity are not suggested.
    const ALIKE: f64 = 0.7;
    let names: Vec<String> = names.collect();
    let likeness = |name: &String| strsim::jaro_winkler(wanted, name);
    let best = names.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    match best.filter(|best| likeness(best) >= ALIKE) {
        Some(best) => format!("did you mean {best}?"),
        None => format!("there are {}", names.join(", ")),
    }
}
