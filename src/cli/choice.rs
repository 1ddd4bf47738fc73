//! Choices of the library as values of options: names and help lines.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use epirig_core::choice::Choice;

/// Parses a choice by its name. Help and completions list all choices.
pub(super) fn choice<T: Choice>() -> impl TypedValueParser<Value = T> {
    let values = T::ALL
        .iter()
        .map(|choice| PossibleValue::new(choice.name()).help(choice.help().trim_end_matches('.')));
    PossibleValuesParser::new(values)
        .try_map(|name| T::from_name(&name).ok_or_else(|| format!("\"{name}\" is not one of them")))
}
