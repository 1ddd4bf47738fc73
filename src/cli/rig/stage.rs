//! Which stage, and how to reach it.

use std::fs::File;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::key_options::{KeyGroup, KeyOption, KeyOptions};
use super::profile::RigArgument;
use crate::cli::files::taken;
use crate::cli::{CliError, Talk};
use crate::profile::{Override, Profile};
use crate::rig::RigStage;
use epirig_devices::link::{Link, LinkError, Recorder};
use epirig_devices::stage::{Driver, Stage, StageError, StageSource, driver_keys, drivers};

/// Reads the name of a driver. Help and completions list all of them.
pub(in crate::cli) fn driver(suits: impl Fn(Driver) -> bool) -> impl TypedValueParser<Value = Driver> {
    let suitable = drivers().into_iter().filter(|driver| suits(*driver));
    let values = suitable.map(|driver| PossibleValue::new(driver.name()).help(driver.summary()));
    PossibleValuesParser::new(values)
        .try_map(|name| Driver::named(&name).ok_or_else(|| format!("\"{name}\" is not among them")))
}

/// The keys of the stage, those of all drivers among them.
#[derive(Debug)]
pub(in crate::cli) struct StageKeys;

impl KeyGroup for StageKeys {
    const HEADING: &'static str = "The stage";

    fn options() -> Vec<KeyOption> {
        let common =
            KeyOption::all(&["stage.port", "stage.driver", "stage.approach_mm", "stage.tolerance_mm"]);
        let own = driver_keys().into_iter().map(|(key, drivers)| KeyOption::of_drivers(key, &drivers));
        common.into_iter().chain(own).collect()
    }
}

/// Which stage, and whether its line is recorded.
#[derive(Debug, Args)]
pub(in crate::cli) struct StageArguments {
    #[command(flatten)]
    keys: KeyOptions<StageKeys>,
    /// Record every byte in FILE (`epirig decode` reads it); one that exists is refused
    #[arg(long, value_name = "FILE", help_heading = StageKeys::HEADING)]
    transcript: Option<PathBuf>,
}

impl StageArguments {
    /// As keys of a profile.
    pub(in crate::cli) fn changes(&self) -> Vec<Override> {
        self.keys.changes()
    }

    /// Where bytes are to be recorded.
    pub(in crate::cli) fn transcript(&self) -> Option<&Path> {
        self.transcript.as_deref()
    }
}

/// The stage of a profile, connected as often as it takes. Ctrl-C stops the one that is connected.
pub(in crate::cli) struct Stages<'a> {
    pub(in crate::cli) stage: RigStage<'a>,
    talk: &'a Talk,
}

impl<'a> Stages<'a> {
    /// Connects to nothing yet.
    pub(in crate::cli) fn new(
        profile: &'a Profile,
        transcript: Option<&Path>,
        talk: &'a Talk,
    ) -> Result<Self, CliError> {
        if transcript.is_some() && !profile.stage.driver.has_line() {
            return Err(CliError::usage(
                "--transcript means nothing with --driver sim; leave it out".to_owned(),
            ));
        }
        let stage = RigStage::of(profile)?;
        let Some(path) = transcript else { return Ok(Self { stage, talk }) };
        let (file, dialect) = (create_new(path)?, profile.stage.driver.name());
        Ok(Self { stage: stage.tapped(Box::new(move |link| recorded(link, &file, dialect))), talk })
    }

    /// The same, which stops a stage that moves when it is connected.
    pub(in crate::cli) fn stopping(self) -> Self {
        Self { stage: self.stage.stopping(), ..self }
    }
}

fn recorded(link: Box<dyn Link>, file: &File, dialect: &str) -> Result<Box<dyn Link>, LinkError> {
    let file = file.try_clone().map_err(|error| LinkError::Io {
        port: link.name().to_owned(),
        action: "write its transcript",
        detail: error.to_string(),
    })?;
    Ok(Box::new(Recorder::new(link, file, dialect)?))
}

impl StageSource for Stages<'_> {
    fn connect(&mut self) -> Result<Box<dyn Stage>, StageError> {
        let stage = self.stage.connect()?;
        stage.notes().iter().for_each(|note| self.talk.say(&format!("note: {note}")));
        if let Some(switches) = self.talk.switches() {
            switches.stops(stage.stop_switch());
        }
        Ok(stage)
    }
}

fn create_new(path: &Path) -> Result<File, CliError> {
    File::create_new(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => taken(path),
        _ => CliError::file("create", path)(error),
    })
}

/// The stage of a rig.
#[derive(Debug, Args)]
pub(in crate::cli) struct WhichStage {
    #[command(flatten)]
    rig: RigArgument,
    #[command(flatten)]
    stage: StageArguments,
}

impl WhichStage {
    pub(in crate::cli) fn profile(&self) -> Result<Profile, CliError> {
        self.rig.profile(self.stage.changes())
    }

    /// Where bytes are to be recorded.
    pub(in crate::cli) fn transcript(&self) -> Option<&Path> {
        self.stage.transcript()
    }

    /// Connects to it; from then on Ctrl-C stops the stage.
    pub(in crate::cli) fn connect(&self, talk: &Talk) -> Result<Box<dyn Stage>, CliError> {
        Ok(Stages::new(&self.profile()?, self.transcript(), talk)?.connect()?)
    }
}

/// Home first, if asked to; with word of what homing found.
pub(in crate::cli) fn home(stage: &mut dyn Stage, talk: &Talk) -> Result<(), StageError> {
    talk.say("homing ...");
    stage.home()?;
    if let Some(shift_mm) = stage.home_shift_mm().filter(|shift_mm| shift_mm.abs() > 0.0) {
        talk.say(&format!(
            "note: home was {shift_mm:+.4} mm from where it had been: steps were lost or gained since it was homed before"
        ));
    }
    Ok(())
}
