//! The GRBL driver against GRBL itself. The truth is what the carriage did, not what the firmware says.

mod board;
mod connecting;
mod settings;

use std::time::{Duration, Instant};

use board::{Board, SWITCH, board};
use epirig_devices::stage::grbl::AxisLetter;
use epirig_devices::stage::{Stage, StageError, Urgency};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Home with the settings of the tests: the pull-off of 1 mm below the switch, at 100 steps/mm.
const HOME: i64 = SWITCH - 100;
const STEPS_PER_MM: f64 = 100.0;
/// What a damaged order may do at most.
const MILLIMETRE: i64 = 100;

#[test]
fn a_hundred_stops_are_exact_to_the_step() {
    let Some(mut board) = board(&[]) else { return };
    let mut stage = board.connect();
    assert_eq!(stage.travel_mm(), 59.0);
    stage.home().unwrap();
    assert_eq!(board.carriage(0), HOME);
    let others = (board.carriage(1), board.carriage(2));
    for stop in 1..=100_i64 {
        stage.move_to(0.57 * stop as f64).unwrap();
        assert_eq!(HOME - board.carriage(0), 57 * stop);
    }
    stage.move_to(59.0).unwrap();
    assert_eq!(HOME - board.carriage(0), 5900);
    assert_eq!((board.carriage(1), board.carriage(2)), others, "the other axes stand");
    // Another process finds it again.
    drop(stage);
    assert_eq!(board.connect().position_mm(), Ok(59.0));
}

#[test]
fn a_position_counts_only_with_the_settings_it_was_homed_with() {
    let Some(board) = board(&[]) else { return };
    board.connect().home().unwrap();
    assert_eq!(board.connect().position_mm(), Ok(0.0));
    // GRBL may have homed Y, too, but not for this program.
    assert_eq!(board.connect_axis(AxisLetter::Y).unwrap().position_mm(), Err(StageError::NotHomed));
    for (change, back) in [("$130=100", "$130=60"), ("$100=101", "$100=100"), ("$1=25", "$1=255")] {
        board.connect().home().unwrap();
        board.other_program(change);
        let mut stage = board.connect();
        assert_eq!(stage.position_mm(), Err(StageError::NotHomed), "{change}");
        assert_eq!(stage.move_to(1.0), Err(StageError::NotHomed), "{change}");
        drop(stage);
        board.other_program(back);
    }
    // The motor was let go meanwhile, so the old value does not bring the position back.
    assert_eq!(board.connect().position_mm(), Err(StageError::NotHomed));
}

/// What the driver sends for a move: the origin of the work coordinates, then the jog. Digits of the origin stand for
/// themselves: they only count the bytes.
const ORDER: &str = "G90G94G21G92X-8.1700Y0Z0F1234567\n$J=X.0G90G21F777777\n";

/// One byte of an order and what it becomes; 0 if it is lost. The first is counted among its like.
fn damages(bytes: impl Fn(usize, char) -> Vec<u8>) -> Vec<(u8, usize, u8)> {
    let mut damages = Vec::new();
    for (index, letter) in ORDER.char_indices() {
        let nth = ORDER[..=index].chars().filter(|other| *other == letter).count();
        damages.extend(bytes(index, letter).into_iter().map(|becomes| (letter as u8, nth, becomes)));
    }
    damages
}

/// Gives orders of which one byte is damaged: whatever comes of it, the carriage stays within a millimetre of its way, the
/// other axes stand, and what is said to be done is done.
fn damaged_orders(soft_limits: f64, damages: &[(u8, usize, u8)]) {
    let Some(mut board) = board(&[(20, soft_limits)]) else { return };
    let mut stage = board.connect();
    stage.home().unwrap();
    let others = (board.carriage(1), board.carriage(2));
    let (mut at, mut errors) = (0, 0);
    for (index, (what, nth, becomes)) in damages.iter().enumerate() {
        // To and fro, with several digits.
        let target = if index % 2 == 0 { 1030 } else { 213 };
        board.forget_extremes();
        board.tell(&format!("edit {what} {nth} {becomes}"));
        let moved = stage.move_to(target as f64 / STEPS_PER_MM);
        board.tell("edit 1 1 1");
        let what = char::from(*what);
        let context = format!("{what:?} {nth} becomes {becomes}, $20={soft_limits}: {moved:?}");
        let (low, high) = board.extremes();
        assert!(HOME - high >= at.min(target) - MILLIMETRE, "{context}");
        assert!(HOME - low <= at.max(target) + MILLIMETRE, "{context}");
        assert_eq!((board.carriage(1), board.carriage(2)), others, "{context}");
        match moved {
            Ok(()) => assert_eq!(HOME - board.carriage(0), target, "{context}"),
            Err(error) => {
                println!("{context}: {error}");
                errors += 1;
                if stage.home().is_err() {
                    // Its first order may be damaged, too.
                    stage.home().unwrap();
                }
            }
        }
        at = HOME - board.carriage(0);
    }
    println!("$20={soft_limits}: {errors} of {} orders failed", damages.len());
}

