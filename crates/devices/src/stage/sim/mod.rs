//! A stage in memory, with the faults of real ones.

mod course;
mod driver;

use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::watch::Screw;
use super::{
    Axis, CheckedStage, Homed, Kinematics, Motion, PositionSettings, StageError, StageIdentity,
    StagePosition, StageState, StopSwitch, Urgency,
};
use course::{Course, End};
pub use driver::Simulated;

/// Name of the driver.
const NAME: &str = "sim";

const UM_PER_MM: f64 = 1000.0;
const SECONDS_PER_HOUR: f64 = 3600.0;

/// Properties of a simulated stage.
#[derive(Debug, Clone, PartialEq)]
pub struct SimStageConfig {
    /// Length of the travel, in mm; positions go from 0 to this.
    pub travel_mm: f64,
    /// Length of a motor step, to which positions are rounded, in um; 0 for none.
    pub step_um: f64,
    /// Velocity of a long move, in mm/s.
    pub velocity_mm_s: f64,
    /// Acceleration and deceleration, in mm/s2.
    pub acceleration_mm_s2: f64,
    /// Backlash, in um: the carriage lags by this much after a reversal to downwards.
    pub backlash_um: f64,
    /// Probability that a move loses steps.
    pub slip_probability: f64,
    /// Distance lost in a slip, in um. The stage does not notice; homing corrects it.
    pub slip_um: f64,
    /// Standard deviation of the position at rest, in um.
    pub position_noise_um: f64,
    /// Total drift of the carriage while the machine warms up, in um.
    pub thermal_drift_um: f64,
    /// Time constant of the drift (63 %), in hours.
    pub thermal_hours: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl SimStageConfig {
    /// A stage without any error.
    pub fn ideal(travel_mm: f64) -> Self {
        Self {
            travel_mm,
            step_um: 0.0,
            velocity_mm_s: 5.0,
            acceleration_mm_s2: 20.0,
            backlash_um: 0.0,
            slip_probability: 0.0,
            slip_um: 0.0,
            position_noise_um: 0.0,
            thermal_drift_um: 0.0,
            thermal_hours: 1.0,
            seed: 0,
        }
    }
}

/// The simulated stage, checked. Its time is simulated too: moves take no real time, unless
/// [`in_real_time`](SimStage::in_real_time) asks for it.
///
/// The true position can be watched, for example by the simulated camera.
///
/// ```
/// use epirig_devices::stage::{SimStage, SimStageConfig, Stage};
///
/// let mut stage = SimStage::new(SimStageConfig::ideal(200.0));
/// assert!(stage.move_to(10.0).is_err());
/// stage.home()?;
/// stage.move_to(10.0)?;
/// assert_eq!(stage.position_mm()?, 10.0);
/// # Ok::<(), epirig_devices::stage::StageError>(())
/// ```
pub type SimStage = CheckedStage<SimAxis>;

/// The axis of a simulated stage.
#[derive(Debug)]
pub struct SimAxis {
    config: SimStageConfig,
    random: ChaCha8Rng,
    homed: bool,
    screw: Screw,
    elapsed: Duration,
    carriage: StagePosition,
    stop: StopSwitch,
    in_real_time: bool,
}

/// The state of an axis at the start of a move.
struct Start {
    screw: Screw,
    elapsed: Duration,
}

impl SimStage {
    /// A stage that is not yet homed.
    pub fn new(config: SimStageConfig) -> Self {
        Self::seen_through(config, StagePosition::default())
    }

    /// The same for watchers of a former stage; their time continues.
    pub fn seen_through(config: SimStageConfig, watch: StagePosition) -> Self {
        Self::over(Box::new(SimAxis::seen_through(config, watch)))
    }

    /// The same, whose moves take real time: the carriage can be watched and stopped on its way.
    pub fn in_real_time(mut self) -> Self {
        self.axis.in_real_time = true;
        self
    }

