//! Which stage, and how to reach it.

use std::fs::File;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use firmware_protocol::message::Settings;

use super::profile::Options;
use crate::cli::{CliError, Talk, interrupt};
use crate::profile::{AxisName, Driver, Profile};
use epirig_devices::link::{Link, LinkError, PortChoice, Recorder, choose, open, ports};
use epirig_devices::stage::grbl::{Axis, GrblOptions};
use epirig_devices::stage::native::NativeOptions;
use epirig_devices::stage::zaber::ZaberOptions;
use epirig_devices::stage::{
    Dialect, GrblStage, LoggedStage, MotionLimits, NativeStage, OneSided, SimStage, SimStageConfig, Stage,
    StageError, StagePosition, StageSource, ZaberStage, grbl, native, zaber,
};

const NM_PER_MM: f64 = 1e6;
/// Of a simulated stage that is not described.
const SIMULATED_TRAVEL_MM: f64 = 200.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum DriverName {
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
enum AxisLetter {
    X,
    Y,
    Z,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "The stage")]
pub(in crate::cli) struct StageArguments {
    /// Its port: a path, usb:SERIAL or usb:VID:PID [default: the only USB serial port] [env: EPIRIG_PORT]
    #[arg(long, value_name = "PORT")]
    port: Option<PortChoice>,
    /// The language that it speaks [default: native] [env: EPIRIG_DRIVER]
    #[arg(long, value_enum)]
    driver: Option<DriverName>,
    /// Its axis (GRBL) [default: x]
    #[arg(long, value_enum)]
    axis: Option<AxisLetter>,
    /// Length of a microstep, from its data sheet (Zaber)
    #[arg(long, value_name = "UM", allow_negative_numbers = true)]
    microstep_um: Option<String>,
    /// Number of the device in its chain (Zaber) [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    device: Option<String>,
    /// Come to every position from so far below, against backlash [default: 0]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    approach_mm: Option<String>,
    /// How far the reported position may be off, beyond half a step [default: 0]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    tolerance_mm: Option<String>,
    /// Record every byte in FILE (`epirig decode` reads it); one that exists is refused
    #[arg(long, value_name = "FILE")]
    transcript: Option<PathBuf>,
}

impl StageArguments {
    /// As keys of a profile.
    pub(in crate::cli) fn options(&self, options: &mut Options) {
        let name =
            |value: Option<clap::builder::PossibleValue>| value.map(|value| value.get_name().to_owned());
        let driver = self.driver.and_then(|driver| name(driver.to_possible_value()));
        let axis = self.axis.and_then(|axis| name(axis.to_possible_value()));
        options.add("stage.port", "--port", self.port.as_ref());
        options.add("stage.driver", "--driver", driver);
        options.add("stage.axis", "--axis", axis);
        options.add("stage.microstep_um", "--microstep-um", self.microstep_um.as_ref());
        options.add("stage.device", "--device", self.device.as_ref());
        options.add("stage.approach_mm", "--approach-mm", self.approach_mm.as_ref());
        options.add("stage.tolerance_mm", "--tolerance-mm", self.tolerance_mm.as_ref());
    }

    /// Where bytes are to be recorded.
    pub(in crate::cli) fn transcript(&self) -> Option<&Path> {
        self.transcript.as_deref()
    }
}

/// The stage of a profile, connected as often as it takes. Ctrl-C stops the one that is connected.
pub(in crate::cli) struct Stages<'a> {
    profile: &'a Profile,
    port: PortChoice,
    talk: &'a Talk,
    transcript: Option<File>,
    /// Where the carriage of a simulated stage is, whichever connection moves it.
    watch: StagePosition,
}

impl<'a> Stages<'a> {
    /// Connects to nothing yet.
    pub(in crate::cli) fn new(
        profile: &'a Profile,
        transcript: Option<&Path>,
        talk: &'a Talk,
    ) -> Result<Self, CliError> {
        if transcript.is_some() && profile.stage.driver == Driver::Sim {
            return Err(CliError::Usage(
                "--transcript means nothing with --driver sim; leave it out".to_owned(),
            ));
        }
        let port = profile.stage.port.as_deref().map_or(Ok(PortChoice::Any), str::parse);
        let port = port.map_err(|reason| CliError::Usage(format!("stage.port: {reason}")))?;
        let transcript = transcript.map(create_new).transpose()?;
        Ok(Self { profile, port, talk, transcript, watch: StagePosition::default() })
    }

