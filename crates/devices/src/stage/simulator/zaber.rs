//! A simulated stage with the Zaber ASCII protocol.

use std::time::Duration;

use firmware_protocol::axis::Way;
use firmware_protocol::ramp::{Ramp, Run};

use super::{Body, FaultScript, Mishap, Plant, TICK_HZ};
use crate::link::SimulatedDevice;
use crate::stage::zaber::checksum;

const MICROSTEP_UM: f64 = ZaberDevice::MICROSTEP_UM;
/// Position of the sensor, in microsteps from the start position of the carriage.
const HOME_SENSOR_AT: i64 = -4000;
const TRAVEL_MICROSTEPS: i64 = 302_362;
/// In the protocol's units: 2 mm/s, and 100 mm/s2.
const MAX_SPEED: f64 = 6605.0;
const ACCELERATION: f64 = 33.0;
const LONGEST: usize = 120;

/// A stage of 150 mm with a home sensor at its low end.
pub struct ZaberDevice {
    body: Body,
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
}

impl Default for ZaberDevice {
    fn default() -> Self {
        Self::new(FaultScript::default())
    }
}

impl ZaberDevice {
    /// Length of a microstep of this stage, in um.
    pub const MICROSTEP_UM: f64 = 0.49609375;

    /// Position of a carriage at `steps` of its [`Plant`], in mm from home.
    pub fn mm_from_home(steps: i64) -> f64 {
        (steps - HOME_SENSOR_AT) as f64 * MICROSTEP_UM / 1000.0
    }

    /// A stage after power-up, with scripted faults.
    pub fn new(script: FaultScript) -> Self {
        Self {
            body: Body::new(script, MICROSTEP_UM / 1000.0, HOME_SENSOR_AT, TRAVEL_MICROSTEPS),
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
        }
    }

    /// The carriage and its switches.
    pub fn plant(&self) -> Plant {
        self.body.plant.clone()
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
        let Some(inside) = line.strip_prefix('/') else { return };
        // A wrong checksum gets no answer.
        let text = match inside.rsplit_once(':') {
            Some((text, sum)) if u8::from_str_radix(sum, 16).is_ok_and(|sum| sum == checksum(text)) => text,
            Some(_) => return,
            None => inside,
        };
        let (numbers, words) = addressed(text);
        // Without a number, or with 0, every device is meant, and every axis.
        if !matches!(numbers[0], None | Some(0 | 1)) {
            return;
        }
        let (axis, id) = (numbers[1].unwrap_or(0), numbers[2]);
        let answer = if axis > 1 { Err("BADAXIS") } else { self.execute(words) };
        let (verdict, data) = match answer {
            Ok(data) => ("OK", data),
            Err(reason) => ("RJ", reason.to_owned()),
        };
        let state = if self.run.is_some() { "BUSY" } else { "IDLE" };
        let warnings = self.warnings();
        let warning = warnings.split(' ').nth(1).unwrap_or("--");
        let id = id.map_or(String::new(), |id| format!("{id:02} "));
        let inside = format!("01 {axis} {id}{verdict} {state} {warning} {data}");
        let end = if self.checksums { format!(":{:02X}", checksum(&inside)) } else { String::new() };
        self.body.say(format!("@{inside}{end}\r\n").as_bytes());
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
            [] | ["tools", "echo"] => done,
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
                    self.body.move_begins();
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
        if self.homing && self.body.plant.limits().home {
            (self.homing, self.run, self.referenced, self.position) = (false, None, true, 0);
        }
        let Some((run, way)) = &mut self.run else { return };
        if run.tick() {
            self.position += if *way == Way::Out { 1 } else { -1 };
            self.body.plant.step(*way);
        }
        if run.finished() {
            self.run = None;
            // Known from its encoder, or the end of the search.
            self.stalled = std::mem::take(&mut self.homing) || self.body.troubles.no_motion();
            self.body.move_ends();
        }
    }
}

/// Device, axis and message id, each if it is given, and the words of a command. No word of a command that may come
/// first is a number.
fn addressed(text: &str) -> ([Option<u8>; 3], &str) {
    /// The largest number of each.
    const MOST: u8 = 99;
    let (mut numbers, mut rest) = ([None; 3], text.trim_start());
    for number in &mut numbers {
        let (word, behind) = rest.split_once(' ').unwrap_or((rest, ""));
        let Some(found) = word.parse().ok().filter(|found| *found <= MOST) else { break };
        (*number, rest) = (Some(found), behind.trim_start());
    }
    (numbers, rest)
}

impl SimulatedDevice for ZaberDevice {
    fn receive(&mut self, byte: u8) {
        for byte in self.body.heard(byte) {
            match byte {
                b'\r' | b'\n' => {
                    let line = std::mem::take(&mut self.line);
                    self.obey(&String::from_utf8_lossy(&line));
                }
                byte if self.line.len() < LONGEST => self.line.push(byte),
                _ => self.line.clear(),
            }
        }
    }

    fn advance(&mut self, time: Duration) {
        match self.body.troubles.advance(time) {
            Some(mishap @ (Mishap::Reset | Mishap::OtherSettings)) => {
                self.resolution += u32::from(mishap == Mishap::OtherSettings);
                (self.run, self.referenced, self.position, self.homing) = (None, false, 0, false);
            }
            Some(Mishap::LimitCloses) => {
                (self.run, self.stalled) = (None, true);
            }
            Some(Mishap::LimitOpens) | None => {}
        }
        for _ in 0..self.body.ticks(time) {
            self.tick();
        }
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.body.take_sent()
    }

    fn connected(&self) -> bool {
        self.body.troubles.connected()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a homed stage at 0 answers to a line.
    fn answer(line: &str) -> String {
        let mut device = ZaberDevice { referenced: true, ..ZaberDevice::default() };
        format!("{line}\n").bytes().for_each(|byte| device.receive(byte));
        String::from_utf8(device.take_sent()).unwrap()
    }

    #[test]
    fn number_of_the_device_axis_and_message_id_may_be_left_out() {
        // Forms of the protocol manual.
        for (line, reply) in [
            ("/", "@01 0 OK IDLE -- 0\r\n"),
            ("/get pos", "@01 0 OK IDLE -- 0\r\n"),
            ("/1 get pos", "@01 0 OK IDLE -- 0\r\n"),
            ("/01 1 get pos", "@01 1 OK IDLE -- 0\r\n"),
            ("/1 1 7 get pos", "@01 1 07 OK IDLE -- 0\r\n"),
            ("/0 0 7 get version", "@01 0 07 OK IDLE -- 7.28\r\n"),
            ("/1 move abs 5000", "@01 0 OK BUSY -- 0\r\n"),
            ("/1 1 move abs 5000", "@01 1 OK BUSY -- 0\r\n"),
            ("/1 2 get pos", "@01 2 RJ IDLE -- BADAXIS\r\n"),
            ("/1 mov abs 5000", "@01 0 RJ IDLE -- BADCOMMAND\r\n"),
            // Another device of the chain is meant.
            ("/2 get pos", ""),
            ("get pos", ""),
            ("/1 tools echo x", "@01 0 OK IDLE -- x\r\n"),
            // The checksum of the manual's example, and a wrong one.
            ("/01 tools echo:8F", "@01 0 OK IDLE -- 0\r\n"),
            ("/01 tools echo:8E", ""),
        ] {
            assert_eq!(answer(line), reply, "{line}");
        }
    }
}
