//! What the GRBL driver makes of a controller that other programs have used, on a line that loses answers.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use epirig_devices::link::{Link, SimulatedDevice, SimulatedLink};
use epirig_devices::stage::grbl::{AxisLetter, GrblOptions};
use epirig_devices::stage::simulator::GrblDevice;
use epirig_devices::stage::{GrblStage, Stage, StageError, WhenMoving};

type Shared = Arc<Mutex<GrblDevice>>;

fn connect_as(device: &Shared, options: GrblOptions) -> GrblStage {
    GrblStage::connect(Box::new(SimulatedLink::new(Arc::clone(device))), options).unwrap()
}

fn connect(device: &Shared) -> GrblStage {
    connect_as(device, GrblOptions::default())
}

fn homed() -> Shared {
    let device = Arc::new(Mutex::new(GrblDevice::default()));
    connect(&device).home().unwrap();
    device
}

/// Another program sends a line, and leaves after a while.
fn send(device: &Shared, line: &str, then: Duration) {
    let mut link = SimulatedLink::new(Arc::clone(device));
    link.send(format!("{line}\n").as_bytes()).unwrap();
    let until = link.now() + then;
    while link.now() < until {
        link.receive(&mut [0; 64], until - link.now()).unwrap();
    }
}

const MOMENT: Duration = Duration::from_millis(100);

#[test]
fn all_that_makes_a_position_makes_its_mark() {
    for change in ["$23=1", "$130=100", "$100=251", "$27=1.004", "$3=1", "$2=1", "$4=1", "$1=25"] {
        let device = homed();
        assert_eq!(connect(&device).position_mm(), Ok(0.0));
        send(&device, change, MOMENT);
        assert_eq!(connect(&device).position_mm(), Err(StageError::NotHomed), "{change}");
        // The old value does not bring it back after the motor was let go; else it means the same again.
        send(&device, "$1=255", MOMENT);
    }
    let device = homed();
    // Others do not matter: velocities, and the travel of another axis.
    send(&device, "$110=400", MOMENT);
    send(&device, "$132=20", MOMENT);
    assert_eq!(connect(&device).position_mm(), Ok(0.0));
    let y = GrblOptions { axis: AxisLetter::Y, ..GrblOptions::default() };
    assert_eq!(connect_as(&device, y).position_mm(), Err(StageError::NotHomed));
}

#[test]
fn a_stage_that_moves_is_waited_for_or_stopped_and_keeps_its_position() {
    for line in ["$J=G90X-41F500", "G0X-41"] {
        let device = homed();
        let plant = device.lock().unwrap().plant();
        let home = plant.carriage_steps();
        send(&device, line, Duration::from_secs(1));
        let mut stage = connect(&device);
        assert_eq!((stage.position_mm(), home - plant.carriage_steps()), (Ok(40.0), 10_000), "{line}");
        assert!(stage.notes().iter().any(|note| note.contains("it was moving")), "{:?}", stage.notes());

        send(&device, &line.replace("-41", "-2"), Duration::from_secs(1));
        let mut stage =
            connect_as(&device, GrblOptions { when_moving: WhenMoving::Stop, ..GrblOptions::default() });
        let stopped = home - plant.carriage_steps();
        assert!((2500..9900).contains(&stopped), "{line}: {stopped}");
        assert_eq!(stage.position_mm(), Ok(stopped as f64 / 250.0), "{line}");
    }
}

/// A controller of which each answer to a question is lost once.
struct Forgetful {
    device: Shared,
    line: Vec<u8>,
    deaf_for: Duration,
    asked: Vec<Vec<u8>>,
}

impl SimulatedDevice for Forgetful {
    fn receive(&mut self, byte: u8) {
        self.line.push(byte);
        if byte == b'?' || byte == b'\n' {
            let line = std::mem::take(&mut self.line);
            if !self.asked.contains(&line) {
                self.asked.push(line);
                self.deaf_for = Duration::from_millis(50);
            }
        }
        self.device.receive(byte);
    }

    fn advance(&mut self, time: Duration) {
        self.device.advance(time);
        self.deaf_for = self.deaf_for.saturating_sub(time);
    }

    fn take_sent(&mut self) -> Vec<u8> {
        let sent = self.device.take_sent();
        if self.deaf_for.is_zero() { sent } else { Vec::new() }
    }
}

