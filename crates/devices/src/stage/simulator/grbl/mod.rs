//! A simulated stage with GRBL 1.1, modelled on a recording of GRBL 1.1h.
//!
//! The X axis is a carriage with switches; Y and Z are numbers only. Everything that matters to a driver is
//! modelled: `ok` means accepted, the planner's queue, `G4 P0` as a barrier, hold and resume, alarms after
//! which it does not respond, the stale `ok` before the banner, silence during homing.

mod command;
mod modal;
mod motion;
mod settings;

use std::collections::VecDeque;
use std::time::Duration;

use super::{Body, FaultScript, Mishap, Plant};
use crate::link::SimulatedDevice;
use modal::Modal;
use motion::Motion;
use settings::{AXES, Table};

/// Longest line, without its end.
const LONGEST_LINE: usize = 79;
/// Silence after an alarm.
const ALARM_SILENCE: Duration = Duration::from_millis(500);
/// Time from a reset to the banner.
const BOOT: Duration = Duration::from_millis(25);

/// Number of the setting of the X axis.
const STEPS_PER_MM: u8 = 100;

/// Position of the high switch above the start, and of the low switch below it, in steps.
const HIGH_SWITCH_AT: i64 = 2000;
const LOW_SWITCH_AT: i64 = -20_000;

/// Period of the rarer status fields, in reports, at rest and in motion (GRBL's `config.h`).
const OFFSET_EVERY: (u32, u32) = (10, 30);
const OVERRIDES_EVERY: (u32, u32) = (10, 20);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Idle,
    Run,
    Hold,
    Jog,
    Alarm,
    Home,
    /// After a critical alarm: only a reset is accepted.
    Locked,
}

/// The event that a line waits for before it is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Waiting {
    /// `G4`: the end of all motion.
    Motion,
    /// Room in the queue for a move.
    Room(motion::Block),
    /// `$H`.
    Homing,
    /// The hold after a move beyond the soft limits.
    SoftLimit,
}

/// A simulated GRBL 1.1 controller with a simulated carriage.
pub struct GrblDevice {
    table: Table,
    body: Body,
    state: State,
    motion: Motion,
    waiting: Option<Waiting>,
    line: Vec<u8>,
    lines: VecDeque<Vec<u8>>,
    modal: Modal,
    status_wanted: bool,
    offset_in: u32,
    overrides_in: u32,
    /// Time until it has booted, and the output before the banner.
    booting: Option<(Duration, &'static str)>,
    /// Time after an alarm until it asks for a reset.
    reset_hint_in: Option<Duration>,
    /// The line that caused an alarm is answered only at the reset.
    stale_ok: bool,
}

impl Default for GrblDevice {
    /// A stage of 60 mm with homing and limits, after power-up: locked until it is homed.
    fn default() -> Self {
        Self::new(FaultScript::default())
    }
}

impl GrblDevice {
    /// Length of a step with the initial settings, in mm.
    pub const STEP_MM: f64 = 0.004;

    /// Position of a carriage at `steps` of its [`Plant`], in mm from home, with the initial settings: homing
    /// moves upwards, and 1 mm (250 steps) down from the switch.
    pub fn mm_from_home(steps: i64) -> f64 {
        (HIGH_SWITCH_AT - 250 - steps) as f64 * Self::STEP_MM
    }

    /// The stage of [`GrblDevice::default`], with scripted faults.
    pub fn new(script: FaultScript) -> Self {
        let mut device = Self::factory(script);
        for (number, value) in
            [(20, 1.0), (21, 1.0), (22, 1.0), (24, 100.0), (130, 60.0), (131, 10.0), (132, 10.0)]
        {
            device.table.set(number, value);
        }
        device.state = State::Alarm;
        device
    }

    /// A controller with GRBL's own defaults (`DEFAULTS_GENERIC`): no homing, no limits, motors without
    /// current at rest.
    pub fn factory(script: FaultScript) -> Self {
        Self {
            table: Table::default(),
            body: Body::new(script, Self::STEP_MM, LOW_SWITCH_AT, HIGH_SWITCH_AT),
            state: State::Idle,
            motion: Motion::default(),
            waiting: None,
            line: Vec::new(),
            lines: VecDeque::new(),
            modal: Modal::default(),
            status_wanted: false,
            offset_in: 0,
            overrides_in: 0,
            booting: Some((BOOT, "")),
            reset_hint_in: None,
            stale_ok: false,
        }
    }

    /// The carriage and its switches.
    pub fn plant(&self) -> Plant {
        self.body.plant.clone()
    }

