//! Declares a section: its keys, and the struct that they are read into.

use std::time::Duration;

use super::super::given::Given;
use super::super::value::interpret;
use epirig_core::settings::quantity::{NS, PERCENT, UNITS, Unit};
pub(super) use epirig_core::settings::{Allowed, Key, Kind, Setting};

/// A section.
#[derive(Debug)]
pub(in crate::profile) struct Section {
    pub(in crate::profile) name: &'static str,
    /// Its purpose, without full stop.
    pub(in crate::profile) meaning: &'static str,
    pub(super) keys: &'static [&'static Key],
}

/// Declares a section of a profile. Each key is stated once: meaning, name, field, type, kind with unit and
/// range, an example, and the default.
///
/// The documentation of struct and fields is their meaning in a profile. A field has the unit that its name
/// ends in behind the name of its key; a share without a unit is a part of 1. Fields behind `and` are no keys.
macro_rules! section {
    (
        $(#[doc = $about:literal])+
        pub struct $struct:ident in $section:literal {$(
            $(#[doc = $meaning:literal])+
            $name:literal => $field:ident: $type:ty = $kind:expr, like $example:literal $(or $default:literal)?;
        )+}
        $(and {$(
            $(#[doc = $what:literal])+
            $more:ident: $more_type:ty,
        )+})?
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, PartialEq)]
        #[allow(rustdoc::broken_intra_doc_links, reason = "a name in brackets is a section of a file")]
        pub struct $struct {
            $(
                $(#[doc = $meaning])+
                #[doc = concat!("\n\nThe key `", $section, ".", $name, "`: `", stringify!($kind), "`.")]
                pub $field: $type,
            )+
            $($($(#[doc = $what])+ pub $more: $more_type,)+)?
        }

        impl $struct {
            pub(in crate::profile) const SECTION: $crate::profile::schema::section::Section =
                $crate::profile::schema::section::Section {
                    name: $section,
                    meaning: $crate::profile::schema::section::sentence(concat!($($about),+)),
                    keys: &[$(&section!(@key $section $name, $kind, $example, ($($meaning)+) $($default)?)),+],
                };

            /// With the values that `value` has for the keys, and without what is no key.
            pub(in crate::profile) fn read(
                value: &mut dyn FnMut(&'static epirig_core::settings::Key) -> Option<epirig_core::settings::Setting>,
            ) -> Self {
                Self {
                    $($field: {
                        const KEY: &epirig_core::settings::Key =
                            &section!(@key $section $name, $kind, $example, ($($meaning)+) $($default)?);
                        let unit = $crate::profile::schema::section::unit_of(KEY, stringify!($field));
                        $crate::profile::schema::section::Field::of(value(KEY), unit)
                    },)+
                    $($($more: Default::default(),)+)?
                }
            }
        }

        /// What counts if nothing is given.
        impl Default for $struct {
            fn default() -> Self {
                Self::read(&mut $crate::profile::schema::section::default_of)
            }
        }
    };
    (@key $section:literal $name:literal, $kind:expr, $example:literal, ($($meaning:literal)+) $($default:literal)?) => {
        epirig_core::settings::Key::new(
            $section,
            $name,
            $kind,
            $example,
            $crate::profile::schema::section::sentence(concat!($($meaning),+)),
        )$(.or($default))?
    };
}
pub(super) use section;

pub(super) const fn measure(unit: Unit, allowed: Allowed) -> Kind {
    Kind::measure(unit, allowed)
}

/// The sentence of a documentation, without full stop.
pub(super) const fn sentence(doc: &'static str) -> &'static str {
    let doc = doc.trim_ascii();
    assert!(matches!(doc.as_bytes(), [.., b'.']), "a meaning is a sentence");
    doc.split_at(doc.len() - 1).0
}

/// The unit of a field: the end of its name, behind the name of the key.
pub(super) fn unit_of(key: &Key, field: &str) -> Option<Unit> {
    let suffix = field.strip_prefix(key.name)?.strip_prefix('_')?;
    UNITS.iter().copied().find(|unit| unit.suffix == suffix)
}

/// The value of a key that is not given.
pub(in crate::profile) fn default_of(key: &'static Key) -> Option<Setting> {
    interpret(key, None, &Given::Plain(key.default?.to_owned())).ok()
}

/// What a field of a section can be: optional, or with a default.
pub(super) trait Field {
    /// Of the value of its key, if there is one; `unit` is that of the field.
    fn of(value: Option<Setting>, unit: Option<Unit>) -> Self;
}

impl<T: FromValue> Field for Option<T> {
    fn of(value: Option<Setting>, unit: Option<Unit>) -> Self {
        T::from_value(value?, unit)
    }
}

impl<T: FromValue + Default> Field for T {
    fn of(value: Option<Setting>, unit: Option<Unit>) -> Self {
        value.and_then(|value| T::from_value(value, unit)).unwrap_or_default()
    }
}

/// What the value of a key can be turned into.
pub(super) trait FromValue: Sized {
    /// `None` for the value of another kind of key.
    fn from_value(value: Setting, unit: Option<Unit>) -> Option<Self>;
}

impl FromValue for f64 {
    fn from_value(value: Setting, unit: Option<Unit>) -> Option<Self> {
        match (value, unit) {
            (Setting::Number(number), _) => Some(number),
            (Setting::Measure(measure), Some(unit)) => Some(measure.in_unit(unit)),
            (Setting::Measure(share), None) => Some(share.in_unit(PERCENT) / 100.0),
            _ => None,
        }
    }
}

/// Implements [`FromValue`] for types that one kind of value makes.
macro_rules! from_value {
    ($($type:ty: $value:pat => $made:expr;)+) => {$(
        impl $crate::profile::schema::section::FromValue for $type {
            fn from_value(
                value: epirig_core::settings::Setting,
                _: Option<epirig_core::settings::quantity::Unit>,
            ) -> Option<Self> {
                if let $value = value { $made } else { None }
            }
        }
    )+};
}
pub(super) use from_value;

from_value! {
    // The allowed range is far below 2^64 ns.
    Duration: Setting::Measure(time) => Some(Self::from_nanos(time.in_unit(NS).round() as u64));
    bool: Setting::Flag(flag) => Some(flag);
    usize: Setting::Whole(number) => Self::try_from(number).ok();
    u64: Setting::Whole(number) => Self::try_from(number).ok();
    String: Setting::Text(text) => Some(text);
}
