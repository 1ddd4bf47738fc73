//! The machine that this firmware drives. Change these figures to those of yours.

use firmware_protocol::device::Build;

/// Ticks of the axis in a second; the fastest step rate is half of it. While it moves, the interrupt takes a third of a tick, and
/// half of one at the worst (525 and 785 of 1600 cycles, counted in simavr).
pub const TICK_HZ: u32 = 10_000;

/// 250 steps/mm (200 full steps a turn, 1/8 microsteps, 6.4 mm a turn) on a travel of 200 mm.
pub const BUILD: Build = Build { number: 1, steps_per_mm: 250, travel_nm: 200_000_000, tick_hz: TICK_HZ };
