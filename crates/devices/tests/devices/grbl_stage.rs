//! The GRBL driver against the simulator that passes the recorded session: moves, faults, and what the user reads.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use epirig_devices::link::{LineNoise, Link, LinkError, SimulatedDevice, SimulatedLink};
use epirig_devices::stage::grbl::{GrblOptions, alarm_text, error_text};
use epirig_devices::stage::simulator::{FaultScript, GrblDevice, Plant};
use epirig_devices::stage::{GrblStage, Stage, StageError, Urgency};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const STEPS_PER_MM: f64 = 250.0;

fn connect(device: impl SimulatedDevice + 'static) -> Result<GrblStage, StageError> {
    GrblStage::connect(Box::new(SimulatedLink::new(device)), GrblOptions::default())
}

fn homed(script: &str) -> (GrblStage, Plant, i64) {
    let device = GrblDevice::new(script.parse().unwrap());
    let plant = device.plant();
    let mut stage = connect(device).unwrap();
    stage.home().unwrap();
    let home = plant.carriage_steps();
    (stage, plant, home)
}

#[test]
fn a_scan_ends_each_time_where_it_should() {
    let (mut stage, plant, home) = homed("");
    assert_eq!(stage.travel_mm(), 59.0);
    for index in 0..=39 {
        let position_mm = 1.5 * f64::from(index);
        stage.move_to(position_mm).unwrap();
        // It homes upwards, so the way out is downwards.
        assert_eq!(home - plant.carriage_steps(), i64::from(index) * 375);
        assert!((stage.position_mm().unwrap() - position_mm).abs() < 1e-9);
    }
    assert!(matches!(stage.move_to(59.1), Err(StageError::OutsideTravel { .. })));
}

#[test]
fn homing_downwards_works_as_well() {
    let device = Tampered::new(GrblDevice::default(), "", "");
    let plant = device.inner.plant();
    let mut link = SimulatedLink::new(device);
    link.receive(&mut [0; 256], Duration::from_millis(100)).unwrap();
    link.send(b"$23=7\n$130=100\n").unwrap();
    let mut stage = GrblStage::connect(Box::new(link), GrblOptions::default()).unwrap();
    stage.home().unwrap();
    let home = plant.carriage_steps();
    stage.move_to(12.5).unwrap();
    assert_eq!(plant.carriage_steps() - home, 3125);
}

#[test]
fn motors_that_let_go_are_told_to_hold_and_the_user_is_told() {
    let stage = connect(GrblDevice::default()).unwrap();
    assert!(stage.notes()[0].contains("$1 has been set to 255"), "{:?}", stage.notes());
    assert_eq!(stage.identity().to_string(), "GRBL 1.1h, axis X, 59 mm at simulated port");
}

#[test]
fn a_stage_that_cannot_home_is_refused_with_what_to_send() {
    let error = connect(GrblDevice::factory(FaultScript::default())).err().unwrap().to_string();
    assert!(
        error.contains(
            "homing is switched off ($22=0); fit a limit switch and send $22=1 with `epirig stage console`"
        ),
        "{error}"
    );
}

#[test]
fn who_connects_again_finds_the_position_as_long_as_it_is_known() {
    let device = Arc::new(Mutex::new(GrblDevice::default()));
    let mut stage = connect(Arc::clone(&device)).unwrap();
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    stage.home().unwrap();
    stage.move_to(7.5).unwrap();
    let mut stage = connect(Arc::clone(&device)).unwrap();
    assert_eq!(stage.position_mm(), Ok(7.5));
    stage.move_to(6.0).unwrap();
    device.lock().unwrap().power_cycle();
    let mut stage = connect(Arc::clone(&device)).unwrap();
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    // Unlocked by hand, not homed: GRBL says "Idle" all the same.
    let mut link = SimulatedLink::new(Arc::clone(&device));
    link.send(b"$X\n").unwrap();
    let mut stage = GrblStage::connect(Box::new(link), GrblOptions::default()).unwrap();
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
}

#[test]
fn work_offsets_move_nothing() {
    let device = Arc::new(Mutex::new(GrblDevice::default()));
    let plant = device.lock().unwrap().plant();
    connect(Arc::clone(&device)).unwrap().home().unwrap();
    let home = plant.carriage_steps();
    let mut link = SimulatedLink::new(device);
    link.send(b"G92 X12.3\n").unwrap();
    let mut stage = GrblStage::connect(Box::new(link), GrblOptions::default()).unwrap();
    stage.move_to(10.0).unwrap();
    assert_eq!(home - plant.carriage_steps(), 2500);
}

