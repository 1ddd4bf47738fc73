//! The native driver against the firmware's own state machine: over a line that lies, and through every fault.

use std::sync::{Arc, Mutex};

use epirig_devices::link::{LineNoise, LinkError, SimulatedLink};
use epirig_devices::stage::native::NativeOptions;
use epirig_devices::stage::simulator::{FaultScript, NativeDevice, Plant};
use epirig_devices::stage::{NativeStage, Stage, StageError, Urgency};
use firmware_protocol::message::Settings;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const STEPS_PER_MM: f64 = 250.0;

/// Fast, so that thousands of moves take little simulated time.
fn fast() -> NativeOptions {
    let settings = Settings {
        velocity_nm_s: 20_000_000,
        acceleration_nm_s2: 400_000_000,
        seek_velocity_nm_s: 10_000_000,
        touch_velocity_nm_s: 2_000_000,
        ..Settings::default()
    };
    NativeOptions { settings: Some(settings) }
}

fn connect(script: &str) -> (NativeStage, Plant) {
    let device = NativeDevice::new(script.parse().unwrap());
    let plant = device.plant();
    (NativeStage::connect(Box::new(SimulatedLink::new(device)), fast()).unwrap(), plant)
}

fn homed(script: &str) -> (NativeStage, Plant, i64) {
    let (mut stage, plant) = connect(script);
    stage.home().unwrap();
    let home = plant.carriage_steps();
    (stage, plant, home)
}

#[test]
fn a_scan_of_a_hundred_steps_ends_each_time_where_it_should() {
    let (mut stage, plant, home) = homed("");
    for index in 0..=100 {
        let position_mm = 1.5 * f64::from(index);
        stage.move_to(position_mm).unwrap();
        assert_eq!(plant.carriage_steps() - home, i64::from(index) * 375);
        assert!((stage.position_mm().unwrap() - position_mm).abs() < 1e-9);
    }
}

/// The name of an error, and what a fault says.
fn kind(error: &StageError) -> String {
    match error {
        StageError::Fault { fault, .. } => fault.clone(),
        other => format!("{other:?}").split([' ', '(']).next().unwrap_or_default().to_owned(),
    }
}

