//! Macros for the tables of keys.

use epirig_core::settings::quantity::Unit;
pub(super) use epirig_core::settings::{Allowed, Key, Kind};

/// Most corners per row and column; no camera resolves more.
pub(super) const MOST_CORNERS: i64 = 1000;

/// A key of the surrounding section.
pub(super) const fn key(name: &'static str, kind: Kind, example: &'static str, meaning: &'static str) -> Key {
    Key::new("", name, kind, example, meaning)
}

pub(super) const fn measure(unit: Unit, allowed: Allowed) -> Kind {
    Kind::measure(unit, allowed)
}

/// Defines the keys of a section as constants.
macro_rules! keys {
    ($section:literal, $($constant:ident = $key:expr),* $(,)?) => {
        $(pub(in crate::profile) static $constant: Key = $key.within($section);)*
        /// All keys of the section.
        pub(in crate::profile) static KEYS: &[&Key] = &[$(&$constant),*];
    };
}
pub(super) use keys;
