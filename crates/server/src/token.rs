//! Tokens: who has the one may change things, who has the other may look.

use super::ServerError;

/// A secret of 128 random bits, as 32 hexadecimal digits.
#[derive(Clone)]
pub(super) struct Token(String);

impl Token {
    /// A new token.
    pub(super) fn new() -> Result<Self, ServerError> {
        let mut bytes = [0_u8; 16];
        getrandom::fill(&mut bytes).map_err(|error| ServerError::NoToken(error.to_string()))?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// The digits, for the link.
    pub(super) fn digits(&self) -> &str {
        &self.0
    }

    /// Whether `given` is the token. The time this takes does not tell how much of it is right.
    pub(super) fn is(&self, given: &str) -> bool {
        let different = self.0.bytes().zip(given.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
        given.len() == self.0.len() && different == 0
    }
}

/// What a server gives to people.
#[derive(Clone)]
pub(super) struct Tokens {
    /// For changing things, and for looking.
    pub(super) control: Token,
    /// For looking alone.
    pub(super) watch: Token,
}

impl Tokens {
    /// New tokens.
    pub(super) fn new() -> Result<Self, ServerError> {
        Ok(Self { control: Token::new()?, watch: Token::new()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_whole_token_is_the_token() {
        let token = Token::new().unwrap();
        let digits = token.digits().to_owned();
        assert_eq!(digits.len(), 32);
        assert!(token.is(&digits));
        assert!(!token.is(""));
        assert!(!token.is(&digits[..31]));
        assert!(!token.is(&format!("{digits}0")));
        assert!(!token.is(Token::new().unwrap().digits()));
    }
}
