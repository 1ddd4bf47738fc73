//! How the tables of keys are written.

use epirig_core::settings::quantity::Unit;
pub(super) use epirig_core::settings::{Allowed, Key, Kind};

/// More corners each way than any board has that a camera can count.
pub(super) const MOST_CORNERS: i64 = 1000;

/// A key of the section that the table around it is of.
pub(super) const fn key(name: &'static str, kind: Kind, example: &'static str, meaning: &'static str) -> Key {
    Key::new("", name, kind, example, meaning)
}

pub(super) const fn measure(unit: Unit, allowed: Allowed) -> Kind {
    Kind::measure(unit, allowed)
}

/// Keys of a section, each with a name in code.
macro_rules! keys {
    ($section:literal, $($constant:ident = $key:expr),* $(,)?) => {
        $(pub(in crate::profile) static $constant: Key = $key.within($section);)*
        /// All of the section.
        pub(in crate::profile) static KEYS: &[&Key] = &[$(&$constant),*];
    };
}
pub(super) use keys;
