//! The processor: registers, interrupts, and the one cell that they share with the main loop. All unsafe code is here.

use core::arch::asm;
use core::cell::UnsafeCell;
use core::sync::atomic::{Ordering, compiler_fence};

/// An 8-bit register of the ATmega328P, by its address in data space.
#[derive(Clone, Copy)]
pub struct Register(u16);

/// Port B: input, direction, output.
pub const PINB: Register = Register(0x23);
/// Direction of port B.
pub const DDRB: Register = Register(0x24);
/// Output of port B; for inputs: the pull-up.
pub const PORTB: Register = Register(0x25);
/// Direction of port D.
pub const DDRD: Register = Register(0x2A);
/// Output of port D.
pub const PORTD: Register = Register(0x2B);
/// EEPROM control.
pub const EECR: Register = Register(0x3F);
/// EEPROM data.
pub const EEDR: Register = Register(0x40);
/// EEPROM address, low byte.
pub const EEARL: Register = Register(0x41);
/// EEPROM address, high byte.
pub const EEARH: Register = Register(0x42);
/// Timer 1 interrupt mask.
pub const TIMSK1: Register = Register(0x6F);
/// Timer 1 control A.
pub const TCCR1A: Register = Register(0x80);
/// Timer 1 control B.
pub const TCCR1B: Register = Register(0x81);
/// Timer 1 compare A, low byte. The high byte is written first.
pub const OCR1AL: Register = Register(0x88);
/// Timer 1 compare A, high byte.
pub const OCR1AH: Register = Register(0x89);
/// Serial port status.
pub const UCSR0A: Register = Register(0xC0);
/// Serial port control.
pub const UCSR0B: Register = Register(0xC1);
/// Serial port frame format.
pub const UCSR0C: Register = Register(0xC2);
/// Serial port baud rate, low byte.
pub const UBRR0L: Register = Register(0xC4);
/// Serial port baud rate, high byte.
pub const UBRR0H: Register = Register(0xC5);
/// Serial port data.
pub const UDR0: Register = Register(0xC6);

const SREG: Register = Register(0x5F);

impl Register {
    /// Reads it.
    pub fn read(self) -> u8 {
        // SAFETY: only this file makes registers, each at an address of an 8-bit register that may be read at any time.
        unsafe { core::ptr::read_volatile(self.0 as *const u8) }
    }

    /// Writes it.
    pub fn write(self, value: u8) {
        // SAFETY: as for reading; no register of the list changes memory that Rust knows of.
        unsafe { core::ptr::write_volatile(self.0 as *mut u8, value) }
    }

    /// Sets bits. Not atomic: for registers that no interrupt changes, or with interrupts off.
    pub fn set(self, bits: u8) {
        self.write(self.read() | bits);
    }

    /// Clears bits; as [`Register::set`].
    pub fn clear(self, bits: u8) {
        self.write(self.read() & !bits);
    }
}

/// Lets interrupts happen.
pub fn enable_interrupts() {
    // SAFETY: both handlers touch nothing but registers and `Shared` cells, which are ready before main starts.
    unsafe { asm!("sei") }
}

/// Lets no interrupt happen any more.
pub fn disable_interrupts() {
    // SAFETY: turning interrupts off breaks no promise of Rust's.
    unsafe { asm!("cli") }
}

/// Runs `work` with interrupts off, and puts them back as they were.
pub fn uninterrupted<R>(work: impl FnOnce() -> R) -> R {
    let before = SREG.read();
    disable_interrupts();
    compiler_fence(Ordering::SeqCst);
    let result = work();
    // What `work` stored must not be put off until interrupts are on again.
    compiler_fence(Ordering::SeqCst);
    SREG.write(before);
    result
}

/// Something that the main loop and the interrupts share. It lives in a `static`.
pub struct Shared<T>(UnsafeCell<T>);

// SAFETY: there is one core, and `with` lets no interrupt come between, so no two uses overlap in time.
unsafe impl<T: Send> Sync for Shared<T> {}

impl<T> Shared<T> {
    /// A cell that holds `value`.
    pub const fn new(value: T) -> Self {
        Self(UnsafeCell::new(value))
    }

    /// Runs `work` on it with interrupts off. `work` must not use the same cell again; nothing in this crate nests.
    pub fn with<R>(&self, work: impl FnOnce(&mut T) -> R) -> R {
        uninterrupted(|| {
            // SAFETY: interrupts are off and uses do not nest, so this is the only reference.
            work(unsafe { &mut *self.0.get() })
        })
    }
}

/// Timer 1, compare A: a tick.
// SAFETY: the name is that of the interrupt's vector, which the C library's start-up code looks for; nobody calls it.
#[unsafe(no_mangle)]
extern "avr-interrupt" fn __vector_11() {
    crate::board::on_tick();
}

/// Serial port: a byte has come.
// SAFETY: as above.
#[unsafe(no_mangle)]
extern "avr-interrupt" fn __vector_18() {
    crate::board::on_byte();
}
