//! `epirig import` of photographs that tell when they were taken.

use std::fs;
use std::path::Path;

use crate::support::{epirig, succeeds};

/// A photograph with its time, from Pillow; see `make.py` beside it.
const PHOTOGRAPH: &[u8] = include_bytes!("../../crates/data/tests/times/fraction.jpg");
const ITS_TIME: &[u8] = b"2024:05:17 09:30:21";

/// Writes the photograph, taken at this second.
fn photograph(path: &Path, second: u32) {
    let place = PHOTOGRAPH.windows(ITS_TIME.len()).position(|text| text == ITS_TIME).unwrap();
    let mut bytes = PHOTOGRAPH.to_vec();
    bytes[place + ITS_TIME.len() - 2..place + ITS_TIME.len()]
        .copy_from_slice(format!("{second:02}").as_bytes());
    fs::write(path, bytes).unwrap();
}

/// Sources and times of the frames of a sequence, from its journal.
fn frames(sequence: &Path) -> Vec<(String, Option<String>)> {
    let journal = fs::read_to_string(sequence.join(epirig_data::sequence::JOURNAL)).unwrap();
    let text = |value: &serde_json::Value| value.as_str().map(str::to_owned);
    let line = |line| {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        Some((text(&line["source"])?, text(&line["taken"])))
    };
    journal.lines().filter_map(line).collect()
}

fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = epirig(folder, arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    said
}

#[test]
fn the_time_of_each_photograph_is_kept_and_sorts_them() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::create_dir(folder.join("photos")).unwrap();
    // The last one by name was taken between the others.
    for (name, second) in [("a1", 10), ("a2", 14), ("a3", 12)] {
        photograph(&folder.join(format!("photos/{name}.jpg")), second);
    }
    let by_name = said(folder, &["import", "photos", "--out", "by-name"]);
    assert!(by_name.contains("a3.jpg follows a2.jpg") && by_name.contains("--sort time"), "{by_name}");
    let named = |frames: &[(String, Option<String>)]| -> Vec<String> {
        frames.iter().map(|(source, _)| source.clone()).collect()
    };
    let found = frames(&folder.join("by-name"));
    assert_eq!(named(&found), ["a1.jpg", "a2.jpg", "a3.jpg"]);
    assert_eq!(found[1].1.as_deref(), Some("2024-05-17T09:30:14.25"));
    succeeds(folder, &["verify", "by-name"]);

    // The files were written in the order of their names.
    let by_time = said(folder, &["import", "photos", "--out", "by-time", "--sort", "time"]);
    assert!(!by_time.contains("follows") && !by_time.contains("do not tell"), "{by_time}");
    assert_eq!(named(&frames(&folder.join("by-time"))), ["a1.jpg", "a3.jpg", "a2.jpg"]);

    // One that tells no time has none in the sequence, and leaves only the times of the files to sort by.
    let without = include_bytes!("../../crates/data/tests/times/none.jpg");
    fs::write(folder.join("photos/a4.jpg"), without).unwrap();
    let epoch = std::time::UNIX_EPOCH;
    for (name, seconds) in [("a1", 30), ("a2", 20), ("a3", 40), ("a4", 10)] {
        let file = fs::File::options().write(true).open(folder.join(format!("photos/{name}.jpg"))).unwrap();
        file.set_modified(epoch + std::time::Duration::from_secs(seconds)).unwrap();
    }
    let mixed = said(folder, &["import", "photos", "--out", "mixed", "--sort", "time"]);
    assert!(mixed.contains("1 of 4 images do not tell"), "{mixed}");
    assert!(mixed.contains("a1.jpg follows a2.jpg"), "{mixed}");
    let found = frames(&folder.join("mixed"));
    assert_eq!(named(&found), ["a4.jpg", "a2.jpg", "a1.jpg", "a3.jpg"]);
    assert_eq!(found[0].1, None);
}