/// Ten thousand moves through a line that loses, doubles and flips one byte in a hundred each. Every move ends at the right
/// place or with an error, no limit is passed, and the carriage makes the steps of each move once: no more, no fewer.
#[test]
fn a_line_that_lies_never_bends_the_scan() {
    let seed = 20_260_823;
    println!("seed {seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let device = Arc::new(Mutex::new(NativeDevice::new(FaultScript::default())));
    let plant = device.lock().unwrap().plant();
    let connect = |seed| {
        let noise = LineNoise::bad(seed, 0.01);
        let link = SimulatedLink::with_noise(Arc::clone(&device), &noise);
        NativeStage::connect(Box::new(link), fast())
    };
    let mut stage = connect(seed).unwrap();
    let (mut home, mut right, mut errors) = (None, 0, std::collections::BTreeMap::<String, u32>::new());
    for index in 0..10_000_u64 {
        let Some(home_steps) = home else {
            match stage.home() {
                Ok(()) => home = Some(plant.carriage_steps()),
                Err(error) => *errors.entry(format!("home: {}", kind(&error))).or_default() += 1,
            }
            continue;
        };
        let steps = random.random_range(0..50_000_i64);
        let steps = if random.random_bool(0.8) { steps % 2000 + 20_000 } else { steps };
        let (from, made) = (plant.carriage_steps(), plant.steps_made());
        match stage.move_to(steps as f64 / STEPS_PER_MM) {
            Ok(()) => {
                assert_eq!(plant.carriage_steps() - home_steps, steps, "move {index}");
                assert_eq!(plant.steps_made() - made, (home_steps + steps).abs_diff(from), "move {index}");
                right += 1;
            }
            Err(error) => {
                *errors.entry(kind(&error)).or_default() += 1;
                home = None;
                if matches!(error, StageError::Link(_) | StageError::NoAnswer { .. }) {
                    stage = connect(seed + index).unwrap();
                }
            }
        }
    }
    println!("{right} moves right, errors: {errors:#?}");
    let (lowest, highest) = plant.range_steps();
    // Beyond the switch at -900 the carriage goes for the debouncing time: 4 ticks at half a step a tick at the most.
    assert!(lowest >= -900 - 3, "lowest {lowest}");
    let farthest = home.unwrap_or(-650) + 50_000;
    assert!(highest <= farthest, "highest {highest}");
    assert!(right > 9000, "{right} moves");
}

/// A byte in fifty, and all after it, come up to 0.3 s late: answers arrive after the time-out.
#[test]
fn answers_that_come_late_are_told_from_those_that_are_waited_for() {
    let device = NativeDevice::default();
    let plant = device.plant();
    let mut noise = LineNoise::quiet(9);
    (noise.delay, noise.longest_delay) = (0.02, std::time::Duration::from_millis(300));
    let link = SimulatedLink::with_noise(device, &noise);
    let mut stage = NativeStage::connect(Box::new(link), fast()).unwrap();
    stage.home().unwrap();
    let home = plant.carriage_steps();
    for index in 1..=100_i64 {
        stage.move_to(1.5 * index as f64).unwrap();
        assert_eq!(plant.carriage_steps() - home, index * 375);
    }
}

#[test]
fn an_answer_lost_after_the_move_moves_nothing_twice() {
    let (mut stage, plant, home) = homed("mute@2/1s");
    stage.move_to(10.0).unwrap();
    stage.move_to(11.5).unwrap();
    assert_eq!(plant.carriage_steps() - home, 11 * 250 + 125);
    assert_eq!(plant.steps_made() - steps_of_homing(), 11 * 250 + 125);
}

/// What homing takes from the carriage's first place: 900 steps to the switch, and three times the pull-off of 250.
fn steps_of_homing() -> u64 {
    let (_, plant, _) = homed("");
    plant.steps_made()
}

#[test]
fn a_silence_longer_than_patience_is_an_error_that_names_it() {
    let (mut stage, _, _) = homed("mute@1/10s");
    let error = stage.move_to(10.0).unwrap_err();
    assert!(matches!(error, StageError::NoAnswer { .. }), "{error}");
    // It may have arrived, which is unknown. Only homing helps.
    assert_eq!(stage.move_to(10.0), Err(StageError::NotHomed));
}

#[test]
fn a_reset_in_mid_move_loses_the_position_and_home_finds_it() {
    let (mut stage, plant, _) = homed("reset@2+0.1s");
    stage.move_to(10.0).unwrap();
    let error = stage.move_to(50.0).unwrap_err();
    assert_eq!(error, StageError::Restarted { during: "in the move to 50.000 mm".to_owned() });
    assert_eq!(stage.move_to(50.0), Err(StageError::NotHomed));
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    stage.home().unwrap();
    let home = plant.carriage_steps();
    stage.move_to(50.0).unwrap();
    assert_eq!(plant.carriage_steps() - home, 50 * 250);
}

#[test]
fn a_pulled_cable_is_an_error_and_the_stage_stops_by_itself() {
    let script = "hang-up@1+0.5s/5s".parse().unwrap();
    let device = Arc::new(Mutex::new(NativeDevice::new(script)));
    let plant = device.lock().unwrap().plant();
    let link = SimulatedLink::new(Arc::clone(&device));
    let slow = NativeOptions::default();
    let mut stage = NativeStage::connect(Box::new(link), slow).unwrap();
    stage.home().unwrap();
    let home = plant.carriage_steps();
    let error = stage.move_to(190.0).unwrap_err();
    assert!(matches!(error, StageError::Link(LinkError::Lost { .. })), "{error}");
    // The watchdog of 0.5 s, and 0.25 s to slow down from 5 mm/s at 20 mm/s2.
    let mut device_alone = Arc::clone(&device);
    epirig_devices::link::SimulatedDevice::advance(&mut device_alone, std::time::Duration::from_millis(760));
    let stopped_at = plant.carriage_steps();
    epirig_devices::link::SimulatedDevice::advance(&mut device_alone, std::time::Duration::from_secs(10));
    assert_eq!(plant.carriage_steps(), stopped_at);
    assert!(stopped_at - home < 190 * 250);
    // The cable is back. What has failed is not built upon; but the stage has kept count, as homing shows.
    let mut stage = NativeStage::connect(Box::new(SimulatedLink::new(device)), slow).unwrap();
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    stage.home().unwrap();
    assert_eq!(stage.home_shift_mm(), Some(0.0));
}

#[test]
fn a_move_that_has_lost_its_host_is_ended_by_the_next_one() {
    for settings in [None, Some(Settings::default())] {
        // The cable is back before the watchdog has noticed: as if a program had been killed and another one started.
        let device = Arc::new(Mutex::new(NativeDevice::new("hang-up@1+0.5s/0.1s".parse().unwrap())));
        let plant = device.lock().unwrap().plant();
        let options = NativeOptions { settings };
        let connect = || NativeStage::connect(Box::new(SimulatedLink::new(Arc::clone(&device))), options);
        let mut stage = connect().unwrap();
        stage.home().unwrap();
        let error = stage.move_to(190.0).unwrap_err();
        assert!(matches!(error, StageError::Link(LinkError::Lost { .. })), "{error}");
        let mut device_alone = Arc::clone(&device);
        let made = plant.steps_made();
        epirig_devices::link::SimulatedDevice::advance(
            &mut device_alone,
            std::time::Duration::from_millis(110),
        );
        assert!(plant.steps_made() > made, "it moves without a host");
        let mut stage = connect().unwrap();
        assert_eq!(stage.move_to(10.0), Err(StageError::NotHomed));
        stage.home().unwrap();
        assert_eq!(stage.home_shift_mm(), Some(0.0));
        stage.move_to(10.0).unwrap();
    }
}

#[test]
fn an_emergency_stop_that_is_lost_is_sent_again() {
    for seed in 0..20 {
        let device = Arc::new(Mutex::new(NativeDevice::default()));
        let plant = device.lock().unwrap().plant();
        let mut noise = LineNoise::quiet(seed);
        noise.lose = 0.3;
        let link = PressWhenMoving {
            link: SimulatedLink::with_noise(device, &noise),
            plant: plant.clone(),
            switch: None,
            urgency: Urgency::AtOnce,
        };
        let (link, handle) = link.share();
        let Ok(mut stage) = NativeStage::connect(Box::new(link), fast()) else { continue };
        if stage.home().is_err() {
            continue;
        }
        *handle.lock().unwrap() = Some(stage.stop_switch());
        let error = stage.move_to(190.0).unwrap_err();
        assert!(plant.carriage_steps() < 40_000, "seed {seed}: {error} at {}", plant.carriage_steps());
    }
}

#[test]
fn a_limit_in_mid_move_and_a_switch_that_never_closes_are_told() {
    let (mut stage, _, _) = homed("limit@1+0.1s");
    let error = stage.move_to(50.0).unwrap_err().to_string();
    assert_eq!(
        error,
        "the stage stopped in the move to 50.000 mm: a limit switch closed, so steps were lost or the travel is set \
         too long; home it"
    );
    let (mut stage, _) = connect("switch-never-closes");
    let error = stage.home().unwrap_err().to_string();
    assert!(error.contains("the home switch never closed; check the switch"), "{error}");
    assert_eq!(stage.move_to(1.0), Err(StageError::NotHomed));
}

#[test]
fn a_stall_shows_when_it_is_homed_again() {
    let (mut stage, plant, home) = homed("no-motion@2");
    stage.move_to(10.0).unwrap();
    // A stage without an encoder counts steps that the carriage does not make.
    stage.move_to(12.0).unwrap();
    assert_eq!(plant.carriage_steps() - home, 10 * 250);
    plant.set_stalled(false);
    stage.home().unwrap();
    assert!((stage.home_shift_mm().unwrap() - 2.0).abs() < 1e-9, "{:?}", stage.home_shift_mm());
}

#[test]
fn a_stop_from_another_thread_ends_the_move_and_keeps_the_position() {
    for (urgency, known) in [(Urgency::Soon, true), (Urgency::AtOnce, false)] {
        let (mut stage, plant, home) = homed("");
        let switch = stage.stop_switch();
        // The move ends within simulated ms, so the switch is pressed before: nothing must move then.
        switch.press(urgency);
        let before = plant.carriage_steps();
        assert!(matches!(stage.move_to(100.0), Err(StageError::Stopped { position_mm: Some(_) })));
        assert_eq!(plant.carriage_steps(), before);
        switch.release();
        let device = Arc::new(Mutex::new(NativeDevice::default()));
        let plant_two = device.lock().unwrap().plant();
        let link = PressWhenMoving {
            link: SimulatedLink::new(device),
            plant: plant_two.clone(),
            switch: None,
            urgency,
        };
        let (link, handle) = link.share();
        let mut stage = NativeStage::connect(Box::new(link), fast()).unwrap();
        stage.home().unwrap();
        *handle.lock().unwrap() = Some(stage.stop_switch());
        let error = stage.move_to(150.0).unwrap_err();
        match error {
            StageError::Stopped { position_mm: Some(position_mm) } if known => {
                let carriage = plant_two.carriage_steps() - home;
                assert!((position_mm * STEPS_PER_MM - carriage as f64).abs() < 1e-6);
                stage.stop_switch().release();
                stage.move_to(1.0).unwrap();
            }
            StageError::Stopped { position_mm: None } if !known => {}
            other => panic!("{other}"),
        }
    }
}

type SwitchToPress = Arc<Mutex<Option<epirig_devices::stage::StopSwitch>>>;

/// A line that presses a stop switch once the carriage has gone 5000 steps up.
struct PressWhenMoving<L> {
    link: L,
    plant: Plant,
    switch: Option<SwitchToPress>,
    urgency: Urgency,
}

impl<L> PressWhenMoving<L> {
    fn share(mut self) -> (Self, SwitchToPress) {
        let handle = SwitchToPress::default();
        self.switch = Some(Arc::clone(&handle));
        (self, handle)
    }
}

impl<L: epirig_devices::link::Link> epirig_devices::link::Link for PressWhenMoving<L> {
    fn name(&self) -> &str {
        self.link.name()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.link.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], patience: std::time::Duration) -> Result<usize, LinkError> {
        if self.plant.carriage_steps() > 5000
            && let Some(switch) = self.switch.as_ref().and_then(|switch| switch.lock().unwrap().take())
        {
            switch.press(self.urgency);
        }
        self.link.receive(buffer, patience)
    }

    fn now(&self) -> std::time::Duration {
        self.link.now()
    }
}