#[test]
fn a_damaged_order_goes_nowhere_else() {
    // Points, signs, letters and digits that would matter most.
    let some = |_: usize, letter: char| match letter {
        '.' | '-' => vec![0],
        'G' => vec![b'F'],
        '2' => vec![b'3', b'0'],
        'X' => vec![b'Y', 0],
        _ => vec![],
    };
    damaged_orders(0.0, &damages(some));
}

#[test]
#[ignore = "takes ten minutes"]
fn no_damaged_byte_of_an_order_goes_anywhere_else() {
    // Each of the eight bits, and the loss of the byte.
    let all = |_: usize, letter: char| (0..8).map(|bit| letter as u8 ^ (1 << bit)).chain([0]).collect();
    damaged_orders(0.0, &damages(all));
}

#[test]
fn a_damaged_status_at_rest_is_not_believed() {
    let Some(mut board) = board(&[]) else { return };
    let mut stage = board.connect();
    stage.home().unwrap();
    stage.move_to(6.0).unwrap();
    drop(stage);
    for mask in [1, 2, 4, 8] {
        // The next status after the handshake.
        board.tell(&format!("oarm {mask}"));
        assert_eq!(board.connect().position_mm(), Ok(6.0), "mask {mask}");
        board.tell(&format!("oarm {mask}"));
        assert_eq!(board.connect().state().unwrap().position_mm, Some(6.0), "mask {mask}");
    }
}

/// Neither 1.006 nor 0.994 mm are whole steps.
#[test]
fn home_is_a_whole_step_in_each_process() {
    for pull_off_mm in [1.006, 0.994] {
        let Some(mut board) = board(&[(100, 80.0), (27, pull_off_mm)]) else { return };
        let mut stage = board.connect();
        stage.home().unwrap();
        let home = board.carriage(0);
        drop(stage);
        let mut stage = board.connect();
        assert_eq!(stage.position_mm(), Ok(0.0));
        stage.move_to(5.0).unwrap();
        assert_eq!((stage.position_mm(), home - board.carriage(0)), (Ok(5.0), 400));
        let travel_mm = stage.travel_mm();
        stage.move_to(travel_mm).unwrap();
        assert_eq!(home - board.carriage(0), (travel_mm * 80.0).round() as i64);
        assert!(matches!(stage.move_to(travel_mm + 0.02), Err(StageError::OutsideTravel { .. })));
    }
}

fn press(board: &mut Board, pin: u8) {
    board.tell(&format!("pin C {pin} 0"));
    std::thread::sleep(Duration::from_millis(50));
    board.tell(&format!("pin C {pin} 1"));
}

#[test]
fn feed_hold_is_named_and_can_be_gone_on_from() {
    // Slow, so that there is time to press it.
    let Some(mut board) = board(&[(110, 600.0)]) else { return };
    let mut stage = board.connect();
    stage.home().unwrap();
    let moving = std::thread::spawn(move || {
        let moved = stage.move_to(40.0);
        (moved, Instant::now(), stage)
    });
    std::thread::sleep(Duration::from_millis(800));
    press(&mut board, 1);
    let pressed = Instant::now();
    let (moved, ended, mut stage) = moving.join().unwrap();
    let error = moved.unwrap_err();
    assert!(matches!(error, StageError::Held { position_mm: Some(_) }), "{error}");
    assert!(ended - pressed < Duration::from_secs(1), "{:?}", ended - pressed);
    // The hold ended the motion with a ramp, and the position is right.
    stage.move_to(10.0).unwrap();
    assert_eq!(HOME - board.carriage(0), 1000);
    // At rest it blocks, until cycle start is pressed.
    press(&mut board, 1);
    let error = stage.move_to(12.0).unwrap_err().to_string();
    assert!(error.starts_with("the stage is held at 10.000 mm: feed hold was pressed"), "{error}");
    assert!(error.contains("press cycle start"), "{error}");
    press(&mut board, 2);
    stage.move_to(12.0).unwrap();
    assert_eq!(HOME - board.carriage(0), 1200);
}

#[test]
fn homing_whose_answer_is_lost_ends_when_it_ends() {
    let Some(mut board) = board(&[]) else { return };
    let mut stage = board.connect();
    stage.home().unwrap();
    let started = Instant::now();
    stage.home().unwrap();
    let usual = started.elapsed();
    let homing = std::thread::spawn(move || {
        let started = Instant::now();
        (stage.home(), started.elapsed())
    });
    // The time of `$H`, until after its `ok`.
    std::thread::sleep(usual / 2);
    board.tell("deaf 1");
    std::thread::sleep(usual / 2 + Duration::from_millis(300));
    board.tell("deaf 0");
    let (homed, took) = homing.join().unwrap();
    homed.unwrap();
    assert_eq!(board.carriage(0), HOME);
    // Deaf for 0.3 s beyond the end, then two polls and the readings at rest.
    assert!(took < usual + Duration::from_secs(2), "{took:?} instead of {usual:?}");
}

