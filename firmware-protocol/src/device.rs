//! The stage's side of the conversation.

use crate::axis::{Axis, HomingPlan, Snapshot};
use crate::frame::{Direction, Encoded, Event, FrameError, Received, Receiver, decode, encode};
use crate::message::{Identity, Outcome, PROTOCOL_VERSION, Refusal, Reply, Request, Settings, Status};
use crate::ramp::Ramp;

/// Shortest watchdog that a host can keep, in ms: it must be able to say a thing three times.
const SHORTEST_WATCHDOG_MS: u16 = 250;

const NM_PER_MM: i64 = 1_000_000;

/// What is fixed when the firmware is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Build {
    /// Number of the build.
    pub number: u32,
    /// Motor steps (microsteps) to a mm.
    pub steps_per_mm: u32,
    /// Positions go from 0 to this, in nm.
    pub travel_nm: i64,
    /// How often [`Axis::tick`] is called in a second.
    pub tick_hz: u32,
}

impl Build {
    /// The step nearest to a position.
    fn steps(&self, position_nm: i64) -> i32 {
        let scaled = position_nm * i64::from(self.steps_per_mm);
        ((scaled + NM_PER_MM / 2).div_euclid(NM_PER_MM)) as i32
    }

    fn position_nm(&self, steps: i32) -> i64 {
        let steps_per_mm = i64::from(self.steps_per_mm);
        (i64::from(steps) * NM_PER_MM + steps_per_mm / 2).div_euclid(steps_per_mm)
    }

    fn ramp(&self, velocity_nm_s: u32, acceleration_nm_s2: u32) -> Option<Ramp> {
        Ramp::new(velocity_nm_s, acceleration_nm_s2, self.steps_per_mm, self.tick_hz)
    }
}

/// Settings turned into what the axis counts in.
#[derive(Debug, Clone, Copy)]
struct Profile {
    travel: Ramp,
    homing: HomingPlan,
    watchdog_ticks: u32,
}

impl Profile {
    fn new(build: &Build, settings: &Settings) -> Option<Self> {
        let acceleration = settings.acceleration_nm_s2;
        let pull_off_steps = build.steps(settings.pull_off_nm.into()) as u32;
        // Home may be anywhere on the travel, and half as much again may be wrong with the stage's own figure.
        let search_steps = build.steps(build.travel_nm + build.travel_nm / 2) as u32;
        let profile = Self {
            travel: build.ramp(settings.velocity_nm_s, acceleration)?,
            homing: HomingPlan {
                seek: build.ramp(settings.seek_velocity_nm_s, acceleration)?,
                touch: build.ramp(settings.touch_velocity_nm_s, acceleration)?,
                search_steps: search_steps.saturating_add(pull_off_steps),
                pull_off_steps,
            },
            watchdog_ticks: (u64::from(settings.watchdog_ms) * u64::from(build.tick_hz) / 1000) as u32,
        };
        let whole_step = i64::from(settings.pull_off_nm) * i64::from(build.steps_per_mm) >= NM_PER_MM;
        let valid = whole_step
            && i64::from(settings.pull_off_nm) <= build.travel_nm
            && settings.watchdog_ms >= SHORTEST_WATCHDOG_MS;
        valid.then_some(profile)
    }
}

/// Access to an axis that a timer interrupt may be using.
pub trait SharedAxis {
    /// Runs `work` on the axis while no tick can happen.
    fn with<R>(&mut self, work: impl FnOnce(&mut Axis) -> R) -> R;
}

impl SharedAxis for Axis {
    fn with<R>(&mut self, work: impl FnOnce(&mut Axis) -> R) -> R {
        work(self)
    }
}

/// The stage's side of the conversation: bytes in, frames out, orders to the axis.
#[derive(Debug, Clone)]
pub struct Device {
    build: Build,
    settings: Settings,
    /// `None` if the defaults do not fit the build; then nothing moves until settings come that do.
    profile: Option<Profile>,
    boot_id: u32,
    receiver: Receiver,
    operation: u32,
    target_nm: i64,
    /// Sequence number of the running operation's request, until its end has been told.
    to_tell: Option<u8>,
}

