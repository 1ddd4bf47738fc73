//! What the threads of the panel share: the state, the pictures, and orders to the rig.

mod control;
mod coverage;
mod jog;
mod orders;
mod panel_state;
mod picture_feed;
mod pictures;
mod state_feed;

pub(in crate::panel) use coverage::{COLUMNS, ROWS};
pub(in crate::panel) use orders::{Order, OrderReply};
pub(in crate::panel) use panel_state::SharedState;
pub use panel_state::{PanelHooks, PanelOptions};
pub(in crate::panel) use picture_feed::PictureFeed;
#[cfg(test)]
pub(in crate::panel) use picture_feed::{PictureHead, PictureWish};
pub(in crate::panel) use state_feed::StateFeed;
