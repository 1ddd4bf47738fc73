//! The state as it is sent to a page: whole, and no more often than a person can follow.

use std::sync::Arc;

use super::desk::Shared;
use epirig_server::{Bell, Feed, Message};

/// The state for one page.
pub(in crate::panel) struct StateFeed {
    shared: Arc<Shared>,
    sent: Option<String>,
}

impl StateFeed {
    pub(in crate::panel) fn new(shared: Arc<Shared>) -> Self {
        Self { shared, sent: None }
    }
}

impl Feed for StateFeed {
    fn bell(&self) -> Bell {
        self.shared.bell.clone()
    }

    fn next(&mut self) -> Option<Message> {
        let text = self.shared.look(|state| serde_json::to_string(state).ok())?;
        if self.sent.as_ref() == Some(&text) {
            return None;
        }
        self.sent = Some(text.clone());
        Some(Message::Text(text))
    }
}