impl Device {
    /// A device that has just booted. `boot_id` must differ from boot to boot.
    pub fn new(build: Build, boot_id: u32) -> Self {
        let settings = Settings::default();
        Self {
            build,
            settings,
            profile: Profile::new(&build, &settings),
            boot_id,
            receiver: Receiver::default(),
            operation: 0,
            target_nm: 0,
            to_tell: None,
        }
    }

    /// Takes a byte from the host; a frame that is to be sent comes back.
    pub fn receive(&mut self, byte: u8, axis: &mut impl SharedAxis) -> Option<Encoded> {
        let received = match self.receiver.push(byte)? {
            Event::EmergencyStop => {
                axis.with(Axis::emergency_stop);
                return None;
            }
            Event::Overlong => return None,
            Event::Payload(payload) => decode::<Request>(Direction::Request, payload),
        };
        match received {
            Ok(Received { sequence, message }) => {
                if let Some(profile) = &self.profile {
                    let ticks = profile.watchdog_ticks;
                    axis.with(|axis| axis.feed_watchdog(ticks));
                }
                let reply = self.answer(sequence, message, axis);
                encode(Direction::Reply, sequence, &reply)
            }
            Err(FrameError::Unknown { sequence }) => {
                encode(Direction::Reply, sequence, &Reply::Refused(Refusal::Unknown))
            }
            Err(_) => None,
        }
    }

    /// To be called often: a frame that is to be sent because an operation has ended.
    pub fn poll(&mut self, axis: &mut impl SharedAxis) -> Option<Encoded> {
        let sequence = self.to_tell?;
        let snapshot = axis.with(|axis| axis.snapshot());
        if snapshot.moving {
            return None;
        }
        self.to_tell = None;
        let finished = Reply::Finished {
            id: self.operation,
            outcome: snapshot.outcome,
            position_nm: self.build.position_nm(snapshot.position_steps),
        };
        encode(Direction::Reply, sequence, &finished)
    }

    fn answer(&mut self, sequence: u8, request: Request, axis: &mut impl SharedAxis) -> Reply {
        match request {
            Request::Hello { .. } => Reply::Hello(self.identity()),
            Request::Status => self.status(axis),
            Request::Heartbeat => {
                Reply::Alive { boot_id: self.boot_id, moving: axis.with(|axis| axis.snapshot().moving) }
            }
            Request::Stop => {
                axis.with(Axis::stop);
                self.status(axis)
            }
            Request::Home { id } => self.operate(sequence, id, None, axis),
            Request::Move { id, position_nm } => self.operate(sequence, id, Some(position_nm), axis),
            Request::ReadSettings => Reply::Settings(self.settings),
            Request::WriteSettings(settings) => self.set(settings, axis),
        }
    }

    fn identity(&self) -> Identity {
        Identity {
            version: PROTOCOL_VERSION,
            build: self.build.number,
            steps_per_mm: self.build.steps_per_mm,
            travel_nm: self.build.travel_nm,
            boot_id: self.boot_id,
            last_operation: self.operation,
        }
    }

    fn status(&self, axis: &mut impl SharedAxis) -> Reply {
        let Snapshot { position_steps, moving, homed, limits, fault, outcome, home_shift_steps } =
            axis.with(|axis| axis.snapshot());
        Reply::Status(Status {
            boot_id: self.boot_id,
            position_nm: self.build.position_nm(position_steps),
            moving,
            homed,
            limits: u8::from(limits.home) | u8::from(limits.far) << 1,
            fault,
            operation: self.operation,
            outcome,
            home_shift_nm: self.build.position_nm(home_shift_steps),
        })
    }

