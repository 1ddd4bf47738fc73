//! Whatever goes wrong with a camera ends with the right frame or with an error that says what it was: never with a wrong frame, and
//! never late. Here with the simulated camera; tests/virtual_rig.rs does the same with a real driver.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

#[path = "support/faults.rs"]
mod faults;
#[path = "support/sim_bench.rs"]
mod sim_bench;

use faults::{FAULTS, Fault, outcome};
use sim_bench::SimBench;

#[test]
fn every_fault_ends_with_the_right_frame_or_a_typed_error() {
    let errors = [
        (Fault::LongSilence, "error `Timeout`"),
        (Fault::NoSignal, "error `NoSignal`"),
        (Fault::AnotherCamera, "gone is noticed, and after reconnecting: error `AnotherCamera`"),
        (Fault::Disconnect, "gone is noticed, and after reconnecting: the right frame"),
    ];
    let mut bench = SimBench::new();
    let mut seen = 0;
    for (step, (fault, _)) in FAULTS.iter().enumerate() {
        let Some(found) = outcome(&mut bench, *fault, step) else { continue };
        let expected =
            errors.iter().find(|(error, _)| error == fault).map_or("the right frame", |(_, words)| words);
        assert_eq!(found, expected, "{fault:?}");
        seen += 1;
    }
    assert!(seen >= 25, "only {seen} faults were tried");
}
