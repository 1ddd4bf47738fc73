//! A simulated stage with the Zaber ASCII protocol.

use std::time::Duration;

use firmware_protocol::axis::Way;
use firmware_protocol::ramp::{Ramp, Run};

use super::script::{Mishap, Troubles};
use super::{FaultScript, Plant, TICK_HZ, Ticks};
use crate::link::SimulatedDevice;
use crate::stage::zaber::command;

/// Length of a microstep, in um.
const MICROSTEP_UM: f64 = 0.49609375;
/// Position of the sensor, in microsteps from the start position of the carriage.
const HOME_SENSOR_AT: i64 = -4000;
const TRAVEL_MICROSTEPS: i64 = 302_362;
/// In the protocol's units: 2 mm/s, and 100 mm/s2.
const MAX_SPEED: f64 = 6605.0;
const ACCELERATION: f64 = 33.0;
const LONGEST: usize = 120;

/// A stage of 150 mm with a home sensor at its low end.
pub struct ZaberDevice {
    plant: Plant,
    troubles: Troubles,
    position: i64,
    referenced: bool,
    stalled: bool,
    interrupted: bool,
    low_voltage: bool,
    /// Microsteps per step.
    resolution: u32,
    run: Option<(Run, Way)>,
    homing: bool,
    checksums: bool,
    line: Vec<u8>,
    ticks: Ticks,
    sent: Vec<u8>,
}

impl Default for ZaberDevice {
    fn default() -> Self {
        Self::new(FaultScript::default())
    }
}

impl ZaberDevice {
    /// Length of a microstep of this stage, in um.
    pub const MICROSTEP_UM: f64 = MICROSTEP_UM;

    /// Position of a carriage at `steps` of its [`Plant`], in mm from home.
    pub fn mm_from_home(steps: i64) -> f64 {
        (steps - HOME_SENSOR_AT) as f64 * MICROSTEP_UM / 1000.0
    }

    /// A stage after power-up, with scripted faults.
    pub fn new(script: FaultScript) -> Self {
        let troubles = Troubles::new(script);
        let plant = Plant::new(HOME_SENSOR_AT, TRAVEL_MICROSTEPS);
        plant.set_switches_work(troubles.switches_work());
        Self {
            plant,
            troubles,
            position: 0,
            referenced: false,
            stalled: false,
            interrupted: false,
            low_voltage: false,
            resolution: 64,
            run: None,
            homing: false,
            checksums: false,
            line: Vec::new(),
            ticks: Ticks::default(),
            sent: Vec::new(),
        }
    }

    /// The carriage and its switches.
    pub fn plant(&self) -> Plant {
        self.plant.clone()
    }

    fn ramp() -> Option<Ramp> {
        let nm_per_microstep = 1000.0 * MICROSTEP_UM;
        let velocity = (MAX_SPEED / 1.6384 * nm_per_microstep) as u32;
        let acceleration = (ACCELERATION / 1.6384 * 10_000.0 * nm_per_microstep) as u32;
        Ramp::new(velocity, acceleration, (1000.0 / MICROSTEP_UM) as u32, TICK_HZ)
    }

    fn begin(&mut self, target: i64) {
        let way = if target > self.position { Way::Out } else { Way::Home };
        let steps = u32::try_from(target.abs_diff(self.position)).unwrap_or(u32::MAX);
        self.run = Self::ramp().map(|ramp| (Run::new(steps, ramp), way));
        self.interrupted = false;
    }

    fn obey(&mut self, line: &str) {
        // `/device axis id words`; a wrong checksum gets no answer.
        let Some(inside) = line.strip_prefix('/') else { return };
        let words = match inside.rsplit_once(':') {
            Some((words, sum)) => {
                let mut parts = words.splitn(4, ' ').map(str::to_owned);
                let (Some(device), Some(axis), Some(id)) = (parts.next(), parts.next(), parts.next()) else {
                    return;
                };
                let (Ok(device), Ok(axis), Ok(id)) = (device.parse(), axis.parse(), id.parse()) else {
                    return;
                };
                if !command(device, axis, id, &parts.next().unwrap_or_default()).trim_end().ends_with(sum)
                    || sum.len() != 2
                {
                    return;
                }
                words
            }
            None => inside,
        };
        let mut parts = words.splitn(4, ' ');
        let (Some("1" | "01"), Some(axis), Some(id)) = (parts.next(), parts.next(), parts.next()) else {
            return;
        };
        let answer = self.execute(parts.next().unwrap_or_default());
        let (verdict, data) = match answer {
            Ok(data) => ("OK", data),
            Err(reason) => ("RJ", reason.to_owned()),
        };
        let state = if self.run.is_some() { "BUSY" } else { "IDLE" };
        let warnings = self.warnings();
        let warning = warnings.split(' ').nth(1).unwrap_or("--");
        let inside = format!("01 {axis} {id:0>2} {verdict} {state} {warning} {data}");
        let sum = inside.bytes().fold(0_u8, u8::wrapping_sub);
        let end = if self.checksums { format!(":{sum:02X}") } else { String::new() };
        if !self.troubles.muted() && self.troubles.connected() {
            self.sent.extend(format!("@{inside}{end}\r\n").bytes());
        }
    }

