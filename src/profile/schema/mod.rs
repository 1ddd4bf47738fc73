//! The sections and keys of a profile: what the reader accepts and what the commented profile explains.

pub(super) mod camera;
mod measurement;
pub(super) mod sim;
pub(super) mod stage;

use super::error::{Problem, did_you_mean};
use super::quantity::{Quantity, UNITS, Unit};

pub(super) use measurement::{board, limits, optics, plan, target};

/// Longest time of a profile, in h: so that a duration is exact as a number of seconds.
pub(super) const LONGEST_H: f64 = 24.0;

/// Largest number of a quantity in its key's unit, and smallest of one that is divided by: no quotient of two leaves what a time can be.
pub(super) const LARGEST: f64 = 1e9;
/// See [`LARGEST`].
pub(super) const SMALLEST: f64 = 1e-9;

/// More corners each way than any board has that a camera can count.
pub(super) const MOST_CORNERS: i64 = 1000;

/// Values of a quantity that make sense, in the key's own unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Allowed {
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
pub(super) enum Kind {
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
    pub(super) fn units(self) -> impl Iterator<Item = Unit> {
        let quantities = match self {
            Self::Measure { unit, or, .. } => [Some(unit.quantity), or.map(|unit| unit.quantity)],
            _ => [None, None],
        };
        UNITS.iter().copied().filter(move |unit| quantities.contains(&Some(unit.quantity)))
    }

    /// What a value must be, for a person.
    pub(super) fn allowed(self) -> String {
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
    pub(super) fn is_quoted(self) -> bool {
        !matches!(self, Self::Whole(..) | Self::Number | Self::Flag)
    }
}

/// A key.
#[derive(Debug)]
pub(super) struct Key {
    pub(super) section: &'static str,
    /// Without a unit.
    pub(super) name: &'static str,
    pub(super) kind: Kind,
    /// What counts if the key is left out, as an override would give it.
    pub(super) default: Option<&'static str>,
    /// A value as an override would give it.
    pub(super) example: &'static str,
    /// What it is, without full stop.
    pub(super) meaning: &'static str,
    /// The drivers of the stage with which it means something; empty: all.
    pub(super) drivers: &'static [&'static str],
}

impl Key {
    /// With its section.
    pub(super) fn path(&self) -> String {
        format!("{}.{}", self.section, self.name)
    }

    /// All names under which it may be given.
    fn spellings(&self) -> impl Iterator<Item = String> {
        let with_unit = self.kind.units().map(|unit| format!("{}_{}", self.name, unit.suffix));
        std::iter::once(self.name.to_owned()).chain(with_unit)
    }
}

const fn key(name: &'static str, kind: Kind, example: &'static str, meaning: &'static str) -> Key {
    Key { section: "", name, kind, default: None, example, meaning, drivers: &[] }
}

const fn measure(unit: Unit, allowed: Allowed) -> Kind {
    Kind::Measure { unit, or: None, allowed }
}

impl Key {
    const fn or(self, default: &'static str) -> Self {
        Self { default: Some(default), ..self }
    }

    const fn only_with(self, drivers: &'static [&'static str]) -> Self {
        Self { drivers, ..self }
    }
}

