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
    StagePosition, ZaberStage, grbl, native, zaber,
};

const SIMULATED_TRAVEL_MM: f64 = 200.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Driver {
    /// epirig's own firmware
    Native,
    /// GRBL 1.1
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
    /// Its axis (GRBL) [default: x]
    #[arg(long, value_enum)]
    axis: Option<AxisName>,
    /// Length of a microstep, from its data sheet (Zaber)
    #[arg(long, value_name = "UM")]
    microstep_um: Option<f64>,
    /// Number of the device in its chain (Zaber) [default: 1]
    #[arg(long, value_name = "N")]
    device: Option<u8>,
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
        Ok(self.connect_and_watch(talk)?.0)
    }

    /// The same, with a view on where the carriage truly is, which a stage in memory offers.
    pub(super) fn connect_and_watch(
        &self,
        talk: &Talk,
    ) -> Result<(Box<dyn Stage>, Option<StagePosition>), CliError> {
        let lengths = [self.tolerance_mm, self.approach_mm];
        if !lengths.iter().all(|length| length.is_finite() && *length >= 0.0) {
            return Err(CliError::Usage(
                "--tolerance-mm and --approach-mm are lengths, 0 or more".to_owned(),
            ));
        }
        self.refuse_what_the_driver_ignores()?;
        let (stage, watch) = match self.driver {
            Driver::Sim => {
                let stage = SimStage::new(SimStageConfig::ideal(SIMULATED_TRAVEL_MM));
                let watch = stage.watch();
                (Box::new(stage) as Box<dyn Stage>, Some(watch))
            }
            Driver::Native => (self.native()?, None),
            Driver::Grbl => (self.grbl(talk)?, None),
            Driver::Zaber => (self.zaber()?, None),
        };
        interrupt::stops(stage.stop_switch());
        Ok((Box::new(OneSided::new(stage, self.approach_mm)), watch))
    }

    /// An option that does nothing would be believed to do something.
    fn refuse_what_the_driver_ignores(&self) -> Result<(), CliError> {
        let given = [
            (self.transcript.is_some() && self.driver == Driver::Sim, "--transcript"),
            (self.tolerance_mm > 0.0 && self.driver == Driver::Sim, "--tolerance-mm"),
            (self.axis.is_some() && self.driver != Driver::Grbl, "--axis"),
            (self.microstep_um.is_some() && self.driver != Driver::Zaber, "--microstep-um"),
            (self.device.is_some() && self.driver != Driver::Zaber, "--device"),
        ];
        let name =
            self.driver.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned());
        given.iter().find(|(ignored, _)| *ignored).map_or(Ok(()), |(_, option)| {
            Err(CliError::Usage(format!("{option} means nothing with --driver {name}; leave it out")))
        })
    }

    fn limits(&self) -> MotionLimits {
        MotionLimits { tolerance_mm: self.tolerance_mm }
    }

    fn native(&self) -> Result<Box<dyn Stage>, CliError> {
        let link = self.link(native::BAUD, Dialect::Native)?;
        let options = NativeOptions { limits: self.limits(), ..NativeOptions::default() };
        Ok(Box::new(NativeStage::connect(link, options)?))
    }

    fn grbl(&self, talk: &Talk) -> Result<Box<dyn Stage>, CliError> {
        let link = self.link(grbl::BAUD, Dialect::Grbl)?;
        let axis = match self.axis {
            None | Some(AxisName::X) => Axis::X,
            Some(AxisName::Y) => Axis::Y,
            Some(AxisName::Z) => Axis::Z,
        };
        let stage = GrblStage::connect(link, GrblOptions { axis, limits: self.limits() })?;
        stage.notes().iter().for_each(|note| talk.say(&format!("note: {note}")));
        Ok(Box::new(stage))
    }

    fn zaber(&self) -> Result<Box<dyn Stage>, CliError> {
        let microstep_um = self.microstep_um.filter(|length| length.is_finite() && *length > 0.0);
        let microstep_um = microstep_um.ok_or_else(|| {
            CliError::Usage("a Zaber stage needs --microstep-um, from its data sheet".to_owned())
        })?;
        let link = self.link(zaber::BAUD, Dialect::Zaber)?;
        let device = self.device.unwrap_or(1);
        let options = ZaberOptions { device, axis: 1, microstep_um, limits: self.limits() };
        Ok(Box::new(ZaberStage::connect(link, options)?))
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
