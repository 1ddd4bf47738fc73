//! Images written bit by bit after ITU-T T.81, and those of an encoder that is not ours.

use proptest::prelude::*;

use super::*;

/// A JPEG image whose blocks are flat: luma of block (row, column) is `level(row, column)`, chroma is
/// neutral.
struct Flat {
    rows: usize,
    columns: usize,
    /// Blocks of luma in a unit, across and down; `None` for a grey image.
    sampling: Option<(usize, usize)>,
    restart_interval: u8,
}

fn level(row: usize, column: usize) -> u8 {
    u8::try_from((row * 53 + column * 29 + 7) % 256).unwrap()
}

impl Flat {
    fn truth(&self) -> Vec<u8> {
        let places = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (row, column)));
        places.map(|(row, column)| level(row / 8, column / 8)).collect()
    }

    /// Without Huffman tables, as MJPG may come.
    fn bytes(&self) -> Vec<u8> {
        let (across, down) = self.sampling.unwrap_or((1, 1));
        let (rows, columns) = (self.rows as u16, self.columns as u16);
        let mut bytes = vec![0xff, 0xd8];
        // A quantisation of 8: the first coefficient of a flat block is 8 (level - 128).
        bytes.extend([0xff, 0xdb, 0, 67, 0]);
        bytes.extend([8; 64]);
        let colours = if self.sampling.is_some() { 3 } else { 1 };
        bytes.extend([0xff, 0xc0, 0, 8 + 3 * colours, 8]);
        bytes.extend([rows.to_be_bytes(), columns.to_be_bytes()].concat());
        bytes.extend([colours, 1, (across << 4 | down) as u8, 0]);
        bytes.extend(if colours == 3 { &[2, 0x11, 0, 3, 0x11, 0][..] } else { &[] });
        bytes.extend([0xff, 0xdd, 0, 4, 0, self.restart_interval]);
        bytes.extend([0xff, 0xda, 0, 6 + 2 * colours, colours, 1, 0x00]);
        bytes.extend(if colours == 3 { &[2, 0x11, 3, 0x11][..] } else { &[] });
        bytes.extend([0, 63, 0]);
        bytes.extend(self.scan(across, down));
        bytes.extend([0xff, 0xd9]);
        bytes
    }

    fn scan(&self, across: usize, down: usize) -> Vec<u8> {
        let (unit_rows, unit_columns) = (self.rows.div_ceil(8 * down), self.columns.div_ceil(8 * across));
        let (mut bytes, mut bits, mut previous) = (Vec::new(), String::new(), 128);
        for unit in 0..unit_rows * unit_columns {
            let interval = usize::from(self.restart_interval);
            if interval > 0 && unit > 0 && unit % interval == 0 {
                bytes.extend(stuffed(&bits));
                bytes.extend([0xff, 0xd0 + ((unit / interval - 1) % 8) as u8]);
                bits.clear();
                previous = 128;
            }
            for block in 0..across * down {
                let row = unit / unit_columns * down + block / across;
                let column = unit % unit_columns * across + block % across;
                let value = i32::from(level(row, column));
                bits += &difference(value - previous);
                // Table K.5: 1010 ends a block of luma.
                bits += "1010";
                previous = value;
            }
            // Tables K.4 and K.6: 00 is no difference, 00 ends a block of chroma.
            bits += if self.sampling.is_some() { "00000000" } else { "" };
        }
        bytes.extend(stuffed(&bits));
        bytes
    }
}

/// Code and bits of a difference of luma, T.81 F.1.2.1 and table K.3.
fn difference(value: i32) -> String {
    let codes = ["00", "010", "011", "100", "101", "110", "1110", "11110", "111110"];
    let size = (32 - value.unsigned_abs().leading_zeros()) as usize;
    let bits = if value < 0 { value + (1 << size) - 1 } else { value };
    let bits = if size == 0 { String::new() } else { format!("{bits:0size$b}") };
    format!("{}{bits}", codes[size])
}

