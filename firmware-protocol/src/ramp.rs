//! The trapezoidal velocity profile, in integers.
//!
//! Time goes in ticks of a timer, distance in 2^-32 of a step. Each tick the velocity grows by the acceleration, stays,
//! or shrinks by it, and the distance grows by the velocity; a step is due whenever the distance passes the middle
//! between two steps. While the stage accelerates from rest, the distance after k ticks is therefore exactly
//! acceleration x k (k + 1) / 2: nothing is rounded after the start, and nothing drifts.

/// Distance of one step.
const STEP: u64 = 1 << 32;

/// No faster than a step in two ticks, so that a step's pulse and the gap after it each have a tick.
const FASTEST: u64 = STEP / 2;

/// Velocity and acceleration of a move, in the units of the profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ramp {
    /// In 2^-32 steps per tick.
    cruise: u32,
    /// In 2^-32 steps per tick per tick; never more than `cruise`.
    acceleration: u32,
    /// The largest multiple of the acceleration that is no more than `cruise`: the way down goes over the same velocities as
    /// the way up.
    below_cruise: u32,
}

impl Ramp {
    /// The profile for a velocity in nm/s and an acceleration in nm/s2, both rounded down to what the units can say.
    ///
    /// `None` if that is zero, faster than a step in two ticks, or beyond 2^46 in nm steps / (mm s).
    pub fn new(velocity_nm_s: u32, acceleration_nm_s2: u32, steps_per_mm: u32, tick_hz: u32) -> Option<Self> {
        if tick_hz == 0 {
            return None;
        }
        // Numerator x 2^32 / (nm per mm x ticks), in two goes that fit 64 bits.
        let nm_ticks = 1_000_000 * u64::from(tick_hz);
        let scaled = |value: u32| -> Option<u64> {
            let product = u64::from(value) * u64::from(steps_per_mm);
            let high = (product < 1 << 46).then_some(product << 18)?;
            Some(((high / nm_ticks) << 14) + ((high % nm_ticks) << 14) / nm_ticks)
        };
        let cruise = scaled(velocity_nm_s)?;
        let acceleration = scaled(acceleration_nm_s2)? / u64::from(tick_hz);
        let nm_steps_in_two_seconds = 2 * u64::from(velocity_nm_s) * u64::from(steps_per_mm);
        let keeps_pace = nm_steps_in_two_seconds <= 1_000_000 * u64::from(tick_hz);
        let valid = keeps_pace && (1..=FASTEST).contains(&cruise) && acceleration > 0;
        let acceleration = acceleration.min(cruise);
        valid.then(|| Self {
            cruise: cruise as u32,
            acceleration: acceleration as u32,
            below_cruise: (cruise / acceleration * acceleration) as u32,
        })
    }
}

/// A move under way: how much is left and how fast it goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    ramp: Ramp,
    steps_left: u32,
    /// Distance to the target.
    remaining: u64,
    /// Distance that slowing down to a stand takes, after a tick at the present velocity.
    braking: u64,
    velocity: u32,
    /// Distance since the last middle between two steps.
    phase: u32,
    stopping: bool,
}

impl Run {
    /// From rest, `steps` far.
    pub fn new(steps: u32, ramp: Ramp) -> Self {
        Self {
            ramp,
            steps_left: steps,
            remaining: u64::from(steps) << 32,
            braking: 0,
            velocity: 0,
            phase: 1 << 31,
            stopping: false,
        }
    }

    /// Slows down to a stand from here.
    pub fn stop(&mut self) {
        self.stopping = true;
    }

    /// Whether the stage stands: at the target, or where it was stopped.
    pub fn finished(&self) -> bool {
        self.complete() || (self.stopping && self.velocity == 0)
    }

    /// Whether all its steps are made.
    pub fn complete(&self) -> bool {
        self.steps_left == 0
    }

