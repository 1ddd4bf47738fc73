//! Bytes, lines and times of the GRBL dialect.

use std::time::Duration;

/// Name of the driver.
pub(super) const NAME: &str = "grbl";

/// Baud rate of the serial line.
pub const BAUD: u32 = 115_200;

pub(super) const SOFT_RESET: u8 = 0x18;
pub(super) const STATUS_QUERY: u8 = b'?';
pub(super) const FEED_HOLD: u8 = b'!';
pub(super) const CYCLE_START: u8 = b'~';
pub(super) const JOG_CANCEL: u8 = 0x85;

/// A line is accepted within some 10 ms, settings are written within some 100 ms.
pub(super) const REPLY_PATIENCE: Duration = Duration::from_secs(2);
pub(super) const STATUS_PATIENCE: Duration = Duration::from_millis(400);
/// A board boots in two seconds.
pub(super) const BOOT_PATIENCE: Duration = Duration::from_secs(3);
/// Interval of status queries during a motion.
pub(super) const POLL: Duration = Duration::from_millis(100);

/// Attempts of a command that may be repeated.
pub(super) const TRIES: u32 = 3;
/// Attempts of a short exchange that noise may spoil: at a share of 1 % of damaged bytes, half of those with
/// 70 bytes fail, and all ten once in a thousand.
pub(super) const EXCHANGES: u32 = 10;

/// Positions are reported with three decimals.
pub(super) const REPORT_ROUNDING_MM: f64 = 0.0005;
