//! Times that another program wrote into images, and what is left of them when they are damaged.

#![allow(clippy::unwrap_used, reason = "a test stops at the first thing that does not work")]

use std::fs;
use std::path::Path;

use epirig_data::sequence::time_taken;

fn bytes(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/times").join(name)).unwrap()
}

fn told(name: &str) -> Option<String> {
    time_taken(&bytes(name)).map(|time| time.to_string())
}

#[test]
fn times_are_read_from_the_formats_of_photographs() {
    // As make.py beside the images asked Pillow to write them.
    assert_eq!(told("fraction.jpg").unwrap(), "2024-05-17T09:30:21.25");
    assert_eq!(told("whole.png").unwrap(), "2024-05-17T09:30:21");
    assert_eq!(told("whole.tif").unwrap(), "2024-05-17T09:30:21");
    for name in ["none.jpg", "unset.jpg", "impossible.jpg", "make.py"] {
        assert_eq!(told(name), None, "{name}");
    }
}

#[test]
fn damaged_exif_is_no_exif_and_hurts_nobody() {
    for name in ["fraction.jpg", "whole.png", "whole.tif"] {
        let whole = bytes(name);
        for length in 0..whole.len() {
            time_taken(&whole[..length]);
        }
        // Where it ends before the time, none is told.
        let place = whole.windows(10).position(|text| text == b"2024:05:17").unwrap();
        assert_eq!(time_taken(&whole[..place + 4]), None, "{name}");
        let mut damaged = whole.clone();
        for place in 0..whole.len() {
            for value in [0, 1, 0x7f, 0x80, 0xff] {
                damaged[place] = value;
                time_taken(&damaged);
            }
            damaged[place] = whole[place];
        }
    }
}
