//! A key: its name, its unit, its range, its default and its meaning.

use super::quantity::{Quantity, UNITS, Unit};

/// Longest time, in h: so that a duration is exact as a number of seconds.
pub const LONGEST_H: f64 = 24.0;

/// Largest number of a quantity in its key's unit. No quotient of two numbers from [`SMALLEST`] to this
/// leaves what a time can be.
pub const LARGEST: f64 = 1e9;

/// Smallest positive number of a quantity that something is divided by, in its key's unit.
pub const SMALLEST: f64 = 1e-9;

const NS_PER_H: f64 = 3600.0e9;

/// Values of a quantity that make sense, in the key's own unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Allowed {
    /// All of them.
    Any,
    /// More than 0.
    Positive,
    /// 0 or more.
    ZeroOrMore,
    /// From 0 to this.
    UpTo(f64),
    /// From minus this to this.
    Within(f64),
    /// These only.
    Among(&'static [f64]),
}

impl Allowed {
    /// Whether `value`, in the key's unit, is allowed.
    pub fn holds(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Any => true,
                Self::Positive => value > 0.0,
                Self::ZeroOrMore => value >= 0.0,
                Self::UpTo(most) => (0.0..=most).contains(&value),
                Self::Within(most) => value.abs() <= most,
                Self::Among(values) => values.contains(&value),
            }
    }

    /// Whether `value`, in the key's unit, is a number that can be calculated with: neither too large, nor
    /// so small that something divided by it becomes too large.
    pub fn is_of_usual_size(self, value: f64) -> bool {
        let is_too_small = self == Self::Positive && value > 0.0 && value < SMALLEST;
        value.abs() <= LARGEST && !is_too_small
    }
}

/// What a key's value is.
#[derive(Debug, Clone, Copy)]
pub enum Kind {
    /// Any text that is not empty.
    Text,
    /// Text of a form.
    Form {
        /// What it must be, for a person.
        allowed: &'static str,
        /// Whether a text is that.
        is_valid: fn(&str) -> bool,
    },
    /// One of these names.
    Choice(fn() -> Vec<&'static str>),
    /// A whole number from the first to the second.
    Whole(i64, i64),
    /// A number without a unit.
    Number,
    /// True or false.
    Flag,
    /// A quantity.
    Measure {
        /// The unit of the values of drivers, and the one that messages propose.
        unit: Unit,
        /// A unit of another quantity that may stand instead.
        or: Option<Unit>,
        /// What is allowed, in `unit`.
        allowed: Allowed,
    },
}

impl Kind {
    /// A quantity in `unit`.
    pub const fn measure(unit: Unit, allowed: Allowed) -> Self {
        Self::Measure { unit, or: None, allowed }
    }

    /// The units that a value may have.
    pub fn units(self) -> impl Iterator<Item = Unit> {
        let quantities = match self {
            Self::Measure { unit, or, .. } => [Some(unit.quantity), or.map(|unit| unit.quantity)],
            _ => [None, None],
        };
        UNITS.iter().copied().filter(move |unit| quantities.contains(&Some(unit.quantity)))
    }

    /// What a value must be, for a person.
    pub fn allowed(self) -> String {
        match self {
            Self::Text => "text that is not empty".to_owned(),
            Self::Form { allowed, .. } => allowed.to_owned(),
            Self::Choice(names) => format!("one of {}", names().join(", ")),
            Self::Whole(least, most) => format!("a whole number from {least} to {most}"),
            Self::Number => "a number".to_owned(),
            Self::Flag => "true or false".to_owned(),
            Self::Measure { unit, or, allowed } => {
                let other = or.map_or_else(String::new, |or| format!(" or {}", or.quantity.noun()));
                let nouns = format!("{}{other}", unit.quantity.noun());
                let is_time = unit.quantity == Quantity::Time;
                match allowed {
                    Allowed::Positive if is_time => format!("a time from 1 ns to {LONGEST_H} h"),
                    Allowed::ZeroOrMore if is_time => format!("a time from 0 s to {LONGEST_H} h"),
                    Allowed::Any => nouns,
                    Allowed::Positive => format!("{nouns} greater than 0"),
                    Allowed::ZeroOrMore => format!("{nouns} of 0 or more"),
                    Allowed::UpTo(most) => format!("{nouns} from 0 {} to {most} {}", unit.name, unit.name),
                    Allowed::Within(most) => {
                        format!("{nouns} from -{most} {} to {most} {}", unit.name, unit.name)
                    }
                    Allowed::Among(values) => {
                        let values: Vec<String> =
                            values.iter().map(|value| format!("{value} {}", unit.name)).collect();
                        values.join(" or ")
                    }
                }
            }
        }
    }

    /// Whether a value stands between quotes in a file.
    pub fn is_quoted(self) -> bool {
        !matches!(self, Self::Whole(..) | Self::Number | Self::Flag)
    }

    /// Whether a time of so many ns is allowed.
    pub fn allows_time(allowed: Allowed, time_ns: f64) -> bool {
        let least_ns = if allowed == Allowed::Positive { 1.0 } else { 0.0 };
        (least_ns..=LONGEST_H * NS_PER_H).contains(&time_ns)
    }
}

/// A key.
#[derive(Debug)]
pub struct Key {
    /// The section of a profile that it stands in.
    pub section: &'static str,
    /// Its name, without a unit.
    pub name: &'static str,
    /// What its value is.
    pub kind: Kind,
    /// What counts if the key is left out, as the command line would give it.
    pub default: Option<&'static str>,
    /// A value as the command line would give it.
    pub example: &'static str,
    /// What it is, without full stop.
    pub meaning: &'static str,
    /// Where a person finds its value, if the key must be given.
    pub needed: Option<&'static str>,
}

impl Key {
    /// A key without a default, which may be left out.
    pub const fn new(
        section: &'static str,
        name: &'static str,
        kind: Kind,
        example: &'static str,
        meaning: &'static str,
    ) -> Self {
        Self { section, name, kind, default: None, example, meaning, needed: None }
    }

    /// The same with a default.
    pub const fn or(self, default: &'static str) -> Self {
        Self { default: Some(default), ..self }
    }

    /// The same as a key that must be given; `advice` says where its value is found.
    pub const fn needed(self, advice: &'static str) -> Self {
        Self { needed: Some(advice), ..self }
    }

    /// The same in another section.
    pub const fn within(self, section: &'static str) -> Self {
        Self { section, ..self }
    }

    /// With its section: `plan.step`.
    pub fn path(&self) -> String {
        format!("{}.{}", self.section, self.name)
    }

    /// Whether this is the key at a path such as `plan.step`.
    pub fn is(&self, path: &str) -> bool {
        path.split_once('.') == Some((self.section, self.name))
    }

    /// All names under which it may be given: plain, and with each unit.
    pub fn spellings(&self) -> impl Iterator<Item = String> {
        let with_unit = self.kind.units().map(|unit| format!("{}_{}", self.name, unit.suffix));
        std::iter::once(self.name.to_owned()).chain(with_unit)
    }
}
