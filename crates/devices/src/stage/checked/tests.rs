//! The rules that hold for all dialects, over an axis that says what it is told to say.

use super::*;
use crate::stage::{Kinematics, Urgency};

/// An axis whose answers are set by the test.
#[derive(Debug)]
struct Puppet {
    homed: bool,
    /// Where it says that it is, in mm from home.
    at_mm: f64,
    /// By how much its report after a move is off, in mm.
    off_mm: f64,
    /// How long a move takes, in s; `None`: as its kinematics say.
    move_s: Option<f64>,
    /// What the next move fails with.
    fails: Option<StageError>,
    /// Where homing ends, in mm.
    home_mm: f64,
    now: Duration,
    forgotten: usize,
    targets_mm: Vec<f64>,
    stop: StopSwitch,
}

fn puppet() -> Puppet {
    Puppet {
        homed: false,
        at_mm: 0.0,
        off_mm: 0.0,
        move_s: None,
        fails: None,
        home_mm: 0.0,
        now: Duration::ZERO,
        forgotten: 0,
        targets_mm: Vec::new(),
        stop: StopSwitch::default(),
    }
}

impl Axis for Puppet {
    fn identity(&self) -> StageIdentity {
        StageIdentity { driver: "puppet", description: "a puppet".to_owned(), port: None }
    }

    fn travel_mm(&self) -> f64 {
        50.0
    }

    fn kinematics(&self) -> Kinematics {
        Kinematics { velocity_mm_s: 5.0, acceleration_mm_s2: 20.0, step_mm: 0.004 }
    }

    fn is_homed(&self) -> bool {
        self.homed
    }

    fn position_settings(&mut self) -> Result<PositionSettings, StageError> {
        Ok(PositionSettings::new())
    }

    fn home(&mut self) -> Result<Homed, StageError> {
        (self.homed, self.at_mm) = (true, self.home_mm);
        Ok(Homed { position_mm: self.home_mm, shift_mm: Some(0.25) })
    }

    fn position_at_rest_mm(&mut self, _during: &str) -> Result<Option<f64>, StageError> {
        Ok(self.homed.then_some(self.at_mm))
    }

    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        self.targets_mm.push(motion.target_mm);
        if let Some(error) = self.fails.take() {
            return Err(error);
        }
        let usual = self.kinematics().duration(motion.target_mm - motion.from_mm);
        self.now += self.move_s.map_or(usual, Duration::from_secs_f64);
        self.at_mm = motion.target_mm + self.off_mm;
        Ok(Some(self.at_mm))
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        Ok(StageState { position_mm: self.homed.then_some(self.at_mm), moving: false, at_limit: false })
    }

    fn stop(&mut self) -> Result<(), StageError> {
        Ok(())
    }

    fn forget_position(&mut self) {
        self.forgotten += 1;
    }

    fn stop_switch(&self) -> StopSwitch {
        self.stop.clone()
    }

    fn now(&self) -> Duration {
        self.now
    }
}

fn homed(change: impl FnOnce(&mut Puppet)) -> CheckedStage<Puppet> {
    let mut stage = CheckedStage::over(Box::new(puppet()));
    stage.home().unwrap();
    change(&mut stage.axis);
    stage
}

#[test]
fn nothing_moves_before_the_position_is_known_or_outside_the_travel() {
    let mut stage = CheckedStage::over(Box::new(puppet()));
    assert_eq!(stage.move_to(1.0), Err(StageError::NotHomed));
    stage.home().unwrap();
    assert_eq!(stage.home_shift_mm(), Some(0.25));
    for outside_mm in [-0.001, 50.001, f64::NAN, f64::INFINITY] {
        assert!(matches!(stage.move_to(outside_mm), Err(StageError::OutsideTravel { .. })), "{outside_mm}");
    }
    assert!(stage.axis.targets_mm.is_empty());
    assert_eq!(stage.position_mm(), Ok(0.0));
}

#[test]
fn a_report_beside_the_target_costs_the_position_unless_it_is_tolerated() {
    // Half a step of 4 um and half a um of rounding.
    let mut stage = homed(|axis| axis.off_mm = 0.0026);
    assert!(matches!(stage.move_to(10.0), Err(StageError::Disagrees { .. })));
    assert_eq!((stage.position_mm(), stage.axis.forgotten), (Err(StageError::NotHomed), 1));
    assert_eq!(stage.move_to(10.0), Err(StageError::NotHomed));
    let mut stage = homed(|axis| axis.off_mm = 0.0026).with_tolerance(0.001);
    assert_eq!(stage.move_to(10.0), Ok(()));
}

#[test]
fn a_move_that_is_over_too_soon_did_not_happen() {
    // 10 mm at 5 mm/s with ramps of 0.25 s take 2.25 s; half of that is the least.
    let mut stage = homed(|axis| axis.move_s = Some(1.1));
    assert!(matches!(stage.move_to(10.0), Err(StageError::TooFast { .. })));
    let mut stage = homed(|axis| axis.move_s = Some(1.2));
    assert_eq!(stage.move_to(10.0), Ok(()));
}

#[test]
fn what_has_moved_meanwhile_is_noticed_before_the_next_move() {
    let mut stage = homed(|_| ());
    stage.move_to(10.0).unwrap();
    stage.axis.at_mm = 10.004;
    assert!(matches!(stage.move_to(11.0), Err(StageError::Disagrees { .. })));
    assert_eq!(stage.axis.targets_mm, [10.0]);
}

#[test]
fn each_fault_leaves_of_the_position_what_the_table_says() {
    let refused = StageError::Refused { reason: "busy".to_owned() };
    let stopped = |position_mm| StageError::Stopped { position_mm };
    let fault = StageError::Fault { during: "in a test".to_owned(), fault: "it broke".to_owned() };
    for (error, is_kept) in [
        (refused, true),
        (stopped(Some(3.0)), true),
        (stopped(None), false),
        (fault, false),
        (StageError::Restarted { during: "in a test".to_owned() }, false),
    ] {
        let mut stage = homed(|axis| axis.fails = Some(error.clone()));
        assert_eq!(stage.move_to(10.0), Err(error.clone()));
        assert_eq!(stage.position_mm().is_ok(), is_kept, "{error}");
        assert_eq!(error.consequence().position == PositionAfter::Kept, is_kept, "{error}");
        stage.home().unwrap();
        assert_eq!(stage.move_to(10.0), Ok(()), "after {error}");
    }
}

#[test]
fn positions_are_approached_from_below_where_there_is_room() {
    let mut stage = homed(|_| ()).approaching_by(0.5);
    assert!(matches!(stage.move_to(0.4), Err(StageError::NoApproach { .. })));
    stage.move_to(10.0).unwrap();
    stage.move_to(5.0).unwrap();
    assert_eq!(stage.axis.targets_mm, [10.0, 4.5, 5.0]);
}

#[test]
fn home_elsewhere_is_no_home_and_a_stop_that_is_asked_for_holds() {
    let mut stage = CheckedStage::over(Box::new(Puppet { home_mm: 0.2, ..puppet() }));
    assert!(matches!(stage.home(), Err(StageError::Fault { .. })));
    assert_eq!(stage.move_to(1.0), Err(StageError::NotHomed));
    let mut stage = homed(|_| ());
    stage.stop_switch().press(Urgency::Soon);
    assert_eq!(stage.move_to(1.0), Err(StageError::Stopped { position_mm: Some(0.0) }));
    assert_eq!(stage.home(), Err(StageError::Stopped { position_mm: Some(0.0) }));
    stage.stop_switch().release();
    assert_eq!(stage.move_to(1.0), Ok(()));
}
