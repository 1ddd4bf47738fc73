//! Images that other programs made, decoded: `tests/images/make.py` says which, and states their grey values.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

use std::fs;
use std::path::Path;

use epirig_core::frame::Samples;
use epirig_data::sequence::{decode_grey, header};

/// Luma is rounded by either program in its own way, and the decoder's weights have four to five digits.
const fn tolerance_dn(bits: u8) -> u16 {
    if bits == 8 { 1 } else { 4 }
}

#[test]
fn layouts_of_other_programs_become_the_same_grey_values() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images");
    let table = fs::read_to_string(folder.join("expected.csv")).unwrap();
    let mut lines = 0;
    for line in table.lines() {
        let fields: Vec<&str> = line.split(',').collect();
        let (name, bits) = (fields[0], fields[1]);
        let bytes = fs::read(folder.join(name)).unwrap();
        lines += 1;
        if bits == "refused" {
            let said = decode_grey(&bytes).unwrap_err().to_string();
            assert!(said.contains(fields[2]), "{name}: {said}");
            continue;
        }
        let frame = decode_grey(&bytes).unwrap_or_else(|fault| panic!("{name}: {fault}")).frame;
        let head = header(&bytes).unwrap();
        assert_eq!((head.rows, head.columns, head.bits), (frame.rows(), frame.columns(), frame.bit_depth()));
        assert_eq!(
            (frame.bit_depth(), frame.columns()),
            (bits.parse().unwrap(), fields[2].parse().unwrap()),
            "{name}"
        );
        let expected = fields[3..].iter().map(|value| value.parse::<u16>().unwrap());
        let found: Vec<u16> = match frame.samples() {
            Samples::U8(values) => values.iter().map(|&value| value.into()).collect(),
            Samples::U16(values) => values.clone(),
        };
        assert_eq!(found.len(), fields.len() - 3, "{name}");
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                found.abs_diff(expected) <= tolerance_dn(frame.bit_depth()),
                "{name}: {found} is not {expected}"
            );
        }
    }
    assert!(lines > 20, "{lines}");
}

#[test]
fn files_that_are_cut_short_are_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images");
    let images = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    for path in images.filter(|path| !path.ends_with("make.py") && !path.ends_with("expected.csv")) {
        let bytes = fs::read(&path).unwrap();
        // What follows the pixels in a PNG and a TIFF is not needed; the first half is.
        for length in 0..bytes.len() / 2 {
            assert!(decode_grey(&bytes[..length]).is_err(), "{} cut to {length} bytes", path.display());
        }
    }
}
