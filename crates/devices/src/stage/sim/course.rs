//! The course of a move in real time: a trapezoid of velocity, which a stop may shorten.

use std::time::Duration;

use crate::stage::{Kinematics, StopSwitch, Urgency};

/// Time between two looks at the clock and the stop switch.
const SLICE: Duration = Duration::from_millis(10);

/// The planned course of a move.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Course {
    from_mm: f64,
    target_mm: f64,
    acceleration_mm_s2: f64,
    /// The largest velocity on the way, in mm/s.
    peak_mm_s: f64,
    duration: Duration,
}

/// The end of a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct End {
    /// Position of the motor, in mm.
    pub(super) at_mm: f64,
    /// Time since the start.
    pub(super) took: Duration,
    /// How urgent the stop was, if the move was stopped.
    pub(super) stopped: Option<Urgency>,
}

/// The deceleration after a stop.
#[derive(Debug, Clone, Copy)]
struct Braking {
    began: Duration,
    from_mm: f64,
    /// Velocity at the beginning, in mm/s; negative downwards.
    velocity_mm_s: f64,
    duration: Duration,
}

impl Course {
    /// The course from rest to rest.
    pub(super) fn new(kinematics: &Kinematics, from_mm: f64, target_mm: f64) -> Self {
        let Kinematics { velocity_mm_s, acceleration_mm_s2, .. } = *kinematics;
        let distance_mm = target_mm - from_mm;
        Self {
            from_mm,
            target_mm,
            acceleration_mm_s2,
            peak_mm_s: velocity_mm_s.min((acceleration_mm_s2 * distance_mm.abs()).sqrt()),
            duration: kinematics.duration(distance_mm),
        }
    }

    /// Position in mm and velocity in mm/s at a time since the start.
    fn at(&self, time: Duration) -> (f64, f64) {
        let left = self.duration.saturating_sub(time).as_secs_f64();
        let (time, acceleration) = (time.as_secs_f64(), self.acceleration_mm_s2);
        let outwards = (self.target_mm - self.from_mm).signum();
        let ramp = self.peak_mm_s / acceleration;
        if left <= ramp {
            (self.target_mm - outwards * acceleration * left * left / 2.0, outwards * acceleration * left)
        } else if time < ramp {
            (self.from_mm + outwards * acceleration * time * time / 2.0, outwards * acceleration * time)
        } else {
            (self.from_mm + outwards * self.peak_mm_s * (time - ramp / 2.0), outwards * self.peak_mm_s)
        }
    }

    fn brake(&self, began: Duration) -> Braking {
        let (from_mm, velocity_mm_s) = self.at(began);
        let duration = Duration::try_from_secs_f64(velocity_mm_s.abs() / self.acceleration_mm_s2);
        Braking { began, from_mm, velocity_mm_s, duration: duration.unwrap_or_default() }
    }

    fn braking_at(&self, braking: &Braking, time: Duration) -> f64 {
        let Braking { began, from_mm, velocity_mm_s, duration } = *braking;
        let seconds = time.saturating_sub(began).min(duration).as_secs_f64();
        let lost_mm_s = velocity_mm_s.signum() * self.acceleration_mm_s2 * seconds;
        from_mm + (velocity_mm_s - lost_mm_s / 2.0) * seconds
    }

