//! A stage with checked answers: the same rules for all dialects.

use std::time::{Duration, Instant};

use tracing::{debug, debug_span, info, warn};

use super::axis::{Axis, Homed, Motion};
use super::limits::{REPORT_ROUNDING_MM, check_move};
use super::{
    PositionAfter, PositionSettings, Stage, StageError, StageIdentity, StagePosition, StageState, StopSwitch,
};

/// Largest distance from 0 after homing, for stages with an encoder.
const HOME_WITHIN_MM: f64 = 0.1;

/// Readings of the position until two agree.
const READINGS: u32 = 6;

/// A stage that verifies what its axis reports.
///
/// - A position at rest counts once two readings agree, within the travel: one may be damaged on the line.
/// - It moves only while the position is known: the device was homed, and no later fault has invalidated the
///   position ([`StageError::consequence`]).
/// - Before a move the axis must be where the last move ended; otherwise something else has moved it.
/// - A move ends at the commanded position, within the tolerance, and not sooner than velocity and
///   acceleration allow.
/// - With unidirectional approach every position is reached from below, so that backlash has no effect.
///
/// ```
/// use epirig_devices::stage::{SimStage, SimStageConfig, Stage};
///
/// let slack = SimStageConfig { backlash_um: 50.0, ..SimStageConfig::ideal(100.0) };
/// let mut stage = SimStage::new(slack).approaching_by(0.5);
/// let position = stage.watch();
/// stage.home()?;
/// stage.move_to(10.0)?;
/// stage.move_to(5.0)?; // goes to 4.5 mm first
/// assert!((position.get_mm() - 5.0).abs() < 1e-9);
/// # Ok::<(), epirig_devices::stage::StageError>(())
/// ```
#[derive(Debug)]
pub struct CheckedStage<A: ?Sized> {
    pub(super) axis: Box<A>,
    tolerance_mm: f64,
    approach_mm: f64,
    /// Whether the position is known: the device knew it, and no fault has happened since.
    is_known: bool,
    /// End of the last move, in mm from home.
    rest_mm: Option<f64>,
    home_shift_mm: Option<f64>,
    shown: Option<Shown>,
    listener: Option<Listener>,
}

/// Called with the position directly before it is approached.
struct Listener(Box<dyn FnMut(f64) + Send>);

impl std::fmt::Debug for Listener {
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        to.write_str("Listener")
    }
}

/// The position as a simulated camera sees it.
#[derive(Debug)]
struct Shown {
    watch: StagePosition,
    /// When it was shown first, and the time that the watch had then.
    began: Instant,
    before: Duration,
}

impl<A: Axis + ?Sized> CheckedStage<A> {
    /// Wraps `axis` without a tolerance; every position is approached directly.
    pub fn over(axis: Box<A>) -> Self {
        info!(
            device = axis.identity().to_string(),
            travel_mm = axis.travel_mm(),
            is_homed = axis.is_homed(),
            "stage connected"
        );
        Self {
            is_known: axis.is_homed(),
            axis,
            // A stage without an encoder must report exactly the commanded step.
            tolerance_mm: 0.0,
            approach_mm: 0.0,
            rest_mm: None,
            home_shift_mm: None,
            shown: None,
            listener: None,
        }
    }

    /// The same, which calls `listener` with the position, in mm, directly before the last motion of each move.
    pub fn telling(self, listener: impl FnMut(f64) + Send + 'static) -> Self {
        Self { listener: Some(Listener(Box::new(listener))), ..self }
    }

    /// The same with a tolerance: the largest distance of the reported from the commanded position, in mm,
    /// beyond half a step and the rounding of the report.
    pub fn with_tolerance(self, tolerance_mm: f64) -> Self {
        Self { tolerance_mm, ..self }
    }

    /// The same with unidirectional approach, from `approach_mm` or more below each position; 0 for direct
    /// moves.
    pub fn approaching_by(self, approach_mm: f64) -> Self {
        Self { approach_mm, ..self }
    }

    /// The same with its reported position shown to a simulated camera at `watch`, whose time continues. So a rig
    /// can be rehearsed without its camera; the frames do not show the true position of the carriage.
    pub fn shown_at(self, watch: StagePosition) -> Self {
        let shown = Shown { before: watch.elapsed(), began: Instant::now(), watch };
        Self { shown: Some(shown), ..self }
    }

    /// Shows the position, if it is known.
    fn show(&mut self) -> Result<(), StageError> {
        if self.shown.is_some()
            && let Some(position_mm) = self.state()?.position_mm
            && let Some(shown) = &self.shown
        {
            shown.watch.set(position_mm, shown.before + shown.began.elapsed());
        }
        Ok(())
    }

