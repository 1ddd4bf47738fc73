//! Bytes, marks and times of the GRBL dialect.

use std::time::Duration;

/// Name of the driver.
pub(super) const NAME: &str = "grbl";

/// Baud rate of the serial line.
pub const BAUD: u32 = 115_200;

pub(super) const SOFT_RESET: u8 = 0x18;
pub(super) const STATUS_QUERY: u8 = b'?';
pub(super) const FEED_HOLD: u8 = b'!';
pub(super) const MILLIMETRES: &str = "G21";

/// A line is accepted within some 10 ms, settings are written within some 100 ms.
pub(super) const REPLY_PATIENCE: Duration = Duration::from_secs(2);
pub(super) const STATUS_PATIENCE: Duration = Duration::from_millis(400);
/// A board boots in two seconds.
pub(super) const BOOT_PATIENCE: Duration = Duration::from_secs(3);
/// Interval of status queries during a motion.
pub(super) const POLL: Duration = Duration::from_millis(100);

/// The work offset comes at least once in this number of answers.
pub(super) const OFFSET_WITHIN: u32 = 30;
/// Attempts to send an absolute move that has verifiably not begun.
pub(super) const TRIES: u32 = 3;

/// GRBL does not report whether it was homed or only unlocked. An unusual feed rate serves as a mark: it
/// lasts until the next reset, as the position does. GRBL prints feed rates without decimals.
pub(super) const HOMED_MARK: f64 = 27183.0;
pub(super) const NOT_HOMED_MARK: f64 = 1.0;
