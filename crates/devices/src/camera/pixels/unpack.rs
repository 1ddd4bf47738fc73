//! Unpacks the bytes of a row to samples.
//!
//! Each function fills `samples` from the start of `row`, which holds at least the format's least stride.

use super::SampleCoding;

/// Samples of any coding, widened to 16 bit.
pub(super) fn samples(coding: SampleCoding, row: &[u8], samples: &mut [u16]) {
    match coding {
        SampleCoding::Byte => {
            samples.iter_mut().zip(row).for_each(|(sample, &byte)| *sample = byte.into());
        }
        SampleCoding::Word10 | SampleCoding::Word12 | SampleCoding::Word14 | SampleCoding::Word16 => {
            words(row, samples, u16::from_le_bytes);
        }
        SampleCoding::Mipi10 => mipi_10(row, samples),
        SampleCoding::Mipi12 => mipi_12(row, samples),
        SampleCoding::Mipi14 => mipi_14(row, samples),
    }
}

/// Words of two bytes in the byte order of `read`.
pub(super) fn words(row: &[u8], samples: &mut [u16], read: impl Fn([u8; 2]) -> u16) {
    samples.iter_mut().zip(row.as_chunks().0).for_each(|(sample, &word)| *sample = read(word));
}

/// 10 bit without gaps, the highest bit first.
pub(super) fn bit_packed_10(row: &[u8], samples: &mut [u16]) {
    for (four, group) in samples.chunks_mut(4).zip(row.chunks(5)) {
        // Sample i spans bytes i and i + 1 of its group.
        for ((sample, pair), unused) in four.iter_mut().zip(group.windows(2)).zip([6, 4, 2, 0]) {
            *sample = (u16::from_be_bytes([pair[0], pair[1]]) >> unused) & 0x3ff;
        }
    }
}

fn mipi_10(row: &[u8], samples: &mut [u16]) {
    for (four, &[high @ .., low]) in samples.chunks_mut(4).zip(row.as_chunks::<5>().0) {
        let high: [u8; 4] = high;
        for ((sample, high), shift) in four.iter_mut().zip(high).zip([0, 2, 4, 6]) {
            *sample = (u16::from(high) << 2) | u16::from((low >> shift) & 0x3);
        }
    }
}

fn mipi_12(row: &[u8], samples: &mut [u16]) {
    for (two, &[first, second, low]) in samples.chunks_mut(2).zip(row.as_chunks::<3>().0) {
        for (sample, (high, low)) in two.iter_mut().zip([(first, low & 0xf), (second, low >> 4)]) {
            *sample = (u16::from(high) << 4) | u16::from(low);
        }
    }
}

fn mipi_14(row: &[u8], samples: &mut [u16]) {
    for (four, &[a, b, c, d, low_0, low_1, low_2]) in samples.chunks_mut(4).zip(row.as_chunks::<7>().0) {
        let mut low = u32::from_le_bytes([low_0, low_1, low_2, 0]);
        for (sample, high) in four.iter_mut().zip([a, b, c, d]) {
            *sample = (u16::from(high) << 6) | u16::from(low.to_le_bytes()[0] & 0x3f);
            low >>= 6;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpacked(coding: SampleCoding, row: &[u8], count: usize) -> Vec<u16> {
        let mut out = vec![0; count];
        samples(coding, row, &mut out);
        out
    }

    // Bytes and samples below are worked out by hand from the tables of the kernel's userspace-api/media/v4l:
    // pixfmt-yuv-luma, pixfmt-srggb10p, -12p and -14p.

    #[test]
    fn words_are_little_endian() {
        assert_eq!(unpacked(SampleCoding::Word16, &[0x34, 0x12, 0xff, 0x00], 2), [0x1234, 0x00ff]);
        let mut out = [0; 2];
        words(&[0x12, 0x34, 0x00, 0xff], &mut out, u16::from_be_bytes);
        assert_eq!(out, [0x1234, 0x00ff]);
    }

    #[test]
    fn ten_bit_mipi_has_its_low_bits_in_the_fifth_byte() {
        // Low bits of samples 3, 2, 1, 0: 11 10 01 00.
        let row = [0x80, 0x40, 0x20, 0xff, 0b11_10_01_00];
        assert_eq!(unpacked(SampleCoding::Mipi10, &row, 4), [0x200, 0x101, 0x082, 0x3ff]);
        assert_eq!(unpacked(SampleCoding::Mipi10, &row, 3), [0x200, 0x101, 0x082], "an incomplete group");
    }

    #[test]
    fn twelve_bit_mipi_has_its_low_bits_in_the_third_byte() {
        // Sample 1's low bits 7-4, sample 0's 3-0.
        assert_eq!(unpacked(SampleCoding::Mipi12, &[0xab, 0x12, 0x3c], 2), [0xabc, 0x123]);
        assert_eq!(unpacked(SampleCoding::Mipi12, &[0, 0, 0, 0xab, 0x12, 0x3c], 3), [0, 0, 0xabc]);
    }

    #[test]
    fn fourteen_bit_mipi_has_its_low_bits_in_the_last_three_bytes() {
        // Low bits of samples 0 to 3: 101010, 110001, 011110, 000111. Byte 4: sample 1 bits 1-0, sample 0.
        // Byte 5: sample 2 bits 3-0, sample 1 bits 5-2. Byte 6: sample 3, sample 2 5-4.
        let row = [0x80, 0x01, 0x00, 0xff, 0b0110_1010, 0b1110_1100, 0b0001_1101];
        let low = [0b10_1010, 0b11_0001, 0b01_1110, 0b00_0111];
        let truth = [0x2000 + low[0], 0x0040 + low[1], low[2], 0x3fc0 + low[3]];
        assert_eq!(unpacked(SampleCoding::Mipi14, &row, 4), truth);
    }

    #[test]
    fn ten_bit_packed_starts_with_the_highest_bit() {
        // 1000000001 0111111110 1111111111 0000000010 in bytes of eight.
        let row = [0b1000_0000, 0b0101_1111, 0b1110_1111, 0b1111_1100, 0b0000_0010];
        let truth = [0x201, 0x1fe, 0x3ff, 0x002];
        for count in 1..=4 {
            let mut out = vec![0; count];
            bit_packed_10(&row[..(count * 10_usize).div_ceil(8)], &mut out);
            assert_eq!(out, truth[..count]);
        }
    }
}
