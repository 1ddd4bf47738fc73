//! Any bytes from a stage that speaks in lines, and any transcript: no panic, no line longer than its bound.
#![no_main]

use epirig_devices::link::{Side, SimulatedDevice, Transcript};
use epirig_devices::stage::drivers;
use epirig_devices::stage::grbl::Response;
use epirig_devices::stage::simulator::{GrblDevice, ZaberDevice};
use epirig_devices::stage::zaber::ZaberReply;
use libfuzzer_sys::fuzz_target;

/// Lines are cut at 256 bytes; escapes and replacement characters make them longer, at most tenfold.
const LONGEST_TEXT: usize = 4000;

fuzz_target!(|bytes: &[u8]| {
    for mut decoder in drivers().into_iter().filter_map(|driver| driver.decoder()) {
        for side in [Side::Host, Side::Device] {
            let texts = decoder.push(side, bytes);
            assert!(texts.iter().all(|text| text.len() < LONGEST_TEXT));
        }
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        let _ = Response::parse(text).to_string();
        let _ = ZaberReply::parse(text);
        let _ = Transcript::parse(text);
        let _ = Transcript::parse(&format!("# epirig transcript 1\n{text}"));
    }
    let (mut grbl, mut zaber) = (GrblDevice::default(), ZaberDevice::default());
    let moment = std::time::Duration::from_millis(1);
    for _ in 0..30 {
        grbl.advance(moment);
    }
    for &byte in bytes.iter().take(200) {
        grbl.receive(byte);
        zaber.receive(byte);
        if byte == b'\n' {
            grbl.advance(moment);
            zaber.advance(moment);
        }
    }
});
