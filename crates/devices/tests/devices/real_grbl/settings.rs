//! Settings of GRBL that change what it says, and where things are.

use epirig_devices::stage::{Stage, StageError};

use super::board::{SWITCH, board};
use super::{HOME, STEPS_PER_MM};

#[test]
fn reports_that_hide_the_position_are_refused_with_what_to_send() {
    let Some(board) = board(&[]) else { return };
    for (line, word) in [
        ("$10=0", "send $10=1 with"),
        ("$10=2", "send $10=3 with"),
        ("$13=1", "send $13=0 with"),
        ("$22=0", "send $22=1 with"),
    ] {
        board.other_program(line);
        let error = board.connect_x().err().unwrap().to_string();
        assert!(error.contains(word), "{line}: {error}");
        board.other_program(match line {
            "$13=1" => "$13=0",
            "$22=0" => "$22=1",
            _ => "$10=1",
        });
    }
    board.other_program("$10=3");
    board.connect().home().unwrap();
}

#[test]
fn the_travel_begins_at_home_whichever_way_it_homes() {
    // The bits of $3 turn the motor round, those of $23 the way to the switch.
    for (turned, to_negative) in [(0, 1), (1, 0), (1, 1)] {
        let Some(mut board) = board(&[(3, f64::from(turned)), (23, f64::from(to_negative))]) else { return };
        // In which direction of the carriage the switch is.
        let towards = if turned == to_negative { 1 } else { -1 };
        board.tell(if towards == 1 { "lo x -1000000" } else { "sw x 1000000" });
        if towards == -1 {
            board.tell(&format!("lo x -{SWITCH}"));
        }
        let mut stage = board.connect();
        stage.home().unwrap();
        assert_eq!(board.carriage(0), towards * HOME, "$3={turned} $23={to_negative}");
        for place_mm in [5.0, 59.0, 0.0, 0.01] {
            stage.move_to(place_mm).unwrap();
            let steps = (place_mm * STEPS_PER_MM) as i64;
            assert_eq!(
                towards * (towards * HOME - board.carriage(0)),
                steps,
                "$3={turned} $23={to_negative}"
            );
        }
        assert!(matches!(stage.move_to(59.01), Err(StageError::OutsideTravel { .. })));
        drop(stage);
        assert_eq!(board.connect().position_mm(), Ok(0.01));
    }
}

#[test]
fn a_hard_limit_in_mid_move_is_named() {
    let Some(mut board) = board(&[(21, 1.0), (110, 600.0)]) else { return };
    let mut stage = board.connect();
    stage.home().unwrap();
    let moving = std::thread::spawn(move || (stage.move_to(40.0), stage));
    std::thread::sleep(std::time::Duration::from_millis(800));
    let hit_at = board.tell("lim x 1")["pos"][0].as_i64().unwrap();
    let (moved, mut stage) = moving.join().unwrap();
    let error = moved.unwrap_err().to_string();
    assert!(error.contains("a limit switch closed") && error.contains("ALARM:1"), "{error}");
    // A slice of the simulation at 10 mm/s.
    assert!((board.carriage(0) - hit_at).abs() <= 10);
    assert_eq!(stage.move_to(1.0), Err(StageError::NotHomed));
    board.tell("lim x auto");
    stage.home().unwrap();
    assert_eq!(board.carriage(0), HOME);
}

#[test]
fn settings_that_change_between_and_in_a_power_loss_are_found_before_anything_moves() {
    let Some(mut board) = board(&[]) else { return };
    let mut stage = board.connect();
    let recorded = stage.position_settings().unwrap();
    assert_eq!((recorded["$100"], recorded["$27"], recorded["$130"]), (STEPS_PER_MM, 1.0, 60.0));
    stage.home().unwrap();
    stage.move_to(5.0).unwrap();
    drop(stage);
    // Between two processes.
    board.other_program("$100=50");
    let at = board.carriage(0);
    let mut stage = board.connect();
    assert_eq!(stage.position_settings().unwrap()["$100"], 50.0);
    assert_eq!(board.carriage(0), at);
    stage.home().unwrap();
    // 1 mm below the switch is 50 steps now, and 10 mm are 500.
    assert_eq!(board.carriage(0), SWITCH - 50);
    stage.move_to(10.0).unwrap();
    assert_eq!(SWITCH - 50 - board.carriage(0), 500);
    // While it is connected, and its power goes.
    "$100=100\n$27=2\n".bytes().for_each(|byte| board.slip_in(byte));
    std::thread::sleep(std::time::Duration::from_millis(300));
    board.tell("reset");
    assert!(stage.move_to(20.0).is_err());
    let found = stage.position_settings().unwrap();
    assert_eq!((found["$100"], found["$27"]), (STEPS_PER_MM, 2.0));
    stage.home().unwrap();
    assert_eq!(board.carriage(0), SWITCH - 200);
    stage.move_to(10.0).unwrap();
    assert_eq!(SWITCH - 200 - board.carriage(0), 1000);
}
