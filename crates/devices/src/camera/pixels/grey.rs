//! Formats with one sample per pixel, and the luma of colour images.

/// The first `columns` bytes of every row.
pub(super) fn bytes<'a>(rows: impl Iterator<Item = &'a [u8]>, columns: usize, count: usize) -> Vec<u8> {
    let mut samples = Vec::with_capacity(count * columns);
    rows.for_each(|row| samples.extend_from_slice(&row[..columns]));
    samples
}

/// The luma of every pixel, as stored.
pub(super) fn interleaved_luma<'a>(
    luma_first: bool,
    rows: impl Iterator<Item = &'a [u8]>,
    columns: usize,
    count: usize,
) -> Vec<u8> {
    let mut samples = Vec::with_capacity(count * columns);
    for row in rows {
        let pixels = row.as_chunks::<2>().0[..columns].iter();
        if luma_first {
            samples.extend(pixels.map(|&[luma, _]| luma));
        } else {
            samples.extend(pixels.map(|&[_, luma]| luma));
        }
    }
    samples
}

/// Rows of `columns` samples, each unpacked by `unpack`.
pub(super) fn unpacked<'a>(
    rows: impl Iterator<Item = &'a [u8]>,
    columns: usize,
    count: usize,
    unpack: impl Fn(&[u8], &mut [u16]),
) -> Vec<u16> {
    let mut samples = vec![0; count * columns];
    samples.chunks_exact_mut(columns).zip(rows).for_each(|(samples, row)| unpack(row, samples));
    samples
}
