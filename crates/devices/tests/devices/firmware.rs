//! The Uno firmware in a simulated processor, with a carriage on its pins, against the native driver.
//!
//! `firmware-protocol/uno/build.sh` builds both; without them the tests skip. Steps are counted by the carriage, times are
//! those of the simulated processor.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use epirig_devices::link::{Link, LinkError, SerialLink};
use epirig_devices::stage::native::{BAUD, NativeOptions};
use epirig_devices::stage::{NativeStage, Stage, StageError, Urgency};
use firmware_protocol::frame::{Direction, encode};
use firmware_protocol::message::{Request, Settings};
use serde_json::Value;

use crate::avr::Avr;

const STEPS_PER_MM: i64 = 250;
/// Where the plant's switch closes, and how far from it home is (the pull-off of 1 mm).
const HOME: i64 = -900 + 250;

/// The board and its carriage.
struct Board(Avr);

fn newest(folder: &Path) -> SystemTime {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries.map(|entry| entry.metadata().unwrap().modified().unwrap()).max().unwrap()
}

/// A board that has just been switched on; `None`, loudly, if it has not been built.
fn board() -> Option<Board> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let built = root.join("target/uno");
    let (firmware, plant): (PathBuf, PathBuf) = (built.join("stage-uno.elf"), built.join("plant"));
    if !firmware.exists() || !plant.exists() {
        let required = std::env::var_os("EPIRIG_REQUIRE_FIRMWARE").is_some();
        assert!(!required, "the firmware is required and not built");
        println!("SKIPPED: there is no firmware in target/uno; firmware-protocol/uno/build.sh builds it");
        return None;
    }
    let sources =
        ["firmware-protocol/src", "firmware-protocol/uno/src"].map(|folder| newest(&root.join(folder)));
    let age = firmware.metadata().unwrap().modified().unwrap();
    assert!(
        sources.iter().all(|time| *time <= age),
        "the firmware is older than its source: run build.sh again"
    );
    Some(Board(Avr::start(&plant, &firmware)))
}

impl Board {
    fn tell(&mut self, command: &str) -> Value {
        let answer = self.0.tell(command);
        assert_eq!(answer["command"], command);
        answer
    }

    fn carriage(&mut self) -> i64 {
        self.tell("state")["carriage"].as_i64().unwrap()
    }

    fn link(&self) -> SerialLink {
        SerialLink::open(self.0.port(), BAUD).unwrap()
    }

    fn connect(&self, settings: Settings) -> NativeStage {
        let options = NativeOptions { settings: Some(settings) };
        NativeStage::connect(Box::new(self.link()), options).unwrap()
    }

    fn homed(&self, settings: Settings) -> NativeStage {
        let mut stage = self.connect(settings);
        stage.home().unwrap();
        stage
    }
}

/// Faster than the defaults, so that the tests are; 3750 steps/s.
fn brisk() -> Settings {
    Settings {
        velocity_nm_s: 15_000_000,
        acceleration_nm_s2: 200_000_000,
        touch_velocity_nm_s: 1_000_000,
        ..Settings::default()
    }
}

#[test]
fn a_hundred_steps_of_a_scan_are_counted_exactly() {
    let Some(mut board) = board() else { return };
    let mut stage = board.homed(brisk());
    assert_eq!(board.carriage(), HOME);
    for index in 1..=100_i64 {
        let before = board.tell("state")["steps"].as_i64().unwrap();
        stage.move_to(1.5 * index as f64).unwrap();
        let after = board.tell("state");
        assert_eq!(after["steps"].as_i64().unwrap() - before, 375, "move {index}");
        assert_eq!(after["carriage"].as_i64().unwrap(), HOME + index * 375, "move {index}");
        assert_eq!(after["unpowered_steps"].as_i64(), Some(0));
    }
    // 3750 steps/s are 267 us apart; a tick of jitter either way, and the interrupt may wait for another one.
    let shortest_us = board.tell("state")["shortest_gap_us"].as_f64().unwrap();
    println!("shortest gap between steps {shortest_us} us");
    assert!(shortest_us > 267.0 - 100.0 - 60.0, "{shortest_us} us");
    stage.home().unwrap();
    assert_eq!(board.carriage(), HOME);
    assert_eq!(stage.home_shift_mm(), Some(0.0));
}

#[test]
fn a_limit_stops_the_move_and_homing_recovers() {
    let Some(mut board) = board() else { return };
    let mut stage = board.homed(brisk());
    let during = std::thread::spawn(move || (stage.move_to(190.0), stage));
    std::thread::sleep(Duration::from_millis(800));
    let hit_at = board.tell("switch closed")["carriage"].as_i64().unwrap();
    let (moved, mut stage) = during.join().unwrap();
    let error = moved.unwrap_err().to_string();
    assert!(error.contains("a limit switch closed"), "{error}");
    let stopped_at = board.carriage();
    // Debouncing takes 4 ticks of 0.1 ms, less than two steps at 3750 steps/s; and a step may be under way.
    assert!((hit_at..=hit_at + 3).contains(&stopped_at), "hit at {hit_at}, stopped at {stopped_at}");
    assert_eq!(stage.move_to(1.0), Err(StageError::NotHomed));
    board.tell("switch auto");
    stage.home().unwrap();
    assert_eq!(board.carriage(), HOME);
}

