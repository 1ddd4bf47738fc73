//! The moving part: steps, homing, limits, watchdog. Driven by a timer and by nothing else.
//!
//! [`Axis::tick`] is what the firmware's timer interrupt calls, and what the simulator calls as often as simulated
//! time demands. Everything else only says what the coming ticks are to do.

use crate::message::{Fault, Outcome};
use crate::ramp::{Ramp, Run};

/// A limit switch counts as closed or open after this many equal readings, one a tick: motors make noise.
pub const DEBOUNCE_TICKS: u8 = 4;

/// Which way a step goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Away from the home switch.
    Out,
    /// Towards the home switch.
    Home,
}

/// The limit switches as they are read.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// The switch at home is closed.
    pub home: bool,
    /// The switch at the far end is closed. A stage without one says `false`.
    pub far: bool,
}

/// How to home.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HomingPlan {
    /// Profile of the search for the switch.
    pub seek: Ramp,
    /// Profile of the approach that counts, and of what leads away from the switch.
    pub touch: Ramp,
    /// How far to search, in steps.
    pub search_steps: u32,
    /// From the place where the switch closes to position 0, in steps; at least 1.
    pub pull_off_steps: u32,
}

/// What there is to know of an axis at a moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Snapshot {
    /// Steps from home.
    pub position_steps: i32,
    /// Whether an operation runs.
    pub moving: bool,
    /// Whether the position is known.
    pub homed: bool,
    /// The limit switches, debounced.
    pub limits: Limits,
    /// Why the latest operation failed.
    pub fault: Fault,
    /// How the latest operation stands.
    pub outcome: Outcome,
    /// Where the latest homing found home, in steps by the count kept until then: what was lost or gained since the
    /// homing before. 0 if the position was not known before.
    pub home_shift_steps: i32,
}

/// The legs of homing, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leg {
    /// The switch is closed already: away from it.
    Release,
    Seek,
    BackOff,
    Touch,
    PullOff,
}

#[derive(Debug, Clone, Copy)]
enum Task {
    Rest,
    Move,
    Home(Leg, HomingPlan),
}

/// A switch with its noise taken off.
#[derive(Debug, Clone, Copy)]
struct Debounced {
    closed: bool,
    contrary: u8,
}

impl Debounced {
    fn read(&mut self, closed: bool) {
        self.contrary = if closed == self.closed { 0 } else { self.contrary + 1 };
        if self.contrary == DEBOUNCE_TICKS {
            *self = Self { closed, contrary: 0 };
        }
    }
}

/// One axis and what it is doing.
#[derive(Debug, Clone)]
pub struct Axis {
    position_steps: i32,
    homed: bool,
    home_switch: Debounced,
    far_switch: Debounced,
    task: Task,
    run: Option<Run>,
    way: Way,
    outcome: Outcome,
    fault: Fault,
    /// What the operation ends as once a decelerated stop is complete.
    stopping: Option<(Outcome, Fault)>,
    watchdog_ticks_left: u32,
    counted_before_homing: bool,
    home_shift_steps: i32,
}

impl Default for Axis {
    fn default() -> Self {
        Self::new()
    }
}

impl Axis {
    /// At rest, with an unknown position.
    pub const fn new() -> Self {
        const OPEN: Debounced = Debounced { closed: false, contrary: 0 };
        Self {
            position_steps: 0,
            homed: false,
            home_switch: OPEN,
            far_switch: OPEN,
            task: Task::Rest,
            run: None,
            way: Way::Out,
            outcome: Outcome::None,
            fault: Fault::None,
            stopping: None,
            watchdog_ticks_left: 0,
            counted_before_homing: false,
            home_shift_steps: 0,
        }
    }