    /// Number and names of active warnings, the highest priority first.
    fn warnings(&self) -> String {
        let all = [
            (self.stalled, "FS"),
            (self.low_voltage, "WV"),
            (!self.referenced, "WR"),
            (self.interrupted, "NI"),
        ];
        let names: Vec<&str> = all.iter().filter(|(on, _)| *on).map(|(_, name)| *name).collect();
        format!("{:02} {}", names.len(), names.join(" ")).trim_end().to_owned()
    }

    /// Sets a low supply voltage: a warning with priority over a lost reference.
    pub fn set_low_voltage(&mut self, low: bool) {
        self.low_voltage = low;
    }

    fn execute(&mut self, words: &str) -> Result<String, &'static str> {
        let done = Ok("0".to_owned());
        match words.split_whitespace().collect::<Vec<_>>()[..] {
            [] => done,
            ["set", "comm.checksum", value] => {
                self.checksums = value == "1";
                done
            }
            ["tools", "echo", message] => Ok(message.to_owned()),
            ["get", "device.id"] => Ok("50081".to_owned()),
            ["get", "version"] => Ok("7.28".to_owned()),
            ["get", "resolution"] => Ok(self.resolution.to_string()),
            ["get", "limit.min" | "limit.home.preset"] => Ok("0".to_owned()),
            ["get", "limit.max"] => Ok(TRAVEL_MICROSTEPS.to_string()),
            ["get", "maxspeed"] => Ok(format!("{MAX_SPEED}")),
            ["get", "accel"] => Ok(format!("{ACCELERATION}")),
            ["get", "pos"] => Ok(self.position.to_string()),
            ["warnings"] => Ok(self.warnings()),
            ["warnings", "clear"] => {
                let warnings = self.warnings();
                (self.stalled, self.interrupted) = (false, false);
                Ok(warnings)
            }
            ["home"] => {
                self.homing = true;
                self.begin(self.position - 2 * TRAVEL_MICROSTEPS);
                done
            }
            ["move", "abs", position] => {
                let target: i64 = position.parse().map_err(|_| "BADDATA")?;
                if !(0..=TRAVEL_MICROSTEPS).contains(&target) {
                    return Err("BADDATA");
                }
                // A command repeated while it runs has no effect.
                if self.run.is_none() {
                    self.troubles.move_begins();
                    self.plant.set_stalled(self.troubles.no_motion());
                }
                self.begin(target);
                done
            }
            ["stop"] => {
                if let Some((run, _)) = &mut self.run {
                    run.stop();
                    (self.interrupted, self.homing) = (true, false);
                }
                done
            }
            ["estop"] => {
                self.interrupted = self.run.take().is_some();
                self.homing = false;
                done
            }
            _ => Err("BADCOMMAND"),
        }
    }

    fn tick(&mut self) {
        if self.homing && self.plant.limits().home {
            (self.homing, self.run, self.referenced, self.position) = (false, None, true, 0);
        }
        let Some((run, way)) = &mut self.run else { return };
        if run.tick() {
            self.position += if *way == Way::Out { 1 } else { -1 };
            self.plant.step(*way);
        }
        if run.finished() {
            self.run = None;
            // Known from its encoder, or the end of the search.
            self.stalled = std::mem::take(&mut self.homing) || self.troubles.no_motion();
            self.troubles.move_ends();
        }
    }
}

impl SimulatedDevice for ZaberDevice {
    fn receive(&mut self, byte: u8) {
        if !self.troubles.connected() {
            return;
        }
        match byte {
            b'\r' | b'\n' => {
                let line = std::mem::take(&mut self.line);
                self.obey(&String::from_utf8_lossy(&line));
            }
            byte if self.line.len() < LONGEST => self.line.push(byte),
            _ => self.line.clear(),
        }
    }

    fn advance(&mut self, time: Duration) {
        match self.troubles.advance(time) {
            Some(mishap @ (Mishap::Reset | Mishap::OtherSettings)) => {
                self.resolution += u32::from(mishap == Mishap::OtherSettings);
                (self.run, self.referenced, self.position, self.homing) = (None, false, 0, false);
            }
            Some(Mishap::LimitCloses) => {
                (self.run, self.stalled) = (None, true);
            }
            Some(Mishap::LimitOpens) | None => {}
        }
        for _ in 0..self.ticks.pass(time) {
            self.tick();
        }
    }

    fn take_sent(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.sent)
    }

    fn connected(&self) -> bool {
        self.troubles.connected()
    }
}