    /// Follows the course until it ends or is stopped. `wait` waits for a time, and returns the time since
    /// the start; `pass` receives the positions on the way, in mm, with their times.
    pub(super) fn follow(
        &self,
        stop: &StopSwitch,
        mut wait: impl FnMut(Duration) -> Duration,
        mut pass: impl FnMut(f64, Duration),
    ) -> End {
        let (mut now, mut braking) = (Duration::ZERO, None);
        loop {
            let end =
                braking.as_ref().map_or(self.duration, |Braking { began, duration, .. }| *began + *duration);
            let took = now.min(end);
            let at_mm =
                braking.as_ref().map_or_else(|| self.at(took).0, |braking| self.braking_at(braking, took));
            pass(at_mm, took);
            let stopped = stop.pressed();
            if stopped == Some(Urgency::AtOnce) || took == end {
                return End { at_mm, took, stopped: stopped.or(braking.map(|_| Urgency::Soon)) };
            }
            if stopped.is_some() && braking.is_none() {
                braking = Some(self.brake(took));
                continue;
            }
            now = wait(SLICE.min(end - took));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINEMATICS: Kinematics = Kinematics { velocity_mm_s: 5.0, acceleration_mm_s2: 20.0, step_mm: 0.0 };

    /// Follows a course on a clock that is always `late` ms late, and presses `stop` at a time.
    fn followed(
        from_mm: f64,
        target_mm: f64,
        late: u64,
        press: Option<(u64, Urgency)>,
    ) -> (End, Vec<(f64, Duration)>) {
        let (stop, mut now, mut way) = (StopSwitch::default(), Duration::ZERO, Vec::new());
        let wait = |time: Duration| {
            now += time + Duration::from_millis(late);
            if let Some((_, urgency)) = press.filter(|(at, _)| now >= Duration::from_millis(*at)) {
                stop.press(urgency);
            }
            now
        };
        let course = Course::new(&KINEMATICS, from_mm, target_mm);
        let end = course.follow(&stop, wait, |at_mm, time| way.push((at_mm, time)));
        (end, way)
    }

    /// Distance after `time` in s of a move that takes `duration`, as a sum over its velocity.
    fn summed_mm(duration: f64, time: f64) -> f64 {
        let slice = 1e-5;
        let slices = (time / slice).round() as usize;
        let middles = (0..slices).map(|index| (index as f64 + 0.5) * slice);
        middles.map(|time| (20.0 * time).min(5.0).min(20.0 * (duration - time)) * slice).sum()
    }

    #[test]
    fn a_course_is_the_integral_of_its_velocity() {
        for (from_mm, target_mm, late, duration) in
            [(0.0, 10.0, 0, 2.25), (10.0, 9.55, 0, 0.3), (3.0, 3.002, 0, 0.02), (12.0, 2.0, 7, 2.25)]
        {
            let (end, way) = followed(from_mm, target_mm, late, None);
            assert_eq!((end.at_mm, end.stopped), (target_mm, None));
            assert!((end.took.as_secs_f64() - duration).abs() < 1e-6, "{end:?}");
            assert_eq!((way[0], way[way.len() - 1]), ((from_mm, Duration::ZERO), (target_mm, end.took)));
            assert!(way.len() as f64 > duration / 0.018, "{} places", way.len());
            for (at_mm, time) in way {
                let truth_mm = summed_mm(duration, time.as_secs_f64());
                assert!(((at_mm - from_mm).abs() - truth_mm).abs() < 1e-4, "{at_mm} mm at {time:?}");
            }
        }
        assert_eq!(followed(4.0, 4.0, 0, None).1, [(4.0, Duration::ZERO)]);
    }

    #[test]
    fn a_stop_takes_the_braking_distance() {
        for (from_mm, target_mm, sign) in [(0.0, 100.0, 1.0), (100.0, 0.0, -1.0)] {
            // After 2 s: 0.25 s of ramp, and 1.75 s at 5 mm/s.
            let (end, way) = followed(from_mm, target_mm, 0, Some((2000, Urgency::Soon)));
            let pressed_mm = from_mm + sign * (0.625 + 1.75 * 5.0);
            assert!((end.at_mm - (pressed_mm + sign * 5.0 * 5.0 / (2.0 * 20.0))).abs() < 1e-9, "{end:?}");
            assert_eq!((end.took, end.stopped), (Duration::from_millis(2250), Some(Urgency::Soon)));
            assert!(way.windows(2).all(|pair| (pair[1].0 - pair[0].0) * sign >= 0.0));
            let (end, _) = followed(from_mm, target_mm, 0, Some((2000, Urgency::AtOnce)));
            assert!((end.at_mm - pressed_mm).abs() < 1e-9, "{end:?}");
            assert_eq!(end.stopped, Some(Urgency::AtOnce));
        }
        // In the ramp upwards, after 0.1 s: 0.1 mm at 2 mm/s.
        let (end, _) = followed(0.0, 100.0, 0, Some((100, Urgency::Soon)));
        assert!((end.at_mm - 0.2).abs() < 1e-9 && end.took == Duration::from_millis(200), "{end:?}");
        // It slows down already, and cannot stop before the target.
        let (end, _) = followed(0.0, 1.25, 0, Some((400, Urgency::Soon)));
        assert!((end.at_mm - 1.25).abs() < 1e-9 && end.stopped == Some(Urgency::Soon), "{end:?}");
    }
}