#[test]
fn an_ok_without_motion_is_noticed() {
    let (mut stage, _, _) = homed("no-motion@2");
    stage.move_to(10.0).unwrap();
    let error = stage.move_to(20.0).unwrap_err();
    assert!(matches!(error, StageError::TooFast { .. }), "{error}");
    // And one that says that it is still where it was.
    let mut stage = connect(Tampered::new(GrblDevice::default(), "$J=", "ok")).unwrap();
    stage.home().unwrap();
    let error = stage.move_to(20.0).unwrap_err();
    assert!(matches!(error, StageError::Disagrees { .. }), "{error}");
    assert_eq!(stage.move_to(20.0), Err(StageError::NotHomed));
}

/// A byte in fifty, and all after it, come up to 0.3 s late.
#[test]
fn an_ok_that_comes_late_is_no_ok_for_the_next_line() {
    let device = GrblDevice::default();
    let plant = device.plant();
    let mut noise = LineNoise::quiet(9);
    (noise.delay, noise.longest_delay) = (0.02, Duration::from_millis(300));
    let link = SimulatedLink::with_noise(device, &noise);
    let mut stage = GrblStage::connect(Box::new(link), GrblOptions::default()).unwrap();
    stage.home().unwrap();
    let home = plant.carriage_steps();
    for index in 1..=39_i64 {
        stage.move_to(1.5 * index as f64).unwrap();
        assert_eq!(home - plant.carriage_steps(), index * 375);
    }
}

#[test]
fn an_ok_lost_after_the_move_moves_nothing_twice() {
    let (mut stage, plant, home) = homed("mute@2/0.8s");
    let before = plant.steps_made();
    stage.move_to(10.0).unwrap();
    stage.move_to(20.0).unwrap();
    assert_eq!(home - plant.carriage_steps(), 5000);
    assert_eq!(plant.steps_made() - before, 5000);
}

#[test]
fn resets_limits_and_cables_in_mid_move_are_told_apart() {
    let (mut stage, _, _) = homed("reset@1+0.5s");
    let error = stage.move_to(30.0).unwrap_err();
    assert_eq!(error, StageError::Restarted { during: "in the move to 30.000 mm".to_owned() });
    assert_eq!(stage.move_to(30.0), Err(StageError::NotHomed));
    stage.home().unwrap();
    stage.move_to(30.0).unwrap();

    let (mut stage, plant, _) = homed("limit@1+0.5s");
    let error = stage.move_to(30.0).unwrap_err().to_string();
    assert!(
        error.starts_with("the stage stopped in the move to 30.000 mm: a limit switch closed"),
        "{error}"
    );
    assert!(error.ends_with("home it (ALARM:1)"), "{error}");
    assert_eq!(stage.move_to(30.0), Err(StageError::NotHomed));
    plant.press_switches(false);
    stage.home().unwrap();

    let (mut stage, _, _) = homed("hang-up@1+0.5s/1s");
    let error = stage.move_to(30.0).unwrap_err();
    assert!(matches!(error, StageError::Link(LinkError::Lost { .. })), "{error}");
}

#[test]
fn a_switch_that_never_closes_is_told() {
    let mut stage = connect(GrblDevice::new("switch-never-closes".parse().unwrap())).unwrap();
    let error = stage.home().unwrap_err().to_string();
    assert_eq!(error, format!("the stage stopped while homing: {} (ALARM:9)", alarm_text(9)));
    assert!(error.contains("never found the limit switch"), "{error}");
}

/// A safe stop is hold, then reset: the position is kept. A stop at once is not, and says so.
#[test]
fn stops_are_safe_or_say_that_they_were_not() {
    for urgency in [Urgency::Soon, Urgency::AtOnce] {
        let device = Arc::new(Mutex::new(GrblDevice::default()));
        let plant = device.lock().unwrap().plant();
        let pressing = Pressing { device, plant: plant.clone(), home: None, switch: Arc::default(), urgency };
        let (switch, mut stage) = (Arc::clone(&pressing.switch), connect(pressing).unwrap());
        stage.home().unwrap();
        let home = plant.carriage_steps();
        *switch.lock().unwrap() = Some(stage.stop_switch());
        let error = stage.move_to(50.0).unwrap_err();
        stage.stop_switch().release();
        if urgency == Urgency::Soon {
            let StageError::Stopped { position_mm: Some(position_mm) } = error else { panic!("{error}") };
            assert_eq!((position_mm * STEPS_PER_MM).round() as i64, home - plant.carriage_steps());
            assert!(position_mm > 10.0 && position_mm < 45.0, "{position_mm}");
            stage.move_to(1.5).unwrap();
            assert_eq!(home - plant.carriage_steps(), 375);
        } else {
            assert_eq!(error, StageError::Stopped { position_mm: None });
            assert_eq!(stage.move_to(1.5), Err(StageError::NotHomed));
            stage.home().unwrap();
        }
    }
}

