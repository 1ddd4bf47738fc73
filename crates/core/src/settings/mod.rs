//! What can be set: keys with units, ranges, defaults and meaning, and the values that were set.
//!
//! A driver states its keys once, as a table. Profiles, the command line, records and help are made from it.
//!
//! ```
//! use epirig_core::settings::quantity::UM;
//! use epirig_core::settings::{Allowed, Key, Kind, Setting, Settings};
//!
//! static MICROSTEP: Key = Key::new(
//!     "stage",
//!     "microstep",
//!     Kind::measure(UM, Allowed::Positive),
//!     "0.05 um",
//!     "Length of a microstep, from its data sheet",
//! );
//!
//! let mut settings = Settings::default();
//! settings.set(&MICROSTEP, Setting::Number(0.05));
//! assert_eq!(settings.number(&MICROSTEP), Some(0.05)); // in um, the unit of the key
//! ```

mod key;
pub mod quantity;
mod values;

pub use key::{Allowed, Key, Kind, LARGEST, LONGEST_H, SMALLEST};
pub use values::{Setting, Settings};
