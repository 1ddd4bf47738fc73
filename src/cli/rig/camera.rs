//! Which camera, and how it is to be set.

use clap::Args;

use super::RigArgument;
use super::key_options::{KeyGroup, KeyOption, KeyOptions};
use super::profile::Options;
use crate::cli::{CliError, Talk};
use crate::rig::open_camera;
use epirig_core::settings::quantity::{HZ, S, US};
use epirig_devices::camera::{Camera, Configuration};
use epirig_devices::stage::StagePosition;

/// Which camera.
#[derive(Debug)]
pub(in crate::cli) struct WhichCamera;

impl KeyGroup for WhichCamera {
    const HEADING: &'static str = "The camera";

    fn options() -> Vec<KeyOption> {
        KeyOption::plain("camera.device").into_iter().map(|option| option.named("camera")).collect()
    }
}

/// The camera alone.
pub(in crate::cli) type CameraArgument = KeyOptions<WhichCamera>;

/// The keys of the camera.
#[derive(Debug)]
pub(in crate::cli) struct CameraKeys;

impl KeyGroup for CameraKeys {
    const HEADING: &'static str = WhichCamera::HEADING;

    fn options() -> Vec<KeyOption> {
        let more = [
            KeyOption::plain("camera.format"),
            KeyOption::plain("camera.size"),
            KeyOption::quantity("camera.rate", HZ),
            KeyOption::quantity("camera.exposure", US),
            KeyOption::plain("camera.bayer"),
            KeyOption::quantity("camera.patience", S),
        ];
        WhichCamera::options().into_iter().chain(more.into_iter().flatten()).collect()
    }
}

/// The camera and what it is to be.
#[derive(Debug, Args)]
pub(in crate::cli) struct CameraArguments {
    #[command(flatten)]
    keys: KeyOptions<CameraKeys>,
    /// A control and its value, as often as needed: --control gain=10
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment, help_heading = CameraKeys::HEADING)]
    control: Vec<(String, String)>,
}

fn assignment(text: &str) -> Result<(String, String), String> {
    let parts = text.split_once('=').filter(|(name, value)| !name.is_empty() && !value.is_empty());
    let (name, value) = parts.ok_or("give NAME=VALUE, such as gain=10")?;
    Ok((name.to_owned(), value.to_owned()))
}

impl CameraArgument {
    /// Opens the camera; a simulated one looks at a stage that has not moved.
    pub(in crate::cli) fn open(&self, rig: &RigArgument) -> Result<Box<dyn Camera>, CliError> {
        let mut options = Options::default();
        self.options(&mut options);
        Ok(open_camera(&rig.profile(options)?, &StagePosition::default())?.camera)
    }
}

impl CameraArguments {
    /// As keys of a profile.
    pub(in crate::cli) fn options(&self, options: &mut Options) {
        self.keys.options(options);
        for (name, value) in &self.control {
            options.add(&format!("camera.controls.{name}"), "--control", Some(value));
        }
    }
}

/// Says what a camera has been set to.
pub(in crate::cli) fn tell_configuration(configuration: &Configuration, talk: &Talk) {
    talk.say(&format!("camera set to {configuration}"));
    configuration.notes.iter().for_each(|note| talk.say(&format!("note: {note}")));
}
