//! The table of stage drivers. A driver of this crate adds one line.

use super::StageDriver;
use super::grbl::Grbl;
use super::native::Native;
use super::sim::Simulated;
use super::zaber::Zaber;

/// The first is the default.
pub(super) static BUILT_IN: [&dyn StageDriver; 4] = [&Native, &Grbl, &Zaber, &Simulated];
