//! Choices of the library as values of options: names and help lines.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use epirig_core::choice::Choice;

/// Parses a choice by its name. Help and completions list all choices.
pub(super) fn choice<T: Choice>() -> impl TypedValueParser<Value = T> {
    choice_among(T::ALL)
}

/// The same for a subset of the choices.
pub(super) fn choice_among<T: Choice>(choices: &[T]) -> impl TypedValueParser<Value = T> + use<T> {
    let values = choices
        .iter()
        .map(|choice| PossibleValue::new(choice.name()).help(choice.help().trim_end_matches('.')));
    PossibleValuesParser::new(values)
        .try_map(|name| T::from_name(&name).ok_or_else(|| format!("\"{name}\" is not one of them")))
}
