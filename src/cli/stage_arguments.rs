//! Which stage, and how to reach it.

use std::fs::File;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::{CliError, Talk, interrupt};
use crate::link::{Link, PortChoice, Recorder, choose, open, ports};
use crate::stage::grbl::{Axis, GrblOptions};
use crate::stage::native::NativeOptions;
use crate::stage::zaber::ZaberOptions;
use crate::stage::{
    Dialect, GrblStage, MotionLimits, NativeStage, OneSided, SimStage, SimStageConfig, Stage, StageError,
    ZaberStage, grbl, native, zaber,
};

const SIMULATED_TRAVEL_MM: f64 = 200.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Driver {
    /// epirig's own firmware
    Native,
    /// GRBL 1.1 and what is compatible with it
    Grbl,
    /// Zaber ASCII
    Zaber,
    /// No hardware: a stage in memory, new with each command
    Sim,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum AxisName {
    X,
    Y,
    Z,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "The stage")]
pub(super) struct StageArguments {
    /// Its port: a path, usb:SERIAL or usb:VID:PID [default: the only USB serial port]
    #[arg(long, value_name = "PORT", env = "EPIRIG_PORT")]
    port: Option<PortChoice>,
    /// The language that it speaks
    #[arg(long, value_enum, env = "EPIRIG_DRIVER", default_value = "native")]
    driver: Driver,
    /// Its axis (GRBL)
    #[arg(long, value_enum, default_value = "x")]
    axis: AxisName,
    /// Length of a microstep, from its data sheet (Zaber)
    #[arg(long, value_name = "UM")]
    microstep_um: Option<f64>,
    /// Number of the device in its chain (Zaber)
    #[arg(long, value_name = "N", default_value = "1")]
    device: u8,
    /// Come to every position from so far below, against backlash
    #[arg(long, value_name = "MM", default_value = "0")]
    approach_mm: f64,
    /// How far the reported position may be off, beyond half a step
    #[arg(long, value_name = "MM", default_value = "0")]
    tolerance_mm: f64,
    /// Record every byte in FILE (`epirig decode` reads it); one that exists is refused
    #[arg(long, value_name = "FILE")]
    transcript: Option<PathBuf>,
}

impl StageArguments {
    /// The path of the port.
    pub(super) fn port(&self) -> Result<String, CliError> {
        let choice = self.port.as_ref().unwrap_or(&PortChoice::Any);
        let known = if matches!(choice, PortChoice::Path(_)) { Vec::new() } else { ports()? };
        Ok(choose(choice, &known)?)
    }

    /// Connects to the stage; from then on Ctrl-C stops it.
    pub(super) fn connect(&self, talk: &Talk) -> Result<Box<dyn Stage>, CliError> {
        if !(self.tolerance_mm >= 0.0 && self.approach_mm >= 0.0) {
            return Err(CliError::Usage("--tolerance-mm and --approach-mm must not be negative".to_owned()));
        }
        let stage = self.connect_directly(talk)?;
        interrupt::stops(stage.stop_switch());
        Ok(Box::new(OneSided::new(stage, self.approach_mm)))
    }

    fn connect_directly(&self, talk: &Talk) -> Result<Box<dyn Stage>, CliError> {
        let limits = MotionLimits { tolerance_mm: self.tolerance_mm };
        Ok(match self.driver {
            Driver::Sim => Box::new(SimStage::new(SimStageConfig::ideal(SIMULATED_TRAVEL_MM))),
            Driver::Native => {
                let link = self.link(native::BAUD, Dialect::Native)?;
                let options = NativeOptions { limits, ..NativeOptions::default() };
                Box::new(NativeStage::connect(link, options)?)
            }
            Driver::Grbl => {
                let link = self.link(grbl::BAUD, Dialect::Grbl)?;
                let axis = match self.axis {
                    AxisName::X => Axis::X,
                    AxisName::Y => Axis::Y,
                    AxisName::Z => Axis::Z,
                };
                let stage = GrblStage::connect(link, GrblOptions { axis, limits })?;
                stage.notes().iter().for_each(|note| talk.say(&format!("note: {note}")));
                Box::new(stage)
            }
            Driver::Zaber => {
                let microstep_um = self.microstep_um.ok_or_else(|| {
                    CliError::Usage("a Zaber stage needs --microstep-um, from its data sheet".to_owned())
                })?;
                let link = self.link(zaber::BAUD, Dialect::Zaber)?;
                let options = ZaberOptions { device: self.device, axis: 1, microstep_um, limits };
                Box::new(ZaberStage::connect(link, options)?)
            }
        })
    }

    fn link(&self, baud: u32, dialect: Dialect) -> Result<Box<dyn Link>, CliError> {
        let link = open(&self.port()?, baud)?;
        let Some(path) = &self.transcript else { return Ok(link) };
        let file = create_new(path)?;
        Ok(Box::new(Recorder::new(link, file, dialect.name())?))
    }
}

fn create_new(path: &Path) -> Result<File, CliError> {
    File::create_new(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => {
            CliError::Usage(format!("{} exists already; give another name", path.display()))
        }
        _ => CliError::File { path: path.to_owned(), action: "create", source: error },
    })
}

/// Home first, if asked to; with word of what homing found.
pub(super) fn home(stage: &mut dyn Stage, talk: &Talk) -> Result<(), StageError> {
    talk.say("homing ...");
    stage.home()?;
    if let Some(shift_mm) = stage.home_shift_mm().filter(|shift_mm| shift_mm.abs() > 0.0) {
        talk.say(&format!(
            "note: home was {shift_mm:+.4} mm from where it had been: steps were lost or gained since it was homed before"
        ));
    }
    Ok(())
}
