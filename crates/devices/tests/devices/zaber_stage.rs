//! The Zaber driver against a simulated device: moves, faults, and a line that lies.

use epirig_devices::link::{LineNoise, LinkError, SimulatedLink};
use epirig_devices::stage::simulator::{Plant, ZaberDevice};
use epirig_devices::stage::zaber::ZaberOptions;
use epirig_devices::stage::{Stage, StageError, Urgency, ZaberStage};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MICROSTEP_MM: f64 = ZaberDevice::MICROSTEP_UM / 1000.0;

fn connect(script: &str, noise: &LineNoise) -> (ZaberStage, Plant) {
    let device = ZaberDevice::new(script.parse().unwrap());
    let plant = device.plant();
    let options = ZaberOptions { device: 1, microstep_um: ZaberDevice::MICROSTEP_UM };
    let link = SimulatedLink::with_noise(device, noise);
    (ZaberStage::connect(Box::new(link), options).unwrap(), plant)
}

fn homed(script: &str) -> (ZaberStage, Plant, i64) {
    let (mut stage, plant) = connect(script, &LineNoise::quiet(0));
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    stage.home().unwrap();
    let home = plant.carriage_steps();
    (stage, plant, home)
}

#[test]
fn a_scan_of_a_hundred_steps_ends_each_time_where_it_should() {
    let (mut stage, plant, home) = homed("");
    assert!((stage.travel_mm() - 150.0).abs() < 0.001);
    for index in 0..100 {
        let position_mm = 1.5 * f64::from(index);
        stage.move_to(position_mm).unwrap();
        let microsteps = (position_mm / MICROSTEP_MM).round() as i64;
        assert_eq!(plant.carriage_steps() - home, microsteps);
    }
}

#[test]
fn a_line_that_lies_never_bends_the_scan() {
    let seed = 41;
    println!("seed {seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut stage, plant) = connect("", &LineNoise::bad(seed, 0.003));
    stage.home().unwrap();
    let (home, mut right) = (plant.carriage_steps(), 0);
    for index in 0..500 {
        let microsteps = 100_000 + random.random_range(0..2000_i64);
        match stage.move_to(microsteps as f64 * MICROSTEP_MM) {
            Ok(()) => {
                assert_eq!(plant.carriage_steps() - home, microsteps, "move {index}");
                right += 1;
            }
            Err(error) => {
                println!("move {index}: {error}");
                while stage.home().is_err() {}
                assert_eq!(plant.carriage_steps(), home);
            }
        }
    }
    println!("{right} moves right");
    assert!(right > 450, "{right}");
}

#[test]
fn faults_are_told_apart() {
    let (mut stage, _, _) = homed("reset@1+0.5s");
    let error = stage.move_to(30.0).unwrap_err().to_string();
    assert_eq!(
        error,
        "the stage stopped in the move to 30.000 mm: it has lost its position (power or reset); home it (WR)"
    );
    assert_eq!(stage.move_to(30.0), Err(StageError::NotHomed));
    stage.home().unwrap();
    stage.move_to(3.0).unwrap();

    let (mut stage, _, _) = homed("no-motion@1");
    let error = stage.move_to(3.0).unwrap_err().to_string();
    assert!(error.contains("it stalled; look for what blocks the carriage, then home it (FS)"), "{error}");

    let (mut stage, _, _) = homed("hang-up@1+0.5s/1s");
    assert!(matches!(stage.move_to(30.0), Err(StageError::Link(LinkError::Lost { .. }))));

    let (mut stage, plant, home) = homed("mute@1/1s");
    stage.move_to(3.0).unwrap();
    assert_eq!(plant.carriage_steps() - home, (3.0 / MICROSTEP_MM).round() as i64);

    let (mut stage, _) = connect("switch-never-closes", &LineNoise::quiet(0));
    let error = stage.home().unwrap_err();
    assert!(matches!(error, StageError::Fault { .. }), "{error}");
}

#[test]
fn a_lost_reference_is_seen_behind_another_warning() {
    let mut device = ZaberDevice::default();
    device.set_low_voltage(true);
    let options = ZaberOptions { device: 1, microstep_um: ZaberDevice::MICROSTEP_UM };
    let mut stage = ZaberStage::connect(Box::new(SimulatedLink::new(device)), options).unwrap();
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    assert_eq!(stage.move_to(3.0), Err(StageError::NotHomed));
    stage.home().unwrap();
    stage.move_to(3.0).unwrap();
}

#[test]
fn a_pressed_switch_moves_nothing() {
    let (mut stage, plant, home) = homed("");
    stage.stop_switch().press(Urgency::Soon);
    assert_eq!(stage.move_to(3.0), Err(StageError::Stopped { position_mm: Some(0.0) }));
    assert_eq!(plant.carriage_steps(), home);
    stage.stop_switch().release();
    stage.move_to(3.0).unwrap();
}