    /// Starts a move, or homing if there is no position, unless the id says that it has been started before.
    fn operate(
        &mut self,
        sequence: u8,
        id: u32,
        position_nm: Option<i64>,
        axis: &mut impl SharedAxis,
    ) -> Reply {
        if id == self.operation && id != 0 {
            return Reply::Accepted { id, target_nm: self.target_nm };
        }
        if id < self.operation || id == 0 {
            return Reply::Refused(Refusal::StaleId);
        }
        let Some(profile) = self.profile else { return Reply::Refused(Refusal::BadSettings) };
        let snapshot = axis.with(|axis| axis.snapshot());
        if snapshot.moving {
            return Reply::Refused(Refusal::Busy);
        }
        match position_nm {
            None => axis.with(|axis| axis.begin_home(profile.homing)),
            Some(_) if !snapshot.homed => return Reply::Refused(Refusal::NotHomed),
            Some(position_nm) if !(0..=self.build.travel_nm).contains(&position_nm) => {
                return Reply::Refused(Refusal::OutsideTravel);
            }
            Some(position_nm) => {
                let target = self.build.steps(position_nm);
                axis.with(|axis| axis.begin_move(target, profile.travel));
            }
        }
        self.operation = id;
        self.target_nm = position_nm.unwrap_or(0);
        self.to_tell = Some(sequence);
        Reply::Accepted { id, target_nm: self.target_nm }
    }

