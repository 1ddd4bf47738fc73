//! What a stage in memory does, in simulated and in real time.

use super::*;
use crate::stage::{Connection, Stage as _, StageDriver as _, Urgency, WhenMoving};
use epirig_core::settings::Settings;

fn homed(config: SimStageConfig) -> (SimStage, StagePosition) {
    let mut stage = SimStage::new(config);
    stage.home().unwrap();
    let carriage = stage.watch();
    (stage, carriage)
}

#[test]
fn the_stage_refuses_what_it_cannot_do() {
    let mut stage = SimStage::new(SimStageConfig::ideal(50.0));
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    stage.home().unwrap();
    assert!(matches!(stage.move_to(50.1), Err(StageError::OutsideTravel { .. })));
    assert!(stage.move_to(f64::NAN).is_err());
    stage.move_to(50.0).unwrap();
    assert_eq!(stage.watch().get_mm(), 50.0);
    stage.stop_switch().press(Urgency::Soon);
    assert_eq!(stage.move_to(1.0), Err(StageError::Stopped { position_mm: Some(50.0) }));
}

#[test]
fn backlash_shows_on_the_way_down_only() {
    let (mut stage, carriage) = homed(SimStageConfig { backlash_um: 40.0, ..SimStageConfig::ideal(100.0) });
    for (position_mm, behind_um) in [(10.0, 0.0), (5.0, 40.0), (4.99, 40.0), (5.01, 20.0), (5.1, 0.0)] {
        stage.move_to(position_mm).unwrap();
        let off_um = (carriage.get_mm() - position_mm) * UM_PER_MM;
        assert!((off_um - behind_um).abs() < 1e-6, "at {position_mm} mm: {off_um} um");
        assert_eq!(stage.position_mm(), Ok(position_mm));
    }
}

#[test]
fn lost_steps_add_up_unnoticed_until_home() {
    let slips =
        SimStageConfig { slip_probability: 0.3, slip_um: 4.0, seed: 5, ..SimStageConfig::ideal(200.0) };
    let (mut stage, carriage) = homed(slips);
    for index in 1..=100 {
        stage.move_to(f64::from(index)).unwrap();
    }
    let lost = (100.0 - carriage.get_mm()) * UM_PER_MM / 4.0;
    // 100 moves at 0.3: 30 +- 4.6, so within five standard deviations.
    assert!((7.0..=53.0).contains(&lost) && (lost - lost.round()).abs() < 1e-6, "{lost} slips");
    stage.home().unwrap();
    assert_eq!(carriage.get_mm(), 0.0);
    // Home is found early by what was lost on the way up, but for what the way home may have lost.
    let shift = stage.home_shift_mm().unwrap() * UM_PER_MM / 4.0;
    assert!((lost - 1.001..=lost + 0.001).contains(&shift), "{shift} of {lost}");
}

#[test]
fn noise_and_drift_are_as_large_as_asked_and_the_same_for_a_seed() {
    let noisy = SimStageConfig { position_noise_um: 3.0, seed: 8, ..SimStageConfig::ideal(100.0) };
    let run = || {
        let (mut stage, carriage) = homed(noisy.clone());
        let offs: Vec<f64> = (0..2000)
            .map(|index| {
                stage.move_to(f64::from(index % 100)).unwrap();
                (carriage.get_mm() - f64::from(index % 100)) * UM_PER_MM
            })
            .collect();
        offs
    };
    let offs = run();
    assert_eq!(offs, run());
    // The standard deviation of 2000 samples is known to 1.6 %; five of those.
    let deviation = (offs.iter().map(|off| off * off).sum::<f64>() / 2000.0).sqrt();
    assert!((deviation - 3.0).abs() < 0.24, "{deviation} um");

    let warm = SimStageConfig { thermal_drift_um: 20.0, thermal_hours: 0.5, ..SimStageConfig::ideal(100.0) };
    let (mut stage, carriage) = homed(warm);
    stage.axis.elapsed = Duration::from_secs(1800);
    stage.axis.settle();
    let expected_um = 20.0 * (1.0 - (-1.0_f64).exp());
    assert!((carriage.get_mm() * UM_PER_MM - expected_um).abs() < 1e-6);
}

#[test]
fn moves_take_the_time_of_their_ramps() {
    let (mut stage, _) = homed(SimStageConfig::ideal(100.0));
    let before = stage.axis.elapsed;
    // 5 mm/s and 20 mm/s2: 0.25 s up, 0.25 s down, 8.75 mm at speed.
    stage.move_to(10.0).unwrap();
    let took_s = (stage.axis.elapsed - before).as_secs_f64();
    assert!((took_s - (0.5 + 8.75 / 5.0)).abs() < 1e-9, "{took_s} s");
}

/// A fast stage, so that real time is short: 0.1 s from rest to 50 mm/s.
fn fast(travel_mm: f64) -> SimStageConfig {
    SimStageConfig { velocity_mm_s: 50.0, acceleration_mm_s2: 500.0, ..SimStageConfig::ideal(travel_mm) }
}

