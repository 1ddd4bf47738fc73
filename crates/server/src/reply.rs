//! The answer to one request.

use serde::Serialize;

use super::refusal::{Refusal, RefusalKind};

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// Its media type.
    pub media_type: &'static str,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Whether its address never has another answer: a browser keeps it, and does not ask again.
    pub is_lasting: bool,
}

impl Reply {
    /// A record as JSON.
    ///
    /// # Errors
    /// [`Refusal`] if it cannot be written as JSON.
    pub fn json(record: &(impl Serialize + ?Sized)) -> Result<Self, Refusal> {
        let bytes = serde_json::to_vec(record)
            .map_err(|error| Refusal::new(RefusalKind::Failed, format!("the answer is no JSON: {error}")))?;
        Ok(Self::of("application/json", bytes))
    }

    /// Bytes of a media type, which may be other ones the next time.
    pub fn of(media_type: &'static str, bytes: Vec<u8>) -> Self {
        Self { media_type, bytes, is_lasting: false }
    }

    /// The same answer, where its address never has another one.
    #[must_use]
    pub fn lasting(self) -> Self {
        Self { is_lasting: true, ..self }
    }

    /// Numbers as 32-bit floats, little-endian, without more.
    pub fn numbers(values: &[f32]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        Self::of(BYTES, bytes)
    }

    /// A record and numbers: the length of the record's JSON (u32, little-endian), the JSON, filled with
    /// spaces to a multiple of four bytes, and 32-bit floats.
    ///
    /// # Errors
    /// As [`json`](Self::json).
    pub fn framed(record: &impl Serialize, values: &[f32]) -> Result<Self, Refusal> {
        let mut bytes = head(record, 4 * values.len())?;
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        Ok(Self::of(BYTES, bytes))
    }
}

const BYTES: &str = "application/octet-stream";

/// The length of the record's JSON and the JSON, filled with spaces, with room for so many bytes behind it.
pub(super) fn head(record: &(impl Serialize + ?Sized), room: usize) -> Result<Vec<u8>, Refusal> {
    let mut json = Reply::json(record)?.bytes;
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = Vec::with_capacity(4 + json.len() + room);
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.append(&mut json);
    Ok(bytes)
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
}