    fn set(&mut self, settings: Settings, axis: &mut impl SharedAxis) -> Reply {
        if axis.with(|axis| axis.snapshot().outcome) == Outcome::Running {
            return Reply::Refused(Refusal::Busy);
        }
        let Some(profile) = Profile::new(&self.build, &settings) else {
            return Reply::Refused(Refusal::BadSettings);
        };
        (self.settings, self.profile) = (settings, Some(profile));
        Reply::Settings(settings)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::axis::{Limits, Way};

    const BUILD: Build = Build { number: 1, steps_per_mm: 250, travel_nm: 200_000_000, tick_hz: 10_000 };

    struct Rig {
        device: Device,
        axis: Axis,
        carriage: i64,
        steps: u64,
        sequence: u8,
    }

    impl Rig {
        fn new() -> Self {
            Self {
                device: Device::new(BUILD, 5),
                axis: Axis::default(),
                carriage: 900,
                steps: 0,
                sequence: 0,
            }
        }

        fn ask(&mut self, request: Request) -> Reply {
            self.sequence = (self.sequence + 1) & 0x7F;
            let frame = encode(Direction::Request, self.sequence, &request).unwrap();
            let mut replies =
                frame.bytes().iter().filter_map(|&byte| self.device.receive(byte, &mut self.axis));
            let reply = replies.next().unwrap();
            assert!(replies.next().is_none());
            let received = open(&reply);
            assert_eq!(received.sequence, self.sequence);
            received.message
        }

        fn tick(&mut self) {
            match self.axis.tick(Limits { home: self.carriage <= 0, far: false }) {
                Some(Way::Out) => self.carriage += 1,
                Some(Way::Home) => self.carriage -= 1,
                None => return,
            }
            self.steps += 1;
        }

        /// Runs until the device tells the end of an operation.
        fn finish(&mut self) -> Reply {
            for _ in 0..1_000_000 {
                self.axis.feed_watchdog(100);
                self.tick();
                if let Some(frame) = self.device.poll(&mut self.axis) {
                    assert!(self.device.poll(&mut self.axis).is_none(), "told once");
                    return open(&frame).message;
                }
            }
            panic!("never finished");
        }

        fn home(&mut self) {
            assert_eq!(self.ask(Request::Home { id: 1 }), Reply::Accepted { id: 1, target_nm: 0 });
            let finished = self.finish();
            assert_eq!(finished, Reply::Finished { id: 1, outcome: Outcome::Done, position_nm: 0 });
        }
    }

    fn open(frame: &Encoded) -> Received<Reply> {
        let mut payload = frame.bytes()[1..frame.bytes().len() - 1].to_vec();
        decode(Direction::Reply, &mut payload).unwrap()
    }

    #[test]
    fn an_id_runs_once_however_often_it_arrives() {
        let mut rig = Rig::new();
        rig.home();
        let request = Request::Move { id: 2, position_nm: 1_500_000 };
        let accepted = Reply::Accepted { id: 2, target_nm: 1_500_000 };
        let before = rig.steps;
        assert_eq!(rig.ask(request), accepted);
        (0..1000).for_each(|_| rig.tick());
        assert_eq!(rig.ask(request), accepted);
        // Even if it asks for something else: another target would be run if the id were.
        let other = Request::Move { id: 2, position_nm: 9_000_000 };
        assert_eq!(rig.ask(other), accepted);
        let finished = Reply::Finished { id: 2, outcome: Outcome::Done, position_nm: 1_500_000 };
        assert_eq!(rig.finish(), finished);
        assert_eq!(rig.ask(request), accepted);
        assert_eq!(rig.ask(other), accepted);
        assert_eq!(rig.ask(Request::Home { id: 2 }), accepted);
        assert_eq!(
            rig.ask(Request::Move { id: 1, position_nm: 9_000_000 }),
            Reply::Refused(Refusal::StaleId)
        );
        assert_eq!(
            rig.ask(Request::Move { id: 0, position_nm: 9_000_000 }),
            Reply::Refused(Refusal::StaleId)
        );
        (0..100_000).for_each(|_| rig.tick());
        assert_eq!(rig.steps - before, 375);
    }

    #[test]
    fn what_must_not_happen_is_refused() {
        let mut rig = Rig::new();
        let refused = |refusal| Reply::Refused(refusal);
        assert_eq!(rig.ask(Request::Move { id: 1, position_nm: 0 }), refused(Refusal::NotHomed));
        rig.home();
        for position_nm in [-1, BUILD.travel_nm + 1, i64::MAX, i64::MIN] {
            assert_eq!(rig.ask(Request::Move { id: 2, position_nm }), refused(Refusal::OutsideTravel));
        }
        rig.ask(Request::Move { id: 2, position_nm: BUILD.travel_nm });
        assert_eq!(rig.ask(Request::Move { id: 3, position_nm: 0 }), refused(Refusal::Busy));
        assert_eq!(rig.ask(Request::WriteSettings(Settings::default())), refused(Refusal::Busy));
        rig.ask(Request::Stop);
        assert!(matches!(rig.finish(), Reply::Finished { id: 2, outcome: Outcome::Stopped, .. }));
        let wrong = [
            Settings { velocity_nm_s: 0, ..Settings::default() },
            Settings { velocity_nm_s: 4_000_000_000, ..Settings::default() },
            Settings { pull_off_nm: 3999, ..Settings::default() },
            Settings { pull_off_nm: u32::MAX, ..Settings::default() },
            Settings { watchdog_ms: 249, ..Settings::default() },
        ];
        for settings in wrong {
            assert_eq!(rig.ask(Request::WriteSettings(settings)), refused(Refusal::BadSettings));
        }
        assert_eq!(rig.ask(Request::ReadSettings), Reply::Settings(Settings::default()));
    }

    #[test]
    fn hello_is_answered_whatever_the_version() {
        let mut rig = Rig::new();
        let Reply::Hello(identity) = rig.ask(Request::Hello { version: 999 }) else { panic!() };
        assert_eq!((identity.version, identity.steps_per_mm, identity.boot_id), (PROTOCOL_VERSION, 250, 5));
    }

    #[test]
    fn positions_round_to_the_nearest_step_and_nm() {
        // 3 steps/mm: 333333.3 nm a step.
        let build = Build { steps_per_mm: 3, ..BUILD };
        assert_eq!(
            [0, 1, 2, 3, -1].map(|steps| build.position_nm(steps)),
            [0, 333_333, 666_667, 1_000_000, -333_333]
        );
        assert_eq!([0, 166_666, 166_667, 500_001].map(|nm| build.steps(nm)), [0, 0, 1, 2]);
    }

    #[test]
    fn a_request_feeds_the_watchdog_and_noise_does_not() {
        let mut rig = Rig::new();
        rig.home();
        rig.ask(Request::Move { id: 2, position_nm: 100_000_000 });
        for _ in 0..20 {
            (0..2000).for_each(|_| rig.tick());
            assert_eq!(rig.ask(Request::Heartbeat), Reply::Alive { boot_id: 5, moving: true });
        }
        for byte in [0, 3, 9, 9, 0] {
            (0..2000).for_each(|_| rig.tick());
            assert!(rig.device.receive(byte, &mut rig.axis).is_none());
        }
        let Reply::Status(status) = rig.ask(Request::Status) else { panic!() };
        assert_eq!((status.moving, status.outcome), (false, Outcome::Failed));
        assert_eq!((status.fault, status.homed), (crate::message::Fault::Watchdog, true));
        assert_eq!(status.position_nm % 4000, 0);
    }
}
