//! What can be wrong with a profile.

use std::fmt;

use thiserror::Error;

/// Why a profile cannot be used: all that is wrong with it, one line each.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{}", .mistakes.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct ProfileError {
    /// At least one.
    pub mistakes: Vec<Mistake>,
}

impl ProfileError {
    pub(super) fn one(place: Place, problem: Problem) -> Self {
        Self { mistakes: vec![Mistake { place, problem }] }
    }
}

/// Where a value was given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In a file.
    Line {
        /// Its name.
        source: String,
        /// From 1.
        line: usize,
    },
    /// In an override.
    Override {
        /// Where that is from: `--set`, or the name of an environment variable.
        from: String,
    },
}

impl Place {
    /// What is given at a place of a higher rank counts instead of what is given at one of a lower: the command line before the
    /// environment, and that before the file.
    pub(super) fn rank(&self) -> u8 {
        match self {
            Self::Line { .. } => 0,
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
        }
    }
}

/// Something wrong in a profile, with its place.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{place}: {}", one_line(.problem))]
pub struct Mistake {
    /// Where.
    pub place: Place,
    /// What.
    pub problem: Problem,
}

/// Names and values of a file may hold line breaks.
fn one_line(problem: &Problem) -> String {
    problem.to_string().replace(char::is_control, " ")
}

/// What is wrong in a profile. Keys are given with their section.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file is no TOML.
    #[error("this is no TOML: {reason}")]
    NotToml {
        /// The parser's words.
        reason: String,
    },
    /// More of something than makes sense; the rest is not looked at.
    #[error("more than {most} {what}; the rest is not looked at")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many are.
        most: usize,
    },
    /// An override has no key and value.
    #[error("{text:?} is no setting; write SECTION.KEY=VALUE, such as plan.step=1.5 mm")]
    NoSetting {
        /// As it was given.
        text: String,
    },
    /// The value of an environment variable is not Unicode.
    #[error("the value is not Unicode; set it anew or unset it")]
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
    #[error("{name} is a section; write [{name}] and its keys in the lines below it")]
    NotASection {
        /// The section.
        name: String,
    },
    /// A key stands before all sections.
    #[error("{name} stands in no section; {hint}")]
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
    /// A key ends in something that is no unit of its quantity.
    #[error("there is no key {key}: {suffix} is no unit of it; write {proposal}, or another of {units}")]
    UnknownUnitInKey {
        /// As it was given.
        key: String,
        /// The end of it.
        suffix: String,
        /// With a unit.
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
        /// With a unit.
        proposal: String,
    },
    /// The unit stands in the key, and the value is not a number only.
    #[error(
        "{key} = {value} is no number, which it must be because the unit stands in the key; write {proposal}"
    )]
    UnitInKey {
        /// The key.
        key: String,
        /// As it was given.
        value: String,
        /// As it would be right.
        proposal: String,
    },
    /// The unit belongs to another quantity, or is none.
    #[error("{key} = {value}: {reason}; write {proposal}")]
    WrongUnit {
        /// The key.
        key: String,
        /// As it was given.
        value: String,
        /// What the unit is, and what it must be.
        reason: String,
        /// A right value.
        proposal: String,
    },
    /// The value is of a wrong kind or out of its range.
    #[error("{key} = {value} is not possible; it must be {allowed}")]
    NotAllowed {
        /// The key.
        key: String,
        /// As it was given.
        value: String,
        /// What is.
        allowed: String,
    },
    /// The same is given twice.
    #[error("{key} is given a second time, first at {first}; leave one out")]
    Twice {
        /// The key.
        key: String,
        /// The other place.
        first: Place,
    },
    /// A key without effect.
    #[error("{key} means nothing {with}; leave it out")]
    MeansNothing {
        /// The key.
        key: String,
        /// With or without what.
        with: String,
    },
    /// A key that needs another one.
    #[error("{key} needs {needed}; {advice}")]
    Needs {
        /// The key.
        key: String,
        /// The other one.
        needed: String,
        /// What to do.
        advice: String,
    },
}

/// The name most like a mistyped one, or all of them.
pub(super) fn did_you_mean(wanted: &str, names: impl Iterator<Item = String>) -> String {
    /// Below this, names have nothing in common.
    const ALIKE: f64 = 0.7;
    let names: Vec<String> = names.collect();
    let likeness = |name: &String| strsim::jaro_winkler(wanted, name);
    let best = names.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    match best.filter(|best| likeness(best) >= ALIKE) {
        Some(best) => format!("did you mean {best}?"),
        None => format!("there are {}", names.join(", ")),
    }
}
