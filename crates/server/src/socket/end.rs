//! How a conversation ends.

use tokio_tungstenite::tungstenite::Error;
use tokio_tungstenite::tungstenite::error::{CapacityError, ProtocolError};
use tokio_tungstenite::tungstenite::protocol::{CloseFrame, frame::coding::CloseCode};

/// Longest text in a frame that closes a socket, in bytes; the protocol allows 123.
const LONGEST_WORDS: usize = 120;

/// Why a conversation ends.
#[derive(Debug)]
pub(super) enum End {
    /// The client is told why.
    Told(CloseCode, String),
    /// Nobody is there to be told.
    Gone(String),
}

impl End {
    /// The client is told why, in at most [`LONGEST_WORDS`].
    pub(super) fn told(code: CloseCode, words: &str) -> Self {
        Self::Told(code, words[..words.floor_char_boundary(LONGEST_WORDS)].to_owned())
    }

    /// Nobody is told.
    pub(super) fn gone(words: &str) -> Self {
        Self::Gone(words.to_owned())
    }

    /// Why.
    pub(super) fn words(&self) -> &str {
        let (Self::Told(_, words) | Self::Gone(words)) = self;
        words
    }

    /// The frame that tells it.
    pub(super) fn frame(self) -> Option<CloseFrame> {
        match self {
            Self::Told(code, words) => Some(CloseFrame { code, reason: words.into() }),
            Self::Gone(_) => None,
        }
    }
}

impl From<Error> for End {
    fn from(error: Error) -> Self {
        match error {
            Error::Capacity(CapacityError::MessageTooLong { max_size, .. }) => {
                Self::told(CloseCode::Size, &format!("a wish has at most {max_size} bytes"))
            }
            Error::Utf8(_) => Self::told(CloseCode::Invalid, "the text is not UTF-8"),
            Error::Protocol(ProtocolError::ResetWithoutClosingHandshake) => Self::Gone(error.to_string()),
            Error::Protocol(error) => Self::told(CloseCode::Protocol, &error.to_string()),
            error => Self::Gone(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_cut_between_letters() {
        let long = format!("a{}", "ä".repeat(100));
        assert_eq!(End::told(CloseCode::Policy, &long).words().len(), 119);
        assert_eq!(End::told(CloseCode::Policy, "short").words(), "short");
    }
}
