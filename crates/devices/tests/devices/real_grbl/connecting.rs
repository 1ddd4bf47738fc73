//! Connecting to GRBL: on damaged lines, and to controllers in unusual states.

use std::time::{Duration, Instant};

use epirig_devices::stage::{Stage, StageError, Urgency};

use super::board::{Board, board};
use super::{HOME, STEPS_PER_MM};

/// The safety door, as a byte: one flipped bit makes it of the one that cancels a jog.
const DOOR: u8 = 0x84;

/// A hold that is not recognised is waited for so long.
const UNRECOGNISED: Duration = Duration::from_secs(10);

/// What the driver sends when it connects to a controller that it has homed.
const CONNECTING: &str = "?\n$$\n$$\n$G\n$G\n";

/// Connects once for each damage of one byte of the lines that are sent; 0 loses the byte. Nothing may move.
fn damaged_connections(becomes: impl Fn(u8) -> Vec<u8>) {
    let Some(mut board) = board(&[]) else { return };
    board.connect().home().unwrap();
    for (index, byte) in CONNECTING.bytes().enumerate() {
        let nth = CONNECTING.bytes().take(index + 1).filter(|other| *other == byte).count();
        for becomes in becomes(byte) {
            let steps = board.tell(&format!("edit {byte} {nth} {becomes}"))["steps"].clone();
            let connected = board.connect_x();
            let after = board.tell("edit 1 1 1");
            let context = format!("{:?} {nth} becomes {becomes}", char::from(byte));
            assert_eq!(after["steps"], steps, "{context}");
            let position_mm = connected.and_then(|mut stage| stage.position_mm());
            println!("{context}: {position_mm:?}");
            assert!(position_mm.is_err() || position_mm == Ok(0.0), "{context}: {position_mm:?}");
            assert_eq!(board.carriage(0), HOME, "{context}");
            // Some of them leave it in check mode.
            if position_mm.is_err() {
                board.connect().home().unwrap();
            }
        }
    }
}

#[test]
fn a_damaged_letter_while_connecting_moves_nothing() {
    damaged_connections(|byte| match byte {
        b'G' => (0..8).map(|bit| byte ^ (1 << bit)).collect(),
        b'$' => vec![0],
        _ => vec![],
    });
}

#[test]
#[ignore = "takes some minutes"]
fn no_damaged_byte_while_connecting_moves_anything() {
    damaged_connections(|byte| (0..8).map(|bit| byte ^ (1 << bit)).chain([0]).collect());
}

#[test]
fn a_safety_door_in_mid_move_stops_the_stage_and_is_named() {
    let Some(mut board) = board(&[(110, 600.0)]) else { return };
    let mut stage = board.connect();
    stage.home().unwrap();
    let moving = std::thread::spawn(move || (stage.move_to(40.0), stage));
    std::thread::sleep(Duration::from_millis(800));
    board.slip_in(DOOR);
    let opened = Instant::now();
    let (moved, mut stage) = moving.join().unwrap();
    let error = moved.unwrap_err().to_string();
    assert!(error.contains("its safety door is open"), "{error}");
    assert!(opened.elapsed() < UNRECOGNISED, "{:?}", opened.elapsed());
    stage.home().unwrap();
    assert_eq!(board.carriage(0), HOME);
}

#[test]
fn a_stop_that_becomes_a_safety_door_stops_as_well() {
    let Some(mut board) = board(&[(110, 600.0)]) else { return };
    let mut stage = board.connect();
    stage.home().unwrap();
    let switch = stage.stop_switch();
    let moving = std::thread::spawn(move || (stage.move_to(40.0), stage));
    std::thread::sleep(Duration::from_millis(800));
    board.tell(&format!("edit {} 1 {DOOR}", DOOR ^ 1));
    switch.press(Urgency::Soon);
    let pressed = Instant::now();
    let (moved, mut stage) = moving.join().unwrap();
    assert!(pressed.elapsed() < UNRECOGNISED, "{:?}", pressed.elapsed());
    switch.release();
    let Err(StageError::Stopped { position_mm: Some(position_mm) }) = moved else { panic!("{moved:?}") };
    assert_eq!((position_mm * STEPS_PER_MM).round() as i64, HOME - board.carriage(0));
    stage.move_to(1.0).unwrap();
    assert_eq!(HOME - board.carriage(0), STEPS_PER_MM as i64);
}

#[test]
fn a_stage_behind_a_safety_door_can_be_connected() {
    let Some(mut board) = board(&[]) else { return };
    board.connect().home().unwrap();
    board.slip_in(DOOR);
    let began = Instant::now();
    let mut stage = board.connect();
    assert!(began.elapsed() < UNRECOGNISED, "{:?}", began.elapsed());
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    stage.home().unwrap();
    stage.move_to(1.0).unwrap();
    assert_eq!(HOME - board.carriage(0), STEPS_PER_MM as i64);
}

/// Where the carriage is not at home, although the controller counts so.
fn displaced(board: &mut Board) {
    // The other program counts 3 mm to and fro; the carriage goes one way. A dwell waits for the end.
    board.other_program("G91G0X-3");
    board.other_program("G4P0.1");
    board.tell("jam 300");
    board.other_program("G0X3");
    board.other_program("G4P0.1");
}

#[test]
fn an_order_to_home_that_is_lost_is_not_taken_for_done() {
    let Some(mut board) = board(&[]) else { return };
    let mut stage = board.connect();
    stage.home().unwrap();
    drop(stage);
    displaced(&mut board);
    assert_ne!(board.carriage(0), HOME);
    let mut stage = board.connect();
    // The letter, or the end of the line.
    for (damage, becomes) in [(b'H', 0), (b'H', b'X'), (b'H', b'@')] {
        board.tell(&format!("edit {damage} 1 {becomes}"));
        let homed = stage.home();
        board.tell("edit 1 1 1");
        assert!(homed.is_err(), "{damage} {becomes}: {homed:?}");
        assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    }
    stage.home().unwrap();
    assert_eq!(board.carriage(0), HOME);
}