#[test]
fn a_stop_while_homing_stops_at_once() {
    let Some(mut board) = board(&[(25, 600.0)]) else { return };
    board.tell("sw x 4000");
    let mut stage = board.connect();
    let switch = stage.stop_switch();
    let homing = std::thread::spawn(move || (stage.home(), stage));
    // Z comes first; then X is on its way to the switch, 40 mm off at 10 mm/s.
    let until = Instant::now() + Duration::from_secs(20);
    while board.carriage(0) < 500 {
        assert!(Instant::now() < until);
        std::thread::sleep(Duration::from_millis(20));
    }
    switch.press(Urgency::Soon);
    let pressed_at = board.carriage(0);
    let (homed, mut stage) = homing.join().unwrap();
    assert_eq!(homed, Err(StageError::Stopped { position_mm: None }));
    let stopped_at = board.carriage(0);
    // A poll of 0.1 s and what the simulation buffers, 10 ms each, at 10 mm/s.
    assert!(stopped_at - pressed_at < 200, "from {pressed_at} to {stopped_at}");
    switch.release();
    board.tell(&format!("sw x {}", stopped_at + 300));
    stage.home().unwrap();
    assert_eq!(board.carriage(0), stopped_at + 300 - 100);
}

#[test]
fn an_axis_that_is_homed_before_and_has_no_switch_is_named() {
    let Some(mut board) = board(&[]) else { return };
    board.connect().home().unwrap();
    let homes_z = board.carriage(2) != 0;
    board.tell("sw z 1000000");
    let homed = board.connect().home();
    if !homes_z {
        // It was built to home X alone.
        return homed.map(|_| ()).unwrap();
    }
    let error = homed.unwrap_err().to_string();
    assert!(error.contains("ALARM:9"), "{error}");
    assert!(error.contains("axis X had not moved: axis Z is homed before it"), "{error}");
}

/// Moves on a line that damages a byte in two hundred, in both directions: no position that is accepted is
/// wrong, and the carriage stays within a millimetre of its way.
fn moves_on_a_bad_line(moves: u32, soft_limits: f64, seed: u64) -> (u32, u32) {
    let Some(mut board) = board(&[(20, soft_limits)]) else { return (moves, 0) };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    board.tell(&format!("seed {seed}"));
    board.tell("noise 0.005 0.005");
    let (mut stage, mut is_homed, mut right, mut wrong) = (None, false, 0, 0);
    while right + wrong < moves {
        let Some(connected) = &mut stage else {
            stage = board.connect_axis(AxisLetter::X).ok();
            continue;
        };
        if !is_homed {
            is_homed = connected.home().is_ok();
            if is_homed {
                assert_eq!(board.carriage(0), HOME, "home, seed {seed}");
            } else {
                stage = None;
            }
            continue;
        }
        let at = HOME - board.carriage(0);
        let target = random.random_range(0..5900_i64);
        board.forget_extremes();
        let moved = connected.move_to(target as f64 / STEPS_PER_MM);
        let (low, high) = board.extremes();
        let context = format!("move {right}+{wrong} from {at} to {target}, seed {seed}: {moved:?}");
        assert!(HOME - high >= at.min(target) - MILLIMETRE, "{context}, to {}", HOME - high);
        assert!(HOME - low <= at.max(target) + MILLIMETRE, "{context}, to {}", HOME - low);
        match moved {
            Ok(()) => {
                assert_eq!(HOME - board.carriage(0), target, "{context}");
                right += 1;
            }
            Err(error) => {
                println!("{error}");
                wrong += 1;
                (stage, is_homed) = (None, false);
            }
        }
    }
    println!("$20={soft_limits}: {right} moves right, {wrong} errors");
    (right, wrong)
}

#[test]
fn a_bad_line_bends_no_move() {
    let (right, _) = moves_on_a_bad_line(5, 0.0, 1);
    assert!(right > 0);
}

#[test]
#[ignore = "takes a quarter of an hour"]
fn a_bad_line_bends_none_of_five_hundred_moves() {
    let (right, _) = moves_on_a_bad_line(500, 0.0, 2);
    assert!(right > 250);
}

#[test]
#[ignore = "takes a quarter of an hour"]
fn a_bad_line_with_soft_limits_bends_none_of_five_hundred_moves() {
    let (right, _) = moves_on_a_bad_line(500, 1.0, 3);
    assert!(right > 250);
}
