//! News for a client, as they come: what a program gives, without sockets.

use std::sync::Arc;

use serde::Serialize;
use serde_json::Value;
use tokio::sync::watch;

use super::refusal::{Refusal, RefusalKind};
use super::reply::{self, Reply};

/// A feed for one client: what it is told, and what it wishes.
///
/// All methods are called from worker threads, one after another. If one panics, this client's socket is
/// closed, and nothing else happens.
pub trait Feed: Send + 'static {
    /// What tells that there may be news. Asked once, when the feed is opened.
    fn bell(&self) -> Bell;

    /// The news since the last call; `None` if there are none. Called when the feed is opened, and then when
    /// the bell was rung or a wish was taken, but only when the client has taken the message before.
    fn next(&mut self) -> Option<Message>;

    /// Takes a wish of the client, for example the part of a picture. Without more, a feed takes none.
    ///
    /// # Errors
    /// [`Refusal`], with whose words the client's socket is closed.
    fn wish(&mut self, _wish: &Value) -> Result<(), Refusal> {
        Err(Refusal::new(RefusalKind::Wrong, "this feed takes no wishes"))
    }
}

/// A message of a feed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Message {
    /// Text, usually JSON.
    Text(String),
    /// Bytes, usually a record and the bytes of a picture.
    Bytes(Vec<u8>),
}

impl Message {
    /// A record as JSON text.
    ///
    /// # Errors
    /// [`Refusal`] if it cannot be written as JSON.
    pub fn json(record: &(impl Serialize + ?Sized)) -> Result<Self, Refusal> {
        // JSON is UTF-8.
        Ok(Self::Text(String::from_utf8_lossy(&Reply::json(record)?.bytes).into_owned()))
    }

    /// A record and bytes: the length of the record's JSON (u32, little-endian), the JSON, filled with spaces
    /// to a multiple of four bytes, and the bytes.
    ///
    /// # Errors
    /// As [`json`](Self::json).
    pub fn framed(record: &(impl Serialize + ?Sized), bytes: &[u8]) -> Result<Self, Refusal> {
        let mut all = reply::head(record, bytes.len())?;
        all.extend_from_slice(bytes);
        Ok(Self::Bytes(all))
    }
}

/// Rings for all who listen; clones are the same bell. A ring never waits, and rings that nobody had time
/// for count as one.
#[derive(Debug, Clone, Default)]
pub struct Bell(Arc<watch::Sender<u64>>);

impl Bell {
    /// Tells all who listen that there may be news.
    pub fn ring(&self) {
        self.0.send_modify(|rings| *rings = rings.wrapping_add(1));
    }

    /// The number of clients that listen now.
    pub fn listeners(&self) -> usize {
        self.0.receiver_count()
    }

    /// Listens from now on.
    pub(super) fn listen(&self) -> watch::Receiver<u64> {
        self.0.subscribe()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_follow_the_record_at_a_multiple_of_four() {
        for name in ["", "a", "ab", "abc", "abcd"] {
            let Message::Bytes(bytes) = Message::framed(name, &[7, 8, 9]).unwrap() else { panic!() };
            let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
            assert_eq!(length % 4, 0);
            assert_eq!(serde_json::from_slice::<String>(&bytes[4..4 + length]).unwrap(), name);
            assert_eq!(bytes[4 + length..], [7, 8, 9]);
        }
        assert_eq!(Message::json(&("ä", 1)), Ok(Message::Text("[\"ä\",1]".to_owned())));
    }

    #[test]
    fn a_bell_knows_who_listens() {
        let bell = Bell::default();
        bell.ring();
        let (one, two) = (bell.listen(), bell.clone().listen());
        assert_eq!(bell.listeners(), 2);
        assert!(!one.has_changed().unwrap(), "a ring of before");
        bell.clone().ring();
        bell.ring();
        assert!(one.has_changed().unwrap() && two.has_changed().unwrap());
        drop((one, two));
        assert_eq!(bell.listeners(), 0);
        bell.ring();
    }
}
