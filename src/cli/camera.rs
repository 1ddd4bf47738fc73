//! `epirig camera get` and `epirig camera set`.

use clap::{Args, Subcommand};

use super::rig::{CameraArgument, RigArgument};
use super::{CliError, Talk};
use epirig_devices::camera::{Control, find_control};

/// Read and set the controls of a camera: exposure, gain and others
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig camera get                         all controls, with their values
  epirig camera get gain
  epirig camera set gain 10
  epirig camera set auto_exposure \"Manual Mode\"
  epirig camera get --camera sim            no hardware needed

A camera keeps its settings until it is unplugged. A simulated camera does not keep them.")]
pub(super) struct CameraVerb {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Show one control, or all
    #[command(
        after_help = "Examples:\n  epirig camera get\n  epirig camera get gain --camera /dev/video0 --json"
    )]
    Get {
        /// Name of the control [default: all]
        control: Option<String>,
        #[command(flatten)]
        rig: RigArgument,
        #[command(flatten)]
        camera: CameraArgument,
    },
    /// Set a control, and show its new value
    #[command(
        after_help = "Examples:\n  epirig camera set gain 10\n  epirig camera set auto_exposure \"Manual Mode\""
    )]
    Set {
        /// Name of the control
        control: String,
        /// A number, a menu item by name, on or off
        #[arg(allow_negative_numbers = true)]
        value: String,
        #[command(flatten)]
        rig: RigArgument,
        #[command(flatten)]
        camera: CameraArgument,
    },
}

impl CameraVerb {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        match self.what {
            What::Get { control: None, rig, camera } => {
                let mut camera = camera.open(&rig)?;
                let controls = camera.controls()?;
                if controls.is_empty() {
                    talk.say(&format!("{} has no controls", camera.identity()));
                }
                talk.result(&controls, || controls.iter().map(|control| format!("{control}\n")).collect())
            }
            What::Get { control: Some(name), rig, camera } => {
                let mut camera = camera.open(&rig)?;
                let controls = camera.controls()?;
                show(find_control(&camera.identity().name(), &controls, &name)?, talk)
            }
            What::Set { control, value, rig, camera } => {
                show(&camera.open(&rig)?.set_control(&control, &value)?, talk)
            }
        }
    }
}

fn show(control: &Control, talk: &Talk) -> Result<(), CliError> {
    talk.result(control, || format!("{control}\n"))
}
