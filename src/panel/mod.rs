//! What the browser shows: results, pixel by pixel, with the reason for each number; and, while a scan runs,
//! the live map.
//!
//! [`epirig_server`] serves it. Nothing here knows HTTP, and nothing here changes a file.

mod error;
mod live_map;
mod results;

pub use error::PanelError;
pub use live_map::{LiveMap, LiveMapMaker};
pub use results::ResultsView;
