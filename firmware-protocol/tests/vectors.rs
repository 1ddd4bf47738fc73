//! The golden frames, which `vectors/encode.py` made from PROTOCOL.md alone, in both directions.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::Path;

use firmware_protocol::frame::{Direction, Event, Received, Receiver, decode, encode};
use firmware_protocol::message::{
    Fault, Identity, Outcome, PROTOCOL_VERSION, Refusal, Reply, Request, Settings, Status,
};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Name and bytes of each file.
fn vectors() -> BTreeMap<String, Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("vectors");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.extension().is_some_and(|extension| extension == "hex"))
        .map(|path| {
            let text = std::fs::read_to_string(&path).unwrap();
            let words = text.lines().filter(|line| !line.starts_with('#')).flat_map(str::split_whitespace);
            let bytes = words.map(|word| u8::from_str_radix(word, 16).unwrap()).collect();
            (path.file_stem().unwrap().to_string_lossy().into_owned(), bytes)
        })
        .collect()
}

fn check<T: Serialize + DeserializeOwned + PartialEq + Debug>(
    vectors: &mut BTreeMap<String, Vec<u8>>,
    direction: Direction,
    name: &str,
    sequence: u8,
    message: &T,
) {
    let bytes = vectors.remove(name).unwrap_or_else(|| panic!("there is no vectors/{name}.hex"));
    let encoded = encode(direction, sequence, message).unwrap();
    assert_eq!(encoded.bytes(), bytes, "{name}");
    let mut receiver = Receiver::default();
    let mut found = Vec::new();
    for byte in bytes {
        if let Some(Event::Payload(payload)) = receiver.push(byte) {
            found.push(decode::<T>(direction, payload).unwrap());
        }
    }
    assert_eq!(found.len(), 1, "{name}");
    let Received { sequence: read, message: ref read_message } = found[0];
    assert_eq!((read, read_message), (sequence, message), "{name}");
}

#[test]
fn golden_requests_are_written_and_read() {
    let mut vectors = vectors();
    vectors.retain(|name, _| name.starts_with("request"));
    let largest = Settings {
        velocity_nm_s: u32::MAX,
        acceleration_nm_s2: u32::MAX,
        seek_velocity_nm_s: u32::MAX,
        touch_velocity_nm_s: u32::MAX,
        pull_off_nm: u32::MAX,
        watchdog_ms: u16::MAX,
    };
    let requests = [
        ("request-hello", 0, Request::Hello { version: PROTOCOL_VERSION }),
        ("request-status", 1, Request::Status),
        ("request-home", 2, Request::Home { id: 1 }),
        ("request-move", 3, Request::Move { id: 2, position_nm: 1_500_000 }),
        ("request-move-far", 127, Request::Move { id: u32::MAX, position_nm: i64::MIN }),
        ("request-stop", 4, Request::Stop),
        ("request-heartbeat", 5, Request::Heartbeat),
        ("request-read-settings", 6, Request::ReadSettings),
        ("request-write-settings", 7, Request::WriteSettings(Settings::default())),
        ("request-write-settings-largest", 127, Request::WriteSettings(largest)),
    ];
    for (name, sequence, request) in requests {
        check(&mut vectors, Direction::Request, name, sequence, &request);
    }
    assert!(vectors.is_empty(), "not tested: {:?}", vectors.keys());
}

#[test]
fn golden_replies_are_written_and_read() {
    let mut vectors = vectors();
    vectors.retain(|name, _| !name.starts_with("request"));
    let identity = Identity {
        version: PROTOCOL_VERSION,
        build: 1,
        steps_per_mm: 250,
        travel_nm: 200_000_000,
        boot_id: 7,
        last_operation: 0,
    };
    let at_rest = Status {
        boot_id: 7,
        position_nm: 1_500_000,
        moving: false,
        homed: true,
        limits: 0,
        fault: Fault::None,
        operation: 2,
        outcome: Outcome::Done,
        home_shift_nm: 0,
    };
    let at_fault = Status {
        position_nm: -4000,
        homed: false,
        limits: 3,
        fault: Fault::HardLimit,
        operation: 300,
        outcome: Outcome::Failed,
        home_shift_nm: 12_000,
        ..at_rest
    };
    let replies = [
        ("reply-hello", 0, Reply::Hello(identity)),
        ("reply-status-rest", 1, Reply::Status(at_rest)),
        ("reply-status-fault", 9, Reply::Status(at_fault)),
        ("reply-accepted", 3, Reply::Accepted { id: 2, target_nm: 1_500_000 }),
        ("reply-finished", 3, Reply::Finished { id: 2, outcome: Outcome::Done, position_nm: 1_500_000 }),
        ("reply-refused", 3, Reply::Refused(Refusal::NotHomed)),
        ("reply-alive", 5, Reply::Alive { boot_id: 7, moving: true }),
        ("reply-settings", 7, Reply::Settings(Settings::default())),
    ];
    for (name, sequence, reply) in replies {
        check(&mut vectors, Direction::Reply, name, sequence, &reply);
    }
    assert!(vectors.is_empty(), "not tested: {:?}", vectors.keys());
}