    fn refuse_if_stopped(&mut self) -> Result<(), StageError> {
        if self.axis.stop_switch().pressed().is_none() {
            return Ok(());
        }
        Err(StageError::Stopped { position_mm: self.state()?.position_mm })
    }

    /// Device and seconds, for the log.
    fn since(&self, began: Duration) -> (String, f64) {
        (self.axis.identity().to_string(), self.axis.now().saturating_sub(began).as_secs_f64())
    }

    fn forget_position(&mut self) {
        (self.is_known, self.rest_mm) = (false, None);
        self.axis.forget_position();
    }

    /// Updates the knowledge of the position after a command.
    fn weigh<T>(&mut self, outcome: Result<T, StageError>) -> Result<T, StageError> {
        if let Err(error) = &outcome {
            self.rest_mm = None;
            if error.consequence().position != PositionAfter::Kept {
                self.forget_position();
            }
        }
        outcome
    }

    fn agree(&self, one_mm: Option<f64>, other_mm: Option<f64>) -> bool {
        match (one_mm, other_mm) {
            (Some(one), Some(other)) => (one - other).abs() <= self.tolerance_mm + REPORT_ROUNDING_MM,
            (None, None) => true,
            _ => false,
        }
    }

    /// The position at rest, once two readings agree. It must lie within the travel.
    fn confirmed_mm(&mut self, during: &str) -> Result<Option<f64>, StageError> {
        let mut before_mm = self.axis.position_at_rest_mm(during)?;
        for _ in 1..READINGS {
            let now_mm = self.axis.position_at_rest_mm(during)?;
            if self.agree(before_mm, now_mm) {
                return self.within_travel(now_mm, during);
            }
            before_mm = now_mm;
        }
        Err(self.unsteady(during))
    }

    fn unsteady(&self, during: &str) -> StageError {
        let fault = format!(
            "no two of {READINGS} reports of its position at rest agree; check cable and earth, then home it"
        );
        StageError::fault(during, fault)
    }

    fn within_travel(&self, position_mm: Option<f64>, during: &str) -> Result<Option<f64>, StageError> {
        let travel_mm = self.axis.travel_mm();
        let margin_mm = HOME_WITHIN_MM + self.tolerance_mm + REPORT_ROUNDING_MM;
        match position_mm {
            Some(mm) if !(-margin_mm..=travel_mm + margin_mm).contains(&mm) => Err(StageError::fault(
                during,
                format!("it reports {mm:.3} mm, which is outside its travel of 0 to {travel_mm} mm; home it"),
            )),
            inside => Ok(inside),
        }
    }

    /// The state, once two readings at rest agree, or two in motion are within the travel.
    fn confirmed_state(&mut self) -> Result<StageState, StageError> {
        let mut before = self.axis.state()?;
        for _ in 1..READINGS {
            let now = self.axis.state()?;
            let is_same = now.moving || self.agree(before.position_mm, now.position_mm);
            if now.moving == before.moving && is_same {
                if self.is_known {
                    self.within_travel(now.position_mm, "at rest")?;
                }
                return Ok(now);
            }
            before = now;
        }
        Err(self.unsteady("at rest"))
    }

    fn go_to(&mut self, target_mm: f64) -> Result<(), StageError> {
        self.refuse_if_stopped()?;
        let moved = self.go_and_check(target_mm);
        self.weigh(moved)
    }

    fn go_and_check(&mut self, target_mm: f64) -> Result<(), StageError> {
        let during = format!("in the move to {target_mm:.3} mm");
        let from_mm = self.confirmed_mm(&during)?.ok_or(StageError::NotHomed)?;
        if let Some(rest_mm) = self.rest_mm {
            let tolerance_mm = self.tolerance_mm + REPORT_ROUNDING_MM;
            // It has restarted, or something else has moved it.
            if (from_mm - rest_mm).abs() > tolerance_mm {
                return Err(StageError::Disagrees {
                    commanded_mm: rest_mm,
                    reported_mm: from_mm,
                    tolerance_mm,
                });
            }
        }
        let kinematics = self.axis.kinematics();
        let patience = kinematics.patience(target_mm - from_mm);
        let began = self.axis.now();
        let reported_mm = self.axis.go_to(&Motion { from_mm, target_mm, patience, during })?;
        let took = self.axis.now().saturating_sub(began);
        let reported_mm = reported_mm.ok_or(StageError::NotHomed)?;
        self.rest_mm = Some(reported_mm);
        check_move(self.tolerance_mm, &kinematics, from_mm, target_mm, reported_mm, took)
    }

