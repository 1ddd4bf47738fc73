//! Numbers and lengths as values of options.

use std::num::{ParseFloatError, ParseIntError};

use clap::error::{ContextKind, ErrorKind};
use epirig_core::settings::quantity::{MM, NoMeasure, Quantity, measure, number};

/// A length in mm: a number, which counts as mm, or one with a unit of length.
pub(super) fn mm(text: &str) -> Result<f64, String> {
    if let Some(number) = number(text.trim()) {
        return Ok(number);
    }
    match measure(text) {
        Ok(length) if length.unit.quantity == Quantity::Length => Ok(length.in_unit(MM)),
        Ok(other) => Err(format!(
            "{} is the unit of {}; a length has one of {}",
            other.unit.name,
            other.unit.quantity.noun(),
            Quantity::Length.unit_names()
        )),
        Err(NoMeasure::UnitUnknown(name)) => {
            Err(format!("{name} is no unit of length; there are {}", Quantity::Length.unit_names()))
        }
        Err(NoMeasure::Number | NoMeasure::UnitMissing) => {
            Err(format!("{NO_NUMBER}, or with a unit: \"12.5 mm\""))
        }
    }
}

/// The same for a length above zero.
pub(super) fn positive_mm(text: &str) -> Result<f64, String> {
    mm(text).and_then(|length| if length > 0.0 { Ok(length) } else { Err("it must be above 0".to_owned()) })
}

const NO_NUMBER: &str = "it is not a number; write it with a decimal point, such as 12.5";

/// The error of a command line. One about a number says what is wrong in the words of a person.
pub(super) fn in_words(error: clap::Error, program: &clap::Command) -> clap::Error {
    use std::error::Error as _;
    let words = match error.source() {
        Some(source) if source.is::<ParseFloatError>() => NO_NUMBER,
        Some(source) if source.is::<ParseIntError>() => "it is not a whole number, such as 12",
        _ => return error,
    };
    let context = |kind| error.get(kind).map(ToString::to_string).unwrap_or_default();
    let (option, value) = (context(ContextKind::InvalidArg), context(ContextKind::InvalidValue));
    let message = format!("invalid value '{value}' for '{option}': {words}");
    clap::Error::raw(ErrorKind::ValueValidation, message + "\n").with_cmd(program)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::super::Cli;
    use super::*;

    #[test]
    fn lengths_may_have_units() {
        for (text, length) in
            [("12.5", 12.5), ("12.5 mm", 12.5), ("1.25cm", 12.5), ("-1500 um", -1.5), ("0.0125 m", 12.5)]
        {
            assert_eq!(mm(text), Ok(length), "{text}");
        }
        for (text, words) in [
            ("12,5", "decimal point"),
            ("12,5 mm", "decimal point"),
            ("inf", "decimal point"),
            ("12.5 furlongs", "no unit of length"),
            ("12.5 s", "the unit of a time"),
        ] {
            assert!(mm(text).unwrap_err().contains(words), "{text}: {:?}", mm(text));
        }
        assert!(positive_mm("-1 mm").is_err() && positive_mm("0").is_err());
    }

    /// Every option of every verb that takes a number: what clap says of the parsers of Rust is no help.
    #[test]
    fn no_option_answers_a_wrong_number_in_the_words_of_the_parser() {
        let program = Cli::command();
        let mut count = 0;
        let mut verbs: Vec<(Vec<&str>, &clap::Command)> = vec![(vec!["epirig"], &program)];
        while let Some((words, verb)) = verbs.pop() {
            verbs.extend(
                verb.get_subcommands().map(|below| ([&words[..], &[below.get_name()]].concat(), below)),
            );
            for name in verb.get_arguments().filter_map(|option| option.get_long()) {
                let option = format!("--{name}=12,5x");
                let arguments = [&words[..], &[option.as_str()]].concat();
                let Err(error) = program.clone().try_get_matches_from(&arguments) else { continue };
                let said = in_words(error, &program).to_string();
                for jargon in ["invalid float literal", "invalid digit", "ParseIntError"] {
                    assert!(!said.contains(jargon), "{arguments:?}: {said}");
                }
                count += usize::from(said.contains("decimal point") || said.contains("whole number"));
            }
        }
        // Verbs of the first level alone have 42 of them.
        assert!(count > 42, "{count} options take a number");
    }
}
