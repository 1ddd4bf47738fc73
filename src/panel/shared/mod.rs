//! What the threads of the panel share: the state, the pictures, and orders to the rig.

mod control;
mod coverage;
mod desk;
mod jog;
mod mailbox;
mod picture_feed;
mod pictures;
mod state_feed;

pub(in crate::panel) use coverage::{COLUMNS, ROWS};
pub use desk::PanelHooks;
pub(in crate::panel) use desk::Shared;
pub(in crate::panel) use mailbox::{Order, Reply};
pub(in crate::panel) use picture_feed::PictureFeed;
pub(in crate::panel) use state_feed::StateFeed;
