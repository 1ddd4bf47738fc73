//! Which camera, and how it is to be set.

use clap::Args;

use super::RigArgument;
use super::profile::Options;
use crate::cli::choice::choice;
use crate::cli::{CliError, Talk};
use crate::rig::open_camera;
use epirig_devices::camera::pixels::{BayerUse, FourCc};
use epirig_devices::camera::{Camera, Configuration, Size};
use epirig_devices::stage::StagePosition;

/// The camera alone.
#[derive(Debug, Args)]
#[command(next_help_heading = "The camera")]
pub(in crate::cli) struct CameraArgument {
    /// Which one: a path, a name in /dev/v4l/by-id, usb:SERIAL, replay:SEQ, or sim [default: the only camera] [env: EPIRIG_CAMERA]
    #[arg(long, value_name = "CAMERA")]
    camera: Option<String>,
}

/// The camera and what it is to be.
#[derive(Debug, Args)]
#[command(next_help_heading = "The camera")]
pub(in crate::cli) struct CameraArguments {
    #[command(flatten)]
    which: CameraArgument,
    /// Pixel format, such as GREY, Y12 or YUYV [default: the deepest uncompressed grey]
    #[arg(long, value_name = "FOURCC")]
    format: Option<FourCc>,
    /// Columns and rows [default: the largest]
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Frames per second
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: Option<String>,
    /// Exposure time
    #[arg(long, value_name = "US", allow_negative_numbers = true)]
    exposure_us: Option<String>,
    /// A control and its value, as often as needed: --control gain=10
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    control: Vec<(String, String)>,
    /// What to make of a colour mosaic: frames of half the width and height
    #[arg(long, value_parser = choice::<BayerUse>())]
    bayer: Option<BayerUse>,
    /// How long to wait for a good frame, and for a steady picture [default: 10]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    patience_s: Option<String>,
}

fn assignment(text: &str) -> Result<(String, String), String> {
    let parts = text.split_once('=').filter(|(name, value)| !name.is_empty() && !value.is_empty());
    let (name, value) = parts.ok_or("give NAME=VALUE, such as gain=10")?;
    Ok((name.to_owned(), value.to_owned()))
}

impl CameraArgument {
    /// As keys of a profile.
    pub(in crate::cli) fn options(&self, options: &mut Options) {
        options.add("camera.device", "--camera", self.camera.as_ref());
    }

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
        self.which.options(options);
        options.add("camera.format", "--format", self.format.as_ref());
        options.add("camera.size", "--size", self.size.as_ref());
        options.add("camera.rate_hz", "--rate-hz", self.rate_hz.as_ref());
        options.add("camera.exposure_us", "--exposure-us", self.exposure_us.as_ref());
        for (name, value) in &self.control {
            options.add(&format!("camera.controls.{name}"), "--control", Some(value));
        }
        options.add("camera.bayer", "--bayer", self.bayer);
        options.add("camera.patience_s", "--patience-s", self.patience_s.as_ref());
    }
}

/// Says what a camera has been set to.
pub(in crate::cli) fn tell_configuration(configuration: &Configuration, talk: &Talk) {
    talk.say(&format!("camera set to {configuration}"));
    configuration.notes.iter().for_each(|note| talk.say(&format!("note: {note}")));
}
