//! Keys of a profile, and the values that they may have.

use crate::profile::quantity::{Quantity, UNITS, Unit};

/// Longest time of a profile, in h: so that a duration is exact as a number of seconds.
pub(in crate::profile) const LONGEST_H: f64 = 24.0;

/// Largest number of a quantity in its key's unit, and smallest of one that is divided by: no quotient of two leaves what a time can be.
pub(in crate::profile) const LARGEST: f64 = 1e9;
/// See [`LARGEST`].
pub(in crate::profile) const SMALLEST: f64 = 1e-9;

/// More corners each way than any board has that a camera can count.
pub(in crate::profile) const MOST_CORNERS: i64 = 1000;

/// Values of a quantity that make sense, in the key's own unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::profile) enum Allowed {
    Any,
    Positive,
    ZeroOrMore,
    /// From 0 to this.
    UpTo(f64),
    /// From minus this to this.
    Within(f64),
    /// These only.
    Among(&'static [f64]),
}

/// What a key's value is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::profile) enum Kind {
    Text,
    /// A camera as [`CameraChoice`](epirig_devices::camera::CameraChoice) reads it.
    Camera,
    /// Code of a pixel format.
    Format,
    /// Columns and rows.
    Size,
    /// One of these names.
    Choice(&'static [&'static str]),
    /// A whole number from the first to the second.
    Whole(i64, i64),
    /// A number without a unit.
    Number,
    Flag,
    /// A quantity. The unit is that of the typed profile, and the one that messages propose.
    Measure {
        unit: Unit,
        or: Option<Unit>,
        allowed: Allowed,
    },
}

impl Kind {
    /// The units that a value may have.
    pub(in crate::profile) fn units(self) -> impl Iterator<Item = Unit> {
        let quantities = match self {
            Self::Measure { unit, or, .. } => [Some(unit.quantity), or.map(|unit| unit.quantity)],
            _ => [None, None],
        };
        UNITS.iter().copied().filter(move |unit| quantities.contains(&Some(unit.quantity)))
    }

    /// What a value must be, for a person.
    pub(in crate::profile) fn allowed(self) -> String {
        match self {
            Self::Text => "text that is not empty".to_owned(),
            Self::Camera => {
                "a path such as /dev/video0, a name in /dev/v4l/by-id, usb:SERIAL, replay:FOLDER or sim"
                    .to_owned()
            }
            Self::Format => "a code of one to four characters, such as GREY or Y12".to_owned(),
            Self::Size => "COLUMNSxROWS, such as 1280x720".to_owned(),
            Self::Choice(names) => format!("one of {}", names.join(", ")),
            Self::Whole(least, most) => format!("a whole number from {least} to {most}"),
            Self::Number => "a number".to_owned(),
            Self::Flag => "true or false".to_owned(),
            Self::Measure { unit, or, allowed } => {
                let mut nouns = unit.quantity.noun().to_owned();
                if let Some(other) = or {
                    nouns = format!("{nouns} or {}", other.quantity.noun());
                }
                match allowed {
                    Allowed::Positive if unit.quantity == Quantity::Time => {
                        format!("a time from 1 ns to {LONGEST_H} h")
                    }
                    Allowed::ZeroOrMore if unit.quantity == Quantity::Time => {
                        format!("a time from 0 s to {LONGEST_H} h")
                    }
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
    pub(in crate::profile) fn is_quoted(self) -> bool {
        !matches!(self, Self::Whole(..) | Self::Number | Self::Flag)
    }
}

/// A key.
#[derive(Debug)]
pub(in crate::profile) struct Key {
    pub(in crate::profile) section: &'static str,
    /// Without a unit.
    pub(in crate::profile) name: &'static str,
    pub(in crate::profile) kind: Kind,
    /// What counts if the key is left out, as an override would give it.
    pub(in crate::profile) default: Option<&'static str>,
    /// A value as an override would give it.
    pub(in crate::profile) example: &'static str,
    /// What it is, without full stop.
    pub(in crate::profile) meaning: &'static str,
    /// The drivers of the stage with which it means something; empty: all.
    pub(in crate::profile) drivers: &'static [&'static str],
}

impl Key {
    /// With its section.
    pub(in crate::profile) fn path(&self) -> String {
        format!("{}.{}", self.section, self.name)
    }

    /// All names under which it may be given.
    pub(super) fn spellings(&self) -> impl Iterator<Item = String> {
        let with_unit = self.kind.units().map(|unit| format!("{}_{}", self.name, unit.suffix));
        std::iter::once(self.name.to_owned()).chain(with_unit)
    }
}

pub(super) const fn key(name: &'static str, kind: Kind, example: &'static str, meaning: &'static str) -> Key {
    Key { section: "", name, kind, default: None, example, meaning, drivers: &[] }
}

pub(super) const fn measure(unit: Unit, allowed: Allowed) -> Kind {
    Kind::Measure { unit, or: None, allowed }
}

impl Key {
    pub(super) const fn or(self, default: &'static str) -> Self {
        Self { default: Some(default), ..self }
    }

    pub(super) const fn only_with(self, drivers: &'static [&'static str]) -> Self {
        Self { drivers, ..self }
    }
}

/// Names of a table of choices.
pub(super) const fn names<T: Copy, const N: usize>(choices: &[(&'static str, T); N]) -> [&'static str; N] {
    let mut names = [""; N];
    let mut index = 0;
    while index < N {
        names[index] = choices[index].0;
        index += 1;
    }
    names
}

/// Keys of a section, each with a name in code.
macro_rules! keys {
    ($section:literal, $($constant:ident = $key:expr),* $(,)?) => {
        $(pub(in crate::profile) static $constant: Key = Key { section: $section, ..$key };)*
        /// All of the section.
        pub(in crate::profile) static KEYS: &[&Key] = &[$(&$constant),*];
    };
}
pub(super) use keys;
