//! The stage of a profile.

use super::RigError;
use crate::profile::Profile;
use epirig_devices::link::{Link, LinkError, PortChoice, choose, open, ports};
use epirig_devices::stage::{
    CheckedStage, Connection, Stage, StageError, StagePosition, StageSource, WhenMoving, connect,
};

/// Inserted between a line and its driver, such as a [`Recorder`](epirig_devices::link::Recorder).
pub type Tap<'a> = Box<dyn FnMut(Box<dyn Link>) -> Result<Box<dyn Link>, LinkError> + 'a>;

/// The stage of a profile, connected as often as needed, and [checked](CheckedStage).
pub struct RigStage<'a> {
    profile: &'a Profile,
    port: PortChoice,
    tap: Option<Tap<'a>>,
    watch: StagePosition,
    when_moving: WhenMoving,
}

impl<'a> RigStage<'a> {
    /// The stage of a profile; connects later.
    ///
    /// # Errors
    /// [`RigError::Value`] if the port is invalid.
    pub fn of(profile: &'a Profile) -> Result<Self, RigError> {
        let port = profile.stage.port.as_deref().map_or(Ok(PortChoice::Any), str::parse);
        let port = port.map_err(|reason| RigError::Value { key: "stage.port", reason })?;
        Ok(Self { profile, port, tap: None, watch: StagePosition::default(), when_moving: WhenMoving::Wait })
    }

    /// The same, with `tap` between line and driver.
    pub fn tapped(self, tap: Tap<'a>) -> Self {
        Self { tap: Some(tap), ..self }
    }

    /// The same, which stops a stage that moves when it is connected.
    pub fn stopping(self) -> Self {
        Self { when_moving: WhenMoving::Stop, ..self }
    }

    /// Opens the line to the stage, without its driver.
    ///
    /// # Errors
    /// [`LinkError`] if it cannot be opened.
    pub fn line(&mut self, baud: u32) -> Result<Box<dyn Link>, LinkError> {
        line(&self.port, &mut self.tap, baud)
    }

    /// The carriage position for a simulated camera, independent of the connection: the true position of a
    /// stage in memory, or the reported position of a stage over a line.
    pub fn watch(&self) -> StagePosition {
        self.watch.clone()
    }

    /// The path of the port.
    ///
    /// # Errors
    /// [`LinkError`] if no port, or more than one, matches the profile.
    pub fn port(&self) -> Result<String, LinkError> {
        port(&self.port)
    }
}

fn port(choice: &PortChoice) -> Result<String, LinkError> {
    let known = if matches!(choice, PortChoice::Path(_)) { Vec::new() } else { ports()? };
    choose(choice, &known)
}

fn line(choice: &PortChoice, tap: &mut Option<Tap<'_>>, baud: u32) -> Result<Box<dyn Link>, LinkError> {
    let link = open(&port(choice)?, baud)?;
    match tap {
        Some(tap) => tap(link),
        None => Ok(link),
    }
}

impl StageSource for RigStage<'_> {
    fn connect(&mut self) -> Result<Box<dyn Stage>, StageError> {
        let Self { profile, port: choice, tap, watch, when_moving } = self;
        let mut open_line = |baud| line(choice, tap, baud);
        let mut connection = Connection {
            open_line: &mut open_line,
            watch: watch.clone(),
            seed: profile.sim.seed,
            in_real_time: profile.sim.real_time,
            when_moving: *when_moving,
        };
        let stage = &profile.stage;
        let axis = connect(stage.driver, &mut connection, &stage.settings)?;
        let checked =
            CheckedStage::over(axis).with_tolerance(stage.tolerance_mm).approaching_by(stage.approach_mm);
        // A stage in memory shows its true position.
        let shown = profile.camera.is_simulated() && !stage.is_simulated();
        Ok(Box::new(if shown { checked.shown_at(watch.clone()) } else { checked }))
    }
}
