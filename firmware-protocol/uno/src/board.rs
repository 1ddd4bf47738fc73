//! The Uno with its CNC shield: step PD2, direction PD5, enable PB0, limit PB1, serial port at 115200 baud.

use firmware_protocol::axis::{Axis, Limits, Way};
use firmware_protocol::device::SharedAxis;
use firmware_protocol::frame::{DELIMITER, EMERGENCY_STOP};

use crate::hardware::{
    DDRB, DDRD, EEARH, EEARL, EECR, EEDR, OCR1AH, OCR1AL, PINB, PORTB, PORTD, Shared, TCCR1A, TCCR1B, TIMSK1,
    UBRR0H, UBRR0L, UCSR0A, UCSR0B, UCSR0C, UDR0, uninterrupted,
};
use crate::machine::TICK_HZ;

const STEP: u8 = 1 << 2;
const DIRECTION: u8 = 1 << 5;
const DISABLE: u8 = 1 << 0;
const LIMIT: u8 = 1 << 1;

const CLOCK_HZ: u32 = 16_000_000;
const TIMER_PRESCALER: u32 = 8;
const TIMER_TOP: u16 = (CLOCK_HZ / TIMER_PRESCALER / TICK_HZ - 1) as u16;

const READY_TO_SEND: u8 = 1 << 5;

/// Axis and pins as the timer sees them.
struct Motor {
    axis: Axis,
    /// A step decided in the last tick: its edge comes at the start of the next, before any work of varying length.
    step_due: bool,
}

/// Bytes received and not yet read. One request of at most 66 bytes is outstanding.
struct Inbox {
    bytes: [u8; 128],
    first: u8,
    count: u8,
    between_frames: bool,
}

static MOTOR: Shared<Motor> = Shared::new(Motor { axis: Axis::new(), step_due: false });
static INBOX: Shared<Inbox> =
    Shared::new(Inbox { bytes: [0; 128], first: 0, count: 0, between_frames: true });

/// Called by the timer's interrupt.
pub fn on_tick() {
    MOTOR.with(|motor| {
        // The edge that ends a step's pulse, or begins one. No two steps come in neighbouring ticks.
        if core::mem::take(&mut motor.step_due) {
            PORTD.set(STEP)
        } else {
            PORTD.clear(STEP)
        }
        // The switch connects the pin to ground. The shield has one pin for both ends; the firmware takes it for home.
        let limits = Limits { home: PINB.read() & LIMIT == 0, far: false };
        if let Some(way) = motor.axis.tick(limits) {
            // A tick ahead of the step: drivers want the direction to stand still before the edge.
            if way == Way::Home {
                PORTD.set(DIRECTION)
            } else {
                PORTD.clear(DIRECTION)
            }
            motor.step_due = true;
        }
    });
}

/// Called by the serial port's interrupt.
pub fn on_byte() {
    let byte = UDR0.read();
    let stop = INBOX.with(|inbox| {
        let stop = inbox.between_frames && byte == EMERGENCY_STOP;
        inbox.between_frames = byte == DELIMITER || stop;
        // A full inbox drops bytes: the frame's CRC tells.
        if usize::from(inbox.count) < inbox.bytes.len() {
            let at = (inbox.first.wrapping_add(inbox.count)) & 127;
            inbox.bytes[usize::from(at)] = byte;
            inbox.count += 1;
        }
        stop
    });
    if stop {
        MOTOR.with(|motor| motor.axis.emergency_stop());
    }
}

/// The board, once it is set up.
pub struct Board(());

impl Board {
    /// Sets up pins, timer and serial port. The motor has no current until [`Board::power_motor`].
    pub fn new() -> Self {
        PORTB.set(DISABLE | LIMIT);
        DDRB.set(DISABLE);
        DDRD.set(STEP | DIRECTION);
        let [top_low, top_high] = TIMER_TOP.to_le_bytes();
        OCR1AH.write(top_high);
        OCR1AL.write(top_low);
        TCCR1A.write(0);
        // Count to the compare value and start again; clock / 8.
        TCCR1B.write(1 << 3 | 1 << 1);
        TIMSK1.write(1 << 1);
        // 115200 baud at double speed: (16 MHz / 8 / 115200) - 1, 2.1 % off, as every Uno is.
        UBRR0H.write(0);
        UBRR0L.write(16);
        UCSR0A.write(1 << 1);
        UCSR0C.write(0b110);
        // Receiver with interrupt, transmitter.
        UCSR0B.write(1 << 7 | 1 << 4 | 1 << 3);
        Self(())
    }

    /// The next byte from the host.
    pub fn receive(&mut self) -> Option<u8> {
        INBOX.with(|inbox| {
            if inbox.count == 0 {
                return None;
            }
            let byte = inbox.bytes[usize::from(inbox.first & 127)];
            inbox.first = inbox.first.wrapping_add(1) & 127;
            inbox.count -= 1;
            Some(byte)
        })
    }

    /// Sends bytes to the host; returns when the last is on its way.
    pub fn send(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            while UCSR0A.read() & READY_TO_SEND == 0 {}
            UDR0.write(byte);
        }
    }

    /// Gives the motor its current, for good: a stage that lets go between moves loses its place.
    pub fn power_motor(&mut self) {
        PORTB.clear(DISABLE);
    }

    /// The axis, shared with the timer's interrupt.
    pub fn axis(&mut self) -> MovingAxis {
        MovingAxis
    }

    /// Counts boots in the EEPROM, so that no two in a row have the same number.
    pub fn count_boot(&mut self) -> u32 {
        let mut bytes = [0, 1, 2, 3].map(|address| {
            Self::eeprom_at(address);
            EECR.set(1 << 0);
            EEDR.read()
        });
        bytes = u32::from_le_bytes(bytes).wrapping_add(1).to_le_bytes();
        for (address, byte) in (0..).zip(bytes) {
            Self::eeprom_at(address);
            EEDR.write(byte);
            uninterrupted(|| {
                // "Master write enable" holds for four cycles, in which "write enable" must follow.
                EECR.write(1 << 2);
                EECR.write(1 << 2 | 1 << 1);
            });
        }
        u32::from_le_bytes(bytes)
    }

    fn eeprom_at(address: u8) {
        while EECR.read() & (1 << 1) != 0 {}
        EEARH.write(0);
        EEARL.write(address);
    }
}

/// The axis that the timer's interrupt moves.
pub struct MovingAxis;

impl SharedAxis for MovingAxis {
    fn with<R>(&mut self, work: impl FnOnce(&mut Axis) -> R) -> R {
        MOTOR.with(|motor| work(&mut motor.axis))
    }
}
