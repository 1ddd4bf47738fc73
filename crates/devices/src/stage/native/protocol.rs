//! Names and numbers of the native dialect.

/// Name of the driver.
pub(super) const NAME: &str = "native";

/// Baud rate of the serial line.
pub const BAUD: u32 = 115_200;

pub(super) const NM_PER_MM: f64 = 1e6;
