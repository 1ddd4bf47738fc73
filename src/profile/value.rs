//! Interpretation of given values.

use super::error::Problem;
use super::given::Given;
use epirig_core::settings::quantity::{Measure, NS, NoMeasure, Quantity, Unit, measure, number};
use epirig_core::settings::{Allowed, Key, Kind, LARGEST, SMALLEST, Setting};

/// Interprets `given` for a key whose name ended in `unit`.
///
/// # Errors
/// [`Problem`] if it is not valid.
pub(super) fn interpret(key: &Key, unit: Option<Unit>, given: &Given) -> Result<Setting, Problem> {
    let found = match key.kind {
        Kind::Measure { .. } => return measured(key, unit, given).map(Setting::Measure),
        Kind::Text => {
            text(given).filter(|text| !text.trim().is_empty()).map(|text| Setting::Text(text.to_owned()))
        }
        Kind::Form { is_valid, .. } => {
            text(given).filter(|text| is_valid(text)).map(|text| Setting::Text(text.to_owned()))
        }
        Kind::Choice(names) => {
            text(given).filter(|text| names().contains(text)).map(|name| Setting::Text(name.to_owned()))
        }
        Kind::Whole(least, most) => {
            whole(given).filter(|number| (least..=most).contains(number)).map(Setting::Whole)
        }
        Kind::Number => plain_number(given).map(Setting::Number),
        Kind::Flag => match given {
            Given::Flag(flag) => Some(Setting::Flag(*flag)),
            Given::Plain(text) => text.parse().ok().map(Setting::Flag),
            _ => None,
        },
    };
    found.ok_or_else(|| not_allowed(key.path(), key.kind.allowed(), given))
}

/// The value of a camera's control, as a name or as digits.
///
/// # Errors
/// [`Problem::NotAllowed`].
pub(super) fn control(path: &str, given: &Given) -> Result<String, Problem> {
    match given {
        Given::Whole(number) => Ok(number.to_string()),
        Given::Flag(flag) => Ok(flag.to_string()),
        Given::Text(text) | Given::Plain(text) if !text.trim().is_empty() => Ok(text.clone()),
        _ => Err(not_allowed(path.to_owned(), "a whole number, true, false or text".to_owned(), given)),
    }
}

fn not_allowed(key: String, allowed: String, given: &Given) -> Problem {
    Problem::NotAllowed { key, value: given.to_string(), allowed }
}

fn text(given: &Given) -> Option<&str> {
    match given {
        Given::Text(text) | Given::Plain(text) => Some(text),
        _ => None,
    }
}

fn whole(given: &Given) -> Option<i64> {
    match given {
        Given::Whole(number) => Some(*number),
        Given::Plain(text) => text.parse().ok(),
        _ => None,
    }
}

/// A number without unit; TOML allows `_` in numbers.
fn plain_number(given: &Given) -> Option<f64> {
    match given {
        Given::Whole(value) => Some(*value as f64),
        Given::Real(text) | Given::Plain(text) => number(text),
        _ => None,
    }
}

fn measured(key: &Key, unit_in_key: Option<Unit>, given: &Given) -> Result<Measure, Problem> {
    let found = match unit_in_key {
        Some(unit) => Measure {
            value: plain_number(given).ok_or_else(|| Problem::UnitInKey {
                key: format!("{}_{}", key.path(), unit.suffix),
                value: given.to_string(),
                proposal: format!("{}, or {}", example_in_key(key, unit), example(key)),
            })?,
            unit,
        },
        None => with_unit(key, given)?,
    };
    let Kind::Measure { unit, allowed, .. } = key.kind else { return Ok(found) };
    if !key.kind.units().any(|unit| unit == found.unit) {
        let quantity = found.unit.quantity;
        let wanted = key.kind.units().map(|unit| unit.name).collect::<Vec<_>>().join(", ");
        let reason = format!(
            "{} is the unit of {}, the units of this key are {wanted}",
            found.unit.name,
            quantity.noun()
        );
        return Err(wrong_unit(key, given, reason));
    }
    let suits = if found.unit.quantity == Quantity::Time {
        Kind::allows_time(allowed, found.in_unit(NS))
    } else {
        // Both forms of a focal length must be positive.
        let value = if unit.quantity == found.unit.quantity { found.in_unit(unit) } else { found.value };
        if !allowed.is_of_usual_size(value) {
            let least = if allowed == Allowed::Positive { SMALLEST } else { -LARGEST };
            let range = format!("from {least:e} to {LARGEST:e} {}", unit.name);
            return Err(not_allowed(key.path(), range, given));
        }
        allowed.holds(value)
    };
    if suits { Ok(found) } else { Err(not_allowed(key.path(), key.kind.allowed(), given)) }
}

fn with_unit(key: &Key, given: &Given) -> Result<Measure, Problem> {
    let without = |number: &str| Problem::NoUnit {
        key: key.path(),
        value: given.to_string(),
        proposal: match (given, key.kind) {
            (Given::Plain(_), Kind::Measure { unit, or, .. }) => {
                let other = or.map_or_else(String::new, |other| format!(" or {number} {}", other.name));
                format!("{number} {}{other}", unit.name)
            }
            (_, Kind::Measure { unit, or, .. }) => {
                let other = or.map_or_else(String::new, |other| {
                    format!(", or {} = \"{number} {}\"", key.name, other.name)
                });
                format!(
                    "{} = \"{number} {}\" or {}_{} = {number}{other}",
                    key.name, unit.name, key.name, unit.suffix
                )
            }
            _ => example(key),
        },
    };
    match given {
        Given::Whole(_) | Given::Real(_) => Err(without(&given.to_string())),
        Given::Text(text) | Given::Plain(text) => measure(text).map_err(|wrong| match wrong {
            NoMeasure::UnitMissing => without(text.trim()),
            NoMeasure::Number => Problem::WrongUnit {
                key: key.path(),
                value: given.to_string(),
                reason: "the value must begin with a number, with a decimal point".to_owned(),
                proposal: proposal(key, given),
            },
            NoMeasure::UnitUnknown(name) => {
                let units = key.kind.units().map(|unit| unit.name).collect::<Vec<_>>().join(", ");
                wrong_unit(key, given, format!("{name} is not a unit of this key; its units are {units}"))
            }
        }),
        _ => Err(not_allowed(key.path(), key.kind.allowed(), given)),
    }
}

fn wrong_unit(key: &Key, given: &Given, reason: String) -> Problem {
    Problem::WrongUnit { key: key.path(), value: given.to_string(), reason, proposal: proposal(key, given) }
}

fn proposal(key: &Key, given: &Given) -> String {
    if matches!(given, Given::Plain(_)) {
        format!("for example {}", key.example)
    } else {
        format!("for example {}", example(key))
    }
}

/// A line of a file that sets a key to its example.
pub(super) fn example(key: &Key) -> String {
    line(key, key.example)
}

/// A line of a file that sets a key to a value, written as in an override.
pub(super) fn line(key: &Key, value: &str) -> String {
    let quote = if key.kind.is_quoted() { "\"" } else { "" };
    format!("{} = {quote}{value}{quote}", key.name)
}

fn example_in_key(key: &Key, unit: Unit) -> String {
    // Examples are valid quantities; the tests check this.
    let value = measure(key.example).map_or(1.0, |example| {
        if example.unit.quantity == unit.quantity { example.in_unit(unit) } else { example.value }
    });
    format!("{}_{} = {value}", key.name, unit.suffix)
}