    /// Changes a setting, as another program does.
    pub fn change_setting(&mut self, number: u8, value: f64) {
        self.table.set(number, value);
    }

    /// Switches the power off and on. Settings are kept.
    pub fn power_cycle(&mut self) {
        self.motion = Motion::default();
        self.state = if self.table.on(22) { State::Alarm } else { State::Idle };
        self.boot_in(BOOT, "");
    }

    fn boot_in(&mut self, time: Duration, first: &'static str) {
        self.motion.halt();
        self.booting = Some((time, first));
        self.waiting = None;
        self.reset_hint_in = None;
        self.stale_ok = false;
        self.line.clear();
        self.lines.clear();
    }

    fn boot(&mut self) {
        self.modal = Modal::default();
        (self.offset_in, self.overrides_in, self.status_wanted) = (0, 0, false);
        self.say("");
        self.say("Grbl 1.1h ['$' for help]");
        if self.state == State::Alarm {
            self.say("[MSG:'$H'|'$X' to unlock]");
        }
    }

    fn say(&mut self, line: &str) {
        self.body.say(format!("{line}\r\n").as_bytes());
    }

    fn soft_reset(&mut self) {
        if self.booting.is_some() {
            return;
        }
        let stale = if self.stale_ok { "ok" } else { "" };
        match self.state {
            State::Run | State::Jog => self.alarm_and_boot("ALARM:3"),
            State::Hold if self.motion.moving() => self.alarm_and_boot("ALARM:3"),
            State::Home => self.alarm_and_boot("ALARM:6"),
            State::Locked | State::Alarm => {
                self.state = State::Alarm;
                self.boot_in(BOOT, stale);
            }
            State::Idle | State::Hold => {
                self.state = State::Idle;
                self.boot_in(BOOT, stale);
            }
        }
    }

    fn alarm_and_boot(&mut self, alarm: &str) {
        self.say(alarm);
        self.state = State::Alarm;
        // After a homing alarm the line is answered before the restart.
        let first = if alarm == "ALARM:9" { "ok" } else { "" };
        self.boot_in(ALARM_SILENCE + BOOT, first);
    }

    /// An alarm that only a reset ends.
    fn critical_alarm(&mut self, alarm: &str) {
        self.motion.halt();
        self.say(alarm);
        self.state = State::Locked;
        self.stale_ok = self.waiting.take().is_some();
        self.reset_hint_in = Some(ALARM_SILENCE);
        self.lines.clear();
    }

    fn real_time(&mut self, byte: u8) -> bool {
        match byte {
            0x18 => self.soft_reset(),
            b'?' => self.status_wanted = true,
            b'!' => self.hold(),
            b'~' => self.resume(),
            0x85 if self.state == State::Jog => self.motion.stop(),
            0x80.. => {}
            _ => return false,
        }
        true
    }

    fn hold(&mut self) {
        // A hold ends a jog for good.
        if self.state == State::Jog {
            self.motion.stop();
        }
        if matches!(self.state, State::Run | State::Idle) {
            self.motion.stop();
            self.state = State::Hold;
        }
    }

    fn resume(&mut self) {
        if self.state == State::Hold && !self.motion.moving() {
            self.state = if self.motion.resume() { State::Run } else { State::Idle };
        }
    }

    fn report(&mut self) {
        let name = match self.state {
            State::Idle => "Idle",
            State::Run => "Run",
            State::Hold if self.motion.moving() => "Hold:1",
            State::Hold => "Hold:0",
            State::Jog => "Jog",
            State::Alarm | State::Locked => "Alarm",
            State::Home => "Home",
        };
        let busy = !matches!(self.state, State::Idle | State::Alarm | State::Locked);
        let triple = |values: [f64; AXES]| values.map(|value| format!("{value:.3}")).join(",");
        let mut text = format!(
            "<{name}|MPos:{}|FS:{:.0},0",
            triple(self.motion.position_mm(&self.table)),
            self.motion.feed()
        );
        let limits = self.body.plant.limits();
        if limits.home || limits.far {
            text += "|Pn:X";
        }
        let pick = |(rest, motion): (u32, u32)| if busy { motion } else { rest };
        if self.offset_in > 0 {
            self.offset_in -= 1;
        } else {
            self.offset_in = pick(OFFSET_EVERY) - 1;
            // Both never occur together.
            self.overrides_in = self.overrides_in.max(1);
            text += &format!("|WCO:{}", triple(self.modal.offset_mm));
        }
        if self.overrides_in > 0 {
            self.overrides_in -= 1;
        } else {
            self.overrides_in = pick(OVERRIDES_EVERY) - 1;
            text += "|Ov:100,100,100";
        }
        self.say(&format!("{text}>"));
    }

