//! epirig's stage on an Arduino Uno: pins, a timer and a serial port around the protocol's own state machine.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

mod board;
mod hardware;
mod machine;

use core::panic::PanicInfo;

use firmware_protocol::device::{Device, SharedAxis};

use board::Board;

/// A stage whose program has failed stands still and is silent: the host finds no answer, and no step is made.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    hardware::disable_interrupts();
    loop {}
}

/// Called by the C library's start-up code.
// SAFETY: this is the program's only `main`, of the signature that the start-up code expects.
#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    let mut board = Board::new();
    let mut device = Device::new(machine::BUILD, board.count_boot());
    let mut axis = board.axis();
    hardware::enable_interrupts();
    loop {
        if let Some(byte) = board.receive() {
            if let Some(frame) = device.receive(byte, &mut axis) {
                if axis.with(|axis| axis.snapshot().moving) {
                    board.power_motor();
                }
                board.send(frame.bytes());
            }
        }
        if let Some(frame) = device.poll(&mut axis) {
            board.send(frame.bytes());
        }
    }
}
