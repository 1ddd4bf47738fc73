//! Choices of the library as values of options: their names, and the line of help that each has.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use epirig_core::choice::Choice;

/// Reads a choice by its name. Help and completions list all of them.
pub(super) fn choice<T: Choice>() -> impl TypedValueParser<Value = T> {
    choice_among(T::ALL)
}

/// The same, of some of them only.
pub(super) fn choice_among<T: Choice>(choices: &[T]) -> impl TypedValueParser<Value = T> + use<T> {
    let values = choices
        .iter()
        .map(|choice| PossibleValue::new(choice.name()).help(choice.help().trim_end_matches('.')));
    PossibleValuesParser::new(values)
        .try_map(|name| T::from_name(&name).ok_or_else(|| format!("\"{name}\" is not among them")))
}