    /// One tick: whether a step is due.
    pub fn tick(&mut self) -> bool {
        if self.finished() {
            return false;
        }
        let Ramp { cruise, acceleration, below_cruise } = self.ramp;
        let coasting = self.braking + u64::from(self.velocity);
        // The sum could be larger than 32 bits; the difference cannot.
        let faster =
            if cruise - self.velocity >= acceleration { self.velocity + acceleration } else { cruise };
        if self.stopping || (self.velocity > acceleration && self.remaining < coasting) {
            let slower = self.velocity.saturating_sub(acceleration);
            self.velocity = if self.velocity > below_cruise { below_cruise } else { slower };
            self.braking -= u64::from(self.velocity).min(self.braking);
        } else if self.velocity == 0
            || (faster > self.velocity && self.remaining >= coasting + u64::from(faster))
        {
            self.braking += u64::from(self.velocity);
            self.velocity = faster;
        }
        self.remaining = self.remaining.saturating_sub(u64::from(self.velocity));
        let (phase, step) = self.phase.overflowing_add(self.velocity);
        self.phase = phase;
        if step {
            self.steps_left -= 1;
        }
        step
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use proptest::prelude::*;
    use std::vec::Vec;

    use super::*;

    const TICK_HZ: u32 = 10_000;

    /// Ticks at which the steps of a whole run come.
    fn step_ticks(mut run: Run) -> Vec<u64> {
        let mut ticks = Vec::new();
        for tick in 1..100_000_000 {
            if run.tick() {
                ticks.push(tick);
            }
            if run.finished() {
                return ticks;
            }
        }
        panic!("{run:?} never ends");
    }

    #[test]
    fn steps_come_when_the_closed_form_says() {
        // 250 steps/mm, 5 mm/s, 20 mm/s2: 1250 steps/s after 0.25 s and 156.25 steps; 5000 steps in all.
        let ramp = Ramp::new(5_000_000, 20_000_000, 250, TICK_HZ).unwrap();
        let ticks = step_ticks(Run::new(5000, ramp));
        assert_eq!(ticks.len(), 5000);
        let (velocity, acceleration, distance) = (1250.0_f64, 5000.0_f64, 5000.0_f64);
        let ramp_s = velocity / acceleration;
        let ramp_steps = 0.5 * acceleration * ramp_s * ramp_s;
        let total_s = 2.0 * ramp_s + (distance - 2.0 * ramp_steps) / velocity;
        for (index, &tick) in ticks.iter().enumerate() {
            let at = index as f64 + 0.5;
            let expected_s = if at < ramp_steps {
                (2.0 * at / acceleration).sqrt()
            } else if at < distance - ramp_steps {
                ramp_s + (at - ramp_steps) / velocity
            } else {
                total_s - (2.0 * (distance - at) / acceleration).sqrt()
            };
            // A tick to find the step in, and the rounding of the start: less than 2e-5 of the time gone by.
            let seconds = tick as f64 / f64::from(TICK_HZ);
            let bound = 3.0 / f64::from(TICK_HZ) + 2e-5 * expected_s;
            assert!((seconds - expected_s).abs() < bound, "step {index}: {seconds} s, {expected_s} s");
        }
    }

    #[test]
    fn what_cannot_be_kept_is_no_ramp() {
        assert_eq!(Ramp::new(0, 1_000_000, 250, TICK_HZ), None);
        assert_eq!(Ramp::new(1_000_000, 0, 250, TICK_HZ), None);
        assert_eq!(Ramp::new(1_000_000, 1_000_000, 250, 0), None);
        // 20 mm/s x 250 = 5000 steps/s is half a step a tick, the fastest there is.
        assert!(Ramp::new(20_000_000, 1_000_000_000, 250, TICK_HZ).is_some());
        assert_eq!(Ramp::new(20_000_001, 1_000_000_000, 250, TICK_HZ), None);
        assert_eq!(Ramp::new(u32::MAX, u32::MAX, u32::MAX, TICK_HZ), None);
    }

    #[test]
    fn the_cruise_velocity_is_reached_whatever_the_acceleration() {
        // 0.1 mm/s and 400 mm/s2 at 250 steps/mm: the acceleration of four ticks is just not the whole velocity.
        for (velocity, acceleration) in
            [(100_000, 400_000_000), (5_000_000, u32::MAX), (20_000_000, u32::MAX)]
        {
            let ramp = Ramp::new(velocity, acceleration, 250, TICK_HZ).unwrap();
            let ticks = step_ticks(Run::new(1000, ramp));
            let rate_hz = f64::from(velocity) * 250.0 / 1e6;
            let expected = 800.0 / rate_hz * f64::from(TICK_HZ);
            let taken = (ticks[900] - ticks[100]) as f64;
            assert!((taken - expected).abs() <= 2.0 + 2e-5 * expected, "{taken} ticks, {expected} expected");
        }
        let dense = Ramp::new(400_000, u32::MAX, 12_500, TICK_HZ).unwrap();
        assert_eq!(step_ticks(Run::new(100, dense)).len(), 100);
    }

    proptest! {
        #[test]
        fn a_run_makes_its_steps_and_is_symmetric(
            steps in 1_u32..3000, velocity in 100_000_u32..20_000_000, acceleration in 2_000_000_u32..2_000_000_000,
        ) {
            let ramp = Ramp::new(velocity, acceleration, 250, TICK_HZ).unwrap();
            let ticks = step_ticks(Run::new(steps, ramp));
            prop_assert_eq!(ticks.len(), steps as usize);
            // Never faster than the cruise velocity, which is at most half a step a tick.
            let fastest = ticks.windows(2).map(|pair| pair[1] - pair[0]).min().unwrap_or(u64::MAX);
            prop_assert!(fastest >= STEP / u64::from(ramp.cruise));
            // The last step comes no faster after its neighbour than the first gap, but for a tick of rounding at
            // either end: the stage is as slow at the end as it was at the start.
            if let ([first, second, ..], [.., before, last]) = (&ticks[..], &ticks[..]) {
                prop_assert!(last - before + 3 >= second - first, "{:?}", (first, second, before, last));
            }
        }

        #[test]
        fn a_stop_takes_no_longer_than_from_full_speed(
            after in 1_u32..20_000, velocity in 100_000_u32..20_000_000, acceleration in 2_000_000_u32..2_000_000_000,
        ) {
            let ramp = Ramp::new(velocity, acceleration, 250, TICK_HZ).unwrap();
            let mut run = Run::new(1_000_000, ramp);
            for _ in 0..after {
                run.tick();
            }
            run.stop();
            let most = ramp.cruise / ramp.acceleration + 1;
            let mut ticks = 0;
            while !run.finished() {
                run.tick();
                ticks += 1;
                prop_assert!(ticks <= most);
            }
        }
    }
}
