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
    /// `None` if the format is only written.
    pub(super) decode: Option<Decode>,
}
