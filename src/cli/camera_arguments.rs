//! Which camera, and how it is to be set.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use clap::{Args, ValueEnum};

use super::import::parse_positive;
use super::{CliError, Talk};
use crate::camera::pixels::{BayerUse, FourCc};
use crate::camera::{
    Camera, CameraChoice, CameraError, CameraSettings, Configuration, ReplayCamera, SimCamera, Size,
    V4l2Camera, V4l2Device, cameras, choose,
};
use crate::stage::StagePosition;
use crate::twin::{Twin, TwinConfig};

/// Size of the simulated camera's frames, unless another is asked for.
const SIMULATED: Size = Size { columns: 640, rows: 480 };

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
pub(super) struct CameraArgument {
    /// Which one: a path, a name in /dev/v4l/by-id, usb:SERIAL, replay:SEQ, or sim [default: the only camera]
    #[arg(long, value_name = "CAMERA", env = "EPIRIG_CAMERA")]
    camera: Option<CameraChoice>,
}

/// The camera and what it is to be.
#[derive(Debug, Args)]
#[command(next_help_heading = "The camera")]
pub(super) struct CameraArguments {
    #[command(flatten)]
    which: CameraArgument,
    /// Pixel format, such as GREY, Y12 or YUYV [default: the deepest uncompressed grey]
    #[arg(long, value_name = "FOURCC")]
    format: Option<FourCc>,
    /// Columns and rows [default: the largest]
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Frames per second
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = parse_positive)]
    rate_hz: Option<f64>,
    /// Exposure time
    #[arg(long, value_name = "US", allow_negative_numbers = true, value_parser = parse_positive)]
    exposure_us: Option<f64>,
    /// A control and its value, as often as needed: --control gain=10
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    control: Vec<(String, String)>,
    /// What to make of a colour mosaic: frames of half the width and height
    #[arg(long, value_enum)]
    bayer: Option<BayerName>,
    /// How long to wait for a good frame, and for a steady picture
    #[arg(long, value_name = "S", default_value = "10", allow_negative_numbers = true, value_parser = parse_positive)]
    patience_s: f64,
}

fn assignment(text: &str) -> Result<(String, String), String> {
    let parts = text.split_once('=').filter(|(name, value)| !name.is_empty() && !value.is_empty());
    let (name, value) = parts.ok_or("give NAME=VALUE, such as gain=10")?;
    Ok((name.to_owned(), value.to_owned()))
}

/// What the simulated camera looks at: a textured plane, seen in frames of `size`.
pub(super) fn simulated_twin(size: Size) -> Result<Arc<Twin>, CliError> {
    /// Not used: nobody asks this twin for a whole scan.
    const FRAMES: usize = 2;
    /// More than any sensor has, and less than would not fit into memory.
    const LARGEST: usize = 100_000_000;
    if size.columns.saturating_mul(size.rows) > LARGEST {
        return Err(CliError::Usage(format!(
            "a simulated camera of {size} is too large; take 10000x10000 or less"
        )));
    }
    Ok(Arc::new(Twin::new(TwinConfig::textured_plane(size.columns, size.rows, FRAMES))?))
}

impl CameraArgument {
    /// Opens the camera.
    pub(super) fn open(&self) -> Result<Box<dyn Camera>, CliError> {
        self.open_before(&StagePosition::default(), SIMULATED)
    }

    fn open_before(&self, stage: &StagePosition, size: Size) -> Result<Box<dyn Camera>, CliError> {
        Ok(match self.camera.as_ref().unwrap_or(&CameraChoice::Any) {
            CameraChoice::Simulated => Box::new(SimCamera::before_twin(simulated_twin(size)?, stage.clone())),
            CameraChoice::Replay(folder) => Box::new(ReplayCamera::open(Path::new(folder))?),
            choice => {
                let known = if matches!(choice, CameraChoice::Path(_)) { Ok(Vec::new()) } else { cameras() };
                let known = known.map_err(|error| match error {
                    CameraError::NotBuilt { .. } => CameraError::NotBuilt { camera: choice.to_string() },
                    other => other,
                })?;
                Box::new(V4l2Camera::new(V4l2Device::open(&choose(choice, &known)?)?))
            }
        })
    }
}

impl CameraArguments {
    /// Opens the camera; a simulated one sees the stage where `stage` says that it is.
    pub(super) fn open(&self, stage: &StagePosition) -> Result<Box<dyn Camera>, CliError> {
        self.which.open_before(stage, self.size.unwrap_or(SIMULATED))
    }

    /// Whether the camera exists in memory only.
    pub(super) fn is_simulated(&self) -> bool {
        self.which.camera == Some(CameraChoice::Simulated)
    }

    /// What it is to be.
    pub(super) fn settings(&self) -> Result<CameraSettings, CliError> {
        let patience = Duration::try_from_secs_f64(self.patience_s);
        Ok(CameraSettings {
            four_cc: self.format,
            size: self.size,
            rate_hz: self.rate_hz,
            exposure_us: self.exposure_us,
            controls: self.control.clone(),
            bayer: self.bayer.map(|bayer| match bayer {
                BayerName::Green => BayerUse::Green,
                BayerName::Binned => BayerUse::Binned,
            }),
            patience: patience
                .map_err(|error| CliError::Usage(format!("--patience-s {}: {error}", self.patience_s)))?,
        })
    }
}

/// Says what a camera has been set to.
pub(super) fn tell_configuration(configuration: &Configuration, talk: &Talk) {
    talk.say(&format!("camera set to {configuration}"));
    configuration.notes.iter().for_each(|note| talk.say(&format!("note: {note}")));
}