#[test]
fn a_move_in_real_time_takes_its_time_and_can_be_watched() {
    let mut stage = SimStage::new(fast(100.0)).in_real_time();
    stage.home().unwrap();
    let watch = stage.watch();
    let began = Instant::now();
    let mover = std::thread::spawn(move || stage.move_to(10.0).map(|()| stage));
    let mut seen = Vec::new();
    while !mover.is_finished() {
        seen.push((watch.elapsed(), watch.get_mm()));
        std::thread::sleep(Duration::from_millis(1));
    }
    let mut stage = mover.join().unwrap().unwrap();
    // 0.1 s up, 0.1 s down, 5 mm at speed.
    assert!(began.elapsed() >= Duration::from_millis(300));
    assert!((stage.axis.elapsed.as_secs_f64() - 0.3).abs() < 1e-6, "{:?}", stage.axis.elapsed);
    assert!(seen.windows(2).all(|pair| pair[0].0 <= pair[1].0 && pair[0].1 <= pair[1].1), "{seen:?}");
    assert!(seen.iter().all(|(_, at_mm)| (0.0..=10.0).contains(at_mm)));
    assert_eq!((watch.get_mm(), stage.position_mm()), (10.0, Ok(10.0)));
    assert!(!stage.state().unwrap().moving);
    // And back: homing is a move to 0.
    let began = Instant::now();
    stage.home().unwrap();
    assert!(began.elapsed() >= Duration::from_millis(300));
    assert_eq!((watch.get_mm(), stage.home_shift_mm()), (0.0, Some(0.0)));
}

/// Starts a move of 40 s or a homing, presses the switch once it runs at speed, and returns where it was
/// then, with the error and the stage.
fn stopped_in(urgency: Urgency, homing: bool) -> (f64, StageError, SimStage) {
    let mut stage = SimStage::new(fast(2000.0));
    stage.home().unwrap();
    if homing {
        stage.move_to(2000.0).unwrap();
    }
    let from_mm = stage.watch().get_mm();
    let (watch, switch) = (stage.watch(), stage.stop_switch());
    let mut stage = stage.in_real_time();
    let mover = std::thread::spawn(move || {
        let moved = if homing { stage.home() } else { stage.move_to(2000.0) };
        (moved.unwrap_err(), stage)
    });
    // The ramp ends after 2.5 mm.
    while (watch.get_mm() - from_mm).abs() < 5.0 {
        std::thread::sleep(Duration::from_millis(1));
    }
    let seen_mm = watch.get_mm();
    switch.press(urgency);
    let (error, stage) = mover.join().unwrap();
    switch.release();
    (seen_mm, error, stage)
}

#[test]
fn a_stop_on_the_way_ends_there_and_keeps_the_position() {
    let (seen_mm, error, mut stage) = stopped_in(Urgency::Soon, false);
    let StageError::Stopped { position_mm: Some(at_mm) } = error else { panic!("{error:?}") };
    // Braking takes 2.5 mm; until the press is noticed it goes on.
    assert!(at_mm >= seen_mm + 2.5 - 1e-9 && at_mm < 2000.0, "from {seen_mm} to {at_mm} mm");
    assert_eq!((stage.watch().get_mm(), stage.position_mm()), (at_mm, Ok(at_mm)));
    stage.move_to(at_mm - 1.0).unwrap();
    assert_eq!(stage.watch().get_mm(), at_mm - 1.0);
}

#[test]
fn a_stop_at_once_and_one_while_homing_lose_the_position() {
    for (urgency, homing) in [(Urgency::AtOnce, false), (Urgency::Soon, true), (Urgency::AtOnce, true)] {
        let (seen_mm, error, mut stage) = stopped_in(urgency, homing);
        assert_eq!(error, StageError::Stopped { position_mm: None });
        let at_mm = stage.watch().get_mm();
        let beyond_mm = if homing { seen_mm - at_mm } else { at_mm - seen_mm };
        assert!((0.0..1900.0).contains(&beyond_mm), "from {seen_mm} to {at_mm} mm");
        assert_eq!(stage.move_to(1.0), Err(StageError::NotHomed));
        stage.axis.in_real_time = false;
        stage.home().unwrap();
        stage.move_to(1.0).unwrap();
    }
}

#[test]
fn real_time_changes_no_place_and_no_duration() {
    let config = SimStageConfig {
        velocity_mm_s: 2000.0,
        acceleration_mm_s2: 1e6,
        step_um: 4.0,
        backlash_um: 30.0,
        slip_probability: 0.5,
        slip_um: 8.0,
        position_noise_um: 2.0,
        thermal_drift_um: 20.0,
        thermal_hours: 1e-4,
        seed: 3,
        ..SimStageConfig::ideal(200.0)
    };
    let run = |mut stage: SimStage| {
        let mut places = Vec::new();
        for target_mm in [10.0, 80.003, 79.99, 79.98, 130.0, 5.0, 5.0] {
            if target_mm == 10.0 || target_mm == 130.0 {
                stage.home().unwrap();
            }
            stage.move_to(target_mm).unwrap();
            places.push((stage.watch().get_mm(), stage.position_mm(), stage.axis.elapsed));
        }
        places
    };
    let simulated = run(SimStage::new(config.clone()));
    assert_eq!(run(SimStage::new(config).in_real_time()), simulated);
}

#[test]
fn a_stage_that_is_connected_again_stands_as_it_was_left() {
    let settings = Settings::default();
    let connect = |watch: &StagePosition| {
        let mut connection = Connection {
            open_line: &mut |_| unreachable!("a stage in memory has no line"),
            watch: watch.clone(),
            seed: 3,
            in_real_time: false,
            when_moving: WhenMoving::Wait,
        };
        CheckedStage::over(Simulated.connect(&mut connection, &settings).unwrap())
    };
    let watch = StagePosition::default();
    let mut stage = connect(&watch);
    assert_eq!(stage.state().unwrap().position_mm, None, "a new machine is not homed");
    stage.home().unwrap();
    stage.move_to(12.5).unwrap();
    drop(stage);
    let mut again = connect(&watch);
    assert_eq!(again.position_mm(), Ok(12.5));
    again.move_to(13.0).unwrap();
    assert_eq!(watch.get_mm(), 13.0);
    // It is another machine that nobody has watched.
    assert_eq!(connect(&StagePosition::default()).position_mm(), Err(StageError::NotHomed));
}
