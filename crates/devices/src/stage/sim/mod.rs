//! A stage in memory, with the faults of real ones.

mod driver;

use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::{
    Axis, CheckedStage, Homed, Kinematics, Motion, StageError, StageIdentity, StagePosition, StageState,
    StopSwitch,
};
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

/// The simulated stage, checked. Its time is simulated too: moves take no real time.
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
    /// Position of the motor, which the stage reports, in mm.
    motor_mm: f64,
    /// Position of the nut without drift and noise, in mm.
    nut_mm: f64,
    /// Total slip since homing, in mm.
    slipped_mm: f64,
    elapsed: Duration,
    carriage: StagePosition,
    stop: StopSwitch,
}

impl SimStage {
    /// A stage that is not yet homed.
    pub fn new(config: SimStageConfig) -> Self {
        Self::seen_through(config, StagePosition::default())
    }

    /// The same for watchers of a former stage; their time continues.
    pub fn seen_through(config: SimStageConfig, watch: StagePosition) -> Self {
        Self::over(SimAxis::seen_through(config, watch))
    }

    /// A shared view of the true position of the carriage.
    pub fn watch(&self) -> StagePosition {
        self.axis.carriage.clone()
    }

    /// Simulated time since the stage was made.
    pub fn elapsed(&self) -> Duration {
        self.axis.elapsed
    }

    /// Advances the simulated time at rest.
    pub fn wait(&mut self, time: Duration) {
        self.axis.elapsed = self.axis.elapsed.saturating_add(time);
        self.axis.settle();
    }
}