#[test]
fn an_answer_that_is_lost_is_asked_for_again() {
    let device = homed();
    connect(&device).move_to(5.0).unwrap();
    let forgetful = Forgetful {
        device: Arc::clone(&device),
        line: Vec::new(),
        deaf_for: Duration::ZERO,
        asked: Vec::new(),
    };
    let mut stage =
        GrblStage::connect(Box::new(SimulatedLink::new(forgetful)), GrblOptions::default()).unwrap();
    assert_eq!(stage.position_mm(), Ok(5.0));
    stage.move_to(6.0).unwrap();
}

/// A controller on a line that damages one byte: it becomes another one, or is lost.
struct Damaged {
    device: Shared,
    sent: Arc<Mutex<Vec<u8>>>,
    nth: usize,
    becomes: Option<u8>,
}

impl SimulatedDevice for Damaged {
    fn receive(&mut self, byte: u8) {
        let mut sent = self.sent.lock().unwrap();
        sent.push(byte);
        let received = if sent.len() == self.nth + 1 { self.becomes } else { Some(byte) };
        received.into_iter().for_each(|byte| self.device.receive(byte));
    }

    fn advance(&mut self, time: Duration) {
        self.device.advance(time);
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.device.take_sent()
    }
}

#[test]
fn no_damaged_byte_while_connecting_begins_a_motion() {
    let fresh = || Arc::new(Mutex::new(GrblDevice::default()));
    for controller in [fresh, homed] {
        let damaged = |nth, becomes| {
            let (device, sent) = (controller(), Arc::default());
            let plant = device.lock().unwrap().plant();
            let before = plant.steps_made();
            let line = Damaged { device: Arc::clone(&device), sent: Arc::clone(&sent), nth, becomes };
            let _ = GrblStage::connect(Box::new(SimulatedLink::new(line)), GrblOptions::default());
            // Whatever was begun would go on.
            device.lock().unwrap().advance(Duration::from_secs(5));
            let sent = sent.lock().unwrap().clone();
            assert_eq!(plant.steps_made(), before, "{nth} becomes {becomes:?} of {sent:?}");
            sent
        };
        let sent = damaged(usize::MAX, None);
        assert!(sent.ends_with(b"$G\n$G\n"), "{}", sent.escape_ascii());
        for (nth, byte) in sent.iter().enumerate() {
            damaged(nth, None);
            (0..8).for_each(|bit| drop(damaged(nth, Some(byte ^ (1 << bit)))));
        }
    }
}

#[test]
fn settings_that_come_with_the_power_hold_from_homing_on() {
    let device = homed();
    let plant = device.lock().unwrap().plant();
    let mut stage = connect(&device);
    let before = stage.position_settings().unwrap();
    assert_eq!((before["$100"], before["$27"]), (250.0, 1.0));
    stage.home().unwrap();
    device.lock().unwrap().change_setting(100, 500.0);
    device.lock().unwrap().power_cycle();
    assert!(stage.move_to(10.0).is_err());
    stage.home().unwrap();
    let home = plant.carriage_steps();
    stage.move_to(10.0).unwrap();
    assert_eq!(home - plant.carriage_steps(), 5000);
    assert_eq!(stage.position_settings().unwrap()["$100"], 500.0);
    // What has changed them may have moved it.
    assert_eq!(stage.move_to(1.0), Err(StageError::NotHomed));
    // A setting that prevents a measurement is found then, too.
    device.lock().unwrap().change_setting(22, 0.0);
    let error = stage.home().unwrap_err().to_string();
    assert!(error.contains("$22=1"), "{error}");
}

/// A controller that says for ever that it moves, at one place.
#[derive(Default)]
struct Restless {
    asked: usize,
    sent: Vec<u8>,
}

impl SimulatedDevice for Restless {
    fn receive(&mut self, byte: u8) {
        match byte {
            b'?' => self.asked += 1,
            b'\n' => self.sent.extend(b"ok\r\n"),
            _ => {}
        }
    }

    fn advance(&mut self, _time: Duration) {
        let answer = b"<Run|MPos:1.000,0.000,0.000|FS:0,0>\r\n";
        (0..std::mem::take(&mut self.asked)).for_each(|_| self.sent.extend(answer));
    }

    fn take_sent(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.sent)
    }
}

#[test]
fn a_controller_that_never_rests_is_told_from_one_that_does_not_answer() {
    let link = Box::new(SimulatedLink::new(Restless::default()));
    let error = GrblStage::connect(link, GrblOptions::default()).err().unwrap().to_string();
    assert!(error.contains("it stays in state Run and obeys no reset"), "{error}");
    assert!(!error.contains("does not answer"), "{error}");
}