    /// A shared view of the true position of the carriage.
    pub fn watch(&self) -> StagePosition {
        self.axis.carriage.clone()
    }
}

impl SimAxis {
    /// An axis that is not yet homed; `watch` shows its true position, and its time continues.
    pub fn seen_through(config: SimStageConfig, watch: StagePosition) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(config.seed),
            config,
            homed: false,
            screw: Screw::default(),
            elapsed: watch.elapsed(),
            carriage: watch,
            stop: StopSwitch::default(),
            in_real_time: false,
        }
    }

    /// The same, as its watchers' former stage was left: a machine that was homed stays so when it is connected
    /// again.
    fn found_again(self) -> Self {
        match self.carriage.left() {
            None => self,
            Some(screw) => Self { homed: true, screw, ..self },
        }
    }

    /// Keeps how the machine stands now, for the next connection.
    fn leave(&self) {
        self.carriage.leave(self.homed.then_some(self.screw));
    }

    /// Moves to a position of the motor; if that is stopped on its way, returns how urgent the stop was.
    fn turn_to(&mut self, motor_mm: f64) -> Option<Urgency> {
        let start = Start { screw: self.screw, elapsed: self.elapsed };
        let distance_mm = motor_mm - start.screw.motor_mm;
        let slips = distance_mm != 0.0
            && self.config.slip_probability > 0.0
            && self.random.random_bool(self.config.slip_probability.min(1.0));
        let slip_mm = if slips { self.config.slip_um / UM_PER_MM } else { 0.0 };
        let slip_mm = slip_mm + self.carriage.take_lost_steps();
        let End { at_mm, took, stopped } = if self.in_real_time {
            self.follow(&start, motor_mm, slip_mm)
        } else {
            let took = Axis::kinematics(self).duration(distance_mm);
            End { at_mm: motor_mm, took, stopped: None }
        };
        self.elapsed = start.elapsed.saturating_add(took);
        self.turn(&start, at_mm, slip_mm);
        self.settle();
        stopped
    }

    /// Follows the course of a move in real time; the carriage can be watched, and the stop switch is obeyed.
    fn follow(&mut self, start: &Start, motor_mm: f64, slip_mm: f64) -> End {
        let course = Course::new(&Axis::kinematics(self), start.screw.motor_mm, motor_mm);
        let (stop, began) = (self.stop.clone(), Instant::now());
        let wait = |time| {
            std::thread::sleep(time);
            began.elapsed()
        };
        let pass = |at_mm, time| {
            self.turn(start, at_mm, slip_mm);
            let elapsed = start.elapsed.saturating_add(time);
            self.carriage.set(self.screw.nut_mm + self.drift_um(elapsed) / UM_PER_MM, elapsed);
        };
        let end = course.follow(&stop, wait, pass);
        // A motor stands still at a step.
        if end.stopped.is_some() { End { at_mm: self.to_step(end.at_mm), ..end } } else { end }
    }

    /// Turns the motor in a move, which loses a distance at its start; the nut follows after the backlash.
    fn turn(&mut self, start: &Start, motor_mm: f64, slip_mm: f64) {
        let distance_mm = motor_mm - start.screw.motor_mm;
        let slipped_mm = start.screw.slipped_mm - slip_mm.min(distance_mm.abs()) * distance_mm.signum();
        let screw_mm = motor_mm + slipped_mm;
        let nut_mm = self.screw.nut_mm.clamp(screw_mm, screw_mm + self.config.backlash_um / UM_PER_MM);
        self.screw = Screw { motor_mm, nut_mm, slipped_mm };
    }

    fn to_step(&self, position_mm: f64) -> f64 {
        let step_mm = self.config.step_um / UM_PER_MM;
        if step_mm > 0.0 { (position_mm / step_mm).round() * step_mm } else { position_mm }
    }

    fn drift_um(&self, elapsed: Duration) -> f64 {
        let hours = elapsed.as_secs_f64() / SECONDS_PER_HOUR;
        self.config.thermal_drift_um * (1.0 - (-hours / self.config.thermal_hours).exp())
    }

    fn settle(&mut self) {
        let noise: f64 =
            if self.config.position_noise_um > 0.0 { self.random.sample(StandardNormal) } else { 0.0 };
        let astray_um = self.drift_um(self.elapsed) + self.config.position_noise_um * noise;
        self.carriage.set(self.screw.nut_mm + astray_um / UM_PER_MM, self.elapsed);
        self.leave();
    }
}

impl Axis for SimAxis {
    fn identity(&self) -> StageIdentity {
        StageIdentity {
            driver: NAME,
            description: format!("simulated stage, {} mm", self.config.travel_mm),
            port: None,
        }
    }

    fn travel_mm(&self) -> f64 {
        self.config.travel_mm
    }

    fn kinematics(&self) -> Kinematics {
        Kinematics {
            velocity_mm_s: self.config.velocity_mm_s,
            acceleration_mm_s2: self.config.acceleration_mm_s2,
            step_mm: self.config.step_um / UM_PER_MM,
        }
    }

    fn is_homed(&self) -> bool {
        self.homed
    }

    // Nothing outlasts the program.
    fn position_settings(&mut self) -> Result<PositionSettings, StageError> {
        Ok(PositionSettings::new())
    }

    fn home(&mut self) -> Result<Homed, StageError> {
        // To the switch, and off it upwards, which removes the backlash.
        if self.turn_to(0.0).is_some() {
            self.homed = false;
            self.leave();
            return Err(StageError::Stopped { position_mm: None });
        }
        let shift_mm = self.homed.then_some(-self.screw.slipped_mm);
        (self.screw, self.homed) = (Screw::default(), true);
        self.settle();
        Ok(Homed { position_mm: 0.0, shift_mm })
    }

    fn position_at_rest_mm(&mut self, _during: &str) -> Result<Option<f64>, StageError> {
        Ok(self.homed.then_some(self.screw.motor_mm))
    }

    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        let Some(urgency) = self.turn_to(self.to_step(motion.target_mm)) else {
            return Ok(Some(self.screw.motor_mm));
        };
        // Without a ramp steps may be lost.
        self.homed &= urgency == Urgency::Soon;
        self.leave();
        Err(StageError::Stopped { position_mm: self.homed.then_some(self.screw.motor_mm) })
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        Ok(StageState {
            position_mm: self.homed.then_some(self.screw.motor_mm),
            moving: false,
            at_limit: false,
        })
    }

    fn stop(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn stop_switch(&self) -> StopSwitch {
        self.stop.clone()
    }

    fn now(&self) -> Duration {
        self.elapsed
    }

    fn holds_at_rest(&self) -> Option<bool> {
        Some(true)
    }
}

#[cfg(test)]
mod tests;
