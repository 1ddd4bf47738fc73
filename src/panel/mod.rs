//! What the browser shows: the rig, a scan, and results, pixel by pixel, with the reason for each number.
//!
//! [`epirig_server`] serves it; nothing here knows HTTP. [`CurrentResults`] shows results and changes nothing.
//! [`Panel`] shows a rig, too: one thread owns stage and camera and obeys the orders of the page, another
//! looks at the pictures, a third makes the live map of a scan.

mod background;
mod error;
mod live_map;
#[cfg(test)]
pub(crate) mod page_type_tests;
mod parameters;
mod questions;
mod requests;
mod results;
mod rig;
mod scan;
mod sequences;
mod shared;
mod site;
mod state;
mod table;

pub use error::PanelError;
pub use live_map::{LiveMap, LiveMapMaker};
pub use results::CurrentResults;
pub use shared::{PanelHooks, PanelOptions};
pub use site::{Panel, PanelCloser, PanelEnd};