/// Every alarm that the recording holds (and those that it does not) during a move: the user reads what it means.
#[test]
fn every_alarm_is_put_in_words() {
    for code in 1..=10 {
        let mut device = Tampered::new(GrblDevice::default(), "$J=", "ALARM:X");
        device.say = format!("ALARM:{code}");
        let mut stage = connect(device).unwrap();
        stage.home().unwrap();
        let error = stage.move_to(3.0).unwrap_err().to_string();
        let expected =
            format!("the stage stopped in the move to 3.000 mm: {} (ALARM:{code})", alarm_text(code));
        assert_eq!(error, expected);
        assert!(error.contains("home it") || error.contains("check"), "{error}");
        assert_eq!(stage.move_to(3.0), Err(StageError::NotHomed));
    }
}

#[test]
fn every_error_of_the_recording_is_put_in_words() {
    for (code, word) in [
        (2, "damaged on its way"),
        (9, "locked until it is homed"),
        (10, "$22=1"),
        (11, "damaged on its way"),
        (15, "outside its travel"),
        (20, "not supported"),
        (22, "no feed rate"),
    ] {
        let mut device = Tampered::new(GrblDevice::default(), "$J=", "");
        device.say = format!("error:{code}");
        let mut stage = connect(device).unwrap();
        stage.home().unwrap();
        let error = stage.move_to(3.0).unwrap_err().to_string();
        assert_eq!(error, format!("the stage refuses: {} (error:{code})", error_text(code)));
        assert!(error.contains(word), "{error}");
    }
    let mut stage = connect(Tampered::new(GrblDevice::default(), "$H", "error:5")).unwrap();
    let error = stage.home().unwrap_err().to_string();
    assert_eq!(error, "the stage refuses: homing is switched off; switch it on with $22=1 (error:5)");
    let error = connect(Tampered::new(GrblDevice::default(), "?", "error:7")).err().unwrap().to_string();
    assert!(
        error.contains("it lost its settings and is back at the defaults (error:7); set them again"),
        "{error}"
    );
}

/// GRBL has no checksums: what a bad line may do is checked by reading back. Every move that is said to be right is.
#[test]
fn a_line_that_lies_never_bends_the_scan() {
    let (mut right, mut wrong) = (0, 0);
    for seed in 1..=40 {
        println!("seed {seed}");
        let (seed_right, seed_wrong) = moves_through_noise(seed);
        right += seed_right;
        wrong += seed_wrong;
    }
    println!("{right} moves right, {wrong} errors");
    assert!(right > 3000, "{right} right, {wrong} errors");
}

/// Two hundred moves, home and connections included: how many were right, and how many said that they were not.
fn moves_through_noise(seed: u64) -> (u32, u32) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let device = Arc::new(Mutex::new(GrblDevice::default()));
    let plant = device.lock().unwrap().plant();
    let connect = |seed| {
        let link = SimulatedLink::with_noise(Arc::clone(&device), &LineNoise::bad(seed, 0.002));
        GrblStage::connect(Box::new(link), GrblOptions::default())
    };
    // The switch closes at 2000 steps and the pull-off is 250: the plant knows where home is.
    let home_steps = 2000 - 250;
    let (mut stage, mut homed, mut right, mut wrong) = (None, false, 0, 0);
    for index in 0..200_u64 {
        let Some(connected) = &mut stage else {
            stage = connect(seed * 1000 + index).ok();
            continue;
        };
        if !homed {
            homed = connected.home().is_ok();
            assert!(!homed || plant.carriage_steps() == home_steps, "home, seed {seed}");
            if !homed {
                stage = None;
            }
            continue;
        }
        let steps = random.random_range(0..14_000_i64);
        let (from, made) = (plant.carriage_steps(), plant.steps_made());
        match connected.move_to(steps as f64 / STEPS_PER_MM) {
            Ok(()) => {
                assert_eq!(home_steps - plant.carriage_steps(), steps, "move {index}, seed {seed}");
                assert_eq!(
                    plant.steps_made() - made,
                    (home_steps - steps).abs_diff(from),
                    "move {index}, seed {seed}"
                );
                right += 1;
            }
            Err(_) => {
                wrong += 1;
                (stage, homed) = (None, false);
            }
        }
    }
    (right, wrong)
}