/// Bytes of bits, filled up with ones, with a zero behind each 0xff.
fn stuffed(bits: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    for eight in bits.as_bytes().chunks(8) {
        let byte = u8::from_str_radix(&format!("{:1<8}", str::from_utf8(eight).unwrap()), 2).unwrap();
        bytes.push(byte);
        bytes.extend((byte == 0xff).then_some(0));
    }
    bytes
}

/// A textured image from the encoder of the `image` crate, colour if `colour`.
fn textured(colour: bool, rows: u32, columns: u32, quality: u8) -> (Vec<u8>, Vec<u8>) {
    let at = |x: u32, y: u32| 128.0 + 60.0 * f64::from(x).sin() * (f64::from(y) * 0.7).cos();
    let grey = image::GrayImage::from_fn(columns, rows, |x, y| image::Luma([at(x, y) as u8]));
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, quality);
    if colour {
        let rgb = image::DynamicImage::ImageLuma8(grey.clone()).into_rgb8();
        encoder.encode_image(&rgb).unwrap();
    } else {
        encoder.encode_image(&grey).unwrap();
    }
    (bytes, grey.into_raw())
}

fn without_huffman_tables(bytes: &[u8]) -> Vec<u8> {
    let mut kept = bytes[..2].to_vec();
    let mut position = 2;
    while bytes[position + 1] != 0xda {
        let length = usize::from(u16::from_be_bytes([bytes[position + 2], bytes[position + 3]]));
        let segment = &bytes[position..position + 2 + length];
        kept.extend(if segment[1] == 0xc4 { &[] } else { segment });
        position += 2 + length;
    }
    kept.extend(&bytes[position..]);
    assert!(kept.len() < bytes.len());
    kept
}

#[test]
fn every_sampling_gives_the_luma_that_was_written() {
    for sampling in [None, Some((1, 1)), Some((2, 1)), Some((2, 2)), Some((1, 2)), Some((4, 1))] {
        for (rows, columns) in [(8, 8), (16, 32), (48, 64), (41, 59), (1, 1), (17, 9), (64, 16)] {
            for restart_interval in [0, 1, 3] {
                let flat = Flat { rows, columns, sampling, restart_interval };
                let samples = whole_luma(&flat.bytes(), rows, columns);
                assert_eq!(
                    samples.as_ref(),
                    Ok(&flat.truth()),
                    "{sampling:?} {rows} x {columns}, {restart_interval}"
                );
            }
        }
    }
}

#[test]
fn another_encoders_images_are_read_with_and_without_their_tables() {
    for colour in [false, true] {
        let (bytes, truth) = textured(colour, 43, 61, 100);
        let samples = whole_luma(&bytes, 43, 61).unwrap();
        // Quality 100 quantises by 1: rounding of coefficients, colours and samples leaves an error of a few
        // DN.
        assert!(samples.iter().zip(&truth).all(|(a, b)| a.abs_diff(*b) <= 3));
        assert_eq!(whole_luma(&without_huffman_tables(&bytes), 43, 61).unwrap(), samples);
    }
}

#[test]
fn a_cut_anywhere_is_an_error_even_with_an_end_marker() {
    let flat = Flat { rows: 48, columns: 64, sampling: Some((2, 1)), restart_interval: 3 };
    let images = [
        (textured(true, 43, 61, 75).0, 43, 61),
        (textured(false, 43, 61, 75).0, 43, 61),
        (flat.bytes(), 48, 64),
    ];
    for (bytes, rows, columns) in images {
        assert!(whole_luma(&bytes, rows, columns).is_ok());
        for cut in 0..bytes.len() {
            assert!(whole_luma(&bytes[..cut], rows, columns).is_err(), "{cut} of {} bytes", bytes.len());
        }
        for cut in 0..bytes.len() - 2 {
            let ended = [&bytes[..cut], &[0xff, 0xd9]].concat();
            assert!(whole_luma(&ended, rows, columns).is_err(), "{cut} of {} bytes, ended", bytes.len());
            let padded = [&bytes[..cut], &[0; 512]].concat();
            assert!(whole_luma(&padded, rows, columns).is_err(), "{cut} of {} bytes, padded", bytes.len());
        }
    }
}

