//! Grey from a colour filter mosaic.

use epirig_core::frame::full_scale;

use super::{SampleCoding, unpack};

epirig_core::choices! {
    /// Use of a colour filter mosaic: one grey pixel for each 2 x 2 cell, so half the rows and columns. An
    /// odd last row or column is dropped.
    ///
    /// Both are sums without rounding, except if a sum needs more than 16 bit: it is then halved until it
    /// fits, rounded to nearest (halves up). Pixel (0, 0) is at row 0.5, column 0.5 of the mosaic, pixel
    /// (row, column) at (2 row + 0.5, 2 column + 0.5). The two greens of a cell are on a diagonal, so their
    /// centre is that of the cell.
    pub enum BayerUse {
        /// The sum of the two green pixels of each cell.
        ///
        /// One bit deeper than the mosaic. With one colour, chromatic aberration has no effect.
        Green = "green",
        /// The sum of all four pixels of each cell.
        ///
        /// Two bits deeper than the mosaic, with the most light.
        Binned = "binned",
    }
}

impl BayerUse {
    /// Bits of a sum, at most 16, and the number of bits shifted out.
    pub(super) fn depth_and_shift(self, mosaic_depth: u8) -> (u8, u8) {
        let depth = mosaic_depth
            + match self {
                Self::Green => 1,
                Self::Binned => 2,
            };
        (depth.min(16), depth.saturating_sub(16))
    }
}

/// Sums over the cells of a mosaic of `bit_depth` bits with `columns` columns. `green` is the column of the
/// green pixel in the first row of a cell.
///
/// # Errors
/// The largest sample in the first pair of rows where one needs more than `bit_depth` bits.
pub(super) fn sums<'a>(
    green: usize,
    coding: SampleCoding,
    bayer: BayerUse,
    bit_depth: u8,
    columns: usize,
    mut rows: impl Iterator<Item = &'a [u8]>,
) -> Result<Vec<u16>, u16> {
    let (_, shift) = bayer.depth_and_shift(bit_depth);
    let half = (1_u32 << shift) >> 1;
    let columns = columns - columns % 2;
    let (mut upper, mut lower) = (vec![0; columns], vec![0; columns]);
    let mut sums = Vec::new();
    while let (Some(first), Some(second)) = (rows.next(), rows.next()) {
        unpack::samples(coding, first, &mut upper);
        unpack::samples(coding, second, &mut lower);
        let seen = upper.iter().chain(&lower).fold(0, |seen, &sample| seen | sample);
        if seen > full_scale(bit_depth) {
            return Err(upper.iter().chain(&lower).copied().max().unwrap_or(seen));
        }
        let cells = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
        // A sum of four samples has 18 bit at most, and its shifted value 16.
        let fit = |sum: u32| u16::try_from((sum + half) >> shift).unwrap_or(u16::MAX);
        match bayer {
            BayerUse::Green => {
                sums.extend(cells.map(|(a, b)| fit(u32::from(a[green]) + u32::from(b[1 - green]))));
            }
            BayerUse::Binned => {
                sums.extend(cells.map(|(a, b)| fit([a[0], a[1], b[0], b[1]].map(u32::from).iter().sum())));
            }
        }
    }
    Ok(sums)
}
