//! Which camera, and how it is to be set.

use clap::Args;

use super::RigArgument;
use super::key_options::{KeyGroup, KeyOption, KeyOptions};
use super::profile::given;
use crate::cli::{CliError, Talk};
use crate::profile::Override;
use crate::rig::open_camera;
use epirig_devices::camera::{Camera, Configuration};
use epirig_devices::stage::StagePosition;

/// Which camera.
#[derive(Debug)]
pub(in crate::cli) struct WhichCamera;

impl KeyGroup for WhichCamera {
    const HEADING: &'static str = "The camera";

    fn options() -> Vec<KeyOption> {
        KeyOption::all(&["camera.device"]).into_iter().map(|option| option.named("camera")).collect()
    }
}

pub(in crate::cli) type CameraArgument = KeyOptions<WhichCamera>;

/// The keys of the camera.
#[derive(Debug)]
pub(in crate::cli) struct CameraKeys;

impl KeyGroup for CameraKeys {
    const HEADING: &'static str = WhichCamera::HEADING;

    fn options() -> Vec<KeyOption> {
        let more = KeyOption::all(&[
            "camera.format",
            "camera.size",
            "camera.rate_hz",
            "camera.exposure_us",
            "camera.bayer",
            "camera.patience_s",
        ]);
        WhichCamera::options().into_iter().chain(more).collect()
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
        Ok(open_camera(&rig.profile(self.changes())?, &StagePosition::default())?.camera)
    }
}

impl CameraArguments {
    /// As keys of a profile.
    pub(in crate::cli) fn changes(&self) -> Vec<Override> {
        let control = |(name, value): &(String, String)| {
            given(&format!("camera.controls.{name}"), "--control", Some(value))
        };
        self.keys.changes().into_iter().chain(self.control.iter().flat_map(control)).collect()
    }
}

/// Says what a camera has been set to.
pub(in crate::cli) fn tell_configuration(configuration: &Configuration, talk: &Talk) {
    talk.say(&format!("camera set to {configuration}"));
    configuration.notes.iter().for_each(|note| talk.say(&format!("note: {note}")));
}
