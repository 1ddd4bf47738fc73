//! The scan in the panel: it is run, watched, and measured.

mod assistant;
mod live;
mod measure;
mod name;
mod notes;
mod plan;
mod run;
mod target;
mod watcher;

pub(in crate::panel) use live::live_map;
pub(in crate::panel) use measure::begin_measurement;
pub(in crate::panel) use name::why_no_name;
pub(in crate::panel) use notes::Notes;
pub(in crate::panel) use plan::plan;
pub(in crate::panel) use run::{ScanRun, run_scan};
pub(in crate::panel) use target::{find_target, has_target, shows_board};
