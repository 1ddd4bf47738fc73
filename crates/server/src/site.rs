//! What a program shows, without HTTP.

use std::collections::BTreeMap;
use std::str::FromStr;

use serde::Serialize;
use serde_json::Value;

/// What a program shows. Its methods are called from worker threads and may take their time.
pub trait Site: Send + Sync + 'static {
    /// Data for reading: `path` are the parts of the path after `/api/`.
    ///
    /// # Errors
    /// [`Refusal`], which the page shows.
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal>;

    /// Work that is asked for, with its JSON. Only who has the token gets here.
    ///
    /// # Errors
    /// [`Refusal`], which the page shows.
    fn post(&self, path: &[&str], _asked: &Value) -> Result<Reply, Refusal> {
        Err(Refusal::unknown(path))
    }
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// Its media type.
    pub media_type: &'static str,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

impl Reply {
    /// A record as JSON.
    ///
    /// # Errors
    /// [`Refusal`] if it cannot be written as JSON.
    pub fn json(record: &(impl Serialize + ?Sized)) -> Result<Self, Refusal> {
        let bytes = serde_json::to_vec(record)
            .map_err(|error| Refusal::new(RefusalKind::Failed, format!("the answer is no JSON: {error}")))?;
        Ok(Self { media_type: "application/json", bytes })
    }

    /// Numbers as 32-bit floats, little-endian, without more.
    pub fn numbers(values: &[f32]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        Self { media_type: BYTES, bytes }
    }

    /// A record and numbers: the length of the record's JSON (u32, little-endian), the JSON, filled with
    /// spaces to a multiple of four bytes, and 32-bit floats.
    ///
    /// # Errors
    /// As [`json`](Self::json).
    pub fn framed(record: &impl Serialize, values: &[f32]) -> Result<Self, Refusal> {
        let mut json = Self::json(record)?.bytes;
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bytes = (json.len() as u32).to_le_bytes().to_vec();
        bytes.reserve(json.len() + 4 * values.len());
        bytes.append(&mut json);
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        Ok(Self { media_type: BYTES, bytes })
    }

    /// A file.
    pub fn file(media_type: &'static str, bytes: Vec<u8>) -> Self {
        Self { media_type, bytes }
    }
}

const BYTES: &str = "application/octet-stream";

/// The kind of a refusal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RefusalKind {
    /// What is asked for makes no sense.
    Wrong,
    /// The token is missing.
    NoToken,
    /// Nobody may ask this way.
    Forbidden,
    /// There is no such thing.
    NotFound,
    /// Not now: come back in a moment.
    Busy,
    /// It was tried and failed.
    Failed,
}

/// A request that is not answered, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The kind.
    pub kind: RefusalKind,
    /// What happened, where, and what to do, for a person.
    pub message: String,
}

impl Refusal {
    /// A refusal.
    pub fn new(kind: RefusalKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }

    /// Nothing stands at `path`.
    pub fn unknown(path: &[&str]) -> Self {
        Self::new(RefusalKind::NotFound, format!("there is nothing at /api/{}", path.join("/")))
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
    fn numbers_begin_at_a_multiple_of_four_bytes() {
        for name in ["", "a", "ab", "abc", "abcd"] {
            let reply = Reply::framed(&name, &[1.5, f32::NAN]).unwrap();
            let length = u32::from_le_bytes(reply.bytes[..4].try_into().unwrap()) as usize;
            assert_eq!(length % 4, 0);
            let json: String = serde_json::from_slice(&reply.bytes[4..4 + length]).unwrap();
            assert_eq!(json, name);
            assert_eq!(reply.bytes[4 + length..][..4], 1.5_f32.to_le_bytes());
            assert_eq!(reply.bytes.len(), 4 + length + 8);
        }
    }

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
