//! What the browser shows: results, pixel by pixel, with the reason for each number.
//!
//! [`epirig_server`] serves it. Nothing here knows HTTP, and nothing here changes a file.

mod error;
mod results;

pub use error::PanelError;
pub use results::ResultsView;