    fn tick(&mut self) {
        let limits = self.body.plant.limits();
        if self.state == State::Home {
            match self.motion.homing_tick(&self.table, &self.body.plant, limits) {
                None => {}
                Some(Ok(())) => self.homed(),
                Some(Err(alarm)) => self.alarm_and_boot(alarm),
            }
            return;
        }
        if self.motion.moving() && self.table.on(21) && (limits.home || limits.far) {
            return self.critical_alarm("ALARM:1");
        }
        self.motion.tick(&self.body.plant);
        if !self.motion.moving() {
            self.at_rest();
        }
    }

    fn homed(&mut self) {
        if self.status_wanted {
            self.status_wanted = false;
            self.report();
        }
        self.state = State::Idle;
        self.waiting = None;
        self.say("ok");
    }

    /// Motion has ended: a block is done, or there was none.
    fn at_rest(&mut self) {
        if matches!(self.state, State::Run | State::Jog) {
            self.body.move_ends();
            if self.motion.queue_is_empty() {
                self.state = State::Idle;
            }
        }
        match self.waiting {
            Some(Waiting::SoftLimit) => self.critical_alarm("ALARM:2"),
            Some(Waiting::Motion) if self.state == State::Idle && self.motion.queue_is_empty() => {
                self.waiting = None;
                self.say("ok");
            }
            _ => {}
        }
    }

    /// Starts the next block, and accepts lines until one has to wait.
    fn go_on(&mut self) {
        if let Some(Waiting::Room(block)) = self.waiting
            && self.motion.queue(block)
        {
            self.waiting = None;
            self.say("ok");
        }
        while self.waiting.is_none() && self.booting.is_none() && self.state != State::Locked {
            let Some(line) = self.lines.pop_front() else { break };
            self.execute(&line);
        }
        if matches!(self.state, State::Idle | State::Run | State::Jog)
            && !self.motion.moving()
            && let Some(jog) = self.motion.next_block(&self.table)
        {
            self.state = if jog { State::Jog } else { State::Run };
            self.body.count_move();
            if self.body.troubles.no_motion() {
                self.motion.pretend();
            }
        }
    }
}

impl SimulatedDevice for GrblDevice {
    fn receive(&mut self, byte: u8) {
        for byte in self.body.heard(byte) {
            if self.booting.is_some() || self.real_time(byte) {
                continue;
            }
            match byte {
                b'\n' | b'\r' => self.lines.push_back(std::mem::take(&mut self.line)),
                b' ' => {}
                // One extra byte is kept to detect that the line was too long.
                byte if self.line.len() <= LONGEST_LINE => self.line.push(byte.to_ascii_uppercase()),
                _ => {}
            }
        }
    }

    fn advance(&mut self, time: Duration) {
        match self.body.troubles.advance(time) {
            Some(Mishap::Reset) => self.power_cycle(),
            Some(Mishap::OtherSettings) => {
                // 251 instead of 250: so little that the picture does not show it.
                self.change_setting(STEPS_PER_MM, self.table.get(STEPS_PER_MM) * 1.004);
                self.power_cycle();
            }
            Some(Mishap::LimitCloses) => self.body.plant.press_switches(true),
            Some(Mishap::LimitOpens) => self.body.plant.press_switches(false),
            None => {}
        }
        if let Some((left, first)) = self.booting {
            match left.checked_sub(time).filter(|left| !left.is_zero()) {
                Some(left) => self.booting = Some((left, first)),
                None => {
                    self.booting = None;
                    if !first.is_empty() {
                        self.say(first);
                    }
                    self.boot();
                }
            }
            return;
        }
        if let Some(left) = self.reset_hint_in {
            self.reset_hint_in = left.checked_sub(time);
            if self.reset_hint_in.is_none() {
                self.say("[MSG:Reset to continue]");
            }
        }
        for _ in 0..self.body.ticks(time) {
            if self.booting.is_some() || self.state == State::Locked {
                break;
            }
            self.go_on();
            self.tick();
        }
        // It does not answer during homing or while locked.
        if self.status_wanted && !matches!(self.state, State::Home | State::Locked) && self.booting.is_none()
        {
            self.status_wanted = false;
            self.report();
        }
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.body.take_sent()
    }

    fn connected(&self) -> bool {
        self.body.troubles.connected()
    }
}