impl SimAxis {
    /// An axis that is not yet homed; `watch` shows its true position, and its time continues.
    pub fn seen_through(config: SimStageConfig, watch: StagePosition) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(config.seed),
            config,
            homed: false,
            motor_mm: 0.0,
            nut_mm: 0.0,
            slipped_mm: 0.0,
            elapsed: watch.elapsed(),
            carriage: watch,
            stop: StopSwitch::default(),
        }
    }

    /// Turns the motor; the nut follows after the backlash.
    fn turn_to(&mut self, motor_mm: f64) {
        let distance_mm = motor_mm - self.motor_mm;
        self.elapsed = self.elapsed.saturating_add(Axis::kinematics(self).duration(distance_mm));
        if distance_mm != 0.0
            && self.config.slip_probability > 0.0
            && self.random.random_bool(self.config.slip_probability.min(1.0))
        {
            let slip_mm = (self.config.slip_um / UM_PER_MM).min(distance_mm.abs());
            self.slipped_mm -= slip_mm * distance_mm.signum();
        }
        self.motor_mm = motor_mm;
        let screw_mm = motor_mm + self.slipped_mm;
        self.nut_mm = self.nut_mm.clamp(screw_mm, screw_mm + self.config.backlash_um / UM_PER_MM);
        self.settle();
    }

    fn settle(&mut self) {
        let hours = self.elapsed.as_secs_f64() / SECONDS_PER_HOUR;
        let warmth = 1.0 - (-hours / self.config.thermal_hours).exp();
        let noise: f64 =
            if self.config.position_noise_um > 0.0 { self.random.sample(StandardNormal) } else { 0.0 };
        let astray_um = self.config.thermal_drift_um * warmth + self.config.position_noise_um * noise;
        self.carriage.set(self.nut_mm + astray_um / UM_PER_MM, self.elapsed);
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

    fn home(&mut self) -> Result<Homed, StageError> {
        // To the switch, and off it upwards, which removes the backlash.
        self.turn_to(0.0);
        let shift_mm = self.homed.then_some(-self.slipped_mm);
        (self.motor_mm, self.nut_mm, self.slipped_mm) = (0.0, 0.0, 0.0);
        self.homed = true;
        self.settle();
        Ok(Homed { position_mm: 0.0, shift_mm })
    }

    fn position_at_rest_mm(&mut self, _during: &str) -> Result<Option<f64>, StageError> {
        Ok(self.homed.then_some(self.motor_mm))
    }

    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        let (step_mm, target_mm) = (self.config.step_um / UM_PER_MM, motion.target_mm);
        self.turn_to(if step_mm > 0.0 { (target_mm / step_mm).round() * step_mm } else { target_mm });
        Ok(Some(self.motor_mm))
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        Ok(StageState { position_mm: self.homed.then_some(self.motor_mm), moving: false, at_limit: false })
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
mod tests {
    use super::*;
    use crate::stage::{Stage as _, Urgency};

    fn homed(config: SimStageConfig) -> (SimStage, StagePosition) {
        let mut stage = SimStage::new(config);
        stage.home().unwrap();
        let carriage = stage.watch();
        (stage, carriage)
    }

    #[test]
    fn the_stage_refuses_what_it_cannot_do() {
        let mut stage = SimStage::new(SimStageConfig::ideal(50.0));
        assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
        stage.home().unwrap();
        assert!(matches!(stage.move_to(50.1), Err(StageError::OutsideTravel { .. })));
        assert!(stage.move_to(f64::NAN).is_err());
        stage.move_to(50.0).unwrap();
        assert_eq!(stage.watch().get_mm(), 50.0);
        stage.stop_switch().press(Urgency::Soon);
        assert_eq!(stage.move_to(1.0), Err(StageError::Stopped { position_mm: Some(50.0) }));
    }

    #[test]
    fn backlash_shows_on_the_way_down_only() {
        let (mut stage, carriage) =
            homed(SimStageConfig { backlash_um: 40.0, ..SimStageConfig::ideal(100.0) });
        for (position_mm, behind_um) in [(10.0, 0.0), (5.0, 40.0), (4.99, 40.0), (5.01, 20.0), (5.1, 0.0)] {
            stage.move_to(position_mm).unwrap();
            let off_um = (carriage.get_mm() - position_mm) * UM_PER_MM;
            assert!((off_um - behind_um).abs() < 1e-6, "at {position_mm} mm: {off_um} um");
            assert_eq!(stage.position_mm(), Ok(position_mm));
        }
    }

    #[test]
    fn lost_steps_add_up_unnoticed_until_home() {
        let slips =
            SimStageConfig { slip_probability: 0.3, slip_um: 4.0, seed: 5, ..SimStageConfig::ideal(200.0) };
        let (mut stage, carriage) = homed(slips);
        for index in 1..=100 {
            stage.move_to(f64::from(index)).unwrap();
        }
        let lost = (100.0 - carriage.get_mm()) * UM_PER_MM / 4.0;
        // 100 moves at 0.3: 30 +- 4.6, so within five standard deviations.
        assert!((7.0..=53.0).contains(&lost) && (lost - lost.round()).abs() < 1e-6, "{lost} slips");
        stage.home().unwrap();
        assert_eq!(carriage.get_mm(), 0.0);
        // Home is found early by what was lost on the way up, but for what the way home may have lost.
        let shift = stage.home_shift_mm().unwrap() * UM_PER_MM / 4.0;
        assert!((lost - 1.001..=lost + 0.001).contains(&shift), "{shift} of {lost}");
    }

    #[test]
    fn noise_and_drift_are_as_large_as_asked_and_the_same_for_a_seed() {
        let noisy = SimStageConfig { position_noise_um: 3.0, seed: 8, ..SimStageConfig::ideal(100.0) };
        let run = || {
            let (mut stage, carriage) = homed(noisy.clone());
            let offs: Vec<f64> = (0..2000)
                .map(|index| {
                    stage.move_to(f64::from(index % 100)).unwrap();
                    (carriage.get_mm() - f64::from(index % 100)) * UM_PER_MM
                })
                .collect();
            offs
        };
        let offs = run();
        assert_eq!(offs, run());
        // The standard deviation of 2000 samples is known to 1.6 %; five of those.
        let deviation = (offs.iter().map(|off| off * off).sum::<f64>() / 2000.0).sqrt();
        assert!((deviation - 3.0).abs() < 0.24, "{deviation} um");

        let warm =
            SimStageConfig { thermal_drift_um: 20.0, thermal_hours: 0.5, ..SimStageConfig::ideal(100.0) };
        let (mut stage, carriage) = homed(warm);
        stage.wait(Duration::from_secs(1800) - stage.elapsed());
        let expected_um = 20.0 * (1.0 - (-1.0_f64).exp());
        assert!((carriage.get_mm() * UM_PER_MM - expected_um).abs() < 1e-6);
    }

    #[test]
    fn moves_take_the_time_of_their_ramps() {
        let (mut stage, _) = homed(SimStageConfig::ideal(100.0));
        let before = stage.elapsed();
        // 5 mm/s and 20 mm/s2: 0.25 s up, 0.25 s down, 8.75 mm at speed.
        stage.move_to(10.0).unwrap();
        let took_s = (stage.elapsed() - before).as_secs_f64();
        assert!((took_s - (0.5 + 8.75 / 5.0)).abs() < 1e-9, "{took_s} s");
    }
}