    /// A view on where the carriage truly is, of a simulated stage.
    pub(in crate::cli) fn watch(&self) -> StagePosition {
        self.watch.clone()
    }

    /// The path of the port.
    pub(in crate::cli) fn port(&self) -> Result<String, LinkError> {
        let known = if matches!(self.port, PortChoice::Path(_)) { Vec::new() } else { ports()? };
        choose(&self.port, &known)
    }

    fn native(&self) -> Result<Box<dyn Stage>, StageError> {
        let stage = &self.profile.stage;
        let given = stage.velocity_mm_s.is_some() || stage.acceleration_mm_s2.is_some();
        let default = Settings::default();
        // Saturating: the stage itself refuses what is beyond its means.
        let settings = Settings {
            velocity_nm_s: stage.velocity_mm_s.map_or(default.velocity_nm_s, |v| (v * NM_PER_MM) as u32),
            acceleration_nm_s2: stage
                .acceleration_mm_s2
                .map_or(default.acceleration_nm_s2, |a| (a * NM_PER_MM) as u32),
            ..default
        };
        let settings = given.then_some(settings);
        let options = NativeOptions { settings, limits: self.limits() };
        Ok(Box::new(NativeStage::connect(self.link(native::BAUD, Dialect::Native)?, options)?))
    }

    fn grbl(&self) -> Result<Box<dyn Stage>, StageError> {
        let axis = match self.profile.stage.axis {
            None | Some(AxisName::X) => Axis::X,
            Some(AxisName::Y) => Axis::Y,
            Some(AxisName::Z) => Axis::Z,
        };
        let link = self.link(grbl::BAUD, Dialect::Grbl)?;
        let stage = GrblStage::connect(link, GrblOptions { axis, limits: self.limits() })?;
        stage.notes().iter().for_each(|note| self.talk.say(&format!("note: {note}")));
        Ok(Box::new(stage))
    }

    fn zaber(&self, microstep_um: f64) -> Result<Box<dyn Stage>, StageError> {
        let device = self.profile.stage.device.unwrap_or(1);
        let options = ZaberOptions { device, axis: 1, microstep_um, limits: self.limits() };
        Ok(Box::new(ZaberStage::connect(self.link(zaber::BAUD, Dialect::Zaber)?, options)?))
    }

    fn limits(&self) -> MotionLimits {
        MotionLimits { tolerance_mm: self.profile.stage.tolerance_mm }
    }

    fn link(&self, baud: u32, dialect: Dialect) -> Result<Box<dyn Link>, LinkError> {
        let link = open(&self.port()?, baud)?;
        let Some(file) = &self.transcript else { return Ok(link) };
        let file = file.try_clone().map_err(|error| LinkError::Io {
            port: link.name().to_owned(),
            action: "write its transcript",
            detail: error.to_string(),
        })?;
        Ok(Box::new(Recorder::new(link, file, dialect.name())?))
    }
}

impl StageSource for Stages<'_> {
    fn connect(&mut self) -> Result<Box<dyn Stage>, StageError> {
        let profile = &self.profile.stage;
        let stage = match profile.driver {
            Driver::Sim => {
                let stage = SimStage::seen_through(sim_config(self.profile), self.watch.clone());
                Box::new(stage) as Box<dyn Stage>
            }
            Driver::Native => self.native()?,
            Driver::Grbl => self.grbl()?,
            // A profile of a Zaber stage has a microstep.
            Driver::Zaber => self.zaber(profile.microstep_um.unwrap_or_default())?,
        };
        interrupt::stops(stage.stop_switch());
        Ok(Box::new(LoggedStage::new(OneSided::new(stage, profile.approach_mm))))
    }
}

/// The stage of a simulated rig.
pub(in crate::cli) fn sim_config(profile: &Profile) -> SimStageConfig {
    let stage = &profile.stage;
    let ideal = SimStageConfig::ideal(stage.travel_mm.unwrap_or(SIMULATED_TRAVEL_MM));
    SimStageConfig {
        velocity_mm_s: stage.velocity_mm_s.unwrap_or(ideal.velocity_mm_s),
        acceleration_mm_s2: stage.acceleration_mm_s2.unwrap_or(ideal.acceleration_mm_s2),
        backlash_um: stage.backlash_um,
        position_noise_um: stage.position_noise_um,
        seed: profile.sim.seed,
        ..ideal
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
