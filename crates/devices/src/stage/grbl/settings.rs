//! GRBL's `$$` settings that matter for a measurement.

use std::collections::BTreeMap;

use crate::stage::{Kinematics, StageError};

const MINUTE_S: f64 = 60.0;

/// Idle delay of the motors; 255 keeps them powered.
pub(super) const IDLE_DELAY: u8 = 1;
pub(super) const ALWAYS_POWERED: f64 = 255.0;

const STATUS_MASK: u8 = 10;
const REPORT_INCHES: u8 = 13;
const SOFT_LIMITS: u8 = 20;
const HARD_LIMITS: u8 = 21;
const HOMING: u8 = 22;
const HOMING_TO_NEGATIVE: u8 = 23;
const HOMING_FEED: u8 = 24;
const HOMING_SEEK: u8 = 25;
const PULL_OFF: u8 = 27;
const STEPS_PER_MM: u8 = 100;
const RATE: u8 = 110;
const ACCELERATION: u8 = 120;
const TRAVEL: u8 = 130;

epirig_core::choices! {
    /// One of GRBL's axes.
    pub enum AxisLetter {
        /// The first, as on a CNC shield.
        X = "x",
        /// The second.
        Y = "y",
        /// The third.
        Z = "z",
    }
}

impl AxisLetter {
    pub(super) const fn index(self) -> usize {
        self as usize
    }

    /// Its letter in G-code.
    pub const fn letter(self) -> char {
        ['X', 'Y', 'Z'][self.index()]
    }
}

/// The settings as read.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Settings {
    values: BTreeMap<u8, f64>,
}

impl Settings {
    pub(super) fn insert(&mut self, number: u8, value: f64) {
        self.values.insert(number, value);
    }

    pub(super) fn get(&self, number: u8) -> Option<f64> {
        self.values.get(&number).copied()
    }

    /// The facts that the driver needs, or why the stage cannot be used.
    pub(super) fn check(
        &self,
        axis: AxisLetter,
        home_is_origin: bool,
        port: &str,
    ) -> Result<AxisSettings, StageError> {
        let offset = axis.index() as u8;
        let unsuitable =
            |what: String, remedy: String| StageError::Unsuitable { port: port.to_owned(), what, remedy };
        let number = |number: u8| {
            let missing = || {
                unsuitable(
                    format!("it does not report its setting ${number}"),
                    "it may not be GRBL 1.1".to_owned(),
                )
            };
            self.get(number).ok_or_else(missing)
        };
        let positive = |of: u8| {
            let value = number(of)?;
            if value > 0.0 {
                Ok(value)
            } else {
                Err(unsuitable(
                    format!("its setting ${of} is {value}"),
                    format!("set ${of} to the value of the machine"),
                ))
            }
        };
        if number(HOMING)? == 0.0 {
            let remedy = format!("fit a limit switch and send ${HOMING}=1");
            return Err(unsuitable(format!("homing is switched off (${HOMING}=0)"), remedy));
        }
        if number(REPORT_INCHES)? != 0.0 {
            let what = format!("it reports inches, rounded to 2.5 um (${REPORT_INCHES}=1)");
            return Err(unsuitable(what, format!("send ${REPORT_INCHES}=0")));
        }
        let mask = number(STATUS_MASK)? as u8;
        if mask & 1 == 0 {
            let what = format!("it reports work positions (${STATUS_MASK}={mask})");
            return Err(unsuitable(what, format!("send ${STATUS_MASK}={}", mask | 1)));
        }
        let towards_negative = number(HOMING_TO_NEGATIVE)? as u8 >> offset & 1 == 1;
        let pull_off_mm = positive(PULL_OFF)?;
        let travel_mm = positive(TRAVEL + offset)? - pull_off_mm;
        let home_mm = match (home_is_origin, towards_negative) {
            (true, _) => 0.0,
            (false, true) => -travel_mm,
            (false, false) => -pull_off_mm,
        };
        let settings = AxisSettings {
            kinematics: Kinematics {
                velocity_mm_s: positive(RATE + offset)? / MINUTE_S,
                acceleration_mm_s2: positive(ACCELERATION + offset)?,
                step_mm: 1.0 / positive(STEPS_PER_MM + offset)?,
            },
            travel_mm,
            outwards: if towards_negative { 1.0 } else { -1.0 },
            homing_s: self.homing_s()?,
            least_homing_s: MINUTE_S * pull_off_mm / positive(HOMING_FEED)?,
            home_mm,
            notes: self.notes(),
        };
        if settings.travel_mm > 0.0 {
            Ok(settings)
        } else {
            let what =
                format!("its travel (${}) is shorter than the pull-off (${PULL_OFF})", TRAVEL + offset);
            Err(unsuitable(what, "set both to the values of the machine".to_owned()))
        }
    }

    /// Longest duration of homing: GRBL searches one and a half times the travel of each axis, the Z axis
    /// first.
    fn homing_s(&self) -> Result<f64, StageError> {
        let value = |number: u8| self.get(number).filter(|value| *value > 0.0).unwrap_or(1.0);
        let axes: f64 = (0..3).map(|axis| 1.5 * self.get(TRAVEL + axis).unwrap_or(0.0).max(0.0)).sum();
        let near = 4.0 * 5.0 * value(PULL_OFF);
        Ok(MINUTE_S * (axes / value(HOMING_SEEK) + near / value(HOMING_FEED)))
    }

    fn notes(&self) -> Vec<String> {
        let off = |number: u8| self.get(number) == Some(0.0);
        let mut notes = Vec::new();
        if off(SOFT_LIMITS) {
            notes.push(format!("its soft limits are off (${SOFT_LIMITS}=0): only epirig checks the travel"));
        }
        if off(HARD_LIMITS) {
            notes
                .push(format!("its hard limits are off (${HARD_LIMITS}=0): lost steps may run into the end"));
        }
        notes
    }
}

/// The facts that the driver needs of its axis.
#[derive(Debug, Clone)]
pub(super) struct AxisSettings {
    pub(super) kinematics: Kinematics,
    pub(super) travel_mm: f64,
    /// Sign of machine coordinates in the direction away from home.
    pub(super) outwards: f64,
    pub(super) homing_s: f64,
    /// Least duration of homing: its slow approach alone, in s.
    pub(super) least_homing_s: f64,
    /// Machine coordinate at the end of homing, in mm.
    pub(super) home_mm: f64,
    pub(super) notes: Vec<String>,
}
