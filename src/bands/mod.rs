//! A match in bands of rows: by several processes, on one machine or on many.
//!
//! Each band is one or more of the [blocks](epirig_matcher::Blocks) of the match, and blocks do not depend on who
//! matches them. So the maps are those of one process, to the last bit. Three steps lead to them, and what they share
//! is a folder:
//!
//! 1. The survey finds what holds for the whole picture, and writes the [plan](BandPlan).
//! 2. Each band is matched by the plan, in any order. It leaves a part for each of its blocks.
//! 3. The merge checks that all parts are there, whole, and of this plan.
//!
//! A part is written under another name and renamed when it is whole, so that a process that is killed leaves none,
//! and two that match the same band leave the same one.

mod error;
mod folder;
mod part;
mod plan;

pub use error::BandError;
pub use folder::{BandFolder, Parts};
pub use part::PartFault;
pub(crate) use plan::bands_of;
pub use plan::{BandPlan, BandTask, Memory};
