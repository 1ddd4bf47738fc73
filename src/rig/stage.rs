//! The stage of a profile.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::RigError;
use super::faults::PlannedFaults;
use crate::profile::Profile;
use epirig_devices::link::{
    Link, LinkError, PortChoice, SimulatedDevice as _, SimulatedLink, choose, open, ports,
};
use epirig_devices::stage::simulator::{FaultInlet, FaultScript, SimulatedStage};
use epirig_devices::stage::{
    CheckedStage, Connection, Stage, StageError, StagePosition, StageSource, WhenMoving, connect,
};

/// Simulated time from one connection to the next: nothing else passes while a program waits.
const BETWEEN_CONNECTIONS: Duration = Duration::from_millis(500);

/// Inserted between a line and its driver, such as a [`Recorder`](epirig_devices::link::Recorder).
pub type Tap<'a> = Box<dyn FnMut(Box<dyn Link>) -> Result<Box<dyn Link>, LinkError> + 'a>;

/// A simulated device at the end of a line.
struct Simulated {
    stage: SimulatedStage,
    faults: FaultInlet,
    in_real_time: bool,
}

impl Simulated {
    /// The device of the profile's driver, whose carriage is shown at `watch`; `None` for every other stage.
    fn of(profile: &Profile, watch: &StagePosition) -> Option<Self> {
        /// For a device that counts its starts.
        const START: u32 = 1;
        let script = FaultScript::default();
        let faults = script.inlet();
        let stage = profile.stage.is_simulated().then(|| profile.stage.driver.simulated(script, START))??;
        Some(Self { stage: stage.shown_at(watch.clone()), faults, in_real_time: profile.sim.real_time })
    }

    fn line(&self) -> Box<dyn Link> {
        let link = SimulatedLink::new(Arc::clone(&self.stage.device));
        Box::new(if self.in_real_time { link.in_real_time() } else { link })
    }
}

/// The stage of a profile, connected as often as needed, and [checked](CheckedStage).
pub struct RigStage<'a> {
    profile: &'a Profile,
    port: PortChoice,
    tap: Option<Tap<'a>>,
    watch: StagePosition,
    when_moving: WhenMoving,
    /// What is simulated, if the line is.
    simulated: Option<Simulated>,
    faults: Arc<Mutex<PlannedFaults>>,
}

impl<'a> RigStage<'a> {
    /// The stage of a profile; connects later.
    ///
    /// # Errors
    /// [`RigError::Value`] if the port is invalid, or a fault of a simulated stage cannot happen.
    pub fn of(profile: &'a Profile) -> Result<Self, RigError> {
        let port = profile.stage.port.as_deref().map_or(Ok(PortChoice::Any), str::parse);
        let port = port.map_err(|reason| RigError::Value { key: "stage.port", reason })?;
        let watch = StagePosition::default();
        let simulated = Simulated::of(profile, &watch);
        let faults = PlannedFaults::of(profile, simulated.is_some())?;
        let faults = Arc::new(Mutex::new(faults));
        Ok(Self { profile, port, tap: None, watch, when_moving: WhenMoving::Wait, simulated, faults })
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
        line(&self.port, self.simulated.as_ref(), &mut self.tap, baud)
    }

    /// The carriage position for a simulated camera, independent of the connection: the true position of a
    /// simulated stage, or the reported position of a real one.
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

fn line(
    choice: &PortChoice,
    simulated: Option<&Simulated>,
    tap: &mut Option<Tap<'_>>,
    baud: u32,
) -> Result<Box<dyn Link>, LinkError> {
    let link = match simulated {
        Some(simulated) => simulated.line(),
        None => open(&port(choice)?, baud)?,
    };
    match tap {
        Some(tap) => tap(link),
        None => Ok(link),
    }
}

impl StageSource for RigStage<'_> {
    fn connect(&mut self) -> Result<Box<dyn Stage>, StageError> {
        let Self { profile, port: choice, tap, watch, when_moving, simulated, faults } = self;
        let (stage, simulated) = (&profile.stage, simulated.as_ref());
        let mut settings = stage.settings.clone();
        if let Some(simulated) = simulated {
            settings.add_missing(&simulated.stage.settings);
            Arc::clone(&simulated.stage.device).advance(BETWEEN_CONNECTIONS);
        }
        let mut open_line = |baud| line(choice, simulated, tap, baud);
        let mut connection = Connection {
            open_line: &mut open_line,
            watch: watch.clone(),
            seed: profile.sim.seed,
            in_real_time: profile.sim.real_time,
            when_moving: *when_moving,
        };
        let axis = connect(stage.driver, &mut connection, &settings)?;
        let (seen, faults) = (watch.clone(), Arc::clone(faults));
        let inlet = simulated.map(|simulated| simulated.faults.clone());
        let checked = CheckedStage::over(axis)
            .with_tolerance(stage.tolerance_mm)
            .approaching_by(stage.approach_mm)
            .telling(move |position_mm| {
                let mut faults = faults.lock().unwrap_or_else(PoisonError::into_inner);
                faults.sent_to(position_mm, &seen, inlet.as_ref());
            });
        // A simulated stage shows its true position.
        let shown = profile.camera.is_simulated() && !stage.is_simulated();
        Ok(Box::new(if shown { checked.shown_at(watch.clone()) } else { checked }))
    }
}
