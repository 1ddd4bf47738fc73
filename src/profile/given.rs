//! Values of keys, as given and as interpreted.

use std::fmt;

use toml::de::DeValue;

use super::schema::{Key, Kind};
use epirig_core::settings::Setting;
use epirig_core::settings::quantity::Measure;

/// A value as given.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Given {
    /// A string in a file.
    Text(String),
    /// An integer in a file.
    Whole(i64),
    /// A floating-point number in a file, as written.
    Real(String),
    /// A boolean in a file.
    Flag(bool),
    /// Another TOML type in a file: array, table or date.
    Other(&'static str),
    /// The text of an override, of any type.
    Plain(String),
    /// An interpreted value from a record.
    Known(Value),
}

impl fmt::Display for Given {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => write!(to, "{text:?}"),
            Self::Whole(number) => write!(to, "{number}"),
            Self::Real(text) | Self::Plain(text) => write!(to, "{text}"),
            Self::Flag(flag) => write!(to, "{flag}"),
            Self::Other(kind) => write!(to, "({kind})"),
            Self::Known(value) => write!(to, "{value}"),
        }
    }
}

impl Given {
    pub(super) fn of(value: &DeValue<'_>) -> Self {
        match value {
            DeValue::String(text) => Self::Text(text.to_string()),
            // TOML allows integers beyond 64 bits, which are not accepted here.
            DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix())
                .map_or_else(|_| Self::Real(number.as_str().to_owned()), Self::Whole),
            DeValue::Float(number) => Self::Real(number.as_str().to_owned()),
            DeValue::Boolean(flag) => Self::Flag(*flag),
            DeValue::Datetime(_) => Self::Other("a date"),
            DeValue::Array(_) => Self::Other("a list"),
            DeValue::Table(_) => Self::Other("a table"),
        }
    }
}

/// A value that is valid for its key.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Text(String),
    /// The name of the choice.
    Choice(&'static str),
    Whole(i64),
    Number(f64),
    Flag(bool),
    Measure(Measure),
}

impl fmt::Display for Value {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => write!(to, "{text}"),
            Self::Choice(name) => write!(to, "{name}"),
            Self::Whole(number) => write!(to, "{number}"),
            Self::Number(number) => write!(to, "{number}"),
            Self::Flag(flag) => write!(to, "{flag}"),
            Self::Measure(Measure { value, unit }) => write!(to, "{value} {}", unit.name),
        }
    }
}

impl Value {
    /// As drivers take it: a quantity in the unit of its key.
    pub(super) fn setting(self, key: &Key) -> Setting {
        match (self, key.kind) {
            (Self::Text(text), _) => Setting::Text(text),
            (Self::Choice(name), _) => Setting::Text(name.to_owned()),
            (Self::Whole(number), _) => Setting::Whole(number),
            (Self::Number(number), _) => Setting::Number(number),
            (Self::Flag(flag), _) => Setting::Flag(flag),
            (Self::Measure(measure), Kind::Measure { unit, .. }) => Setting::Number(measure.in_unit(unit)),
            (Self::Measure(measure), _) => Setting::Number(measure.value),
        }
    }
}
