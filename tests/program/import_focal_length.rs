//! `epirig import` of photographs that tell their focal length.

use std::fs;
use std::path::Path;

use crate::support::{epirig, succeeds};

/// A photograph of 32 x 24 without EXIF.
const PHOTOGRAPH: &[u8] = include_bytes!("../../crates/data/tests/times/none.jpg");

/// Writes the photograph, with its focal length for 35 mm film.
fn photograph(path: &Path, film_mm: u8) {
    // A table with the place of the other; in that, one number of 16 bit.
    let tiff = b"II*\0\x08\0\0\0\
        \x01\0\x69\x87\x04\0\x01\0\0\0\x1a\0\0\0\0\0\0\0\
        \x01\0\x05\xa4\x03\0\x01\0\0\0";
    let segment = [&b"\xff\xe1\0\x34Exif\0\0"[..], tiff, &[film_mm, 0, 0, 0], &[0; 4]].concat();
    // The length in the segment counts itself, but not the mark before it.
    assert_eq!(segment.len(), 2 + usize::from(segment[3]));
    // Tags come right after the mark of the start.
    let bytes = [&PHOTOGRAPH[..2], &segment, &PHOTOGRAPH[2..]].concat();
    fs::write(path, bytes).unwrap();
}

/// What the import says, and the record of the sequence.
fn import(folder: &Path, out: &str, options: &[&str]) -> (String, serde_json::Value) {
    let output = epirig(folder, &[&["import", "photos", "--out", out][..], options].concat());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    succeeds(folder, &["verify", out]);
    let record = fs::read_to_string(folder.join(out).join("sequence.json")).unwrap();
    (said, serde_json::from_str(&record).unwrap())
}

#[test]
fn the_focal_length_of_photographs_is_taken_unless_one_is_stated() {
    const NOTE: &str = "note: focal length 44 px by EXIF (48 mm on 35 mm film); give --focal-length-px";
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::create_dir(folder.join("photos")).unwrap();
    for name in ["a1", "a2", "a3"] {
        photograph(&folder.join(format!("photos/{name}.jpg")), 48);
    }
    // The diagonal of 32 x 24 is 40.
    let expected_px = 48.0 / 43.27 * 40.0;
    let (said, record) = import(folder, "told", &[]);
    assert!(said.contains(NOTE) && !said.contains("heights in mm"), "{said}");
    let px = |record: &serde_json::Value| record["intrinsics"]["focal_length_px"].as_f64();
    assert!((px(&record).unwrap() - expected_px).abs() < 1e-9, "{record}");
    let optics = &record["origin"]["rig"]["optics"];
    assert_eq!(optics["focal_length_sigma"], "5 %", "{optics}");

    // What a person says besides is kept.
    let (said, record) = import(folder, "point", &["--set", "optics.distance=900 mm"]);
    assert!(said.contains(NOTE), "{said}");
    assert_eq!(record["origin"]["rig"]["optics"]["distance"], "900 mm", "{record}");
    assert!((px(&record).unwrap() - expected_px).abs() < 1e-9, "{record}");

    let (said, record) = import(folder, "stated", &["--focal-length-px", "50"]);
    assert!(!said.contains("EXIF"), "{said}");
    assert_eq!(px(&record), Some(50.0));
    assert_eq!(record["origin"]["rig"]["optics"]["focal_length_sigma"], "2 %", "{record}");

    photograph(&folder.join("photos/a3.jpg"), 70);
    let (said, record) = import(folder, "zoom", &[]);
    let words = "from 48 mm on 35 mm film (a1.jpg) to 70 mm on 35 mm film (a3.jpg), 44 and 65 px";
    assert!(said.contains(words) && !said.contains("give --focal-length-px"), "{said}");
    assert_eq!(px(&record), None);
    assert!(record["origin"]["findings"].to_string().contains(words), "{record}");
}