#[test]
fn a_switch_that_never_closes_ends_homing() {
    let Some(mut board) = board() else { return };
    board.tell("switch open");
    let settings = Settings { seek_velocity_nm_s: 20_000_000, acceleration_nm_s2: 400_000_000, ..brisk() };
    let error = board.connect(settings).home().unwrap_err().to_string();
    assert!(error.contains("the home switch never closed"), "{error}");
}

/// PROTOCOL.md: at rest within watchdog_ms + velocity / acceleration + 10 ms after the last valid request.
#[test]
fn silence_stops_the_stage_within_the_promised_time() {
    let Some(mut board) = board() else { return };
    let settings = Settings::default();
    drop(board.homed(settings));
    let mut link = board.link();
    let request = Request::Move { id: 1000, position_nm: 190_000_000 };
    let sent = board.tell("state")["simulated_s"].as_f64().unwrap();
    link.send(encode(Direction::Request, 1, &request).unwrap().bytes()).unwrap();
    std::thread::sleep(Duration::from_secs(2));
    let after = board.tell("state");
    let last_step = after["simulated_s"].as_f64().unwrap() - after["since_last_step_s"].as_f64().unwrap();
    let ramp_s = f64::from(settings.velocity_nm_s) / f64::from(settings.acceleration_nm_s2);
    let promised = f64::from(settings.watchdog_ms) / 1000.0 + ramp_s + 0.010;
    // The frame itself takes 1 ms at 115200 baud and comes to the processor within a slice of the simulation.
    println!("stopped {:.4} s after the request, {promised} s promised", last_step - sent);
    assert!((0.5..=promised + 0.005).contains(&(last_step - sent)), "{} s", last_step - sent);
    drop(link);
    // It slowed down, so it has kept count, as homing shows.
    let mut stage = board.connect(settings);
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    stage.home().unwrap();
    assert_eq!((stage.home_shift_mm(), board.carriage()), (Some(0.0), HOME));
}

#[test]
fn a_cable_pulled_in_mid_move_stops_the_stage_which_is_found_again() {
    let Some(mut board) = board() else { return };
    let mut stage = board.homed(brisk());
    let during = std::thread::spawn(move || stage.move_to(190.0));
    std::thread::sleep(Duration::from_millis(600));
    let pulled_at = board.tell("unplug")["carriage"].as_i64().unwrap();
    let error = during.join().unwrap().unwrap_err();
    assert!(matches!(error, StageError::Link(LinkError::Lost { .. })), "{error}");
    std::thread::sleep(Duration::from_secs(1));
    let stopped_at = board.tell("plug")["carriage"].as_i64().unwrap();
    // 0.5 s of watchdog at 15 mm/s, and the ramp of 0.56 mm.
    assert!(stopped_at - pulled_at < 8 * 250 + 300, "{pulled_at} {stopped_at}");
    let mut stage = board.connect(brisk());
    assert_eq!(stage.position_mm(), Err(StageError::NotHomed));
    stage.home().unwrap();
    assert_eq!(stage.home_shift_mm(), Some(0.0));
    stage.move_to(3.0).unwrap();
    assert_eq!(board.carriage(), HOME + 750);
}

#[test]
fn a_reset_in_mid_move_is_noticed() {
    let Some(mut board) = board() else { return };
    let mut stage = board.homed(brisk());
    let during = std::thread::spawn(move || (stage.move_to(190.0), stage));
    std::thread::sleep(Duration::from_millis(600));
    board.tell("reset");
    let (moved, mut stage) = during.join().unwrap();
    assert!(matches!(moved, Err(StageError::Restarted { .. })), "{moved:?}");
    stage.home().unwrap();
    assert_eq!(board.carriage(), HOME);
}

#[test]
fn stops_are_gentle_or_at_once() {
    let Some(mut board) = board() else { return };
    let mut stage = board.homed(brisk());
    for urgency in [Urgency::Soon, Urgency::AtOnce] {
        let switch = stage.stop_switch();
        let during = std::thread::spawn(move || (stage.move_to(190.0), stage));
        std::thread::sleep(Duration::from_millis(600));
        switch.press(urgency);
        let moved;
        (moved, stage) = during.join().unwrap();
        switch.release();
        let stopped_at = board.carriage();
        std::thread::sleep(Duration::from_millis(200));
        assert_eq!(board.carriage(), stopped_at);
        match (urgency, moved.unwrap_err()) {
            (Urgency::Soon, StageError::Stopped { position_mm: Some(position_mm) }) => {
                assert_eq!((position_mm * STEPS_PER_MM as f64).round() as i64, stopped_at - HOME);
                stage.move_to(0.0).unwrap();
            }
            (Urgency::AtOnce, StageError::Stopped { position_mm: None }) => {}
            (_, other) => panic!("{other}"),
        }
    }
    stage.home().unwrap();
    assert_eq!(board.carriage(), HOME);
}
