//! Formats that a camera offers, and the active one.

use std::fmt;
use std::time::Duration;

use super::pixels::FourCc;
use epirig_core::grid::area;

/// Time from frame to frame, in s, as a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    /// Seconds, multiplied by the denominator.
    pub numerator: u32,
    /// The denominator, positive.
    pub denominator: u32,
}

impl Interval {
    /// Frames per second; NaN for an invalid fraction.
    pub fn rate_hz(self) -> f64 {
        f64::from(self.denominator) / f64::from(self.numerator)
    }

    /// As a duration; `None` for an invalid fraction, such as 0/0 of drivers without rates.
    pub fn duration(self) -> Option<Duration> {
        (self.numerator > 0 && self.denominator > 0)
            .then(|| Duration::from_secs_f64(f64::from(self.numerator) / f64::from(self.denominator)))
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{:.4} Hz", self.rate_hz())
    }
}

/// Columns x rows of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Columns.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

impl fmt::Display for Size {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{} x {}", self.columns, self.rows)
    }
}

impl std::str::FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides =
            text.split_once(['x', 'X']).map(|(columns, rows)| (columns.trim().parse(), rows.trim().parse()));
        match sides {
            Some((Ok(columns), Ok(rows))) if area(rows, columns).is_some() => Ok(Self { columns, rows }),
            _ => Err("a size is COLUMNSxROWS, such as 1280x720".to_owned()),
        }
    }
}

/// The sizes of a format.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sizes {
    /// A list of sizes, each with its intervals (none if the driver does not list them).
    Discrete(Vec<(Size, Vec<Interval>)>),
    /// All sizes between two, in steps.
    Range {
        /// The smallest.
        least: Size,
        /// The largest; the driver may reach it by scaling.
        greatest: Size,
        /// The step.
        step: Size,
    },
}

/// A format that a camera offers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OfferedFormat {
    /// Its code.
    pub four_cc: FourCc,
    /// The driver's description.
    pub description: String,
    /// Its sizes.
    pub sizes: Sizes,
}

impl Sizes {
    /// Whether it includes this size.
    pub fn holds(&self, size: Size) -> bool {
        match self {
            Self::Discrete(sizes) => sizes.iter().any(|(offered, _)| *offered == size),
            Self::Range { least, greatest, step } => {
                let on_grid = |value: usize, least: usize, greatest: usize, step: usize| {
                    (least..=greatest).contains(&value) && (value - least).is_multiple_of(step.max(1))
                };
                on_grid(size.columns, least.columns, greatest.columns, step.columns)
                    && on_grid(size.rows, least.rows, greatest.rows, step.rows)
            }
        }
    }
}

/// The active format of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActiveFormat {
    /// Code of the pixel format.
    pub four_cc: FourCc,
    /// Size of the image.
    pub size: Size,
    /// Bytes from row to row.
    pub stride: usize,
    /// Largest number of bytes in a buffer.
    pub image_bytes: usize,
    /// Whether the two fields of a frame are taken one after the other.
    pub interlaced: bool,
}

impl ActiveFormat {
    /// Grey samples of `bit_depth` bits without padding.
    pub(super) fn grey(size: Size, bit_depth: u8) -> Self {
        let code = match bit_depth {
            ..=8 => b"GREY",
            9..=10 => b"Y10 ",
            11..=12 => b"Y12 ",
            13..=14 => b"Y14 ",
            _ => b"Y16 ",
        };
        let stride = size.columns * if bit_depth <= 8 { 1 } else { 2 };
        Self { four_cc: FourCc(*code), size, stride, image_bytes: stride * size.rows, interlaced: false }
    }
}

impl fmt::Display for ActiveFormat {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{} {}", self.four_cc, self.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold_what_lies_on_their_grid() {
        let size = |columns, rows| Size { columns, rows };
        let range = Sizes::Range { least: size(16, 16), greatest: size(64, 32), step: size(8, 4) };
        assert!(range.holds(size(24, 20)) && range.holds(size(64, 32)));
        assert!(!range.holds(size(25, 20)) && !range.holds(size(72, 32)) && !range.holds(size(8, 16)));
        assert_eq!("1280x720".parse(), Ok(size(1280, 720)));
        assert!("1280".parse::<Size>().is_err() && "0x3".parse::<Size>().is_err());
        assert_eq!(Interval { numerator: 0, denominator: 0 }.duration(), None);
        assert_eq!(Interval { numerator: 1, denominator: 25 }.duration(), Some(Duration::from_millis(40)));
    }
}
