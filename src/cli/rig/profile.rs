//! Source of a profile, and changes to it by options.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::CliError;
use crate::profile::{Draft, Override, Profile, ProfileError, REAL, SIM, overrides_from_environment};
use epirig_data::storage::read_text;

/// Default profile in the working directory ...
pub(in crate::cli) const LOCAL: &str = "rig.toml";
/// ... or in the user's configuration folder.
const GLOBAL: &str = "epirig/rig.toml";
/// The simulated rigs: name, name in messages, profile.
const SIMULATED: [(&str, &str, &str); 2] =
    [("sim", "the simulated rig", SIM), ("real", "the simulated rig with the faults of real ones", REAL)];
/// Short names of the most used environment variables.
pub(super) const SHORT_NAMES: [(&str, &str); 3] =
    [("EPIRIG_PORT", "stage.port"), ("EPIRIG_DRIVER", "stage.driver"), ("EPIRIG_CAMERA", "camera.device")];

/// The rig.
#[derive(Debug, Args)]
#[command(next_help_heading = "The rig")]
pub(in crate::cli) struct RigArgument {
    /// The rig's profile: a file; sim for the simulated rig, real for one with the faults of real ones
    /// [default: ./rig.toml, else ~/.config/epirig/rig.toml, else none]
    #[arg(long, value_name = "FILE|sim|real", env = "EPIRIG_RIG")]
    rig: Option<PathBuf>,
    /// Change a key of the profile; may be repeated: --set plan.step="2 mm"
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// What the option `from` says of a key, if it was given.
pub(in crate::cli) fn given(key: &str, from: &str, value: Option<impl ToString>) -> Option<Override> {
    Some(Override { key: key.to_owned(), value: value?.to_string(), from: from.to_owned() })
}

/// What the values of `--set` say.
pub(in crate::cli) fn given_by_set(texts: &[String]) -> Result<Vec<Override>, ProfileError> {
    texts.iter().map(|text| Override::parse(text, "--set")).collect()
}

impl RigArgument {
    /// The profile with the changes of the environment, `--set` and other options; later ones win.
    pub(in crate::cli) fn profile(&self, options: Vec<Override>) -> Result<Profile, CliError> {
        let (text, source, overrides) = self.parts(options)?;
        Ok(Profile::read(&text, &source, &overrides)?)
    }

    /// The same as a draft; what a person calls it; and the file that it is saved to.
    pub(in crate::cli) fn draft(&self, options: Vec<Override>) -> Result<(Draft, String, PathBuf), CliError> {
        let (text, source, overrides) = self.parts(options)?;
        let draft = Draft::read(&text, &source, &overrides)?;
        let file = self.file().filter(|path| simulated(path).is_none());
        let name = if source.is_empty() { "no profile".to_owned() } else { source };
        Ok((draft, name, file.unwrap_or_else(|| PathBuf::from(LOCAL))))
    }

    /// The text of the profile, its name, and what replaces its values.
    fn parts(&self, options: Vec<Override>) -> Result<(String, String, Vec<Override>), CliError> {
        let (text, source) = match self.file() {
            None => (String::new(), String::new()),
            Some(path) => named_profile(&path)?,
        };
        let mut overrides = self.environment()?;
        overrides.extend(given_by_set(&self.set)?);
        overrides.extend(options);
        Ok((text, source, overrides))
    }

    /// The named profile, or if none is named, the recorded one; with the changes of `--set`. The default
    /// profile is not used: it belongs to another rig.
    pub(in crate::cli) fn over(&self, recorded: Option<Profile>) -> Result<Profile, CliError> {
        let set = given_by_set(&self.set)?;
        match (&self.rig, recorded) {
            (Some(path), _) => {
                let (text, source) = named_profile(path)?;
                Ok(Profile::read(&text, &source, &set)?)
            }
            (None, Some(recorded)) => Ok(recorded.of_lens_and_targets()?.changed(&set)?),
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
        // A named simulated rig does not use the port or camera of the environment.
        if self.rig.as_deref().is_none_or(|path| simulated(path).is_none()) {
            for (name, key) in SHORT_NAMES {
                let value = std::env::var(name).ok().filter(|value| !value.is_empty());
                overrides.extend(given(key, name, value));
            }
        }
        overrides.extend(overrides_from_environment(std::env::vars_os())?);
        Ok(overrides)
    }
}

/// The text of a profile file or simulated rig, and its name for messages.
pub(in crate::cli) fn named_profile(path: &Path) -> Result<(String, String), CliError> {
    match simulated(path) {
        Some((source, text)) => Ok((text.to_owned(), source.to_owned())),
        None => Ok((read(path)?, path.display().to_string())),
    }
}

/// The names of the simulated rigs.
pub(in crate::cli) fn simulated_names() -> [&'static str; SIMULATED.len()] {
    SIMULATED.map(|(name, ..)| name)
}

/// The name in messages and the profile of a simulated rig.
fn simulated(name: &Path) -> Option<(&'static str, &'static str)> {
    let known = SIMULATED.iter().find(|(known, ..)| name == Path::new(known));
    known.map(|(_, source, text)| (*source, *text))
}

fn read(path: &Path) -> Result<String, CliError> {
    /// More than any profile needs, in bytes.
    const LARGEST: u64 = 4 << 20;
    read_text(path, LARGEST).map_err(|error| match error.is_missing() {
        true => CliError::usage(format!(
            "no rig profile {0}; `epirig init --out {0}` writes one, `--rig sim` needs no hardware",
            path.display()
        )),
        false => CliError::usage(format!("cannot read the rig profile: {error}")),
    })
}
