//! The protocol between epirig and the firmware of its stage.
//!
//! The crate is reserved: it holds no message yet. What it will hold is stated here so that nobody puts it
//! elsewhere: messages, framing and the state machine of the stage side, without allocation and without
//! input/output of its own, so that the host, the simulator and the firmware run the same code.
#![no_std]
