//! What a program shows, without HTTP.

use std::collections::BTreeMap;

use serde_json::Value;

use super::feed::Feed;
use super::refusal::Refusal;
use super::reply::Reply;

/// How a [`post`](Site::post) is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PostRules {
    /// Whether everybody who may read may also post: a question that changes nothing, or a stop.
    pub open_to_all: bool,
    /// Whether it must not wait behind other work, such as a stop.
    pub urgent: bool,
    /// Bytes of the largest JSON that is read; by default those of an order, which is short.
    pub largest: usize,
}

impl Default for PostRules {
    fn default() -> Self {
        Self { open_to_all: false, urgent: false, largest: 64 << 10 }
    }
}

/// What a program shows. Its methods are called from worker threads and may take their time.
pub trait Site: Send + Sync + 'static {
    /// Data for reading: `path` are the parts of the path after `/api/`.
    ///
    /// # Errors
    /// [`Refusal`], which the page shows.
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal>;

    /// Work that is asked for, with its JSON. Only who has the token gets here, unless it is
    /// [open to all](PostRules::open_to_all).
    ///
    /// # Errors
    /// [`Refusal`], which the page shows.
    fn post(&self, path: &[&str], _asked: &Value) -> Result<Reply, Refusal> {
        Err(Refusal::unknown(path))
    }

    /// How a [`post`](Self::post) at this path is taken. Unlike the other methods, this one must return at once: the
    /// server itself waits for it.
    fn rules(&self, _path: &[&str]) -> PostRules {
        PostRules::default()
    }

    /// Opens the feed at `path` (after `/api/`) for one client. It is dropped on a worker thread when the
    /// client is gone.
    ///
    /// # Errors
    /// [`Refusal`], which the client gets in place of the feed.
    fn feed(&self, path: &[&str]) -> Result<Box<dyn Feed>, Refusal> {
        Err(Refusal::unknown(path))
    }
}

/// The part of a request's address after the question mark.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Query(BTreeMap<String, String>);

impl Query {
    /// The names and values of `text`. Values are numbers and simple names, so nothing is decoded; what is
    /// encoded is refused by who parses it.
    pub fn parse(text: &str) -> Self {
        let pairs = text.split('&').filter_map(|pair| pair.split_once('='));
        Self(pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).collect())
    }

    /// The text of `name`, if it is given.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }

    /// All names with their texts.
    pub fn pairs(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(name, text)| (name.as_str(), text.as_str()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_has_names_and_texts() {
        let query = Query::parse("x=12&y=-3.5&x0=%31&flag");
        assert_eq!(
            (query.text("x"), query.text("y"), query.text("x0")),
            (Some("12"), Some("-3.5"), Some("%31"))
        );
        assert_eq!(query.text("flag"), None);
        assert_eq!(query.text("none"), None);
    }
}