#[test]
fn only_zeros_may_follow_the_end_and_a_few_bytes_come_before_it() {
    let flat = Flat { rows: 16, columns: 24, sampling: Some((2, 1)), restart_interval: 0 };
    let bytes = flat.bytes();
    let (data, end) = bytes.split_at(bytes.len() - 2);
    for (surplus, behind, ok) in
        [(0, &[0; 9][..], true), (0, &[0, 1], false), (3, &[], true), (16, &[], true), (17, &[], false)]
    {
        let image = [data, &vec![0x55; surplus], end, behind].concat();
        let samples = whole_luma(&image, 16, 24);
        assert_eq!(samples.is_ok(), ok, "{surplus} {behind:?}: {samples:?}");
        assert!(samples.is_err() || samples == Ok(flat.truth()));
    }
}

#[test]
fn lost_and_swapped_restart_intervals_are_errors() {
    let flat = Flat { rows: 8, columns: 64, sampling: None, restart_interval: 2 };
    let bytes = flat.bytes();
    let restarts: Vec<usize> =
        (1..bytes.len()).filter(|&at| bytes[at - 1] == 0xff && (0xd0..=0xd7).contains(&bytes[at])).collect();
    assert_eq!(restarts.len(), 3);
    let lost = [&bytes[..restarts[0] - 1], &bytes[restarts[1] - 1..]].concat();
    assert!(whole_luma(&lost, 8, 64).unwrap_err().contains("restart"));
    let mut renumbered = bytes;
    renumbered[restarts[1]] = 0xd5;
    assert!(whole_luma(&renumbered, 8, 64).unwrap_err().contains("restart"));
}

#[test]
fn other_images_are_refused_with_the_reason() {
    let flat = Flat { rows: 16, columns: 24, sampling: Some((2, 1)), restart_interval: 0 };
    let frame_header = 2 + 69;
    let change = |at: usize, value: u8| {
        let mut bytes = flat.bytes();
        bytes[at] = value;
        whole_luma(&bytes, 16, 24).unwrap_err()
    };
    assert!(whole_luma(&flat.bytes(), 24, 16).unwrap_err().contains("16 rows x 24 columns"));
    assert!(change(frame_header + 1, 0xc2).contains("baseline"));
    assert!(change(frame_header + 4, 12).contains("12 bit"));
    assert!(change(frame_header + 14, 0x41).contains("full resolution"));
    assert!(change(0, 0).contains("begin"));
    assert!(whole_luma(b"", 1, 1).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn damage_gives_an_image_of_the_right_size_or_an_error(
        colour: bool,
        changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (mut bytes, truth) = textured(colour, 19, 27, 60);
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok(samples) = whole_luma(&bytes, 19, 27) {
            prop_assert_eq!(samples.len(), truth.len());
        }
    }

    #[test]
    fn damage_to_headers_gives_an_image_of_the_right_size_or_an_error(
        sampling in proptest::sample::select(vec![None, Some((1, 1)), Some((2, 1)), Some((2, 2)), Some((1, 2))]),
        changes in proptest::collection::vec((69_usize..130, any::<u8>()), 1..4),
        restart_interval in 0_u8..3,
    ) {
        let flat = Flat { rows: 19, columns: 27, sampling, restart_interval };
        let mut bytes = flat.bytes();
        for (at, value) in changes {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = value;
            }
        }
        if let Ok(samples) = whole_luma(&bytes, 19, 27) {
            prop_assert_eq!(samples.len(), 19 * 27);
        }
    }
}
