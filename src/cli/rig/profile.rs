//! Where a profile comes from, and what the command line changes of it.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::CliError;
use crate::profile::{Override, Profile, ProfileError, REAL, SIM, overrides_from_environment};
use epirig_data::storage::read_text;

/// The profile that is taken if none is named, where a person works ...
const LOCAL: &str = "rig.toml";
/// ... or for all their work.
const GLOBAL: &str = "epirig/rig.toml";
/// The simulated rigs: name, what messages call it, profile.
const SIMULATED: [(&str, &str, &str); 2] =
    [("sim", "the simulated rig", SIM), ("real", "the simulated rig with the faults of real ones", REAL)];
/// Older and shorter names of what the environment sets most often.
pub(super) const SHORT_NAMES: [(&str, &str); 3] =
    [("EPIRIG_PORT", "stage.port"), ("EPIRIG_DRIVER", "stage.driver"), ("EPIRIG_CAMERA", "camera.device")];

/// Which rig.
#[derive(Debug, Args)]
#[command(next_help_heading = "The rig")]
pub(in crate::cli) struct RigArgument {
    /// Its profile: a file; sim for the simulated rig, real for one with the faults of real ones [default: rig.toml here, else
    /// ~/.config/epirig/rig.toml, else none]
    #[arg(long, value_name = "FILE|sim|real", env = "EPIRIG_RIG")]
    rig: Option<PathBuf>,
    /// Change a key of the profile, as often as needed: --set plan.step="2 mm"
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// What options of the command line say, as keys of a profile.
#[derive(Debug, Default)]
pub(in crate::cli) struct Options(Vec<Override>);

impl Options {
    /// What the option `from` says of `key`, if it was given.
    pub(in crate::cli) fn add(&mut self, key: &str, from: &str, value: Option<impl ToString>) {
        let value = value.map(|value| value.to_string());
        self.0.extend(value.map(|value| Override { key: key.to_owned(), value, from: from.to_owned() }));
    }

    /// What `--set` says.
    pub(in crate::cli) fn push(&mut self, value: Override) {
        self.0.push(value);
    }

    /// Whether nothing was given.
    pub(in crate::cli) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The profile of a text with what these change of it; `source` is its name for messages.
    pub(in crate::cli) fn profile(&self, text: &str, source: &str) -> Result<Profile, ProfileError> {
        Profile::read(text, source, &self.0)
    }
}

impl RigArgument {
    /// The profile, with what the environment, `--set` and other options change: later ones count.
    pub(in crate::cli) fn profile(&self, options: Options) -> Result<Profile, CliError> {
        let (text, source) = match self.file() {
            None => (String::new(), String::new()),
            Some(path) => named_profile(&path)?,
        };
        let mut overrides = self.environment()?;
        for text in &self.set {
            overrides.push(Override::parse(text, "--set")?);
        }
        overrides.extend(options.0);
        Ok(Profile::read(&text, &source, &overrides)?)
    }

    /// The profile that is named, or if none is, what was recorded of lens and targets; with what `--set` changes. A profile that
    /// just lies here is another rig's.
    pub(in crate::cli) fn over(&self, recorded: Option<Profile>) -> Result<Profile, CliError> {
        let set: Result<Vec<_>, _> = self.set.iter().map(|text| Override::parse(text, "--set")).collect();
        let set = set?;
        match (&self.rig, recorded) {
            (Some(path), _) => {
                let (text, source) = named_profile(path)?;
                Ok(Profile::read(&text, &source, &set)?)
            }
            (None, Some(recorded)) => Ok(recorded.lens_and_targets_over(&set)?),
            (None, None) => Ok(Profile::of(&set)?),
        }
    }

    fn file(&self) -> Option<PathBuf> {
        self.rig.clone().or_else(|| {
            let configured = std::env::var_os("XDG_CONFIG_HOME").filter(|folder| !folder.is_empty());
            let configured = configured.map(PathBuf::from);
            let home = std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".config"));
            let global = configured.or(home).map(|folder| folder.join(GLOBAL));
            std::iter::once(PathBuf::from(LOCAL)).chain(global).find(|path| path.is_file())
        })
    }

    fn environment(&self) -> Result<Vec<Override>, CliError> {
        let mut overrides = Vec::new();
        // Whoever names a simulated rig does not want the port of a real one.
        if self.rig.as_deref().is_none_or(|path| simulated(path).is_none()) {
            for (name, key) in SHORT_NAMES {
                let value = std::env::var(name).ok().filter(|value| !value.is_empty());
                overrides.extend(value.map(|value| Override {
                    key: key.to_owned(),
                    value,
                    from: name.to_owned(),
                }));
            }
        }
        overrides.extend(overrides_from_environment(std::env::vars_os())?);
        Ok(overrides)
    }
}

/// The text of a profile, and its name for messages: of a file, or of a simulated rig.
pub(in crate::cli) fn named_profile(path: &Path) -> Result<(String, String), CliError> {
    match simulated(path) {
        Some((source, text)) => Ok((text.to_owned(), source.to_owned())),
        None => Ok((read(path)?, path.display().to_string())),
    }
}

/// What messages call a simulated rig of this name, and its profile.
fn simulated(name: &Path) -> Option<(&'static str, &'static str)> {
    let known = SIMULATED.iter().find(|(known, ..)| name == Path::new(known));
    known.map(|(_, source, text)| (*source, *text))
}

fn read(path: &Path) -> Result<String, CliError> {
    /// More than a person writes of a rig.
    const LARGEST: u64 = 4 << 20;
    read_text(path, LARGEST).map_err(|error| match error.is_missing() {
        true => CliError::Usage(format!(
            "there is no rig profile {0}; `epirig init --out {0}` writes one, `--rig sim` needs no hardware",
            path.display()
        )),
        false => CliError::Usage(format!("no rig profile: {error}")),
    })
}
