//! `epirig stage home`, `move`, `position`, `stop`, `drivers` and `console`.

use clap::{Args, Subcommand};
use serde::Serialize;

use super::console::Console;
use super::numbers::mm;
use super::rig::{Stages, WhichStage, driver, home};
use super::{CliError, Talk};
use epirig_devices::link::{LinkError, ask_holder_to_stop};
use epirig_devices::stage::{Driver, Stage, StageError, StageSource, drivers};

/// Control the stage: home, move, position, stop, drivers, console
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig stage home
  epirig stage move 12.5
  epirig stage position --json
  epirig stage stop
  epirig stage drivers grbl
  epirig stage console --driver grbl '$$'")]
pub(super) struct StageVerb {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Home the stage
    #[command(after_help = "Examples:
  epirig stage home                                     epirig's own firmware on the only USB port
  epirig stage home --driver grbl --port /dev/ttyUSB0
  epirig stage home --driver sim                        no hardware needed

Ctrl-C stops the stage; a second Ctrl-C stops it at once.")]
    Home(WhichStage),
    Move(Move),
    /// Print the position of the stage
    #[command(after_help = "Example:\n  epirig stage position --json")]
    Position(WhichStage),
    /// Stop the stage
    #[command(after_help = "Example:\n  epirig stage stop --port /dev/ttyACM0

If another epirig uses the port, it is asked to stop the stage.")]
    Stop(WhichStage),
    Drivers(Drivers),
    Console(Console),
}

impl StageVerb {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        match self.what {
            What::Home(which) => {
                let mut stage = which.connect(talk)?;
                home(&mut *stage, talk)?;
                tell(&mut *stage, talk)
            }
            What::Move(verb) => verb.run(talk),
            What::Position(which) => tell(&mut *which.connect(talk)?, talk),
            What::Stop(which) => stop(&which, talk),
            What::Drivers(verb) => verb.run(talk),
            What::Console(verb) => verb.run(talk),
        }
    }
}

/// Move the stage to a position, in mm from home
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig stage move 12.5
  epirig stage move --by -1.5                           or with a unit: '12.5 mm', '-200 um'
  epirig stage move 12.5 --approach-mm 0.5              ends upwards, against backlash
  epirig stage move 12.5 --home --driver sim            no hardware needed

The stage must be homed. The move is done when the stage reports the position.
Ctrl-C stops the stage.")]
struct Move {
    /// Target position, in mm from home
    #[arg(value_name = "MM", value_parser = mm, allow_negative_numbers = true, required_unless_present = "by")]
    to: Option<f64>,
    /// Distance from the present position, in mm
    #[arg(long, value_name = "MM", value_parser = mm, allow_hyphen_values = true, conflicts_with = "to")]
    by: Option<f64>,
    /// Home the stage first
    #[arg(long)]
    home: bool,
    #[command(flatten)]
    stage: WhichStage,
}

/// List the stage drivers, or print the page of one
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig stage drivers
  epirig stage drivers zaber                            its settings, and what to know of it")]
struct Drivers {
    /// The driver whose page is printed
    #[arg(value_parser = driver(|_| true))]
    name: Option<Driver>,
}

#[derive(Serialize)]
struct DriverOutput {
    name: &'static str,
    summary: &'static str,
    /// The keys of section `stage` that this driver adds.
    keys: Vec<String>,
    page: &'static str,
}

impl Drivers {
    fn run(self, talk: &Talk) -> Result<(), CliError> {
        let wanted = self.name.map_or_else(drivers, |driver| vec![driver]);
        let output = |driver: &Driver| DriverOutput {
            name: driver.name(),
            summary: driver.summary(),
            keys: driver.keys().iter().map(|key| key.path()).collect(),
            page: driver.page(),
        };
        let found: Vec<DriverOutput> = wanted.iter().map(output).collect();
        talk.result(&found, || match self.name {
            Some(driver) => driver.page().to_owned(),
            None => found.iter().map(|driver| format!("{:8}{}\n", driver.name, driver.summary)).collect(),
        })
    }
}

#[derive(Serialize)]
struct Report {
    stage: String,
    /// `None` if it is unknown.
    position_mm: Option<f64>,
    travel_mm: f64,
    moving: bool,
    at_limit: bool,
    home_shift_mm: Option<f64>,
}

fn tell(stage: &mut dyn Stage, talk: &Talk) -> Result<(), CliError> {
    let state = stage.state()?;
    let report = Report {
        stage: stage.identity().to_string(),
        position_mm: state.position_mm,
        travel_mm: stage.travel_mm(),
        moving: state.moving,
        at_limit: state.at_limit,
        home_shift_mm: stage.home_shift_mm(),
    };
    talk.result(&report, || {
        let place =
            report.position_mm.map_or("position unknown: not homed".to_owned(), |mm| format!("{mm:.4} mm"));
        let moving = if report.moving { ", moving" } else { "" };
        let limit = if report.at_limit { ", at a limit switch" } else { "" };
        format!("{place}{moving}{limit}\n")
    })
}

impl Move {
    fn run(self, talk: &Talk) -> Result<(), CliError> {
        let mut stage = self.stage.connect(talk)?;
        if self.home {
            home(&mut *stage, talk)?;
        }
        let target_mm = match (self.to, self.by) {
            (Some(to_mm), _) => to_mm,
            (None, by_mm) => stage.position_mm()? + by_mm.unwrap_or(0.0),
        };
        stage.move_to(target_mm)?;
        tell(&mut *stage, talk)
    }
}

/// Stops the stage, or asks the epirig that uses its port to do so.
fn stop(which: &WhichStage, talk: &Talk) -> Result<(), CliError> {
    let profile = which.profile()?;
    match Stages::new(&profile, which.transcript(), talk)?.stopping().connect() {
        Ok(mut stage) => {
            stage.stop()?;
            tell(&mut *stage, talk)
        }
        Err(StageError::Link(error @ LinkError::Busy { .. })) => {
            let port = Stages::new(&profile, None, talk)?.stage.port()?;
            let pid = ask_holder_to_stop(&port).ok_or(error)?;
            talk.say(&format!("process {pid}, an epirig that uses the port, was asked to stop the stage"));
            Ok(())
        }
        Err(other) => Err(other.into()),
    }
}