    fn home_and_check(&mut self) -> Result<(), StageError> {
        self.refuse_if_stopped()?;
        (self.is_known, self.rest_mm, self.home_shift_mm) = (false, None, None);
        // What had changed them, such as a power cut, is often the reason for homing.
        self.axis.position_settings()?;
        let Homed { position_mm, shift_mm } = self.axis.home()?;
        let is_at_home = position_mm.abs() <= HOME_WITHIN_MM;
        if !is_at_home {
            self.forget_position();
            let fault = format!("it reports the end of homing at {position_mm:.4} mm; home it again");
            return Err(StageError::fault("while homing", fault));
        }
        (self.is_known, self.rest_mm, self.home_shift_mm) = (true, Some(position_mm), shift_mm);
        Ok(())
    }

    fn approach(&mut self, position_mm: f64) -> Result<(), StageError> {
        if !self.is_known {
            return Err(StageError::NotHomed);
        }
        let travel_mm = self.axis.travel_mm();
        if !(0.0..=travel_mm).contains(&position_mm) {
            return Err(StageError::OutsideTravel { position_mm, travel_mm });
        }
        let approach_mm = self.approach_mm;
        if approach_mm > 0.0 {
            let below_mm = position_mm - approach_mm;
            if below_mm < 0.0 {
                return Err(StageError::NoApproach { position_mm, approach_mm });
            }
            if self.position_mm()? > below_mm {
                self.go_to(below_mm)?;
            }
        }
        self.refuse_if_stopped()?;
        if let Some(Listener(tell)) = &mut self.listener {
            tell(position_mm);
        }
        self.go_to(position_mm)
    }
}

impl<A: Axis + ?Sized> Stage for CheckedStage<A> {
    fn identity(&self) -> StageIdentity {
        self.axis.identity()
    }

    fn travel_mm(&self) -> f64 {
        self.axis.travel_mm()
    }

    fn position_settings(&mut self) -> Result<PositionSettings, StageError> {
        (self.is_known, self.rest_mm) = (false, None);
        self.axis.position_settings()
    }

    fn home(&mut self) -> Result<(), StageError> {
        let _span = debug_span!("home").entered();
        let began = self.axis.now();
        let homed = self.home_and_check();
        let (device, seconds) = self.since(began);
        match &homed {
            Ok(()) => info!(device, seconds, home_shift_mm = self.home_shift_mm, "homed"),
            Err(reason) => warn!(device, seconds, %reason, "homing failed"),
        }
        homed?;
        self.show()
    }

    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError> {
        let _span = debug_span!("move").entered();
        let began = self.axis.now();
        let moved = self.approach(position_mm);
        let (device, seconds) = self.since(began);
        match &moved {
            Ok(()) => debug!(device, position_mm, seconds, "moved"),
            Err(reason) => warn!(device, position_mm, seconds, %reason, "move failed"),
        }
        moved?;
        self.show()
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        let confirmed = self.confirmed_state();
        if matches!(confirmed, Err(StageError::Fault { .. })) {
            self.forget_position();
        }
        let state = confirmed?;
        Ok(StageState { position_mm: state.position_mm.filter(|_| self.is_known), ..state })
    }

    /// At rest: it waits for the end of a motion.
    fn position_mm(&mut self) -> Result<f64, StageError> {
        if !self.is_known {
            return Err(StageError::NotHomed);
        }
        let confirmed = self.confirmed_mm("at rest");
        self.weigh(confirmed)?.ok_or(StageError::NotHomed)
    }

    fn stop(&mut self) -> Result<(), StageError> {
        self.rest_mm = None;
        let stopped = self.axis.stop();
        match &stopped {
            Ok(()) => info!(device = self.identity().to_string(), "stopped"),
            Err(reason) => {
                warn!(device = self.identity().to_string(), %reason, "the stage could not be stopped")
            }
        }
        self.weigh(stopped)?;
        self.show()
    }

    fn stop_switch(&self) -> StopSwitch {
        self.axis.stop_switch()
    }

    fn home_shift_mm(&self) -> Option<f64> {
        self.home_shift_mm
    }

    fn expected_duration(&self, distance_mm: f64) -> Option<Duration> {
        Some(self.axis.kinematics().duration(distance_mm))
    }

    fn holds_at_rest(&self) -> Option<bool> {
        self.axis.holds_at_rest()
    }

    fn notes(&self) -> &[String] {
        self.axis.notes()
    }
}

#[cfg(test)]
mod tests;
