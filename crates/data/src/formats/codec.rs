//! What a map format is made of, and what it may say about a map.

use super::error::FormatError;
use epirig_core::grid::Grid;

/// What the values of a map are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// Lengths in mm, such as heights.
    LengthMm,
    /// Lengths in the image, in px, such as disparities.
    ImagePx,
    /// Anything else: shares, costs, counts, grey levels.
    #[default]
    Number,
}

/// What is known of a map besides its values. Each format writes what it has a place for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MapFacts {
    /// What the values are.
    pub quantity: Quantity,
    /// Width and height of a pixel on the object, in mm, if known; positive.
    pub pixel_mm: Option<f64>,
    /// What the map shows, in one line.
    pub title: String,
    /// When the frames were taken, as in RFC 3339, if known.
    pub taken: Option<String>,
}

impl MapFacts {
    /// The pixel size, if it is a positive finite number.
    pub(super) fn usable_pixel_mm(&self) -> Option<f64> {
        self.pixel_mm.filter(|pixel_mm| pixel_mm.is_finite() && *pixel_mm > 0.0)
    }

    /// The title in one line of text: control characters become spaces.
    pub(super) fn line(&self) -> String {
        self.title.replace(|letter: char| letter.is_control(), " ")
    }

    /// The same in ASCII.
    pub(super) fn ascii_line(&self) -> String {
        ascii(&self.title)
    }

    /// Year, month, day, hour, minute and second of the time when the frames were taken, if known.
    pub(super) fn taken_parts(&self) -> Option<[i16; 6]> {
        let taken = self.taken.as_deref()?;
        let part = |from: usize, to: usize| taken.get(from..to)?.parse().ok();
        Some([part(0, 4)?, part(5, 7)?, part(8, 10)?, part(11, 13)?, part(14, 16)?, part(17, 19)?])
    }
}

/// A text in one line of ASCII: control characters become spaces, and other letters question marks.
pub(super) fn ascii(text: &str) -> String {
    let plain = |letter: char| match letter {
        _ if letter.is_control() => ' ',
        _ if letter.is_ascii() => letter,
        _ => '?',
    };
    text.chars().map(plain).collect()
}

/// What a format for surfaces needs to know of a map.
pub(super) struct LengthMap {
    /// Width and height of a pixel, in mm.
    pub(super) pixel_mm: f64,
}

impl LengthMap {
    /// Of a map of lengths with pixels whose size is known, for `format`.
    pub(super) fn of(format: &'static str, map: &Grid<f32>, facts: &MapFacts) -> Result<Self, FormatError> {
        let unsuitable = |reason| FormatError::Unsuitable { format, reason };
        if facts.quantity != Quantity::LengthMm {
            return Err(unsuitable(
                "it is for heights and other lengths; choose such a map, or another format",
            ));
        }
        let pixel_mm = facts
            .usable_pixel_mm()
            .ok_or_else(|| unsuitable("the size of its pixels in mm is not known; choose another format"))?;
        if map.values().is_empty() {
            return Err(unsuitable("it has no pixels"));
        }
        Ok(Self { pixel_mm })
    }
}

/// Bytes of a map.
pub(super) type Encode = fn(&Grid<f32>, &MapFacts) -> Result<Vec<u8>, FormatError>;
/// A map of bytes that came from outside.
pub(super) type Decode = fn(&[u8]) -> Result<Grid<f32>, FormatError>;

/// One format.
pub(super) struct Codec {
    /// Name in error messages.
    pub(super) name: &'static str,
    /// Endings of its files, in lower case and without a dot; the first is the usual one.
    pub(super) extensions: &'static [&'static str],
    pub(super) encode: Encode,
    /// Whether its files hold units, the pixel size or a title.
    pub(super) holds_facts: bool,
    /// Whether it is for lengths alone, with pixels of a known size.
    pub(super) lengths_only: bool,
    /// `None` if the format is only written.
    pub(super) decode: Option<Decode>,
}
