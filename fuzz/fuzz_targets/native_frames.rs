//! Any bytes at either end of the native protocol: no panic, and what is understood is encoded as it came.
#![no_main]

use epirig_devices::link::Side;
use epirig_devices::stage::StageDriver as _;
use epirig_devices::stage::native::Native;
use firmware_protocol::axis::{Axis, Limits};
use firmware_protocol::device::{Build, Device};
use firmware_protocol::frame::{Direction, Event, Receiver, decode, encode};
use firmware_protocol::message::{Reply, Request};
use libfuzzer_sys::fuzz_target;

const BUILD: Build = Build { number: 1, steps_per_mm: 250, travel_nm: 200_000_000, tick_hz: 10_000 };

fuzz_target!(|bytes: &[u8]| {
    let mut receiver = Receiver::default();
    let (mut device, mut axis) = (Device::new(BUILD, 1), Axis::new());
    for &byte in bytes {
        if let Some(Event::Payload(payload)) = receiver.push(byte) {
            let (mut request, mut reply) = (payload.to_vec(), payload.to_vec());
            if let Ok(read) = decode::<Request>(Direction::Request, &mut request) {
                assert_eq!(again(Direction::Request, read.sequence, &read.message), read.message);
            }
            if let Ok(read) = decode::<Reply>(Direction::Reply, &mut reply) {
                assert_eq!(again(Direction::Reply, read.sequence, &read.message), read.message);
            }
        }
        device.receive(byte, &mut axis);
        for _ in 0..3 {
            axis.tick(Limits { home: byte & 1 == 1, far: byte & 6 == 6 });
        }
        device.poll(&mut axis);
    }
    let mut decoder = Native.decoder().expect("a stage with a line");
    for side in [Side::Host, Side::Device] {
        let texts = decoder.push(side, bytes);
        assert!(texts.iter().all(|text| text.len() < 400));
    }
});

/// A message after another journey.
fn again<T: serde::Serialize + serde::de::DeserializeOwned>(
    direction: Direction,
    sequence: u8,
    message: &T,
) -> T {
    let encoded = encode(direction, sequence, message).expect("every message fits a frame");
    let mut payload = encoded.bytes()[1..encoded.bytes().len() - 1].to_vec();
    decode(direction, &mut payload).expect("what we encode we decode").message
}
