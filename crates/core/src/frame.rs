//! One grey image as a sensor gave it.

use std::fmt;

use thiserror::Error;

/// Intensities of a frame or a volume, in DN, in the narrowest type that holds them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Samples {
    /// Bit depths 1 to 8.
    U8(Vec<u8>),
    /// Bit depths 9 to 16.
    U16(Vec<u16>),
}

impl Samples {
    /// `count` zeros in the type for `bit_depth`.
    pub fn zeros(bit_depth: u8, count: usize) -> Self {
        if bit_depth <= 8 { Self::U8(vec![0; count]) } else { Self::U16(vec![0; count]) }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(values) => values.len(),
            Self::U16(values) => values.len(),
        }
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The largest sample; 0 for no samples.
    pub fn maximum(&self) -> u16 {
        match self {
            Self::U8(values) => values.iter().copied().max().unwrap_or(0).into(),
            Self::U16(values) => values.iter().copied().max().unwrap_or(0),
        }
    }

    /// The mean; 0 for no samples.
    pub fn mean(&self) -> f64 {
        // Sums of so few samples fit 32 bit, which are added several at a time.
        const TOGETHER: usize = 1 << 16;
        fn sum<T: Copy + Into<u32>>(values: &[T]) -> u64 {
            let part = |some: &[T]| some.iter().map(|&value| value.into()).sum::<u32>();
            values.chunks(TOGETHER).map(|some| u64::from(part(some))).sum()
        }
        let sum = match self {
            Self::U8(values) => sum(values),
            Self::U16(values) => sum(values),
        };
        sum as f64 / self.len().max(1) as f64
    }

    /// How many samples are at least `level`.
    pub fn count_at_least(&self, level: u16) -> usize {
        // Counts of so few samples fit 8 bit, which are added several at a time.
        const TOGETHER: usize = 255;
        fn count<T: Copy + PartialOrd>(values: &[T], level: T) -> usize {
            let part = |some: &[T]| some.iter().map(|&value| u8::from(value >= level)).sum::<u8>();
            values.chunks(TOGETHER).map(|some| usize::from(part(some))).sum()
        }
        match self {
            Self::U8(values) => u8::try_from(level).map_or(0, |level| count(values, level)),
            Self::U16(values) => count(values, level),
        }
    }

    /// Writes `target.len()` samples from `start` on into `target`, as DN.
    ///
    /// # Panics
    /// If the range leaves the samples.
    pub fn copy_to_f32(&self, start: usize, target: &mut [f32]) {
        let range = start..start + target.len();
        match self {
            Self::U8(values) => {
                target.iter_mut().zip(&values[range]).for_each(|(out, &value)| *out = value.into());
            }
            Self::U16(values) => {
                target.iter_mut().zip(&values[range]).for_each(|(out, &value)| *out = value.into());
            }
        }
    }
}

/// Why samples do not make a frame.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The number of samples contradicts the size.
    #[error("{samples} samples cannot fill {rows} rows x {columns} columns")]
    Size {
        /// Rows asked for.
        rows: usize,
        /// Columns asked for.
        columns: usize,
        /// Samples given.
        samples: usize,
    },
    /// The samples are stored in another width than the stated bit depth needs.
    #[error(
        "it holds {stored} bit samples, but {stated} bit are stated; state the true bit depth, or save it with that many"
    )]
    Width {
        /// Bits of a stored sample.
        stored: u8,
        /// Bits stated.
        stated: u8,
    },
    /// The stated bit depth cannot hold the largest sample, or is not 1 to 16.
    #[error("a sample of {maximum} DN does not fit the stated {bit_depth} bit; state the true bit depth")]
    BitDepth {
        /// Bits stated.
        bit_depth: u8,
        /// Largest sample found.
        maximum: u16,
    },
}

/// Size and bit depth of frames; as text, "640 x 480 of 12 bit".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameFormat {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// Bits of a sample, 1 to 16.
    pub bit_depth: u8,
}

impl fmt::Display for FrameFormat {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{} x {} of {} bit", self.columns, self.rows, self.bit_depth)
    }
}

/// A grey image: rows x columns samples of `bit_depth` bits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    rows: usize,
    columns: usize,
    bit_depth: u8,
    samples: Samples,
}

impl Frame {
    /// A frame over `samples`, row by row.
    ///
    /// # Errors
    /// [`FrameError`] if the number of samples or their values contradict size or bit depth.
    pub fn new(rows: usize, columns: usize, bit_depth: u8, samples: Samples) -> Result<Self, FrameError> {
        if rows.checked_mul(columns) != Some(samples.len()) {
            return Err(FrameError::Size { rows, columns, samples: samples.len() });
        }
        let narrow = matches!(samples, Samples::U8(_));
        // Where every value of the type fits, none need be looked at.
        let any_value_fits = bit_depth == if narrow { 8 } else { 16 };
        let maximum = if any_value_fits { 0 } else { samples.maximum() };
        let fits = (1..=16).contains(&bit_depth)
            && narrow == (bit_depth <= 8)
            && u32::from(maximum) < 1_u32 << bit_depth;
        if !fits {
            return Err(FrameError::BitDepth { bit_depth, maximum });
        }
        Ok(Self { rows, columns, bit_depth, samples })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Size and bit depth.
    pub fn format(&self) -> FrameFormat {
        FrameFormat { rows: self.rows, columns: self.columns, bit_depth: self.bit_depth }
    }

    /// Bits of a sample, 1 to 16.
    pub fn bit_depth(&self) -> u8 {
        self.bit_depth
    }

    /// The intensities, row by row.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// The largest value that the bit depth allows, in DN.
    pub fn full_scale(&self) -> u16 {
        full_scale(self.bit_depth)
    }
}

/// The largest value of a sample of `bit_depth` bits (1 to 16), in DN.
pub fn full_scale(bit_depth: u8) -> u16 {
    u16::MAX >> (16 - bit_depth.clamp(1, 16))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_is_that_of_all_samples() {
        let narrow = Samples::U8((0..200_000).map(|index| (index % 251) as u8).collect());
        let wide = Samples::U16((0..200_000).map(|index| (65535 - index % 7) as u16).collect());
        let sum = |modulus: u64| (0..200_000).map(|index| index % modulus).sum::<u64>();
        assert_eq!(narrow.mean(), sum(251) as f64 / 2e5);
        assert_eq!(wide.mean(), (200_000 * 65535 - sum(7)) as f64 / 2e5);
        let least = |modulus: u64, level: u64| (0..200_000).filter(|index| index % modulus >= level).count();
        assert_eq!(narrow.count_at_least(100), least(251, 100));
        assert_eq!((narrow.count_at_least(0), narrow.count_at_least(256)), (200_000, 0));
        assert_eq!(wide.count_at_least(65535), (0..200_000).filter(|index| index % 7 == 0).count());
        let none = Samples::U8(Vec::new());
        assert_eq!((none.mean(), none.count_at_least(0)), (0.0, 0));
    }

    #[test]
    fn a_frame_holds_what_its_bit_depth_allows() {
        assert_eq!(full_scale(8), 255);
        assert_eq!(full_scale(12), 4095);
        assert_eq!(full_scale(16), 65535);
        assert!(Frame::new(1, 2, 10, Samples::U16(vec![0, 1023])).is_ok());
        assert!(matches!(
            Frame::new(1, 2, 10, Samples::U16(vec![0, 1024])),
            Err(FrameError::BitDepth { maximum: 1024, .. })
        ));
        assert!(matches!(Frame::new(1, 2, 8, Samples::U8(vec![0])), Err(FrameError::Size { .. })));
    }
}
