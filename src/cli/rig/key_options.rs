//! Options of the command line for keys of the profile: made from the keys, so that meaning and default are stated once.

use std::marker::PhantomData;

use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};

use super::profile::{SHORT_NAMES, given};
use crate::profile::{Override, key};
use epirig_core::settings::quantity::{Unit, measure, number};
use epirig_core::settings::{Key, Kind};

/// A group of options, as help has it.
pub(in crate::cli) trait KeyGroup {
    const HEADING: &'static str;

    /// Its options, in the order of the help.
    fn options() -> Vec<KeyOption>;
}

/// An option that sets a key.
pub(in crate::cli) struct KeyOption {
    key: &'static Key,
    /// The unit of its value, if it is a quantity: it stands in the name of the option.
    unit: Option<Unit>,
    name: String,
    /// What is said behind the meaning: the drivers that have the key.
    remark: String,
}

impl KeyOption {
    /// Of the keys at these paths; that of a quantity ends with the unit of the option: `plan.step_mm`.
    pub(in crate::cli) fn all(paths: &[&str]) -> Vec<Self> {
        paths.iter().filter_map(|path| Self::at(path)).collect()
    }

    fn at(path: &str) -> Option<Self> {
        if let Some(plain) = key(path) {
            return Some(Self::new(plain, None));
        }
        let (path, suffix) = path.rsplit_once('_')?;
        let quantity = key(path)?;
        let unit = quantity.kind.units().find(|unit| unit.suffix == suffix)?;
        Some(Self::new(quantity, Some(unit)))
    }

    /// Of a key that only some drivers have, in its own unit.
    pub(in crate::cli) fn of_drivers(key: &'static Key, drivers: &[&str]) -> Self {
        let unit = match key.kind {
            Kind::Measure { unit, .. } => Some(unit),
            _ => None,
        };
        Self { remark: format!(" ({})", drivers.join(", ")), ..Self::new(key, unit) }
    }

    /// The same under another name.
    pub(in crate::cli) fn named(self, name: &str) -> Self {
        Self { name: name.to_owned(), ..self }
    }

    fn new(key: &'static Key, unit: Option<Unit>) -> Self {
        Self { key, unit, name: with_unit(key, unit).replace('_', "-"), remark: String::new() }
    }

    /// The key as an override names it: with the unit of the option if the value is a number alone.
    fn path(&self, value: &str) -> String {
        let unit = self.unit.filter(|_| number(value.trim()).is_some());
        format!("{}.{}", self.key.section, with_unit(self.key, unit))
    }

    /// The default of the key, in the unit of the option.
    fn default(&self) -> Option<String> {
        let default = self.key.default?;
        Some(match (self.unit, measure(default)) {
            (Some(unit), Ok(found)) => found.in_unit(unit).to_string(),
            _ => default.to_owned(),
        })
    }

    fn argument(&self, heading: &'static str) -> Arg {
        let mut help = format!("{}{}", self.key.meaning, self.remark);
        if let Some(default) = self.default() {
            help.push_str(&format!(" [default: {default}]"));
        }
        if let Some((name, _)) = SHORT_NAMES.iter().find(|(_, path)| *path == self.key.path()) {
            help.push_str(&format!(" [env: {name}]"));
        }
        let value_name = match (self.unit, self.key.kind) {
            (Some(unit), _) => unit.suffix.to_uppercase(),
            (None, Kind::Whole(..)) => "N".to_owned(),
            (None, _) => self.name.to_uppercase(),
        };
        let argument = Arg::new(self.name.clone())
            .long(self.name.clone())
            .value_name(value_name)
            .allow_negative_numbers(true)
            .help_heading(heading)
            .help(help);
        match self.key.kind {
            Kind::Choice(names) => argument.value_parser(PossibleValuesParser::new(names())),
            _ => argument,
        }
    }
}

fn with_unit(key: &Key, unit: Option<Unit>) -> String {
    match unit {
        Some(unit) => format!("{}_{}", key.name, unit.suffix),
        None => key.name.to_owned(),
    }
}

/// What was given for the options of a group.
#[derive(Debug)]
pub(in crate::cli) struct KeyOptions<G> {
    given: Vec<Override>,
    group: PhantomData<G>,
}

impl<G: KeyGroup> KeyOptions<G> {
    /// As keys of a profile.
    pub(in crate::cli) fn changes(&self) -> Vec<Override> {
        self.given.clone()
    }
}

impl<G: KeyGroup> FromArgMatches for KeyOptions<G> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut given = Self { given: Vec::new(), group: PhantomData };
        given.update_from_arg_matches(matches)?;
        Ok(given)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        let given = G::options().into_iter().filter_map(|option| {
            let value = matches.get_one::<String>(&option.name)?;
            given(&option.path(value), &format!("--{}", option.name), Some(value))
        });
        self.given = given.collect();
        Ok(())
    }
}

impl<G: KeyGroup> Args for KeyOptions<G> {
    fn augment_args(command: Command) -> Command {
        command.args(G::options().iter().map(|option| option.argument(G::HEADING)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

#[cfg(test)]
mod tests {
    use super::super::camera::CameraKeys;
    use super::super::plan::PlanKeys;
    use super::super::stage::StageKeys;
    use super::*;
    use crate::profile::Profile;

    fn group<G: KeyGroup>(least: usize) {
        let options = G::options();
        // Keys that are missing in the profile would be left out silently.
        assert!(options.len() >= least, "{}", G::HEADING);
        for option in options {
            let Some(default) = option.default().filter(|_| option.remark.is_empty()) else { continue };
            let of_default = given(&option.path(&default), &format!("--{}", option.name), Some(default));
            assert_eq!(Profile::of(of_default.as_slice()), Profile::of(&[]), "--{}", option.name);
        }
    }

    #[test]
    fn a_value_may_have_a_unit_of_its_own() {
        let step = KeyOption::at("plan.step_mm").unwrap();
        let profile =
            |value: &str| Profile::of(given(&step.path(value), "--step-mm", Some(value)).as_slice());
        for value in ["1.5", "1.5 mm", "1500um"] {
            assert_eq!(profile(value).unwrap().plan.step_mm, Some(1.5), "{value}");
        }
        let refused = |value: &str| profile(value).unwrap_err().to_string();
        assert!(refused("1,5").contains("decimal point"), "{}", refused("1,5"));
        assert!(refused("1.5 s").contains("the unit of a time"), "{}", refused("1.5 s"));
    }

    #[test]
    fn the_defaults_that_help_tells_are_those_of_the_profile() {
        group::<PlanKeys>(7);
        group::<StageKeys>(4 + 8);
        group::<CameraKeys>(7);
    }
}
