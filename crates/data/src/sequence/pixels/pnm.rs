//! PGM and PPM images, as text or as bytes.

use std::io::Cursor;

use image::codecs::pnm::PnmDecoder;

use super::fault::ImageFault;

/// Pixels that a byte can hold at most: those of a bitmap.
const PIXELS_OF_A_BYTE: usize = 8;

/// Refuses a file that has fewer bytes than pixels: room would be made for all of them first.
pub(super) fn check(bytes: &[u8], rows: usize, columns: usize) -> Result<(), ImageFault> {
    match rows * columns > PIXELS_OF_A_BYTE * bytes.len() {
        true => Err(ImageFault::cut_short()),
        false => Ok(()),
    }
}

/// Bits of a sample, where the largest sample that the header states is that of a number of bits.
pub(super) fn stated_bits(bytes: &[u8]) -> Option<u8> {
    let (_, header) = PnmDecoder::new(Cursor::new(bytes)).ok()?.into_inner();
    let levels = u64::from(header.maximal_sample()) + 1;
    let bits = u8::try_from(levels.ilog2()).ok()?;
    // A bitmap of two levels becomes black and white of 8 bit.
    (levels.is_power_of_two() && (2..16).contains(&bits) && bits != 8).then_some(bits)
}

/// Samples as the file holds them: the decoder scales them to the whole range of 8 or 16 bit.
pub(super) fn unscale<T: Copy + Into<u32> + TryFrom<u32>>(samples: &mut [T], full: u32, bits: u8) {
    let largest = (1 << bits) - 1;
    for sample in samples {
        let scaled: u32 = (*sample).into();
        // Both products fit: full and largest have 16 bit at most.
        *sample = T::try_from((scaled * largest + full / 2) / full).unwrap_or(*sample);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{decode_grey, header};
    use epirig_core::frame::Samples;

    #[test]
    fn text_and_bytes_hold_the_same_samples() {
        let wide = b"P5\n# a remark\n2 2\n65535\n\x01\x02\xff\xff\x00\x07\x80\x00";
        let text = b"P2 2 2 65535 258 65535\n7 32768\n";
        for bytes in [&wide[..], &text[..]] {
            let decoded = decode_grey(bytes).unwrap();
            assert_eq!(decoded.frame.samples(), &Samples::U16(vec![258, 65535, 7, 32768]));
            assert_eq!((decoded.frame.bit_depth(), decoded.conversion), (16, None));
        }
        let decoded = decode_grey(b"P2 3 1 255 0 7 255").unwrap();
        assert_eq!(decoded.frame.samples(), &Samples::U8(vec![0, 7, 255]));
    }

    #[test]
    fn samples_of_a_camera_keep_their_values_and_their_depth() {
        let all: Vec<u16> = (0..4096).collect();
        let bytes: Vec<u8> = all.iter().flat_map(|sample| sample.to_be_bytes()).collect();
        let file = [&b"P5 64 64 4095\n"[..], &bytes].concat();
        let decoded = decode_grey(&file).unwrap();
        assert_eq!(decoded.frame.samples(), &Samples::U16(all));
        assert_eq!((decoded.frame.bit_depth(), header(&file).unwrap().bits), (12, 12));
        let decoded = decode_grey(b"P2 3 1 15 0 7 15").unwrap();
        assert_eq!(decoded.frame.samples(), &Samples::U8(vec![0, 7, 15]));
    }

    #[test]
    fn colour_becomes_luma() {
        for bytes in [&b"P3 1 1 255 200 100 50"[..], &b"P6 1 1 255\n\xc8\x64\x32"[..]] {
            let decoded = decode_grey(bytes).unwrap();
            // 0.2126 R + 0.7152 G + 0.0722 B = 117.7
            assert!(matches!(decoded.frame.samples(), Samples::U8(values) if values[0].abs_diff(118) <= 1));
            assert!(decoded.conversion.is_some());
        }
        let wide = decode_grey(b"P3 1 1 65535 50000 50000 50000").unwrap();
        assert!(matches!(wide.frame.samples(), Samples::U16(values) if values[0].abs_diff(50000) <= 1));
    }

    #[test]
    fn damage_is_an_error() {
        for bytes in
            [&b"P5 9999 9999 255\nabc"[..], b"P2 3 1 255 0 7", b"P5 2 2 255\nabc", b"P5", b"P2 2 1 0 1 1"]
        {
            assert!(header(bytes).and_then(|_| decode_grey(bytes)).is_err(), "{bytes:?}");
        }
    }
}
