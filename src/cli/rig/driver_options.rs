//! Options of the command line for the keys that the drivers of stages bring.

use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};

use super::profile::Options;
use epirig_core::settings::{Key, Kind};
use epirig_devices::stage::driver_keys;

/// What was given for the keys of drivers: each with the key in the profile, the option, and the value.
#[derive(Debug, Default)]
pub(in crate::cli) struct DriverOptions(Vec<(String, String, String)>);

impl DriverOptions {
    /// As keys of a profile.
    pub(in crate::cli) fn options(&self, options: &mut Options) {
        for (key, option, value) in &self.0 {
            options.add(key, option, Some(value));
        }
    }
}

/// `microstep_um` as `microstep-um`.
fn option(key: &Key) -> String {
    key.record_name().replace('_', "-")
}

fn argument(key: &Key, drivers: &[&str]) -> Arg {
    let default = key.default.map_or(String::new(), |default| format!(" [default: {default}]"));
    let value_name = match key.kind {
        Kind::Measure { unit, .. } => unit.suffix.to_uppercase(),
        Kind::Whole(..) => "N".to_owned(),
        Kind::Choice(names) => names().join("|"),
        _ => "VALUE".to_owned(),
    };
    Arg::new(option(key))
        .long(option(key))
        .value_name(value_name)
        .allow_negative_numbers(true)
        .help_heading("The stage")
        .help(format!("{} ({}){default}", key.meaning, drivers.join(", ")))
}

impl FromArgMatches for DriverOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut given = Self::default();
        given.update_from_arg_matches(matches)?;
        Ok(given)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        let given = driver_keys().into_iter().filter_map(|(key, _)| {
            let value = matches.get_one::<String>(&option(key))?;
            let path = format!("{}.{}", key.section, key.record_name());
            Some((path, format!("--{}", option(key)), value.clone()))
        });
        self.0 = given.collect();
        Ok(())
    }
}

impl Args for DriverOptions {
    fn augment_args(command: Command) -> Command {
        command.args(driver_keys().iter().map(|(key, drivers)| argument(key, drivers)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}
