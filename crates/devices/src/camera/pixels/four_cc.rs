//! Codes of pixel formats.

use std::fmt::{self, Write as _};
use std::str::FromStr;

use thiserror::Error;

/// Big-endian variants have the highest bit of the code set, in the last character.
const BIG_ENDIAN: u8 = 0x80;

/// A pixel format's code as in V4L2: four ASCII characters, with short names padded by blanks. The highest
/// bit of the last character marks big-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FourCc(pub [u8; 4]);

impl FourCc {
    /// From V4L2's number: the first character is in the lowest byte.
    pub fn from_u32(code: u32) -> Self {
        Self(code.to_le_bytes())
    }

    /// V4L2's number.
    pub fn to_u32(self) -> u32 {
        u32::from_le_bytes(self.0)
    }

    /// The big-endian variant of a code.
    pub(super) fn big_endian(self) -> Self {
        let [first, second, third, fourth] = self.0;
        Self([first, second, third, fourth | BIG_ENDIAN])
    }
}

/// As V4L2's tools print it, without blanks at the end: `GREY`, `Y16`, `Y16-BE`. Unprintable characters are
/// escaped.
impl fmt::Display for FourCc {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [first, second, third, fourth] = self.0;
        let plain = [first, second, third, fourth & !BIG_ENDIAN];
        for &byte in plain.trim_ascii_end() {
            match byte {
                b' '..=b'~' => formatter.write_char(byte.into())?,
                _ => write!(formatter, "{}", byte.escape_ascii())?,
            }
        }
        if fourth & BIG_ENDIAN == 0 { Ok(()) } else { formatter.write_str("-BE") }
    }
}

/// Text that is not a pixel format code.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "{0:?} is not a pixel format code; write one to four ASCII characters such as GREY or Y16, or Y16-BE"
)]
pub struct FourCcError(String);

/// One to four printable ASCII characters, with the suffix `-BE` for big-endian; blanks at the end may be
/// omitted.
impl FromStr for FourCc {
    type Err = FourCcError;

    fn from_str(text: &str) -> Result<Self, FourCcError> {
        let (name, big_endian) = match text.strip_suffix("-BE") {
            Some(name) if !name.is_empty() => (name, true),
            _ => (text, false),
        };
        let printable = name.bytes().all(|byte| byte.is_ascii_graphic() || byte == b' ');
        if !printable || !(1..=4).contains(&name.len()) || name.trim().is_empty() {
            return Err(FourCcError(text.to_owned()));
        }
        let mut code = [b' '; 4];
        code.iter_mut().zip(name.bytes()).for_each(|(out, byte)| *out = byte);
        Ok(if big_endian { Self(code).big_endian() } else { Self(code) })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn codes_are_the_numbers_of_the_kernels_header() {
        // Printed by a C program from linux/videodev2.h: V4L2_PIX_FMT_GREY, _Y16, _Y16_BE.
        for (text, number) in [("GREY", 0x5945_5247), ("Y16", 0x2036_3159), ("Y16-BE", 0xA036_3159)] {
            let code: FourCc = text.parse().unwrap();
            assert_eq!(code.to_u32(), number);
            assert_eq!(FourCc::from_u32(number), code);
            assert_eq!(code.to_string(), text);
        }
        assert_eq!("Y16 -BE".parse::<FourCc>(), "Y16-BE".parse(), "as v4l2-ctl prints it");
    }

    #[test]
    fn what_is_no_code_is_refused_and_what_is_unprintable_is_escaped() {
        for text in ["", "    ", " -BE", "GREYS", "GREYS-BE", "Yé", "Y\n"] {
            assert!(text.parse::<FourCc>().is_err(), "{text:?}");
        }
        assert_eq!(FourCc([0, b'A', 10, b'B']).to_string(), r"\x00A\nB");
    }

    proptest! {
        #[test]
        fn numbers_survive(number: u32) {
            prop_assert_eq!(FourCc::from_u32(number).to_u32(), number);
        }

        #[test]
        fn any_text_is_a_code_or_an_error(text in ".{0,8}") {
            if let Ok(code) = text.parse::<FourCc>() {
                prop_assert_eq!(code.to_string().parse::<FourCc>(), Ok(code));
            }
        }
    }
}