/// Names of a table of choices.
const fn names<T: Copy, const N: usize>(choices: &[(&'static str, T); N]) -> [&'static str; N] {
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
use keys;

/// A section.
#[derive(Debug)]
pub(super) struct Section {
    pub(super) name: &'static str,
    /// What it is about, without full stop.
    pub(super) meaning: &'static str,
    pub(super) keys: &'static [&'static Key],
}

const fn section(name: &'static str, meaning: &'static str, keys: &'static [&'static Key]) -> Section {
    Section { name, meaning, keys }
}

/// The table of [`camera`] whose keys are the camera's own.
pub(super) const CONTROLS: &str = "controls";

/// All sections.
pub(super) static SECTIONS: &[Section] = &[
    section("stage", "The stage, and how to reach it", stage::KEYS),
    section("camera", "The camera, and how it is to be set", camera::KEYS),
    section("plan", "The scan: where the stage stops, and what is taken there", plan::KEYS),
    section("optics", "The lens and the sensor; with them, heights are given in mm", optics::KEYS),
    section("target", "What is measured, and the chess-boards that are printed on it", target::KEYS),
    section("board", "The chess-board that is held before the camera, to measure the lens", board::KEYS),
    section("limits", "What a scan may not exceed", limits::KEYS),
    section("sim", "The simulated rig; only with a simulated stage or camera", sim::KEYS),
];

/// The section called `name`.
///
/// # Errors
/// [`Problem::UnknownSection`].
pub(super) fn find_section(name: &str) -> Result<&'static Section, Problem> {
    SECTIONS.iter().find(|section| section.name == name).ok_or_else(|| Problem::UnknownSection {
        name: name.to_owned(),
        hint: did_you_mean(name, SECTIONS.iter().map(|section| section.name.to_owned())),
    })
}

/// The key that `name` means in a section, and the unit that it names.
///
/// # Errors
/// [`Problem::UnknownKey`], [`Problem::UnknownUnitInKey`].
pub(super) fn find_key(section: &Section, name: &str) -> Result<(&'static Key, Option<Unit>), Problem> {
    let suffix = |key: &Key| name.strip_prefix(key.name).and_then(|rest| rest.strip_prefix('_'));
    for key in section.keys {
        if key.name == name {
            return Ok((key, None));
        }
        let unit = suffix(key).and_then(|suffix| key.kind.units().find(|unit| unit.suffix == suffix));
        if unit.is_some() {
            return Ok((key, unit));
        }
    }
    // Of two keys one of which begins like the other, the longer is meant.
    let likely = section.keys.iter().filter(|key| suffix(key).is_some()).max_by_key(|key| key.name.len());
    if let Some(key) = likely
        && let (Kind::Measure { unit, .. }, Some(suffix)) = (key.kind, suffix(key))
    {
        return Err(Problem::UnknownUnitInKey {
            key: format!("{}.{name}", section.name),
            suffix: suffix.to_owned(),
            proposal: format!("{}_{}", key.name, unit.suffix),
            units: key.kind.units().map(|unit| unit.name).collect::<Vec<_>>().join(", "),
        });
    }
    // A key that is right elsewhere is more likely meant than one that merely looks alike.
    let elsewhere = SECTIONS
        .iter()
        .flat_map(|section| section.keys)
        .find(|key| key.spellings().any(|spelling| spelling == name));
    let spellings = || section.keys.iter().flat_map(|key| key.spellings());
    Err(Problem::UnknownKey {
        key: format!("{}.{name}", section.name),
        hint: elsewhere.map_or_else(
            || did_you_mean(name, spellings()),
            |key| format!("did you mean {}.{name}?", key.section),
        ),
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn no_two_spellings_are_the_same() {
        for section in SECTIONS {
            let spellings: Vec<String> = section.keys.iter().flat_map(|key| key.spellings()).collect();
            let different: BTreeSet<&String> = spellings.iter().collect();
            assert_eq!(different.len(), spellings.len(), "{}", section.name);
            assert!(section.keys.iter().all(|key| key.section == section.name), "{}", section.name);
        }
    }

    #[test]
    fn keys_are_found_in_all_spellings() {
        let plan = find_section("plan").unwrap();
        let (key, unit) = find_key(plan, "step_um").unwrap();
        assert_eq!((key.name, unit.map(|unit| unit.name)), ("step", Some("um")));
        let stage = find_section("stage").unwrap();
        let (key, unit) = find_key(stage, "velocity_mm_s").unwrap();
        assert_eq!((key.name, unit.map(|unit| unit.name)), ("velocity", Some("mm/s")));
        assert!(find_key(plan, "frames_mm").is_err(), "a count has no unit");
    }
}
