//! Which camera, and how it is to be set.

use std::path::Path;

use clap::{Args, ValueEnum};

use super::profile::Options;
use super::{RigArgument, simulated_simulator, simulator_config};
use crate::cli::{CliError, Talk};
use crate::profile::Profile;
use epirig_devices::camera::pixels::FourCc;
use epirig_devices::camera::{
    Camera, CameraChoice, CameraError, CameraSettings, Configuration, ReplayCamera, SimCamera, Size,
    V4l2Camera, V4l2Device, ViewSwitch, cameras, choose,
};
use epirig_devices::stage::StagePosition;

#[derive(Debug, Clone, Copy, ValueEnum)]
enum BayerName {
    /// The sum of the two green pixels of each cell
    Green,
    /// The sum of all four pixels of each cell
    Binned,
}

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
    #[arg(long, value_enum)]
    bayer: Option<BayerName>,
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
        let bayer = self.bayer.and_then(|bayer| bayer.to_possible_value());
        options.add("camera.bayer", "--bayer", bayer.map(|value| value.get_name().to_owned()));
        options.add("camera.patience_s", "--patience-s", self.patience_s.as_ref());
    }
}

/// A camera, and what a simulated one looks at.
pub(in crate::cli) struct Opened {
    pub(in crate::cli) camera: Box<dyn Camera>,
    pub(in crate::cli) view: Option<ViewSwitch>,
}

/// Opens the camera of a profile; a simulated one sees the stage where `stage` says that it is.
pub(in crate::cli) fn open_camera(profile: &Profile, stage: &StagePosition) -> Result<Opened, CliError> {
    let choice = profile.camera.device.as_deref().map_or(Ok(CameraChoice::Any), str::parse);
    let choice = choice.map_err(|reason| CliError::Usage(format!("camera.device: {reason}")))?;
    let camera: Box<dyn Camera> = match choice {
        CameraChoice::Simulated => {
            let mut camera =
                SimCamera::before_simulator(simulated_simulator(simulator_config(profile)?)?, stage.clone());
            if profile.sim.real_time {
                camera.device().in_real_time();
            }
            let view = Some(camera.device().view());
            return Ok(Opened { camera: Box::new(camera), view });
        }
        CameraChoice::Replay(folder) => Box::new(ReplayCamera::open(Path::new(&folder))?),
        choice => {
            let known = if matches!(choice, CameraChoice::Path(_)) { Ok(Vec::new()) } else { cameras() };
            let known = known.map_err(|error| match error {
                CameraError::NotBuilt { .. } => CameraError::NotBuilt { camera: choice.to_string() },
                other => other,
            })?;
            Box::new(V4l2Camera::new(V4l2Device::open(&choose(&choice, &known)?)?))
        }
    };
    Ok(Opened { camera, view: None })
}

/// What the camera of a profile is to be.
pub(in crate::cli) fn camera_settings(profile: &Profile) -> Result<CameraSettings, CliError> {
    let camera = &profile.camera;
    let four_cc = camera.format.as_deref().map(str::parse).transpose();
    Ok(CameraSettings {
        four_cc: four_cc.map_err(|reason| CliError::Usage(format!("camera.format: {reason}")))?,
        size: camera.size,
        rate_hz: camera.rate_hz,
        exposure_us: camera.exposure_us,
        controls: camera.controls.clone(),
        bayer: camera.bayer,
        patience: camera.patience,
    })
}

/// Says what a camera has been set to.
pub(in crate::cli) fn tell_configuration(configuration: &Configuration, talk: &Talk) {
    talk.say(&format!("camera set to {configuration}"));
    configuration.notes.iter().for_each(|note| talk.say(&format!("note: {note}")));
}
