//! Values of keys, as given.

use std::fmt;

use serde_json::Value as Json;
use toml::de::DeValue;

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
}

impl fmt::Display for Given {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => write!(to, "{text:?}"),
            Self::Whole(number) => write!(to, "{number}"),
            Self::Real(text) | Self::Plain(text) => write!(to, "{text}"),
            Self::Flag(flag) => write!(to, "{flag}"),
            Self::Other(kind) => write!(to, "({kind})"),
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

    pub(super) fn of_record(value: &Json) -> Self {
        match value {
            Json::String(text) => Self::Text(text.clone()),
            Json::Number(number) => {
                number.as_i64().map_or_else(|| Self::Real(number.to_string()), Self::Whole)
            }
            Json::Bool(flag) => Self::Flag(*flag),
            Json::Null => Self::Other("null"),
            Json::Array(_) => Self::Other("a list"),
            Json::Object(_) => Self::Other("a table"),
        }
    }
}
