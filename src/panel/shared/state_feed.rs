//! The state as it is sent to a page: whole, and no more often than a person can follow.

use std::sync::Arc;
use std::time::Instant;

use super::panel_state::SharedState;
use epirig_server::{Bell, Feed, Message};

/// The state for one page.
pub(in crate::panel) struct StateFeed {
    shared: Arc<SharedState>,
    /// The page that follows it, if it has told its name.
    client: Option<String>,
    sent: Option<String>,
}

impl StateFeed {
    pub(in crate::panel) fn new(shared: Arc<SharedState>, client: Option<&str>) -> Self {
        let client = client.map(str::to_owned);
        client.iter().for_each(|client| shared.control(|controller| controller.comes(client)));
        Self { shared, client, sent: None }
    }
}

impl Drop for StateFeed {
    fn drop(&mut self) {
        if let Some(client) = &self.client {
            self.shared.control(|controller| controller.goes(client, Instant::now()));
        }
    }
}

impl Feed for StateFeed {
    fn bell(&self) -> Bell {
        self.shared.bell.clone()
    }

    fn next(&mut self) -> Option<Message> {
        let rig = self.shared.look(|state| state.rig.clone());
        let text = serde_json::to_string(&rig).ok()?;
        if self.sent.as_ref() == Some(&text) {
            return None;
        }
        self.sent = Some(text.clone());
        Some(Message::Text(text))
    }
}