#[test]
fn an_order_to_home_that_became_another_one_is_noticed() {
    // A flipped bit makes `$X` of `$H`: it unlocks and answers `ok`.
    let unlocked = "[MSG:Caution: Unlocked]\r\nok";
    for (answer, place_mm, word) in [
        (unlocked, 0.0, "received another command"),
        ("ok", 0.0, "reports the end of homing"),
        ("ok", 10.0, "reports the end of homing"),
    ] {
        let device = Arc::new(Mutex::new(GrblDevice::default()));
        let mut stage = connect(Arc::clone(&device)).unwrap();
        stage.home().unwrap();
        stage.move_to(place_mm).unwrap();
        let mut stage = connect(Tampered::new(device, "$H", answer)).unwrap();
        assert_eq!(stage.position_mm(), Ok(place_mm));
        let error = stage.home().unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
        assert_eq!(stage.move_to(1.0), Err(StageError::NotHomed));
    }
}

#[test]
fn what_was_distrusted_is_not_trusted_by_the_next_program() {
    let device = Arc::new(Mutex::new(GrblDevice::new("no-motion@1".parse().unwrap())));
    let mut stage = connect(Arc::clone(&device)).unwrap();
    stage.home().unwrap();
    assert!(matches!(stage.move_to(10.0), Err(StageError::TooFast { .. })));
    assert_eq!(connect(device).unwrap().position_mm(), Err(StageError::NotHomed));
}

#[test]
fn who_speaks_another_language_is_named() {
    let error = connect(Babble(true)).err().unwrap().to_string();
    assert!(error.contains("answers, but not as a grbl stage: it says \"Marlin 2.1 ready\""), "{error}");
    let error = connect(Silence).err().unwrap().to_string();
    assert!(error.starts_with("the stage at simulated port does not answer"), "{error}");
}

/// Says the same every simulated millisecond, without end.
struct Babble(bool);

impl SimulatedDevice for Babble {
    fn receive(&mut self, _: u8) {}

    fn advance(&mut self, _: Duration) {
        self.0 = true;
    }

    fn take_sent(&mut self) -> Vec<u8> {
        if std::mem::take(&mut self.0) { b"Marlin 2.1 ready\n".to_vec() } else { Vec::new() }
    }
}

struct Silence;

impl SimulatedDevice for Silence {
    fn receive(&mut self, _: u8) {}

    fn advance(&mut self, _: Duration) {}

    fn take_sent(&mut self) -> Vec<u8> {
        Vec::new()
    }
}

/// A controller of which one line, or byte, never arrives, and is answered by something else.
struct Tampered<D> {
    inner: D,
    on: &'static str,
    say: String,
    line: Vec<u8>,
    said: Vec<u8>,
}

impl<D> Tampered<D> {
    fn new(inner: D, on: &'static str, say: &str) -> Self {
        Self { inner, on, say: say.to_owned(), line: Vec::new(), said: Vec::new() }
    }
}

impl<D: SimulatedDevice> SimulatedDevice for Tampered<D> {
    fn receive(&mut self, byte: u8) {
        if self.on == "?" && byte == b'?' {
            self.said.extend(format!("{}\r\n", self.say).bytes());
        } else if matches!(byte, b'?' | b'!' | 0x18) {
            self.inner.receive(byte);
        } else {
            self.line.push(byte);
        }
        if byte == b'\n' {
            let line = std::mem::take(&mut self.line);
            let words: String = String::from_utf8_lossy(&line).split_whitespace().collect();
            if !self.on.is_empty() && words.starts_with(self.on) {
                self.said.extend(format!("{}\r\n", self.say).bytes());
            } else {
                line.into_iter().for_each(|byte| self.inner.receive(byte));
            }
        }
    }

    fn advance(&mut self, time: Duration) {
        self.inner.advance(time);
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.said.extend(self.inner.take_sent());
        std::mem::take(&mut self.said)
    }
}

/// A controller whose stop switch is pressed once the carriage is 20 mm out.
struct Pressing {
    device: Arc<Mutex<GrblDevice>>,
    plant: Plant,
    home: Option<i64>,
    switch: Arc<Mutex<Option<epirig_devices::stage::StopSwitch>>>,
    urgency: Urgency,
}

impl SimulatedDevice for Pressing {
    fn receive(&mut self, byte: u8) {
        self.device.receive(byte);
    }

    fn advance(&mut self, time: Duration) {
        self.device.advance(time);
        let mut switch = self.switch.lock().unwrap();
        if switch.is_some() {
            let home = *self.home.get_or_insert(self.plant.carriage_steps());
            if home - self.plant.carriage_steps() > 5000 {
                switch.take().unwrap().press(self.urgency);
            }
        }
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.device.take_sent()
    }
}
