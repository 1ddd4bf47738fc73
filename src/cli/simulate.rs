//! `epirig simulate`.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use clap::Args;

use super::rig::driver;
use super::{CliError, Talk, interrupt};
use crate::profile::StageProfile;
use crate::rig;
use epirig_data::sequence::time;
use epirig_devices::camera::Size;
use epirig_devices::link::{LineNoise, SimulatedDevice, serve};
use epirig_devices::stage::native::Native;
use epirig_devices::stage::simulator::{FaultScript, NativeDevice};
use epirig_devices::stage::{Driver, StageDriver as _, StopSwitch};
use epirig_devices::virtual_rig::World;
use epirig_simulator::SimulatorConfig;

/// Simulate a stage on a pseudo-terminal, to try the commands
#[derive(Debug, Args)]
#[command(after_help = help())]
pub(super) struct Simulate {
    /// The protocol of the simulated stage
    #[arg(value_parser = driver(|driver| driver.has_line()))]
    driver: Driver,
    /// Path of the symbolic link to create, which other programs open as the stage's port; or an existing
    /// serial port
    #[arg(long, value_name = "LINK")]
    port: PathBuf,
    /// Video output that shows a textured plane, moved by the stage
    #[arg(long, value_name = "DEVICE")]
    video_output: Option<String>,
    /// Columns and rows of the video output
    #[arg(long, value_name = "WxH", default_value = "640x480")]
    size: Size,
    /// Faults of the simulated stage
    #[arg(long, value_name = "FAULTS", default_value = "")]
    fault: FaultScript,
    /// Probability of each byte to be lost, to be doubled and to be flipped, each
    #[arg(long, value_name = "RATE", default_value = "0")]
    noise: f64,
    /// Seed of the noise
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
}

fn help() -> String {
    let fault = |(form, what): (String, &str)| format!("  {form}\n      {what}\n");
    let faults: String = FaultScript::forms().into_iter().map(fault).collect();
    format!(
        "Examples:
  epirig simulate native --port /tmp/stage &
  epirig stage home --port /tmp/stage
  epirig stage move 12.5 --port /tmp/stage
  epirig simulate grbl --port /tmp/stage --fault reset@3+0.2s     restarts in its third move
  epirig simulate native --port /tmp/stage --noise 0.01           a noisy line

Faults, several separated by commas; MOVE counts from 1, TIME is in seconds, LENGTH in mm:
{faults}
With --video-output the view of the camera is simulated too, for a camera driver that is looped back
to that output, such as the kernel's vivid or v4l2loopback (native stage only):
  epirig simulate native --port /tmp/stage --video-output /dev/video1 --size 640x480

It runs until Ctrl-C."
    )
}

impl Simulate {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        if !(0.0..=1.0).contains(&self.noise) {
            return Err(CliError::usage("--noise is a probability, 0 to 1".to_owned()));
        }
        if self.port == Path::new(StageProfile::SIMULATED_PORT) {
            return Err(CliError::usage(
                "sim is the port of a device that is simulated in memory; choose another name for --port"
                    .to_owned(),
            ));
        }
        if self.video_output.is_some() && self.driver.name() != Native.name() {
            return Err(CliError::usage("--video-output needs a native stage".to_owned()));
        }
        // A board counts its starts; each run is another one.
        let boot = time().as_second() as u32;
        let mut world = None;
        let device: Arc<Mutex<dyn SimulatedDevice>> = if let Some(output) = &self.video_output {
            let mut stage = NativeDevice::new(self.fault).at_boot(boot);
            // The number of frames has no meaning here.
            let scene = SimulatorConfig::textured_plane(self.size.columns, self.size.rows, 2);
            world = Some(World::show(rig::simulator(scene)?, &mut stage, output)?);
            Arc::new(Mutex::new(stage))
        } else {
            let simulated = self.driver.simulated(self.fault, boot);
            simulated.ok_or_else(|| CliError::usage(format!("{} has no serial line", self.driver)))?.device
        };
        let stop = StopSwitch::default();
        interrupt::SWITCHES.stops(stop.clone());
        let server = serve(device, &LineNoise::bad(self.seed, self.noise), &self.port)?;
        talk.say(&format!("a simulated stage is connected to {}; Ctrl-C ends it", self.port.display()));
        while stop.pressed().is_none() && server.alive() {
            std::thread::sleep(Duration::from_millis(20));
        }
        drop(world);
        Ok(())
    }
}
