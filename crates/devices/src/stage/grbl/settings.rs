//! GRBL's `$$` settings that matter for a measurement.

use std::collections::BTreeMap;

use super::mark::homed_mark;
use crate::stage::{Kinematics, PositionSettings, StageError};

const MINUTE_S: f64 = 60.0;

/// Idle delay of the motors; 255 keeps them powered.
pub(super) const IDLE_DELAY: u8 = 1;
pub(super) const ALWAYS_POWERED: f64 = 255.0;

/// Masks of inverted signals: step, direction, enable.
const INVERTED: [u8; 3] = [2, 3, 4];
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

/// The settings of GRBL 1.1, but for those of a spindle.
const OF_EVERY_GRBL: [u8; 31] = [
    0, 1, 2, 3, 4, 5, 6, 10, 11, 12, 13, 20, 21, 22, 23, 24, 25, 26, 27, 100, 101, 102, 110, 111, 112, 120,
    121, 122, 130, 131, 132,
];

/// Axes of the largest controllers with this dialect.
pub(super) const MOST_AXES: usize = 6;

epirig_core::choices! {
    /// One of GRBL's axes.
    #[derive(Default)]
    pub enum AxisLetter {
        /// The first, as on a CNC shield.
        #[default]
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

/// The machine coordinate at which homing ends, which depends on how GRBL was built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum HomeIs {
    /// The pull-off within the travel, whose ends are 0 and minus `$130`.
    PullOff,
    /// 0 (`HOMING_FORCE_SET_ORIGIN`).
    Origin,
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
        home: HomeIs,
        port: &str,
    ) -> Result<AxisSettings, StageError> {
        let offset = axis.index() as u8;
        let unsuitable = |what: String, remedy: &str| StageError::unsuitable(port, what, remedy);
        let number = |number: u8| {
            let missing = format!("it does not report its setting ${number}");
            let remedy = "GRBL 1.1 does, so its firmware is another one: choose another --driver, or put GRBL 1.1 on it";
            self.get(number).ok_or_else(|| unsuitable(missing, remedy))
        };
        let positive = |of: u8| {
            let value = number(of)?;
            let remedy = format!("set ${of} to the value of the machine with `epirig stage console`");
            let usable = (value > 0.0).then_some(value);
            usable.ok_or_else(|| unsuitable(format!("its setting ${of} is {value}"), &remedy))
        };
        if number(HOMING)? == 0.0 {
            let remedy = format!("fit a limit switch and send ${HOMING}=1 with `epirig stage console`");
            return Err(unsuitable(format!("homing is switched off (${HOMING}=0)"), &remedy));
        }
        if number(REPORT_INCHES)? != 0.0 {
            let what = format!("it reports inches, rounded to 2.5 um (${REPORT_INCHES}=1)");
            return Err(unsuitable(what, &format!("send ${REPORT_INCHES}=0 with `epirig stage console`")));
        }
        let mask = number(STATUS_MASK)? as u8;
        if mask & 1 == 0 {
            let what = format!("it reports work positions (${STATUS_MASK}={mask})");
            let remedy = format!("send ${STATUS_MASK}={} with `epirig stage console`", mask | 1);
            return Err(unsuitable(what, &remedy));
        }
        let towards_negative = number(HOMING_TO_NEGATIVE)? as u8 >> offset & 1 == 1;
        let pull_off_mm = positive(PULL_OFF)?;
        let full_mm = positive(TRAVEL + offset)?;
        let steps_per_mm = positive(STEPS_PER_MM + offset)?;
        let (home_steps, travel_steps) =
            home_and_travel(full_mm, pull_off_mm, steps_per_mm, home, towards_negative);
        let settings = AxisSettings {
            kinematics: Kinematics {
                velocity_mm_s: positive(RATE + offset)? / MINUTE_S,
                acceleration_mm_s2: positive(ACCELERATION + offset)?,
                step_mm: 1.0 / steps_per_mm,
            },
            travel_mm: travel_steps as f64 / steps_per_mm,
            outwards: if towards_negative { 1 } else { -1 },
            steps_per_mm,
            home_steps,
            half_steps_mm: self.half_steps_mm(),
            soft_limit_mm: full_mm,
            // Coordinates are negative, unless home is their origin.
            side: if home == HomeIs::Origin && towards_negative { 1.0 } else { -1.0 },
            homing_s: self.homing_s(),
            least_homing_s: MINUTE_S * pull_off_mm / positive(HOMING_FEED)?,
            mark: homed_mark(&self.facts(axis, home)),
            notes: self.notes(),
        };
        if settings.travel_mm > 0.0 {
            Ok(settings)
        } else {
            let what =
                format!("its travel (${}) is shorter than the pull-off (${PULL_OFF})", TRAVEL + offset);
            Err(unsuitable(what, "set both to the values of the machine with `epirig stage console`"))
        }
    }

    /// All that gives a machine coordinate its place on the axis.
    fn facts(&self, axis: AxisLetter, home: HomeIs) -> String {
        let mut facts = format!("{} {home:?}", axis.letter());
        for number in of_positions(axis) {
            facts += &format!(" ${number}={:?}", self.get(number));
        }
        facts
    }

    /// The same of the settings alone, for a record.
    pub(super) fn of_positions(&self, axis: AxisLetter) -> PositionSettings {
        let known = of_positions(axis).filter_map(|number| Some((format!("${number}"), self.get(number)?)));
        known.collect()
    }

    /// The settings that differ from those of `before`, as `$3 was 0 and is 255`, except `except`. Of those
    /// that only one of the two readings has, nothing is known.
    pub(super) fn changes(&self, before: &Self, except: u8) -> Vec<String> {
        let both = before.values.iter().filter_map(|(number, was)| Some((*number, *was, self.get(*number)?)));
        let changed = both.filter(|(number, was, now)| *number != except && was != now);
        changed.map(|(number, was, now)| format!("${number} was {was} and is {now}")).collect()
    }

    fn half_steps_mm(&self) -> [f64; MOST_AXES] {
        let mut half_steps_mm = [0.0; MOST_AXES];
        for (half_step_mm, number) in half_steps_mm.iter_mut().zip(STEPS_PER_MM..) {
            *half_step_mm = self.get(number).filter(|steps| *steps > 0.0).map_or(0.0, |steps| 0.5 / steps);
        }
        half_steps_mm
    }

    /// Longest duration of homing: GRBL searches one and a half times the travel of each axis, the Z axis
    /// first.
    fn homing_s(&self) -> f64 {
        let value = |number: u8| self.get(number).filter(|value| *value > 0.0).unwrap_or(1.0);
        let axes: f64 = (0..3).map(|axis| 1.5 * self.get(TRAVEL + axis).unwrap_or(0.0).max(0.0)).sum();
        let near = 4.0 * 5.0 * value(PULL_OFF);
        MINUTE_S * (axes / value(HOMING_SEEK) + near / value(HOMING_FEED))
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

/// Numbers of the settings that give a machine coordinate its place on the axis.
fn of_positions(axis: AxisLetter) -> impl Iterator<Item = u8> {
    let offset = axis.index() as u8;
    let of_axis = [HOMING_TO_NEGATIVE, PULL_OFF, STEPS_PER_MM + offset, TRAVEL + offset];
    INVERTED.into_iter().chain(of_axis)
}

/// The settings of several readings, of which some lines may be damaged: a value counts once two readings
/// have it.
#[derive(Debug, Default)]
pub(super) struct Readings {
    /// Numbers, values, and the readings that have them.
    seen: Vec<(u8, f64, u32)>,
}

impl Readings {
    pub(super) fn add(&mut self, settings: &Settings) {
        for (&number, &value) in &settings.values {
            match self.seen.iter_mut().find(|(known, had, _)| (*known, *had) == (number, value)) {
                Some((.., readings)) => *readings += 1,
                None => self.seen.push((number, value, 1)),
            }
        }
    }

    /// The settings in force, once all are known that every GRBL 1.1 has.
    pub(super) fn confirmed(&self) -> Option<Settings> {
        let mut settings = Settings::default();
        for number in 0..=u8::MAX {
            let mut values: Vec<_> =
                self.seen.iter().filter(|(known, _, readings)| *known == number && *readings > 1).collect();
            values.sort_by_key(|(.., readings)| *readings);
            match values[..] {
                [] => {}
                [.., (.., second), (.., first)] if second == first => return None,
                [.., (_, value, _)] => settings.insert(number, *value),
            }
        }
        OF_EVERY_GRBL.iter().all(|number| settings.get(*number).is_some()).then_some(settings)
    }
}

/// Home and the length of the travel, in whole steps, as GRBL computes them in single precision
/// (`limits_go_home`, `system_check_travel_limits`).
fn home_and_travel(
    full_mm: f64,
    pull_off_mm: f64,
    steps_per_mm: f64,
    home: HomeIs,
    towards_negative: bool,
) -> (i64, i64) {
    let (full, pull_off, steps_per) = (full_mm as f32, pull_off_mm as f32, steps_per_mm as f32);
    let whole_steps = |mm: f64| (mm * steps_per_mm + WHOLE_WITHIN).floor() as i64;
    match (home, towards_negative) {
        (HomeIs::Origin, _) => (0, whole_steps(full_mm - pull_off_mm)),
        (HomeIs::PullOff, true) => {
            let home_steps = ((pull_off - full) * steps_per).round() as i64;
            (home_steps, -home_steps)
        }
        (HomeIs::PullOff, false) => {
            let home_steps = (-pull_off * steps_per).round() as i64;
            (home_steps, whole_steps(full_mm) + home_steps)
        }
    }
}

/// Rounding of products in double precision, in steps.
const WHOLE_WITHIN: f64 = 1e-6;

/// The facts that the driver needs of its axis.
#[derive(Debug, Clone)]
pub(super) struct AxisSettings {
    pub(super) kinematics: Kinematics,
    /// From home to the last whole step within the soft limits.
    pub(super) travel_mm: f64,
    /// Sign of machine coordinates in the direction away from home.
    pub(super) outwards: i64,
    pub(super) steps_per_mm: f64,
    /// Machine coordinate at the end of homing, in steps.
    pub(super) home_steps: i64,
    /// Half a step of each axis.
    pub(super) half_steps_mm: [f64; MOST_AXES],
    /// Largest absolute machine coordinate within the soft limits.
    soft_limit_mm: f64,
    /// Sign of machine coordinates within the soft limits.
    side: f64,
    pub(super) homing_s: f64,
    /// Least duration of homing: its slow approach alone, in s.
    pub(super) least_homing_s: f64,
    /// The feed rate that marks the controller as homed with these settings.
    pub(super) mark: u32,
    pub(super) notes: Vec<String>,
}

impl AxisSettings {
    /// A machine coordinate in whole steps, which are all that the motor knows.
    pub(super) fn steps(&self, machine_mm: f64) -> i64 {
        (machine_mm * self.steps_per_mm).round() as i64
    }

    /// Position in mm from home of a machine coordinate in steps.
    pub(super) fn place_mm(&self, steps: i64) -> f64 {
        ((steps - self.home_steps) * self.outwards) as f64 / self.steps_per_mm
    }

    /// The step nearest to a position in mm from home.
    pub(super) fn target_steps(&self, place_mm: f64) -> i64 {
        self.home_steps + self.outwards * (place_mm * self.steps_per_mm).round() as i64
    }

    /// The machine coordinate to order for a step, in mm. At a soft limit it is a quarter of a step short:
    /// GRBL rounds it to the same step, but single precision may put the limit itself outside.
    pub(super) fn ordered_mm(&self, steps: i64) -> f64 {
        let quarter_mm = 0.25 / self.steps_per_mm;
        let depth_mm = self.side * steps as f64 / self.steps_per_mm;
        self.side * depth_mm.clamp(quarter_mm, (self.soft_limit_mm - quarter_mm).max(quarter_mm))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(steps_per_mm: f64, pull_off_mm: f64, to_negative: f64) -> AxisSettings {
        let mut settings = Settings::default();
        for (number, value) in [
            (HOMING, 1.0),
            (REPORT_INCHES, 0.0),
            (STATUS_MASK, 1.0),
            (HOMING_TO_NEGATIVE, to_negative),
            (HOMING_FEED, 100.0),
            (HOMING_SEEK, 500.0),
            (PULL_OFF, pull_off_mm),
            (STEPS_PER_MM, steps_per_mm),
            (RATE, 500.0),
            (ACCELERATION, 10.0),
            (TRAVEL, 60.0),
        ] {
            settings.insert(number, value);
        }
        settings.check(AxisLetter::X, HomeIs::PullOff, "port").unwrap()
    }

    #[test]
    fn home_and_the_end_are_whole_steps_within_the_soft_limits() {
        // 1.006 mm are 80.48 steps: GRBL stands at 80. The far limit, 60 mm, is step 4800.
        let upwards = settings(80.0, 1.006, 0.0);
        assert_eq!((upwards.home_steps, upwards.outwards, upwards.travel_mm), (-80, -1, 59.0));
        assert_eq!((upwards.place_mm(-80), upwards.place_mm(-480)), (0.0, 5.0));
        // 0.994 mm are 79.52 steps.
        let upwards = settings(80.0, 0.994, 0.0);
        assert_eq!((upwards.home_steps, upwards.travel_mm), (-80, 59.0));
        assert_eq!(upwards.target_steps(59.0), -4800);
        assert!(upwards.ordered_mm(-4800) > -60.0 && upwards.steps(upwards.ordered_mm(-4800)) == -4800);
        // 60 mm less 1.006 mm are 4719.52 steps.
        let downwards = settings(80.0, 1.006, 1.0);
        assert_eq!((downwards.home_steps, downwards.travel_mm), (-4720, 59.0));
        // 1600.02 steps: the limit itself is no whole step.
        let odd = settings(26.667, 1.0, 0.0);
        assert_eq!((odd.home_steps, odd.target_steps(odd.travel_mm)), (-27, -1600));
        assert!(odd.ordered_mm(-1600) > -60.0);
    }

    #[test]
    fn a_value_counts_once_two_readings_have_it() {
        let reading = |damaged: &[(u8, f64)], lost: u8| {
            let mut settings = Settings::default();
            let all = OF_EVERY_GRBL.into_iter().filter(|number| *number != lost);
            all.for_each(|number| settings.insert(number, f64::from(number)));
            damaged.iter().for_each(|(number, value)| settings.insert(*number, *value));
            settings
        };
        let mut readings = Readings::default();
        readings.add(&reading(&[(100, 1000.0)], 27));
        assert_eq!(readings.confirmed(), None);
        readings.add(&reading(&[(13, 130.0)], 0));
        readings.add(&reading(&[], 100));
        // $100 has been read right once, and wrong once.
        assert_eq!(readings.confirmed(), None);
        readings.add(&reading(&[(100, 1000.0)], 27));
        readings.add(&reading(&[], 27));
        // As often right as wrong.
        assert_eq!(readings.confirmed(), None);
        readings.add(&reading(&[(7, 0.0)], 10));
        assert_eq!(readings.confirmed(), Some(reading(&[], 7)));
    }

    #[test]
    fn the_mark_changes_with_all_that_makes_a_position() {
        let mark = settings(250.0, 1.0, 0.0).mark;
        assert_eq!(settings(250.0, 1.0, 0.0).mark, mark);
        for other in [settings(251.0, 1.0, 0.0), settings(250.0, 1.001, 0.0), settings(250.0, 1.0, 1.0)] {
            assert_ne!(other.mark, mark);
        }
    }
}
