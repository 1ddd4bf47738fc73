//! What a program shows, without HTTP.

use std::collections::BTreeMap;
use std::str::FromStr;

use serde_json::Value;

use super::feed::Feed;
use super::refusal::{Refusal, RefusalKind};
use super::reply::Reply;

/// Bytes of the largest JSON of an order, which is short.
pub const LARGEST_ORDER: usize = 64 << 10;

/// What a program shows. Its methods are called from worker threads and may take their time.
pub trait Site: Send + Sync + 'static {
    /// Data for reading: `path` are the parts of the path after `/api/`.
    ///
    /// # Errors
    /// [`Refusal`], which the page shows.
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal>;

    /// Work that is asked for, with its JSON. Only who has the token gets here, unless the path
    /// [is open to all](Self::is_open_to_all).
    ///
    /// # Errors
    /// [`Refusal`], which the page shows.
    fn post(&self, path: &[&str], _asked: &Value) -> Result<Reply, Refusal> {
        Err(Refusal::unknown(path))
    }

    /// Whether everybody who may read may also [`post`](Self::post) at this path: a question that changes
    /// nothing, or a stop. Like [`is_urgent`](Self::is_urgent), it must return at once.
    fn is_open_to_all(&self, _path: &[&str]) -> bool {
        false
    }

    /// Bytes of the largest JSON that is read for [`post`](Self::post) at this path. Like
    /// [`is_urgent`](Self::is_urgent), it must return at once.
    fn largest_body(&self, _path: &[&str]) -> usize {
        LARGEST_ORDER
    }

    /// Opens the feed at `path` (after `/api/`) for one client. It is dropped on a worker thread when the
    /// client is gone.
    ///
    /// # Errors
    /// [`Refusal`], which the client gets in place of the feed.
    fn feed(&self, path: &[&str]) -> Result<Box<dyn Feed>, Refusal> {
        Err(Refusal::unknown(path))
    }

    /// Whether an order at this path must not wait behind other work, such as a stop. Unlike the other
    /// methods, this one must return at once: the server itself waits for it.
    fn is_urgent(&self, _path: &[&str]) -> bool {
        false
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

    /// The value of `name`.
    ///
    /// # Errors
    /// [`Refusal`] if it is missing, or is none.
    pub fn value<T: FromStr>(&self, name: &str) -> Result<T, Refusal> {
        let text = self.text(name).unwrap_or_default();
        text.parse()
            .map_err(|_| Refusal::new(RefusalKind::Wrong, format!("{name}=\"{text}\" cannot be used")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_a_query_have_types() {
        let query = Query::parse("x=12&y=-3.5&x0=%31&flag");
        assert_eq!(query.value::<usize>("x"), Ok(12));
        assert_eq!(query.value::<f64>("y"), Ok(-3.5));
        assert!(query.value::<usize>("y").is_err());
        assert!(query.value::<usize>("x0").is_err());
        assert!(query.value::<usize>("flag").is_err());
        assert_eq!(query.text("none"), None);
    }
}