    /// How it stands.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            position_steps: self.position_steps,
            moving: self.moving(),
            homed: self.homed,
            limits: Limits { home: self.home_switch.closed, far: self.far_switch.closed },
            fault: self.fault,
            outcome: self.outcome,
            home_shift_steps: self.home_shift_steps,
        }
    }

    fn moving(&self) -> bool {
        !matches!(self.task, Task::Rest)
    }

    /// Starts a move to `target_steps` from home; the caller has checked that the axis is homed and at rest, and that
    /// the target lies within the travel.
    pub fn begin_move(&mut self, target_steps: i32, ramp: Ramp) {
        let steps = target_steps.abs_diff(self.position_steps);
        self.begin(Task::Move);
        self.go(if target_steps < self.position_steps { Way::Home } else { Way::Out }, steps, ramp);
    }

    /// Starts homing; the caller has checked that the axis is at rest.
    pub fn begin_home(&mut self, plan: HomingPlan) {
        self.counted_before_homing = core::mem::take(&mut self.homed);
        let leg = if self.home_switch.closed { Leg::Release } else { Leg::Seek };
        self.begin_leg(leg, plan);
        self.begin(self.task);
    }

    fn begin(&mut self, task: Task) {
        self.task = task;
        self.outcome = Outcome::Running;
        self.fault = Fault::None;
        self.stopping = None;
    }

    fn go(&mut self, way: Way, steps: u32, ramp: Ramp) {
        self.way = way;
        self.run = Some(Run::new(steps, ramp));
    }

    fn begin_leg(&mut self, leg: Leg, plan: HomingPlan) {
        self.task = Task::Home(leg, plan);
        let twice = plan.pull_off_steps.saturating_mul(2);
        match leg {
            Leg::Release => self.go(Way::Out, twice, plan.touch),
            Leg::Seek => self.go(Way::Home, plan.search_steps, plan.seek),
            Leg::BackOff | Leg::PullOff => self.go(Way::Out, plan.pull_off_steps, plan.touch),
            Leg::Touch => self.go(Way::Home, twice, plan.touch),
        }
    }

    /// Slows down and stops; the operation ends as stopped.
    pub fn stop(&mut self) {
        self.slow_down(Outcome::Stopped, Fault::None);
    }

    fn slow_down(&mut self, outcome: Outcome, fault: Fault) {
        if let (None, Some(run)) = (self.stopping, &mut self.run) {
            run.stop();
            self.stopping = Some((outcome, fault));
        }
    }

    /// Stops dead. A motor that is stopped dead may slip, so an axis that was moving has lost its position.
    pub fn emergency_stop(&mut self) {
        if self.moving() {
            self.halt(Fault::EmergencyStop);
        }
    }

    fn halt(&mut self, fault: Fault) {
        self.homed = false;
        self.end(Outcome::Failed, fault);
    }

    fn end(&mut self, outcome: Outcome, fault: Fault) {
        (self.task, self.run, self.stopping) = (Task::Rest, None, None);
        (self.outcome, self.fault) = (outcome, fault);
    }

    /// The host was heard: the axis may move for so many ticks more.
    pub fn feed_watchdog(&mut self, ticks: u32) {
        self.watchdog_ticks_left = ticks;
    }

    /// One tick: reads the switches and says whether a step is due, and which way.
    pub fn tick(&mut self, limits: Limits) -> Option<Way> {
        self.home_switch.read(limits.home);
        self.far_switch.read(limits.far);
        if !self.moving() {
            return None;
        }
        self.watchdog_ticks_left = self.watchdog_ticks_left.saturating_sub(1);
        if self.watchdog_ticks_left == 0 {
            self.slow_down(Outcome::Failed, Fault::Watchdog);
        }
        self.mind_the_switches();
        let step = self.run.as_mut().is_some_and(Run::tick);
        if step {
            self.position_steps += if self.way == Way::Out { 1 } else { -1 };
        }
        let way = self.way;
        if self.run.is_some_and(|run| run.finished()) {
            self.arrive();
        }
        step.then_some(way)
    }

    fn mind_the_switches(&mut self) {
        let (home, far) = (self.home_switch.closed, self.far_switch.closed);
        match self.task {
            Task::Move if home || far => self.halt(Fault::HardLimit),
            Task::Home(..) if far && self.way == Way::Out => self.halt(Fault::HardLimit),
            // A stop under way ends the homing, and not beyond the switch: the position is unknown anyway.
            Task::Home(..) if home && self.way == Way::Home && self.stopping.is_some() => {
                let (outcome, fault) = self.stopping.unwrap_or_default();
                self.end(outcome, fault);
            }
            Task::Home(..) if self.stopping.is_some() => {}
            Task::Home(Leg::Release, plan) if !home => self.begin_leg(Leg::Seek, plan),
            Task::Home(Leg::Seek, plan) if home => self.begin_leg(Leg::BackOff, plan),
            Task::Home(Leg::Touch, plan) if home => self.begin_leg(Leg::PullOff, plan),
            _ => {}
        }
    }

    /// A run has come to its end.
    fn arrive(&mut self) {
        if let Some((outcome, fault)) = self.stopping {
            return self.end(outcome, fault);
        }
        let closed = self.home_switch.closed;
        match self.task {
            Task::Rest | Task::Move => self.end(Outcome::Done, Fault::None),
            Task::Home(Leg::Seek | Leg::Touch, _) => self.halt(Fault::SwitchNeverClosed),
            Task::Home(Leg::Release, _) => self.halt(Fault::SwitchNeverOpened),
            Task::Home(Leg::BackOff | Leg::PullOff, _) if closed => self.halt(Fault::SwitchNeverOpened),
            Task::Home(Leg::BackOff, plan) => self.begin_leg(Leg::Touch, plan),
            Task::Home(Leg::PullOff, _) => {
                self.home_shift_steps = if self.counted_before_homing { self.position_steps } else { 0 };
                (self.position_steps, self.homed) = (0, true);
                self.end(Outcome::Done, Fault::None);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_HZ: u32 = 10_000;
    const SWITCH: i64 = -700;

    /// An axis with a carriage whose home switch closes at [`SWITCH`] steps.
    struct Rig {
        axis: Axis,
        carriage: i64,
        far_at: i64,
        home_works: bool,
    }

    impl Rig {
        fn new() -> Self {
            Self { axis: Axis::default(), carriage: 40, far_at: 2000, home_works: true }
        }

        fn tick(&mut self) {
            let home = self.home_works && self.carriage <= SWITCH;
            match self.axis.tick(Limits { home, far: self.carriage >= self.far_at }) {
                Some(Way::Out) => self.carriage += 1,
                Some(Way::Home) => self.carriage -= 1,
                None => {}
            }
        }

        fn until_rest(&mut self) -> u32 {
            for ticks in 0..10_000_000 {
                if !self.axis.moving() {
                    return ticks;
                }
                self.axis.feed_watchdog(1000);
                self.tick();
            }
            panic!("never at rest");
        }

        fn home(&mut self) -> Snapshot {
            let seek = Ramp::new(4_000_000, 20_000_000, 250, TICK_HZ).unwrap();
            let touch = Ramp::new(400_000, 20_000_000, 250, TICK_HZ).unwrap();
            self.axis.begin_home(HomingPlan { seek, touch, search_steps: 3000, pull_off_steps: 100 });
            self.until_rest();
            self.axis.snapshot()
        }

        fn move_to(&mut self, target: i32) -> Snapshot {
            self.axis.begin_move(target, Ramp::new(4_000_000, 20_000_000, 250, TICK_HZ).unwrap());
            self.until_rest();
            self.axis.snapshot()
        }
    }

    #[test]
    fn home_is_pull_off_steps_from_the_switch_wherever_homing_began() {
        for start in [40, SWITCH - 3, SWITCH, SWITCH + 1, SWITCH + 50, 1900] {
            let mut rig = Rig { carriage: start, ..Rig::new() };
            (0..10).for_each(|_| rig.tick());
            let snapshot = rig.home();
            assert_eq!((snapshot.outcome, snapshot.homed, snapshot.position_steps), (Outcome::Done, true, 0));
            // At touch velocity (100 steps/s) the debouncing of 4 ticks is over before another step.
            assert_eq!(rig.carriage, SWITCH + 100, "from {start}");
        }
    }

    #[test]
    fn moves_end_where_they_should() {
        let mut rig = Rig::new();
        rig.home();
        for target in [375, 0, 1, 1000, 1000, 999] {
            let snapshot = rig.move_to(target);
            assert_eq!((snapshot.outcome, snapshot.position_steps), (Outcome::Done, target));
            assert_eq!(rig.carriage, SWITCH + 100 + i64::from(target));
        }
    }

    #[test]
    fn homing_again_tells_what_was_lost() {
        let mut rig = Rig::new();
        assert_eq!(rig.home().home_shift_steps, 0);
        rig.move_to(500);
        assert_eq!(rig.home().home_shift_steps, 0);
        rig.move_to(500);
        // Three steps upwards that the motor did not make: home is found three steps early.
        rig.carriage -= 3;
        assert_eq!(rig.home().home_shift_steps, 3);
    }

    #[test]
    fn a_hard_limit_stops_dead_and_loses_the_position() {
        let mut rig = Rig { far_at: 100, ..Rig::new() };
        rig.home();
        let snapshot = rig.move_to(2000);
        assert_eq!((snapshot.outcome, snapshot.fault), (Outcome::Failed, Fault::HardLimit));
        assert!(!snapshot.homed && snapshot.limits.far);
        // 1000 steps/s: less than a step in the debouncing time, and the one that closed the switch.
        assert!((100..=101).contains(&rig.carriage), "{}", rig.carriage);
    }

    #[test]
    fn a_switch_that_never_closes_or_never_opens_is_a_fault() {
        let mut rig = Rig { home_works: false, ..Rig::new() };
        assert_eq!(rig.home().fault, Fault::SwitchNeverClosed);
        assert_eq!(rig.carriage, 40 - 3000);
        let mut rig = Rig { carriage: SWITCH - 500, ..Rig::new() };
        (0..10).for_each(|_| rig.tick());
        assert_eq!(rig.home().fault, Fault::SwitchNeverOpened);
    }

    #[test]
    fn silence_slows_the_stage_down_and_keeps_the_position() {
        let mut rig = Rig::new();
        rig.home();
        rig.axis.begin_move(2000, Ramp::new(4_000_000, 20_000_000, 250, TICK_HZ).unwrap());
        rig.axis.feed_watchdog(5000);
        let mut ticks = 0;
        while rig.axis.moving() {
            rig.tick();
            ticks += 1;
        }
        // 0.5 s of watchdog, and 4 mm/s at 20 mm/s2 are 0.2 s.
        assert!((6990..=7010).contains(&ticks), "{ticks}");
        let snapshot = rig.axis.snapshot();
        assert_eq!((snapshot.fault, snapshot.homed), (Fault::Watchdog, true));
        assert_eq!(rig.carriage, SWITCH + 100 + i64::from(snapshot.position_steps));
    }

    #[test]
    fn a_stop_while_homing_does_not_go_beyond_the_switch() {
        let mut rig = Rig { carriage: SWITCH + 400, ..Rig::new() };
        let fast = Ramp::new(20_000_000, 20_000_000, 250, TICK_HZ).unwrap();
        rig.axis.begin_home(HomingPlan { seek: fast, touch: fast, search_steps: 3000, pull_off_steps: 100 });
        while rig.carriage > SWITCH + 1 {
            rig.axis.feed_watchdog(1000);
            rig.tick();
        }
        rig.axis.stop();
        rig.until_rest();
        assert_eq!((rig.axis.snapshot().outcome, rig.axis.snapshot().homed), (Outcome::Stopped, false));
        // 4 ticks of debouncing at half a step a tick, the most there is.
        assert!(rig.carriage >= SWITCH - 3, "{}", rig.carriage);
    }

    #[test]
    fn a_stop_keeps_the_position_and_an_emergency_stop_does_not() {
        let mut rig = Rig::new();
        rig.home();
        for emergency in [false, true] {
            rig.axis.begin_move(1900, Ramp::new(4_000_000, 20_000_000, 250, TICK_HZ).unwrap());
            rig.axis.feed_watchdog(100_000);
            (0..5000).for_each(|_| rig.tick());
            let before = rig.carriage;
            if emergency {
                rig.axis.emergency_stop()
            } else {
                rig.axis.stop()
            }
            rig.until_rest();
            let snapshot = rig.axis.snapshot();
            if emergency {
                assert_eq!((snapshot.fault, snapshot.homed), (Fault::EmergencyStop, false));
                assert_eq!(rig.carriage, before);
            } else {
                assert_eq!((snapshot.outcome, snapshot.homed), (Outcome::Stopped, true));
                assert_eq!(rig.carriage, SWITCH + 100 + i64::from(snapshot.position_steps));
            }
        }
        // At rest there is nothing to lose.
        rig.home();
        rig.axis.emergency_stop();
        assert!(rig.axis.snapshot().homed);
    }
}
